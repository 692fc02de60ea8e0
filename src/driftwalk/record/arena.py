"""The arena of a recording: what the user states or asks to fit, and the shift to its centre."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from driftwalk.core.errors import FormatError, InputError, argument_text, naming_its_file
from driftwalk.core.units import in_percent, parse_quantity
from driftwalk.record.circle import (
    CIRCLE,
    RECTANGLE,
    extent_of,
    fit_circle,
    tank_radius_bound,
)
from driftwalk.record.raw import Array


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
    try:
        value = parse_quantity(text, "m")
    except ValueError as error:
        raise InputError(
            f"{argument_text('tank', whole)}: '{text}' is not a length ({error})"
        ) from error
    if not (np.isfinite(value) and value > 0):
        raise InputError(f"{argument_text('tank', whole)}: a size must be above zero")
    return value


def _center(text: str, whole: str) -> tuple[float, float] | None:
    if not text:
        return None
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError as error:
        raise InputError(
            f"{argument_text('tank', whole)}: '@{text}' is not a centre @X,Y in metres"
        ) from error
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
            f"the fitted circle (radius {fit.radius:.4g} m) is that of the body's centre, which "
            'never reaches the rim: the tank is larger; state it with `tank="circle:D"` if you '
            "know it"
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
    table = read_table(path, TableLayout(delimiter, ["x_m", "y_m"], skip, (0, 1)))
    vertices = np.column_stack([table.numbers[0], table.numbers[1]])
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
