"""Warnings of a calibration: the end of the search, contacts with the wall, the own flow."""

from __future__ import annotations

import math
from collections.abc import Container, Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.calibration.problem import Axes
from driftwalk.core.arrays import Floats
from driftwalk.flow.arena import outline_of
from driftwalk.schema import Parameter, Track

if TYPE_CHECKING:
    from driftwalk.model import Study


class WallWarningPolicy(NamedTuple):
    """When a recording is near a wall often enough for its friction to count. Chosen by hand."""

    notable_share: float = 0.05
    """Share of the samples near the wall above which a warning is given."""
    reach_m: float = 0.002
    """How far a block may move from one sample to the next [m]."""


WALL_WARNING: Final = WallWarningPolicy()


def wall_warning(track: Track, study: Study) -> str | None:
    """Return a warning where the block is often at a wall whose properties were not stated.

    A calibration by steps simulates the contacts with the wall. Where the friction of the wall is 1
    and the study says 0, C_d comes out a third too small.

    Examples
    --------
    >>> import driftwalk as dw
    >>> time, zero = np.arange(5.0), np.zeros(5)
    >>> wall_warning(Track(time, zero, zero, zero), dw.Study()) is None
    True
    """
    tank = study.tank
    if not (tank.is_default("wall_restitution") and tank.is_default("wall_friction")):
        return None
    reach = study.block.side_m / math.sqrt(2.0) + WALL_WARNING.reach_m
    near = outline_of(tank.to_arena()).depth(track.x, track.y) < reach
    share = float(np.mean(near))
    if share <= WALL_WARNING.notable_share:
        return None
    return (
        f"the block may touch the wall in {share:.0%} of the samples, and the study takes the "
        f"default wall (restitution {tank.wall_restitution:g}, friction {tank.wall_friction:g}): a "
        "wrong friction can move C_d by a third; the likelihood fit estimates both from the "
        "contacts (`estimate_wall`): state them (`tank.wall_restitution`, `tank.wall_friction`)"
    )


OWN_FLOW: Final = (
    "the flow was taken from the recording itself, and the parameters make up for its errors: "
    "for a body that drifts, fit flow and parameters together (driftwalk fit) or give a "
    "measured flow; for one that moves by itself, compare models (driftwalk compare-models)"
)
"""Such a flow is too slow where the block seldom was, and its inward part near the wall is half of
the true one (docs/validation.md). C_d and sigma_F make up for that, at times with a D near the
floor."""


Boundary = tuple[int, int]
"""A parameter, and the side of its axis: 0 or -1."""


def optimum_warnings(
    parameters: Sequence[Parameter], axes: Axes, optimum: Sequence[float]
) -> dict[Boundary, str]:
    """Return a warning for every end of the search at which an optimum lies.

    Examples
    --------
    >>> speed = Parameter("speed", "m/s", 0.0, 0.2, step=0.1)
    >>> axes = (np.array([0.0, 0.1, 0.2]),)
    >>> list(optimum_warnings([speed], axes, [0.17])), optimum_warnings([speed], axes, [0.11])
    ([(0, -1)], {})
    """
    found = {}
    for index, (parameter, axis, value) in enumerate(zip(parameters, axes, optimum, strict=True)):
        spacing = np.diff(axis).min() if axis.size > 1 else 0.0
        for side in (0, -1)[: axis.size]:
            if abs(value - axis[side]) <= 0.5 * spacing:
                there, end = (_shown(parameter, one) for one in (value, axis[side]))
                found[index, side] = (
                    f"the optimum lies at the edge of the grid: {parameter.label} = {there} "
                    f"with the grid ending at {end}; extend the grid, or doubt the model"
                )
    return found


def interval_warnings(
    parameters: Sequence[Parameter],
    intervals: Sequence[tuple[float, float]],
    estimates: Floats,
    *,
    border: Floats,
    search: Axes,
    window: Axes,
    lattice: Axes,
    steps: Sequence[float],
    known: Container[Boundary] = (),
) -> list[str]:
    """Return a warning for every end of what was searched that cuts an interval off."""
    found = []
    for index, parameter in enumerate(parameters):
        axis = window[index]
        step = float(np.diff(axis).min()) if axis.size > 1 else steps[index]
        for side in (0, -1):
            # The bootstrap's own 5 % tail may lie there; more means that the grid cuts it off.
            crowded = np.mean(_close(estimates[:, index], lattice[index][side], step)) > 0.05
            cut = _close(intervals[index][side], axis[side], step)
            region_cut = bool(_close(border[:, index], axis[side], step).any())
            reaches = f"the interval of the {parameter.label} reaches the end of the"
            region = f"the joint region reaches, along the {parameter.label}, the end of the"
            end = _shown(parameter, axis[side])
            if not _close(axis[side], search[index][side], step):
                if crowded or cut or region_cut:
                    what = reaches if crowded or cut else region
                    found.append(f"{what} refined grid ({end}): it is wider than stated")
            elif (
                (cut or region_cut)
                and (index, side) not in known
                and parameter.to_value(axis[side]) != 0.0
            ):
                values = "smaller" if side == 0 else "larger"
                found.append(
                    f"{reaches if cut else region} search ({end}): extend the grid if {values} "
                    "values are possible"
                )
    return found


def _shown(parameter: Parameter, coordinate: float) -> str:
    value = f"{float(parameter.to_value(coordinate)):.4g}"
    return value if parameter.unit == "1" else f"{value} {parameter.unit}"


def _close(values: Any, end: float, step: float) -> Any:
    """Return whether coordinates are the same but for rounding, on the scale of a grid's step."""
    return np.abs(values - end) <= min(1e-8 + 1e-5 * abs(end), 1e-3 * step)
