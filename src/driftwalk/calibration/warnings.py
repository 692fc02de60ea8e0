"""Sentences of a calibration: what it warns of, how the model differs, which values are unknown."""

from __future__ import annotations

import math
from collections.abc import Container, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.calibration.grid.bootstrap_region import Bootstrap, simulated_steps
from driftwalk.calibration.problem import Axes, Problem
from driftwalk.comparison import StepDistance
from driftwalk.comparison.statistic import distances_among
from driftwalk.core.arrays import Floats
from driftwalk.core.units import in_percent
from driftwalk.flow.arena import outline_of
from driftwalk.schema import Parameter, Track
from driftwalk.schema.kinds.fit import PARAMETERS
from driftwalk.schema.kinds.flow import FIT_PREFIX

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


class WallWarningPolicy(NamedTuple):
    """When a recording is near a wall often enough for its friction to count. Chosen by hand."""

    notable_share: float = 0.05
    """Share of the samples near the wall above which a warning is given; chosen by hand."""
    reach_m: float = 0.002
    """How far a block may move from one sample to the next [m]; chosen by hand."""


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
        f"the block may touch the wall in {in_percent(share)} of the samples, and the study takes "
        f"the default wall (restitution {tank.wall_restitution:g}, friction "
        f"{tank.wall_friction:g}): a "
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
            at_end = np.mean(_close(estimates[:, index], lattice[index][side], step))
            crowded = at_end > CALIBRATION_VERDICT.most_at_end
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


class CalibrationVerdictPolicy(NamedTuple):
    """When a calibration is open, and what is looked at where the model is far off."""

    recordings: int = 8
    """Simulations at the optimum whose step lengths and turning angles are compared. Chosen by
    hand."""
    drawn: int = 16
    """Simulations with values that chance allows. Chosen by hand."""
    chance: float = 2.0
    """Distances among simulations within which a distance is called chance, as for D itself."""
    half_width: float = 0.25
    """Half an interval over the value, above which the parameter is not determined. Of 132
    recordings of the model itself (studies/coverage) 30 are then said to be explained, and C_d is
    more than 10 % off in 2 of them; with 0.5 it would be in 14 of 53."""
    least_share: float = 0.01
    """Half an interval over the search, below which a parameter near 0 is determined. Chosen by
    hand."""
    most_at_end: float = 0.05
    """Share of the bootstrap's estimates at an end of a grid above which the grid cuts them off: of
    a whole 90 % interval chance puts as many beyond each end."""


CALIBRATION_VERDICT: Final = CalibrationVerdictPolicy()


def drawn_distance(problem: Problem, bootstrap: Bootstrap) -> float:
    """Return the median distance among simulations of values that chance allows.

    The values are the bootstrap's estimates.
    """
    count = min(CALIBRATION_VERDICT.drawn, len(bootstrap.estimates))
    drawn = bootstrap.estimates[np.linspace(0, len(bootstrap.estimates) - 1, count).astype(int)]
    steps, _ = simulated_steps(problem, list(drawn.T), stage="drawn", replicates=1)
    among = distances_among(problem.statistic, steps, threads=problem.like.threads)
    return float(np.median(among))


def step_differences(problem: Problem, point: Sequence[float]) -> list[str]:
    """Say whether step lengths or turning angles differ from those simulated at a point, and how.

    A sentence for each that is farther from the recording than chance; nothing with a statistic of
    a user.
    """
    from scipy.stats import ks_2samp

    if not isinstance(problem.statistic, StepDistance):
        return []
    table, _ = simulated_steps(
        problem, point, stage="bootstrap", replicates=CALIBRATION_VERDICT.recordings
    )
    said = []
    for name, column, recorded in (
        ("step lengths", table.length, problem.steps[:, 0]),
        ("turning angles", table.angle, problem.steps[:, 1]),
    ):
        replicates = [row[:pairs] for row, pairs in zip(column, table.pairs, strict=True)]
        apart = np.median([ks_2samp(recorded, one).statistic for one in replicates])
        among = np.median([ks_2samp(replicates[0], one).statistic for one in replicates[1:]])
        if apart > CALIBRATION_VERDICT.chance * among:
            own, simulated = (_size(name, one) for one in (recorded, np.concatenate(replicates)))
            said.append(
                f"the {name} differ: their KS distance is {apart:.3f}, between simulations "
                f"{among:.3f}; half of them are below {own}, of the simulated ones below "
                f"{simulated}"
            )
    return said


def _size(name: str, values: Floats) -> str:
    middle = float(np.median(np.abs(values)))
    return f"{1e3 * middle:.3g} mm" if name == "step lengths" else f"{math.degrees(middle):.3g}°"


def undetermined(
    parameters: Sequence[Parameter],
    intervals: Sequence[tuple[float, float]],
    point: Sequence[float],
) -> list[str]:
    """Return a sentence for each parameter whose interval is too wide to say what its value is.

    Examples
    --------
    >>> drag = Parameter("drag", "1", 0.0, 2.0, step=0.05)
    >>> undetermined([drag], [(0.3, 0.5)], [0.4]), undetermined([drag], [(0.0, 0.01)], [0.0])
    ([], [])
    >>> undetermined([drag], [(0.0, 0.12)], [0.06])
    ['the drag is not determined: its interval is 0 to 0.12; record longer, or other motion']
    """
    said = []
    for one, bounds, coordinate in zip(parameters, intervals, point, strict=True):
        low, high = (float(one.to_value(end)) for end in bounds)
        wide = 0.5 * (high - low) > CALIBRATION_VERDICT.half_width * abs(
            float(one.to_value(coordinate))
        )
        search = one.coordinates[-1] - one.coordinates[0]
        if wide and bounds[1] - bounds[0] > 2.0 * CALIBRATION_VERDICT.least_share * search:
            unit = "" if one.unit == "1" else f" {one.unit}"
            said.append(
                f"the {one.label} is not determined: its interval is {low:.3g} to {high:.3g}{unit};"
                " record longer, or other motion"
            )
    return said


def fit_disagreements(
    flow: xr.Dataset, recording: str, intervals: Mapping[str, tuple[float, float]]
) -> list[str]:
    """Return where a calibration and the fit that made its flow exclude each other.

    Parameters
    ----------
    flow : xarray.Dataset
        A `flow_field`. One that no fit made, or one of another recording, says nothing.
    recording : str
        Name of the recording's file.
    intervals : mapping of str to tuple
        Of the calibration: ``drag_coefficient`` and ``force_noise_intensity`` [N2 s].
    """
    if recording not in str(flow.attrs.get("source", "")).split(", "):
        return []
    said = []
    for name, bounds in intervals.items():
        of_fit = flow.attrs.get(f"{FIT_PREFIX}{name}")
        if of_fit is None or not (bounds[1] < of_fit[0] or of_fit[1] < bounds[0]):
            continue
        number = PARAMETERS[name]
        own, other = (f"{low:.3g} to {high:.3g}" for low, high in (bounds, of_fit))
        said.append(
            f"{number.words} is {own} here and {other} in the fit that made the flow: at most one "
            "of them is right; read the fit's own verdict, or measure the flow"
        )
    return said
