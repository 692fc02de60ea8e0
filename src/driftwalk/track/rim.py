"""The tank's rim as a circle in the image: with the tank's diameter it gives scale and centre."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.core.extras import require_opencv
from driftwalk.track.camera import Camera, Lens
from driftwalk.track.types import Image


class RimPolicy(NamedTuple):
    """How the rim of the tank is found in an image."""

    small_px: int = 320
    """Longer side of the image in which the circle is first looked for [px]; chosen by hand."""
    rays: int = 360
    """Directions in which the edge is looked for; chosen by hand."""
    around: float = 0.12
    """Half the range in which it is first looked for, in radii; chosen by hand."""
    step_px: float = 0.25
    """Distance of the samples along a ray [px]; chosen by hand."""
    strong: float = 0.35
    """Least slope of an edge, as a share of the usual strongest slope of a ray; chosen by hand."""
    rounds: int = 6
    """Fits of the circle, each in a narrower range; chosen by hand."""
    least_found: float = 0.4
    """Share of the rays that must show the edge; chosen by hand."""
    least_edge: float = 1.5
    """Usual strongest slope below which there is no rim [grey levels per px]; chosen by hand."""


_RIM: Final = RimPolicy()


@dataclass(frozen=True)
class Rim:
    """A circle in an image.

    Parameters
    ----------
    column, row : float
        Centre [px], in the image without lens distortion.
    radius_px : float
        Radius of the inner edge [px].
    found : float
        Share of the directions in which the edge was seen.
    rms_px : float
        How far the edge lies from the circle, root mean square [px].
    """

    column: float
    row: float
    radius_px: float
    found: float
    rms_px: float


def find_rim(image: Image, lens: Lens | None = None) -> Rim:
    """Find the tank's rim.

    The strongest circle is looked for first; then its inner edge is followed around to a part of a
    pixel, and a circle is fitted to it that heeds no gaps and no blocks.

    Parameters
    ----------
    image : array, shape (rows, columns, 3)
        The tank from above; a median of several frames shows it best.
    lens : Lens, optional
        How the lens bends rays.

    Returns
    -------
    Rim
        The circle.

    Raises
    ------
    InputError
        When there is no circle that fills at least a third of the image's height.

    Examples
    --------
    >>> import driftwalk as dw
    >>> track = dw.tank30_recording("without_noise").isel(time=slice(0, 1))
    >>> _, image = next(dw.render_video(track))
    >>> round(find_rim(image).radius_px)
    225
    """
    cv2 = require_opencv()
    grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    circle = _roughly(cv2, cv2.medianBlur(grey, 5), lens)
    smooth = cv2.GaussianBlur(grey, (0, 0), 1.0).astype(np.float32)
    found, rms = 0.0, math.inf
    around = _RIM.around
    for _ in range(_RIM.rounds):
        points = _inner_edge(cv2, smooth, circle, around, lens)
        if len(points) < _RIM.least_found * _RIM.rays:
            break
        circle, kept, rms = _fit(points)
        found, around = kept / _RIM.rays, max(around / 2, 0.02)
    if found < _RIM.least_found:
        raise InputError(
            "no rim of the tank was found as a circle: its edge must be seen all around; or "
            "calibrate with a board that lies on the plane of the water"
        )
    return Rim(float(circle[0]), float(circle[1]), float(circle[2]), found, rms)


def camera_from_rim(image: Image, *, diameter: float, lens: Lens | None = None) -> Camera:
    """Return the camera whose scale and centre come from the tank's rim.

    The camera is taken to look straight down: a tilt needs a board.

    Parameters
    ----------
    image : array, shape (rows, columns, 3)
        See `find_rim`.
    diameter : float
        Inner diameter of the tank [m].
    lens : Lens, optional
        The lens.

    Returns
    -------
    Camera
        Origin at the tank's centre.

    Raises
    ------
    InputError
        When the diameter is not above zero, or no rim is found.

    Examples
    --------
    >>> import driftwalk as dw
    >>> track = dw.tank30_recording("without_noise").isel(time=slice(0, 1))
    >>> _, image = next(dw.render_video(track))
    >>> camera = camera_from_rim(image, diameter=0.30)
    >>> round(1 / camera.homography_px_to_m[0])
    1500
    """
    if not (math.isfinite(diameter) and diameter > 0.0):
        raise InputError(f"a tank's diameter must be above zero metres, got {diameter}")
    rim = find_rim(image, lens)
    (rows, columns), scale = image.shape[:2], 2.0 * rim.radius_px / diameter
    centre = (rim.column, rim.row)
    camera = Camera.from_scale(columns, rows, px_per_m=scale, centre_px=centre, lens=lens)
    return camera.model_copy(update={"plane_found_by": "rim", "tank_diameter_m": diameter})


def centre_on_rim(camera: Camera, image: Image) -> tuple[Camera, float]:
    """Move the origin of a calibrated camera to the tank's centre.

    The image is seen straight from above first: there the rim is a circle, however the camera is
    tilted.

    Parameters
    ----------
    camera : Camera
        With a plane.
    image : array, shape (rows, columns, 3)
        See `find_rim`.

    Returns
    -------
    Camera
        The same scale and axes, origin at the tank's centre.
    float
        Diameter of the rim at the camera's scale [m].

    Raises
    ------
    InputError
        When no rim is found.

    Examples
    --------
    >>> import driftwalk as dw
    >>> track = dw.tank30_recording("without_noise").isel(time=slice(0, 1))
    >>> _, image = next(dw.render_video(track))
    >>> aside = Camera.from_scale(640, 480, px_per_m=1500.0, centre_px=(300.0, 200.0))
    >>> centred, diameter = centre_on_rim(aside, image)
    >>> round(diameter, 3), bool(np.hypot(*centred.to_world(np.array([[319.5, 239.5]]))[0]) < 1e-4)
    (0.3, True)
    """
    rows, columns = image.shape[:2]
    above = _from_above(camera, columns, rows)
    grid = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).reshape(-1, 2)
    at = camera.to_pixel(above.to_world(grid.astype(np.float64))).astype(np.float32)
    cv2 = require_opencv()
    seen = cv2.remap(
        image, *at.reshape(rows, columns, 2).transpose(2, 0, 1), cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )  # fmt: skip
    rim = find_rim(seen)
    middle = above.to_world(np.array([[rim.column, rim.row]]))[0]
    moved = np.eye(3)
    moved[:2, 2] = -middle
    plane = moved @ np.array(camera.homography_px_to_m).reshape(3, 3)
    nine: Any = tuple(plane.ravel().tolist())
    metres_per_px = float(np.hypot(*above.jacobian(np.zeros((1, 2)))[0][:, 0]))
    return camera.model_copy(update={"homography_px_to_m": nine}), 2 * rim.radius_px * metres_per_px


def _from_above(camera: Camera, columns: int, rows: int) -> Camera:
    """Return a camera that looks straight down at what is seen, on an image of the same size."""
    edge = np.array([[0, 0], [columns - 1, 0], [0, rows - 1], [columns - 1, rows - 1]])
    world = camera.to_world(edge.astype(np.float64))
    low, high = world.min(axis=0), world.max(axis=0)
    px_per_m = float(min((columns - 1) / (high - low)[0], (rows - 1) / (high - low)[1]))
    centre = (low + high) / 2
    origin = (columns - 1) / 2 - centre[0] * px_per_m, (rows - 1) / 2 + centre[1] * px_per_m
    return Camera.from_scale(columns, rows, px_per_m=px_per_m, centre_px=origin)


def _roughly(cv2: Any, grey: Any, lens: Lens | None) -> Floats:
    """Return column, row and radius of the strongest large circle, to a few pixels."""
    rows, columns = grey.shape
    factor = max(rows, columns) / _RIM.small_px
    small = cv2.resize(grey, (round(columns / factor), round(rows / factor)))
    short = min(small.shape)
    # The accumulator's limit falls until a circle is seen; the first is the strongest.
    for limit in (60, 40, 25, 15):
        circles = cv2.HoughCircles(
            small, cv2.HOUGH_GRADIENT, 1.5, short, None, 60, limit, short // 6, int(0.75 * short)
        )
        if circles is not None and len(circles):
            column, row, radius = (float(v) for v in np.asarray(circles).reshape(-1, 3)[0])
            centre = np.array([[column, row]]) * factor + (factor - 1) / 2
            if lens is not None:
                centre = lens.straighten(centre)
            return np.array([*centre[0], radius * factor])
    raise InputError(
        "no rim of the tank was found: no circle fills a third of the image's height; or calibrate "
        "with a board that lies on the plane of the water"
    )


def _inner_edge(cv2: Any, grey: Any, circle: Floats, around: float, lens: Lens | None) -> Floats:
    """Return the innermost strong edge along rays from the centre, shape (n, 2)."""
    angle = 2 * np.pi * np.arange(_RIM.rays) / _RIM.rays
    reach = circle[2] * np.array([1.0 - around, 1.0 + around])
    radius = np.arange(reach[0], reach[1], _RIM.step_px)
    ray = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    points = circle[:2] + radius[None, :, None] * ray[:, None, :]
    flat = points.reshape(-1, 2)
    seen = flat if lens is None else lens.bend(flat)
    at = seen.reshape(points.shape).astype(np.float32)
    value = cv2.remap(
        grey, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    rows, columns = grey.shape
    inside = (at > 1).all(-1) & (at[..., 0] < columns - 2) & (at[..., 1] < rows - 2)
    # Neighbouring rays together: the rim goes on, noise does not.
    value = cv2.blur(np.concatenate([value[-2:], value, value[:2]]), (5, 5))[2:-2]
    slope = np.abs(value[:, 2:] - value[:, :-2])
    slope[~(inside[:, 2:] & inside[:, :-2])] = 0.0
    usual = float(np.median(slope.max(axis=1)))
    if usual < _RIM.least_edge * _RIM.step_px:
        return np.empty((0, 2))
    middle = slope[:, 1:-1]
    peak = (middle >= slope[:, :-2]) & (middle > slope[:, 2:]) & (middle > _RIM.strong * usual)
    rays = np.flatnonzero(peak.any(axis=1))
    at_peak = peak[rays].argmax(axis=1)
    low, top, high = (slope[rays, at_peak + k] for k in range(3))
    part = 0.5 * (low - high) / np.minimum(low - 2 * top + high, -1e-9)
    exact = radius[0] + (at_peak + 2 + part) * _RIM.step_px
    return np.asarray(circle[:2] + exact[:, None] * ray[rays])


def _fit(points: Floats) -> tuple[Floats, int, float]:
    """Return a circle (column, row, radius), the points that belong to it, and their rms."""
    kept = np.ones(len(points), dtype=bool)
    circle = np.zeros(3)
    for _ in range(10):
        some = points[kept]
        matrix = np.column_stack([some, np.ones(len(some))])
        solution = np.linalg.lstsq(matrix, (some**2).sum(axis=1), rcond=None)[0]
        centre = solution[:2] / 2
        circle = np.array([*centre, math.sqrt(solution[2] + centre @ centre)])
        off = np.hypot(*(points - centre).T) - circle[2]
        limit = max(3.0 * 1.4826 * float(np.median(np.abs(off))), 0.3)
        now = np.abs(off - np.median(off)) < limit
        if (now == kept).all():
            break
        kept = now
    return circle, int(kept.sum()), float(np.sqrt((off[kept] ** 2).mean()))
