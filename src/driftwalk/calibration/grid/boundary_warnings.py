"""Where an answer reaches the end of what was searched: it may lie, or go on, beyond."""

from __future__ import annotations

from collections.abc import Container, Sequence
from typing import Any

import numpy as np

from driftwalk.calibration.problem import Axes
from driftwalk.core.arrays import Floats
from driftwalk.schema import Parameter

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
            reaches = f"the interval of the {parameter.label} reaches the end of the"
            end = _shown(parameter, axis[side])
            if not _close(axis[side], search[index][side], step):
                if crowded or cut:
                    found.append(f"{reaches} refined grid ({end}): it is wider than stated")
            elif cut and (index, side) not in known and parameter.to_value(axis[side]) != 0.0:
                values = "smaller" if side == 0 else "larger"
                found.append(
                    f"{reaches} search ({end}): extend the grid if {values} values are possible"
                )
    return found


def _shown(parameter: Parameter, coordinate: float) -> str:
    value = f"{float(parameter.to_value(coordinate)):.4g}"
    return value if parameter.unit == "1" else f"{value} {parameter.unit}"


def _close(values: Any, end: float, step: float) -> Any:
    """Return whether coordinates are the same but for rounding, on the scale of a grid's step."""
    return np.abs(values - end) <= min(1e-8 + 1e-5 * abs(end), 1e-3 * step)
