"""The disturbances of a synthetic video: shading, reflections, ripples, bars over the markers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from driftwalk.core.arrays import Bools, Floats, Singles
from driftwalk.core.random_streams import VideoStream
from driftwalk.datasets.synthetic_video_settings import VideoSettings

_WAVES = 48
_COARSE = 4
# For a Gaussian field of wave number k, cut where 5 % of the area is above, a patch has the area
# of a circle of this radius times 1/k.
_RADIUS_TIMES_WAVE_NUMBER = 1.085
_GLARE_RATE = 1.5
_GLARE_EDGE = 0.08
_RIPPLE_RATE = 6.0


class Glare:
    """White patches that drift and change: where a random field of plane waves is high."""

    def __init__(self, settings: VideoSettings) -> None:
        from scipy.stats import norm

        generator = np.random.default_rng([settings.seed, VideoStream.GLARE])
        direction = generator.uniform(0.0, 2 * np.pi, _WAVES)
        number = _RADIUS_TIMES_WAVE_NUMBER / settings.glare_radius_px
        self._kx, self._ky = number * np.cos(direction), number * np.sin(direction)
        self._phase = generator.uniform(0.0, 2 * np.pi, _WAVES)
        self._rate = generator.normal(0.0, _GLARE_RATE, _WAVES)
        self._cut = float(norm.isf(settings.glare_share)) if settings.glare_share > 0 else np.inf
        self._shape = (settings.height_px, settings.width_px)

    def height(self, pixels: Floats, time: float) -> Floats:
        """Return the field minus its cut at pixels, shape (..., 2): above zero is glare."""
        waves = np.cos(
            pixels[..., 0, None] * self._kx
            + pixels[..., 1, None] * self._ky
            + (self._phase + self._rate * time)
        )
        value: Floats = waves.sum(axis=-1) * np.sqrt(2.0 / _WAVES) - self._cut
        return value

    def opacity(self, time: float) -> Singles:
        """Return how much of each pixel is white, shape (rows, columns)."""
        import cv2

        rows, columns = self._shape
        column = np.arange(0, columns + _COARSE, _COARSE, dtype=np.float64)
        row = np.arange(0, rows + _COARSE, _COARSE, dtype=np.float64)
        coarse = self.height(np.stack(np.meshgrid(column, row), axis=-1), time).astype(np.float32)
        # Every `_COARSE`-th pixel is a node, so the pixels between are found by their own place.
        at_column, at_row = np.meshgrid(
            np.arange(columns, dtype=np.float32) / _COARSE,
            np.arange(rows, dtype=np.float32) / _COARSE,
        )
        field = cv2.remap(coarse, at_column, at_row, cv2.INTER_LINEAR)
        return np.asarray(1.0 / (1.0 + np.exp(-field / _GLARE_EDGE)), dtype=np.float32)


def shading(settings: VideoSettings) -> Singles:
    """Return the factor of the light at each pixel, shape (rows, columns)."""
    column, row = np.meshgrid(np.arange(settings.width_px), np.arange(settings.height_px))
    middle = settings.middle_px
    along = (column - middle[0]) * np.cos(settings.shading_angle_rad)
    along = along + (row - middle[1]) * np.sin(settings.shading_angle_rad)
    return np.asarray(1.0 - settings.shading * along / np.abs(along).max(), dtype=np.float32)


def ripples(settings: VideoSettings, world: Singles, time: float) -> Singles:
    """Return the factor of the water's brightness at world points [m], shape (rows, columns, 2)."""
    number = 2 * np.pi / settings.ripple_length_m
    first = np.sin(number * (0.8 * world[..., 0] + 0.6 * world[..., 1]) - _RIPPLE_RATE * time)
    second = np.sin(number * (0.3 * world[..., 0] - 0.95 * world[..., 1]) + _RIPPLE_RATE * time)
    return np.asarray(1.0 + settings.ripple * (first + second) / 2, dtype=np.float32)


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

    offset: Floats
    angle: Floats
    width: float
    length: float

    def hides(self, frame: int, body: int, points: Floats) -> Bools:
        """Return which points of the marker's own frame [m], shape (..., 2), the bar covers."""
        return self.depth(frame, body, points) > 0.0

    def depth(self, frame: int, body: int, points: Floats) -> Floats:
        """Return how deep points of the marker's own frame lie in the bar [m], shape (...)."""
        offset, angle = self.offset[frame, body], self.angle[frame, body]
        across = points[..., 0] * np.cos(angle) + points[..., 1] * np.sin(angle) - offset
        along = -points[..., 0] * np.sin(angle) + points[..., 1] * np.cos(angle)
        inside: Floats = np.minimum(
            self.width / 2 - np.abs(across), self.length / 2 - np.abs(along)
        )
        return inside


def place_bars(settings: VideoSettings, time: Floats, bodies: int) -> Bars:
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


def marker_points(settings: VideoSettings) -> Floats:
    """Return points spread evenly over both discs, in the marker's frame [m], shape (n, 2)."""
    line = (np.arange(40) + 0.5) / 20.0 - 1.0
    u, v = (part.ravel() for part in np.meshgrid(line, line))
    disc = np.stack([u, v], axis=-1)[u**2 + v**2 < 1.0] * (settings.marker_diameter_m / 2)
    half = np.array([settings.marker_spacing_m / 2, 0.0])
    return np.concatenate([disc - half, disc + half])


def _spells(
    settings: VideoSettings, time: Floats, generator: np.random.Generator
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


def _offset(points: Floats, angle: float, width: float, share: float) -> float:
    """Return where a bar that is pushed in from outside first hides the stated share."""
    across = points[:, 0] * np.cos(angle) + points[:, 1] * np.sin(angle)
    offsets = np.linspace(across.max() + width / 2, 0.0, _OFFSETS)
    hidden = (np.abs(across[None, :] - offsets[:, None]) < width / 2).mean(axis=1)
    return float(offsets[int(np.argmax(hidden >= share))])
