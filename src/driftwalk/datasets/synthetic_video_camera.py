"""The camera of a synthetic video: world to pixel and back."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from driftwalk.datasets.synthetic_video_settings import VideoSettings

Array = npt.NDArray[np.float64]
_NEWTON_STEPS = 8


def world_to_image(settings: VideoSettings, points: Array) -> Array:
    """Return world points [m], shape (..., 2), as (column, row) [px]."""
    cos, sin = np.cos(settings.rotation_rad), np.sin(settings.rotation_rad)
    x = cos * points[..., 0] - sin * points[..., 1]
    y = sin * points[..., 0] + cos * points[..., 1]
    depth = 1.0 + settings.tilt_x_per_m * x + settings.tilt_y_per_m * y
    middle = np.asarray(settings.middle_px)
    centre = np.asarray(settings.centre_px) if settings.centre_px is not None else middle
    ray = np.stack([x, -y], axis=-1) * (settings.px_per_m / depth)[..., None] + centre - middle
    square = (ray**2).sum(axis=-1, keepdims=True) / settings.width_px**2
    bent: Array = middle + ray * (1.0 + settings.lens_k1 * square + settings.lens_k2 * square**2)
    return bent


def image_to_world(settings: VideoSettings, pixels: Array) -> Array:
    """Return pixels (column, row), shape (..., 2), as world points [m]."""
    middle = np.asarray(settings.middle_px)
    centre = np.asarray(settings.centre_px) if settings.centre_px is not None else middle
    bent = pixels - middle
    radius = np.hypot(bent[..., 0], bent[..., 1]) / settings.width_px
    straight = radius.copy()
    for _ in range(_NEWTON_STEPS):
        square = straight**2
        value = straight * (1.0 + settings.lens_k1 * square + settings.lens_k2 * square**2)
        slope = 1.0 + 3.0 * settings.lens_k1 * square + 5.0 * settings.lens_k2 * square**2
        straight = straight - (value - radius) / slope
    factor = np.divide(straight, radius, out=np.ones_like(radius), where=radius > 0.0)
    ray = (bent * factor[..., None] + middle - centre) / settings.px_per_m
    a, b = ray[..., 0], -ray[..., 1]
    depth = 1.0 / (1.0 - settings.tilt_x_per_m * a - settings.tilt_y_per_m * b)
    cos, sin = np.cos(settings.rotation_rad), np.sin(settings.rotation_rad)
    x, y = a * depth, b * depth
    return np.stack([cos * x + sin * y, -sin * x + cos * y], axis=-1)


def local_scale(settings: VideoSettings, point: Array) -> float:
    """Return the scale [px/m] around a world point: the root of how areas grow."""
    step = 0.5 / settings.px_per_m
    ends = np.array([[step, 0.0], [-step, 0.0], [0.0, step], [0.0, -step]]) + point
    right, left, up, down = world_to_image(settings, ends)
    (a, b), (c, d) = (right - left) / (2 * step), (up - down) / (2 * step)
    return float(np.sqrt(abs(a * d - b * c)))
