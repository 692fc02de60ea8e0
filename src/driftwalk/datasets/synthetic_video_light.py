"""The light of a synthetic video: shading, reflections, ripples."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from driftwalk.core.random_streams import VideoStream
from driftwalk.datasets.synthetic_video_settings import VideoSettings

Array = npt.NDArray[np.float64]
Grid = npt.NDArray[np.float32]

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

    def height(self, pixels: Array, time: float) -> Array:
        """Return the field minus its cut at pixels, shape (..., 2): above zero is glare."""
        waves = np.cos(
            pixels[..., 0, None] * self._kx
            + pixels[..., 1, None] * self._ky
            + (self._phase + self._rate * time)
        )
        value: Array = waves.sum(axis=-1) * np.sqrt(2.0 / _WAVES) - self._cut
        return value

    def opacity(self, time: float) -> Grid:
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


def shading(settings: VideoSettings) -> Grid:
    """Return the factor of the light at each pixel, shape (rows, columns)."""
    column, row = np.meshgrid(np.arange(settings.width_px), np.arange(settings.height_px))
    middle = settings.middle_px
    along = (column - middle[0]) * np.cos(settings.shading_angle_rad)
    along = along + (row - middle[1]) * np.sin(settings.shading_angle_rad)
    return np.asarray(1.0 - settings.shading * along / np.abs(along).max(), dtype=np.float32)


def ripples(settings: VideoSettings, world: Grid, time: float) -> Grid:
    """Return the factor of the water's brightness at world points [m], shape (rows, columns, 2)."""
    number = 2 * np.pi / settings.ripple_length_m
    first = np.sin(number * (0.8 * world[..., 0] + 0.6 * world[..., 1]) - _RIPPLE_RATE * time)
    second = np.sin(number * (0.3 * world[..., 0] - 0.95 * world[..., 1]) + _RIPPLE_RATE * time)
    return np.asarray(1.0 + settings.ripple * (first + second) / 2, dtype=np.float32)
