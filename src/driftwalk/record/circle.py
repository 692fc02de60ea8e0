"""Robust circle fit to the positions of a body, and the tank that it implies."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.core.units import parse_quantity
from driftwalk.record.raw import Array, RawBody


class CirclePolicy(NamedTuple):
    """How the circle of a body's centres is fitted, and what it may leave out."""

    directions: int = 72
    """Directions in which the outline of the samples is taken; chosen by hand."""
    sectors: int = 36
    """Sectors that a body may have visited; chosen by hand."""
    trimmed_share: float = 2e-4
    """Share of the samples that may lie outside in each direction: tracking errors; chosen by
    hand."""
    stray: float = 1.15
    """Radii of a first fit beyond which samples are tracking errors, if they are few; chosen by
    hand."""
    stray_share: float = 0.01
    """Share of the samples that are few; chosen by hand."""
    outer: float = 0.9
    """Share of the directions in which the fitted circle encloses the samples; chosen by hand."""
    rim: float = 0.85
    """Share of the radius beyond which a sample visits its sector; chosen by hand."""
    outside_percent: float = 0.05
    """Percentage of the samples beyond each side of a rectangle: tracking errors; chosen by
    hand."""
    enough_visited: float = 0.5
    """Share of the sectors that must be visited for a circle to tell about the tank; chosen by
    hand."""


CIRCLE: Final = CirclePolicy()
RECTANGLE: Final = ("rect", "rectangle")
"""Words for a rectangular tank."""


class CircleFit(NamedTuple):
    """The circle of a body's centres."""

    center_x: float
    """Centre x [m]."""
    center_y: float
    """Centre y [m]."""
    radius: float
    """Radius [m] that the centres reach; the tank's own radius is larger."""
    coverage: float
    """Share of 36 sectors in which the body came near the rim (beyond 0.85 of the radius)."""
    residual: float
    """Median distance [m] of the outline in 72 directions from the circle."""
    astray: int
    """Samples more than 2 % of the radius outside: tracking errors, or not a circle."""


def fit_circle(x: npt.ArrayLike, y: npt.ArrayLike) -> CircleFit:
    """Fit the circle that the samples fill, ignoring errors outside it.

    The extent of the samples in direction phi is ``h(phi) = c . u(phi) + r`` for a disc of centre
    c and radius r: linear in the three unknowns. It is taken in 72 directions, each time leaving
    out the 0.02 % (at least 3) outermost samples. A first fit by least absolute deviations, which
    no tracking error moves, tells samples astray (beyond 1.15 radii, if they are fewer than 1 %);
    the second fit, without them, is the 0.9 quantile regression over the directions, since a
    direction in which the body stayed away from the rim says nothing about the rim.

    This is the circle of the *centres*. The robot's centre never reaches the rim: see
    `tank_radius_bound`.

    Parameters
    ----------
    x, y : array_like, shape (n,)
        Positions [m]; NaN is left out.

    Returns
    -------
    CircleFit

    Raises
    ------
    InputError
        With fewer than 20 positions, or positions that all coincide.

    Examples
    --------
    >>> angle = np.linspace(0.0, 6.28, 500)
    >>> round(fit_circle(np.cos(angle) + 3.0, np.sin(angle)).radius, 2)
    1.0
    """
    points = np.column_stack([np.asarray(x, np.float64).ravel(), np.asarray(y, np.float64).ravel()])
    points = points[np.isfinite(points).all(axis=1)]
    if points.shape[0] < 20:
        raise InputError(f"a circle needs at least 20 positions, got {points.shape[0]}")
    total = points.shape[0]
    # Those farther than twice the 99 % distance from the median point are gross errors.
    apart = np.hypot(*(points - np.median(points, axis=0)).T)
    points = points[apart <= 2.0 * np.percentile(apart, 99.0)]
    if np.ptp(points, axis=0).max() == 0.0:
        raise InputError("a circle cannot be fitted: the body never moves")
    angle = 2.0 * np.pi * np.arange(CIRCLE.directions) / CIRCLE.directions
    design = np.column_stack([np.cos(angle), np.sin(angle), np.ones(CIRCLE.directions)])
    center_x, center_y, radius = _quantile_fit(design, _extents(points, design[:, :2]), 0.5)
    astray = np.hypot(points[:, 0] - center_x, points[:, 1] - center_y) > CIRCLE.stray * radius
    if astray.mean() < CIRCLE.stray_share:
        points = points[~astray]
    extent = _extents(points, design[:, :2])
    center_x, center_y, radius = _quantile_fit(design, extent, CIRCLE.outer)
    if radius <= 0.0:
        raise InputError("a circle cannot be fitted: the positions do not fill one")
    distance = np.hypot(points[:, 0] - center_x, points[:, 1] - center_y)
    bearing = np.arctan2(points[:, 1] - center_y, points[:, 0] - center_x)
    sector = ((bearing + np.pi) / (2.0 * np.pi) * CIRCLE.sectors).astype(int) % CIRCLE.sectors
    visited = np.unique(sector[distance > CIRCLE.rim * radius]).size
    residual = np.abs(extent - design @ np.array([center_x, center_y, radius]))
    return CircleFit(
        center_x,
        center_y,
        radius,
        coverage=visited / CIRCLE.sectors,
        residual=float(np.median(residual)),
        astray=total - int((distance <= 1.02 * radius).sum()),
    )


def tank_radius_bound(centers_radius: float, block_side: float) -> float:
    """Return the smallest radius of a round tank in which a square block's centre reaches this far.

    The centre is farthest out when a face lies against the wall with both corners: then
    ``R = sqrt((r + a/2)^2 + (a/2)^2)``. Turned any other way the block needs a larger tank, so this
    is a lower bound, and the radius itself if the block did lie flat against the wall.

    Parameters
    ----------
    centers_radius : float
        Radius r of the circle of the centres [m], as from `fit_circle`.
    block_side : float
        Side a of the block [m].

    Examples
    --------
    >>> round(tank_radius_bound(0.13425, 0.03), 4)
    0.15
    """
    half = 0.5 * block_side
    return math.hypot(centers_radius + half, half)


def _extents(points: Array, directions: Array) -> Array:
    """Return the extent of the samples along each direction, its outermost few left out."""
    last = points.shape[0] - 1 - max(3, int(CIRCLE.trimmed_share * points.shape[0]))
    return np.array([np.partition(points @ direction, last)[last] for direction in directions])


def _quantile_fit(design: Array, values: Array, share: float) -> tuple[float, float, float]:
    """Return the three unknowns with `share` of the values below the fit, by reweighting."""
    scale = float(np.ptp(values)) or 1.0
    weights: Array = np.ones(values.size)
    solution: Array = np.zeros(design.shape[1])
    for _ in range(100):
        root = np.sqrt(weights)
        fitted = np.linalg.lstsq(design * root[:, None], values * root, rcond=None)[0]
        solution = np.asarray(fitted, dtype=np.float64)
        error = values - design @ solution
        weights = np.where(error > 0, share, 1.0 - share) / np.maximum(np.abs(error), 1e-6 * scale)
    x, y, radius = solution.tolist()
    return x, y, radius


def extent_of(coordinate: Array) -> Array:
    """Return the ends of a coordinate, without the few samples beyond that are tracking errors."""
    return np.percentile(coordinate, [CIRCLE.outside_percent, 100.0 - CIRCLE.outside_percent])


def implied_scale(bodies: Sequence[RawBody], tank: str | None) -> str:
    """Return what scale the extent of the positions implies, for a file that does not say it.

    Parameters
    ----------
    bodies : sequence of RawBody
        In the units of the file.
    tank : str or None
        The tank as `load` takes it.

    Examples
    --------
    >>> turn = np.linspace(0.0, 40.0, 5000)
    >>> body = RawBody("0", turn, 200 * np.cos(turn), 200 * np.sin(turn))
    >>> implied_scale([body], "circle:30cm").partition(", ")[2]
    'in a tank of 0.3 m: a unit is 0.00075 m at most'
    """
    x, y = (np.concatenate([getattr(one, axis) for one in bodies]) for axis in "xy")
    kind, _, size = (tank or "").partition("@")[0].partition(":")
    try:
        sides = [parse_quantity(part, "m") for part in size.split("x")]
    except ConfigurationError:
        sides = []
    if not min(sides, default=0.0) > 0.0:
        sides = []
    if kind in RECTANGLE:
        known = np.isfinite(x) & np.isfinite(y)
        if len(sides) != 2 or not known.any():
            return ""
        spans = [float(np.ptp(extent_of(axis[known]))) for axis in (x, y)]
        if min(spans) <= 0.0:
            return ""
        bound = min(side / span for side, span in zip(sides, spans, strict=True))
        return (
            f"the positions span {spans[0]:.4g} by {spans[1]:.4g} units, in a tank of "
            f"{sides[0]:g} m by {sides[1]:g} m: a unit is {bound:.3g} m at most"
        )
    try:
        fit = fit_circle(x, y)
    except (InputError, ValueError):
        return ""
    if fit.coverage < CIRCLE.enough_visited:
        return ""
    across = f"the positions fill a circle of {2.0 * fit.radius:.4g} units across"
    if kind != "circle" or len(sides) != 1:
        return (
            f'{across}: state the tank, as in `tank="circle:30cm"`, for the scale that they imply'
        )
    bound = 0.5 * sides[0] / fit.radius  # the body's centre does not reach the rim
    return f"{across}, in a tank of {sides[0]:g} m: a unit is {bound:.3g} m at most"
