"""The arena of a recording: what the user states, or the circle that the positions fill."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import FormatError, InputError, argument_text, naming_its_file
from driftwalk.core.units import in_percent, parse_quantity
from driftwalk.record.raw import Array, RawBody


class ArenaPolicy(NamedTuple):
    """How many positions may lie outside an arena."""

    inside: float = 0.999
    """Share of the samples that must lie within an arena for its centre to be the file's
    origin: tracking errors are rarer; chosen by hand."""
    most_beyond: float = 0.001
    """Share of the samples that may lie farther beyond the wall than noise takes them; chosen
    by hand."""


_ARENA: Final = ArenaPolicy()


@dataclass(frozen=True)
class PlacedArena:
    """An arena, and where its centre lies in the file's frame."""

    arena: dict[str, Any]
    """As it goes into the dataset, centre at the origin."""
    origin: tuple[float, float]
    """Shift subtracted from the positions [m]."""
    found: dict[str, Any] = field(default_factory=dict)
    """How the centre and the size were found."""
    notes: list[str] = field(default_factory=list)


Reach = Callable[[float], float]
"""From the size of a tank [m] to how far beyond its wall noise may show a body [m]."""


def place_arena(
    text: str,
    x: Array,
    y: Array,
    *,
    block_side: float | None = None,
    reach: Reach = lambda _: 0.0,
) -> PlacedArena:
    """Read the outline of a tank and place it over the positions.

    Parameters
    ----------
    text : str
        ``circle:D``, ``rect:WxH`` (sizes as ``0.3`` in metres or ``30cm``; ``@X,Y`` may follow
        with the centre in metres), ``polygon:FILE`` (CSV of vertices x_m, y_m) or ``fit``. Centre
        and vertices are in the file's frame, in metres with y up.
    x, y : array, shape (n,)
        Positions of all bodies [m], NaN left out.
    block_side : float, optional
        Side of a square block [m]; with ``fit`` it turns the circle of the centres into a lower
        bound of the tank's radius.
    reach : callable, optional
        From the size of the tank [m] to how far beyond its wall noise may show a body [m]. Called
        where positions lie outside.

    Returns
    -------
    PlacedArena
        The arena, and where its centre lies in the file's frame.

    Notes
    -----
    Without ``@X,Y`` the centre is the file's origin if 99.9 % of the positions lie inside the arena
    there, else it is fitted to the positions; which of the two is reported.

    Raises
    ------
    InputError
        When the text cannot be read, or the centre cannot be fitted.

    Examples
    --------
    >>> place_arena("circle:30cm@0.2,0.1", np.array([0.2]), np.array([0.15])).origin
    (0.2, 0.1)
    """
    known = np.isfinite(x) & np.isfinite(y)
    x, y = x[known], y[known]
    kind, _, rest = text.partition(":")
    size, _, center = rest.partition("@")
    if kind == "fit" and not rest:
        return _fitted(x, y, block_side=block_side)
    if kind == "polygon" and rest:
        return _polygon(Path(rest))
    rectangle = kind in RECTANGLE and size.count("x") == 1
    if not rectangle and not (kind == "circle" and size):
        raise InputError(f"`tank` is circle:D, rect:WxH, polygon:FILE or fit; got '{text}'")
    sides = [_length(part, text) for part in (size.split("x") if rectangle else [size])]
    return _placed(sides, x, y, _center(center, text), reach)


def _length(text: str, whole: str) -> float:
    where = argument_text("tank", whole)
    try:
        value = parse_quantity(text, "m")
    except ValueError as error:
        raise InputError(f"{where}: '{text}' is not a length ({error})") from error
    if not (np.isfinite(value) and value > 0):
        raise InputError(f"{where}: a size must be above zero")
    return value


def _center(text: str, whole: str) -> tuple[float, float] | None:
    if not text:
        return None
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError as error:
        where = argument_text("tank", whole)
        raise InputError(f"{where}: '@{text}' is not a centre @X,Y in metres") from error
    return x, y


def _fitted(x: Array, y: Array, *, block_side: float | None) -> PlacedArena:
    fit = fit_circle(x, y)
    radius = fit.radius if block_side is None else tank_radius_bound(fit.radius, block_side)
    found = {
        "by": "fit",
        "radius_of_centers_m": fit.radius,
        "center_m": [fit.center_x, fit.center_y],
        "sectors_visited_share": fit.coverage,
        "residual_m": fit.residual,
        "samples_astray": fit.astray,
        "radius_is": "of the centres" if block_side is None else "lower bound of the tank",
    }
    if block_side is None:
        notes = [
            f"the fitted circle (radius {fit.radius:.4g} m) is the path of the body's centre, "
            "which never reaches the rim: the tank is larger; state it with "
            '`tank="circle:D"` if you know it'
        ]
    else:
        notes = [
            f"centres reach {fit.radius:.4g} m, so the tank's radius is at least {radius:.4g} m, "
            "and this if a face of the block lay against the wall"
        ]
    if fit.coverage < CIRCLE.enough_visited:
        notes.append(
            f"the body came near the rim in {in_percent(fit.coverage)} of the directions only: "
            "the fitted circle is uncertain"
        )
    arena = {"shape": "circle", "diameter_m": 2.0 * radius, "center_m": [0.0, 0.0]}
    return PlacedArena(arena, (fit.center_x, fit.center_y), found, notes)


def _placed(
    sides: list[float], x: Array, y: Array, center: tuple[float, float] | None, reach: Reach
) -> PlacedArena:
    """Return a circle of one size or a rectangle of two.

    Its centre is given, the file's origin, or fitted to the positions.
    """

    def beyond(center_x: float, center_y: float) -> Array:
        if len(sides) == 1:
            return np.hypot(x - center_x, y - center_y) - 0.5 * sides[0]
        return np.maximum(np.abs(x - center_x) - sides[0] / 2, np.abs(y - center_y) - sides[1] / 2)

    arena: dict[str, Any] = {"shape": "circle", "diameter_m": sides[0]}
    if len(sides) == 2:
        arena = {"shape": "rectangle", "width_m": sides[0], "height_m": sides[1]}
    found: dict[str, Any] = {"by": "given"}
    at_origin = beyond(0.0, 0.0) <= 0.0
    if center is None and at_origin.size and float(at_origin.mean()) >= _ARENA.inside:
        center, found = (0.0, 0.0), {"by": "origin of the file"}
    elif center is None and len(sides) == 1:
        fit = fit_circle(x, y)
        center, found = (fit.center_x, fit.center_y), {"by": "fit"}
        found |= {"radius_of_centers_m": fit.radius, "sectors_visited_share": fit.coverage}
    elif center is None:
        if not x.size:
            raise InputError("the arena's centre cannot be fitted: the recording has no positions")
        ends = [extent_of(axis) for axis in (x, y)]
        center, found = (float(ends[0].mean()), float(ends[1].mean())), {"by": "fit"}
    outside = beyond(*center)
    found |= {"center_m": list(center), "samples_outside": int((outside > 0.0).sum())}
    notes = []
    most = _ARENA.most_beyond * x.size
    # More positions beyond the wall than noise takes there.
    if found["samples_outside"] > most and (far := int((outside > reach(min(sides))).sum())) > most:
        notes = [
            f"{far} of {x.size} positions lie outside the arena: its size, or the scale, is wrong"
        ]
    return PlacedArena({**arena, "center_m": [0.0, 0.0]}, center, found, notes)


@naming_its_file
def _polygon(path: Path) -> PlacedArena:
    from driftwalk.record.raw import TableLayout
    from driftwalk.record.tables.text_source import read_header
    from driftwalk.record.text import read_table

    names, delimiter, skip, has_header = read_header(path)
    if len(names) != 2 or (has_header and names != ["x_m", "y_m"]):
        raise FormatError("a polygon has two columns, x_m and y_m", line=1)
    vertices = read_table(path, TableLayout(delimiter, ["x_m", "y_m"], skip, (0, 1))).stack((0, 1))
    if (vertices[0] == vertices[-1]).all():
        vertices = vertices[:-1]
    if vertices.shape[0] < 3 or not np.isfinite(vertices).all():
        raise FormatError("a polygon needs at least three vertices")
    following = np.roll(vertices, -1, axis=0)
    cross = vertices[:, 0] * following[:, 1] - following[:, 0] * vertices[:, 1]
    if cross.sum() == 0.0:
        raise FormatError("the polygon has no area")
    center = ((vertices + following) * cross[:, None]).sum(axis=0) / (3.0 * cross.sum())
    arena = {"shape": "polygon", "vertices_m": (vertices - center).tolist()}
    x, y = center.tolist()
    return PlacedArena(arena, (x, y), {"by": "given", "center_m": [x, y]})


def arena_attributes(
    placed: PlacedArena, *, shifted_before: Sequence[float] = (0.0, 0.0)
) -> dict[str, str]:
    """Return the attributes that a trajectory carries about its arena.

    Parameters
    ----------
    placed : PlacedArena
        The arena.
    shifted_before : sequence of float
        Shift that an earlier conversion subtracted from the positions [m].
    """
    shift = [old + new for old, new in zip(shifted_before, placed.origin, strict=True)]
    return {
        "arena": json.dumps(placed.arena),
        "origin_shift_m": json.dumps(shift),
        "arena_found": json.dumps(placed.found),
    }


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
    coverage = np.unique(sector[distance > CIRCLE.rim * radius]).size / CIRCLE.sectors
    apart = np.abs(extent - design @ np.array([center_x, center_y, radius]))
    outside = total - int((distance <= 1.02 * radius).sum())
    return CircleFit(center_x, center_y, radius, coverage, float(np.median(apart)), outside)


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
        sides = [_length(part, size) for part in size.split("x")]
    except InputError:
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
