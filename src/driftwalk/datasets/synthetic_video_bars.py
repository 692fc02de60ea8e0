"""Bars that hide a stated share of a marker for random stretches of time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from driftwalk.core.random_streams import VideoStream
from driftwalk.datasets.synthetic_video_settings import VideoSettings

Array = npt.NDArray[np.float64]
_OFFSETS = 512


@dataclass(frozen=True)
class Bars:
    """Where the bar over each block is, in the block's frame.

    Parameters
    ----------
    offset : array, shape (time, body)
        Distance of the bar's middle line from the marker's centre [m]; NaN when there is no bar.
    angle : array, shape (time, body)
        Direction of the bar's normal, from the marker's axis [rad].
    width, length : float
        Size of a bar [m].
    """

    offset: Array
    angle: Array
    width: float
    length: float

    def hides(self, frame: int, body: int, points: Array) -> npt.NDArray[np.bool_]:
        """Return which points of the marker's own frame [m], shape (..., 2), the bar covers."""
        return self.depth(frame, body, points) > 0.0

    def depth(self, frame: int, body: int, points: Array) -> Array:
        """Return how deep points of the marker's own frame lie in the bar [m], shape (...)."""
        offset, angle = self.offset[frame, body], self.angle[frame, body]
        across = points[..., 0] * np.cos(angle) + points[..., 1] * np.sin(angle) - offset
        along = -points[..., 0] * np.sin(angle) + points[..., 1] * np.cos(angle)
        inside: Array = np.minimum(self.width / 2 - np.abs(across), self.length / 2 - np.abs(along))
        return inside


def place_bars(settings: VideoSettings, time: Array, bodies: int) -> Bars:
    """Draw when a bar lies over each block and how it lies."""
    shape = (time.size, bodies)
    offset, angle = np.full(shape, np.nan), np.zeros(shape)
    width = 0.4 * (settings.marker_spacing_m + settings.marker_diameter_m)
    if settings.bar_share > 0.0 and settings.bar_time_share > 0.0:
        points = marker_points(settings)
        for body in range(bodies):
            generator = np.random.default_rng([settings.seed, VideoStream.BARS, body])
            for start, stop in _spells(settings, time, generator):
                angle[start:stop, body] = generator.uniform(-np.pi, np.pi)
                offset[start:stop, body] = _offset(
                    points, angle[start, body], width, settings.bar_share
                )
    return Bars(offset, angle, width, length=1.5 * settings.block_side_m)


def marker_points(settings: VideoSettings) -> Array:
    """Return points spread evenly over both discs, in the marker's frame [m], shape (n, 2)."""
    line = (np.arange(40) + 0.5) / 20.0 - 1.0
    u, v = (part.ravel() for part in np.meshgrid(line, line))
    disc = np.stack([u, v], axis=-1)[u**2 + v**2 < 1.0] * (settings.marker_diameter_m / 2)
    half = np.array([settings.marker_spacing_m / 2, 0.0])
    return np.concatenate([disc - half, disc + half])


def _spells(
    settings: VideoSettings, time: Array, generator: np.random.Generator
) -> list[tuple[int, int]]:
    """Return first and past-the-last frame of each stretch with a bar."""
    share, mean = settings.bar_time_share, settings.bar_mean_s
    spells, now = [], float(time[0]) if time.size else 0.0
    while time.size and now <= time[-1]:
        now += generator.exponential(mean * (1.0 - share) / share)
        end = now + generator.exponential(mean)
        start, stop = (int(np.searchsorted(time, edge)) for edge in (now, end))
        if stop > start:
            spells.append((start, stop))
        now = end
    return spells


def _offset(points: Array, angle: float, width: float, share: float) -> float:
    """Return where a bar that is pushed in from outside first hides the stated share."""
    across = points[:, 0] * np.cos(angle) + points[:, 1] * np.sin(angle)
    offsets = np.linspace(across.max() + width / 2, 0.0, _OFFSETS)
    hidden = (np.abs(across[None, :] - offsets[:, None]) < width / 2).mean(axis=1)
    return float(offsets[int(np.argmax(hidden >= share))])
