"""Contents, camera and disturbances of a synthetic video, with three fixed levels of disturbance.

Disturbances are shading, reflections, ripples, and bars over the markers, as they are drawn. The
levels stand apart from every tracker: they were fixed before one was written.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from driftwalk.core.arrays import Floats, Singles
from driftwalk.core.errors import InputError, did_you_mean
from driftwalk.core.random_streams import VideoStream

Colour = tuple[int, int, int]
"""Red, green, blue, each 0 to 255."""


@dataclass(frozen=True)
class VideoSettings:
    """Camera, blocks and disturbances of a synthetic video.

    The world is in metres, origin at the tank's centre, y up; the image in pixels (column, row),
    with pixel centres at whole numbers. A world point is rotated, projected (tilt), scaled, and
    then moved along the ray from the image's middle by ``1 + k1 r² + k2 r⁴``, with r in units of
    the image's width.

    Parameters
    ----------
    width_px, height_px : int
        Size of the image.
    px_per_m : float
        Scale at the tank's centre [px/m].
    centre_px : tuple of float, optional
        Column and row of the tank's centre; the image's middle when left out.
    rotation_rad : float
        Turn of the camera [rad].
    tilt_x_per_m, tilt_y_per_m : float
        How fast the scale falls along x and y [1/m]: the perspective of a tilted camera.
    lens_k1, lens_k2 : float
        Radial distortion.
    tank_diameter_m : float
        Inner diameter of the drawn rim [m].
    rim_m : float
        Width of the rim [m]; 0 draws none.
    block_side_m : float
        Side of a block [m].
    marker_spacing_m : float
        Distance between the centres of a marker's two discs [m].
    marker_diameter_m : float
        Diameter of a disc [m].
    marker_angle_rad : float
        From the block's +x face to the line from disc 1 to disc 2 [rad], counter-clockwise.
    water, rim, block, disc_1, disc_2 : tuple of int
        Colours: red, green, blue, 0 to 255.
    noise_std : float
        Standard deviation of the camera's noise, of 255, in each channel.
    blur_px : float
        Standard deviation of the lens's blur [px].
    shading : float
        Light falls from ``1 + shading`` to ``1 - shading`` across the image.
    shading_angle_rad : float
        Direction in which the light falls, in the image, from the columns' direction [rad].
    glare_share : float
        Share of the image that white reflections cover.
    glare_radius_px : float
        Typical radius of a reflection [px].
    ripple : float
        Relative amplitude of the brightness waves on the water.
    ripple_length_m : float
        Length of these waves [m].
    exposure_s : float
        Time during which the shutter is open [s]; the pose in the truth is that of its middle.
    rolling_s : float
        Time between the exposure of the first and the last row [s]; the truth is the middle row's.
    bar_share : float
        Share of a marker that a bar hides when it is there.
    bar_time_share : float
        Share of the time in which a bar lies over a marker.
    bar_mean_s : float
        Mean time for which a bar stays [s].
    seed : int
        Seed of noise, glare and bars.

    Raises
    ------
    InputError
        When a number is out of range.

    Examples
    --------
    >>> VideoSettings(width_px=320, height_px=240, px_per_m=750.0).middle_px
    (159.5, 119.5)
    """

    width_px: int = 640
    height_px: int = 480
    px_per_m: float = 1500.0
    centre_px: tuple[float, float] | None = None
    rotation_rad: float = 0.0
    tilt_x_per_m: float = 0.0
    tilt_y_per_m: float = 0.0
    lens_k1: float = 0.0
    lens_k2: float = 0.0
    tank_diameter_m: float = 0.30
    rim_m: float = 0.004
    block_side_m: float = 0.03
    marker_spacing_m: float = 0.014
    marker_diameter_m: float = 0.010
    marker_angle_rad: float = 0.0
    water: Colour = (70, 74, 72)
    rim: Colour = (150, 150, 150)
    block: Colour = (196, 194, 188)
    disc_1: Colour = (206, 52, 92)
    disc_2: Colour = (46, 160, 92)
    noise_std: float = 0.0
    blur_px: float = 0.5
    shading: float = 0.0
    shading_angle_rad: float = 0.5
    glare_share: float = 0.0
    glare_radius_px: float = 14.0
    ripple: float = 0.0
    ripple_length_m: float = 0.04
    exposure_s: float = 0.0
    rolling_s: float = 0.0
    bar_share: float = 0.0
    bar_time_share: float = 0.0
    bar_mean_s: float = 0.5
    seed: int = 0

    def __post_init__(self) -> None:
        """Check the ranges."""
        sizes = ("width_px", "height_px", "px_per_m", "tank_diameter_m", "block_side_m")
        others = ("marker_spacing_m", "marker_diameter_m", "glare_radius_px")
        positive = (*sizes, *others, "ripple_length_m", "bar_mean_s")
        not_negative = ("rim_m", "noise_std", "blur_px", "exposure_s", "rolling_s", "ripple")
        shares = ("shading", "glare_share", "bar_share", "bar_time_share")
        for names, least, most in (
            (positive, math.ulp(0.0), math.inf),
            (not_negative, 0.0, math.inf),
            (shares, 0.0, 0.9),
        ):
            for name in names:
                value = getattr(self, name)
                if not (math.isfinite(value) and least <= value <= most):
                    limit = "above zero" if least > 0 else f"between {least:g} and {most:g}"
                    raise InputError(f"{name} of a synthetic video must be {limit}, got {value}")

    @property
    def middle_px(self) -> tuple[float, float]:
        """Column and row of the image's middle."""
        return ((self.width_px - 1) / 2, (self.height_px - 1) / 2)


VIDEO_LEVELS: Final[dict[str, dict[str, float]]] = {
    "clean": {},
    "moderate": {"noise_std": 4.0, "blur_px": 1.0, "shading": 0.2},
    "heavy": {
        "noise_std": 12.0,
        "blur_px": 1.0,
        "shading": 0.2,
        "ripple": 0.05,
        "glare_share": 0.05,
        "bar_share": 0.3,
        "bar_time_share": 0.2,
    },
}
"""Changes of each level of disturbance to `VideoSettings`."""


def video_settings(level: str = "moderate", **changes: Any) -> VideoSettings:
    """Return the settings of a synthetic video at a fixed level of disturbance.

    Parameters
    ----------
    level : {"clean", "moderate", "heavy"}
        Clean: blur of half a pixel. Moderate: noise of 4 of 255, blur of 1 px, shading ±20 %.
        Heavy: noise of 12, ripples, glare on 5 % of the image, and bars that hide 30 % of each
        marker for a fifth of the time.
    **changes
        Other fields of `VideoSettings`.

    Returns
    -------
    VideoSettings
        The settings.

    Raises
    ------
    InputError
        When there is no such level or no such field.

    Examples
    --------
    >>> video_settings("moderate", width_px=320, height_px=240, px_per_m=750.0).noise_std
    4.0
    """
    if level not in VIDEO_LEVELS:
        raise InputError(
            f"no level '{level}' of a synthetic video; there is {', '.join(VIDEO_LEVELS)}"
        )
    known = [field.name for field in dataclasses.fields(VideoSettings)]
    for name in changes:
        if name not in known:
            hint = did_you_mean(name, known)
            raise InputError(f"a synthetic video has no setting '{name}'{hint}")
    return VideoSettings(**{**VIDEO_LEVELS[level], **changes})


_NEWTON_STEPS = 8
"""Steps of Newton's method that undo the lens; it squares the error at each."""


def world_to_image(settings: VideoSettings, points: Floats) -> Floats:
    """Return world points [m], shape (..., 2), as (column, row) [px]."""
    cos, sin = np.cos(settings.rotation_rad), np.sin(settings.rotation_rad)
    x = cos * points[..., 0] - sin * points[..., 1]
    y = sin * points[..., 0] + cos * points[..., 1]
    depth = 1.0 + settings.tilt_x_per_m * x + settings.tilt_y_per_m * y
    middle = np.asarray(settings.middle_px)
    centre = np.asarray(settings.centre_px) if settings.centre_px is not None else middle
    ray = np.stack([x, -y], axis=-1) * (settings.px_per_m / depth)[..., None] + centre - middle
    square = (ray**2).sum(axis=-1, keepdims=True) / settings.width_px**2
    bent: Floats = middle + ray * (1.0 + settings.lens_k1 * square + settings.lens_k2 * square**2)
    return bent


def image_to_world(settings: VideoSettings, pixels: Floats) -> Floats:
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


def local_scale(settings: VideoSettings, point: Floats) -> float:
    """Return the scale [px/m] around a world point: the root of how areas grow."""
    step = 0.5 / settings.px_per_m
    ends = np.array([[step, 0.0], [-step, 0.0], [0.0, step], [0.0, -step]]) + point
    right, left, up, down = world_to_image(settings, ends)
    (a, b), (c, d) = (right - left) / (2 * step), (up - down) / (2 * step)
    return float(np.sqrt(abs(a * d - b * c)))


_WAVES = 48
"""Plane waves of the field of glare: enough for a sum that is nearly Gaussian; chosen by hand."""
_COARSE = 4
"""Pixels between places where glare is computed: patches are smooth. Chosen by hand."""
# For a Gaussian field of wave number k, cut where 5 % of the area is above, a patch has the area
# of a circle of this radius times 1/k.
_RADIUS_TIMES_WAVE_NUMBER = 1.085
_GLARE_RATE = 1.5
"""Standard deviation of the waves' frequencies [rad/s]: a patch lives about a second; by hand."""
_GLARE_EDGE = 0.08
"""Softness of a patch's edge, in standard deviations of the field; chosen by hand."""
_RIPPLE_RATE = 6.0
"""Frequency of the ripples [rad/s], about one a second; chosen by hand."""


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
"""Places that are tried for a bar: it hides the stated share to a few thousandths. By hand."""


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

    def depth(self, frame: int, body: int, points: Floats) -> Floats:
        """Return how deep points of the marker's own frame lie in the bar [m]; outside below 0.

        Points have the shape (..., 2).
        """
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
