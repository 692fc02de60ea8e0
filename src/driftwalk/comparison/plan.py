"""Steps of a correlated random walk: samples that form them, and their lengths and turns.

The plan is decided once from the time stamps; it knows no positions. Built from a recording, it is
applied to the recording and to every trajectory simulated at the same time stamps, so that both
pass through the same function.
"""

from __future__ import annotations

import json
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk import _core
from driftwalk.comparison.ks import ComparisonWarning
from driftwalk.core.arrays import Bools, Floats
from driftwalk.core.errors import InputError
from driftwalk.schema import body_track
from driftwalk.schema.trajectory import Track, build_steps, require_increasing

if TYPE_CHECKING:
    import xarray as xr


Integers = npt.NDArray[np.int32]
Mode = Literal["exact", "interpolated"]


class StepPlanPolicy(NamedTuple):
    """Which intervals between samples make steps."""

    tolerance: float = 0.05
    """Share by which an interval may differ from the usual one; chosen by hand."""
    irregular_fraction: float = 0.05
    """Share of intervals out of tolerance above which steps are formed by interpolation; chosen
    by hand."""
    bridged_intervals: float = 1.5
    """Step intervals between two neighbours over which positions are interpolated; chosen by
    hand."""
    largest_grid: int = 50_000_000
    """Steps of a recording at most; chosen by hand."""


STEP_PLAN: Final = StepPlanPolicy()

# Time stamps are decimal fractions in binary: what is equal on paper differs in the last bits.
ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class StepPlan:
    """Rule for forming steps from a series of positions.

    Resampled point k is ``(1 - weight[k]) p[left[k]] + weight[k] p[left[k] + 1]`` (where the weight
    is zero the right neighbour is not looked at); pair i is formed of the points ``triple[i]``,
    ``triple[i] + 1`` and ``triple[i] + 2``.
    """

    left: Integers
    """Sample to the left of each point, shape (points,)."""
    weight: Floats
    """Weight of the sample to the right, shape (points,)."""
    triple: Integers
    """First point of each pair, shape (pairs,)."""
    time: Floats
    """When the second step of each pair begins [s], shape (pairs,)."""
    mode: Mode
    """"exact": points are samples; "interpolated": points lie between samples."""
    step_interval: float
    """Time between the points of a step [s]."""
    samples: int
    """Samples of the series that the plan was made for."""
    gaps: int
    """Sampling intervals longer than 1.5 times the usual one."""
    irregular: int
    """Sampling intervals that leave the tolerance about the usual one."""

    @property
    def points(self) -> int:
        """Number of resampled points."""
        return int(self.left.size)

    @property
    def pairs(self) -> int:
        """Number of (step length, turning angle) pairs."""
        return int(self.triple.size)


class AppliedSteps(NamedTuple):
    """The pairs of one trajectory."""

    step_length: Floats
    """Length of the second step of each pair [m]."""
    turning_angle: Floats
    """Signed angle from the first step to the second [rad], in (-pi, pi]."""
    pair: Integers
    """Index in the plan of each pair."""
    zero_length: int
    """Pairs left out because a step has zero length, so there is no angle."""
    missing: int
    """Pairs left out because a position is not finite."""


def plan_steps(
    time: npt.ArrayLike,
    *,
    step_interval: float | None = None,
    tolerance: float = STEP_PLAN.tolerance,
) -> StepPlan:
    """Decide from time stamps which positions form steps.

    A pair is formed only from three points `step_interval` apart. Where the sampling is regular (at
    most 5 % of the intervals leave the tolerance about the median), points are samples: every k-th
    of each gap-free run of samples, beginning with its first, k being the whole number of sampling
    intervals in the step interval (mode "exact"; steps do not overlap). Otherwise, or where the
    step interval is no multiple of the sampling interval, points are interpolated linearly on the
    grid first time stamp + j `step_interval`, between samples at most 1.5 `step_interval` apart
    (mode "interpolated").

    Parameters
    ----------
    time : array_like, shape (n,)
        Time stamps of the samples that are present [s], increasing, n >= 3.
    step_interval : float, optional
        Time between the points of a step [s]; default: the median sampling interval.
    tolerance : float
        How far an interval may be from its nominal value, as a fraction of it.

    Returns
    -------
    StepPlan
        Good for every trajectory with samples at these times.

    Raises
    ------
    InputError
        When times do not increase, there are fewer than three, the interval is not positive, or no
        three points are `step_interval` apart.

    Examples
    --------
    >>> plan_steps([0.0, 0.1, 0.2, 0.3, 0.5]).pairs
    2
    """
    stamps = _checked_times(time)
    intervals = np.diff(stamps)
    sampling = usual_interval(stamps)
    wanted = sampling if step_interval is None else float(step_interval)
    if not (np.isfinite(wanted) and wanted > 0):
        raise InputError(f"step_interval must be a positive time in s, got {step_interval!r}")
    within = np.abs(intervals - sampling) <= tolerance * sampling * (1 + ROUNDING)
    multiple = max(1, round(wanted / sampling))
    divides = abs(multiple * sampling - wanted) <= tolerance * wanted * (1 + ROUNDING)
    irregular = int((~within).sum())
    # Positions as they were measured wherever possible: interpolation smooths part of the noise.
    if divides and irregular <= STEP_PLAN.irregular_fraction * intervals.size:
        mode: Mode = "exact"
        left, triple = _decimate(stamps, within, multiple, wanted, tolerance)
        weight = np.zeros(left.size)
        point_time = stamps[left]
    else:
        mode = "interpolated"
        left, weight, triple, point_time = _interpolate(stamps, wanted)
    if triple.size == 0:
        raise InputError(
            f"no three positions are {wanted:.6g} s apart (usual sampling interval "
            f"{sampling:.6g} s, {stamps.size} samples): choose another step interval "
            "(`step_interval`)"
        )
    return StepPlan(
        left=left.astype(np.int32),
        weight=weight,
        triple=triple.astype(np.int32),
        time=point_time[triple + 1],
        mode=mode,
        step_interval=wanted,
        samples=int(stamps.size),
        gaps=int((intervals > STEP_PLAN.bridged_intervals * sampling).sum()),
        irregular=irregular,
    )


def apply_steps(plan: StepPlan, x: npt.ArrayLike, y: npt.ArrayLike) -> AppliedSteps:
    """Form the steps of a trajectory with samples at the plan's time stamps.

    Parameters
    ----------
    plan : StepPlan
        From `plan_steps`.
    x, y : array_like, shape (plan.samples,)
        Positions [m], float32 or float64; a pair that needs a position that is not finite is left
        out and counted.

    Returns
    -------
    AppliedSteps
        Step lengths [m] and turning angles [rad], and what was left out.

    Raises
    ------
    InputError
        When the number of positions is not that of the plan.

    Examples
    --------
    >>> plan = plan_steps([0.0, 0.1, 0.2])
    >>> float(apply_steps(plan, [0.0, 1.0, 1.0], [0.0, 0.0, 2.0]).step_length[0])
    2.0
    """
    x_m, y_m = np.asarray(x), np.asarray(y)
    kind = np.float32 if x_m.dtype == y_m.dtype == np.float32 else np.float64
    if x_m.shape != (plan.samples,) or y_m.shape != (plan.samples,):
        raise InputError(
            f"the step plan was made for {plan.samples} samples, got x {x_m.shape} and y "
            f"{y_m.shape}"
        )
    positions = (np.ascontiguousarray(axis, dtype=kind) for axis in (x_m, y_m))
    return AppliedSteps(*_core.apply_step_plan(plan.left, plan.weight, plan.triple, *positions))


def usual_interval(time: Floats) -> float:
    """Return the median sampling interval [s], to nine digits: time stamps are decimal numbers."""
    return float(f"{np.median(np.diff(time)):.9g}")


def _checked_times(time: npt.ArrayLike) -> Floats:
    stamps = np.asarray(time, dtype=np.float64)
    if stamps.ndim != 1 or stamps.size < 3:
        raise InputError(f"steps need at least three samples, got time stamps {stamps.shape}")
    require_increasing(stamps)
    if not np.isfinite(stamps[[0, -1]]).all():
        raise InputError("the first or last time stamp is not a finite number")
    return stamps


def _decimate(
    stamps: Floats, within: Bools, multiple: int, wanted: float, tolerance: float
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Return every `multiple`-th sample of each gap-free run, and where three of them follow."""
    sample = np.arange(stamps.size)
    run_start = np.maximum.accumulate(np.where(np.r_[True, ~within], sample, 0))
    chosen = sample[(sample - run_start) % multiple == 0]
    follows = np.diff(chosen) == multiple
    follows &= run_start[chosen[1:]] == run_start[chosen[:-1]]
    duration = np.diff(stamps[chosen])
    follows &= np.abs(duration - wanted) <= tolerance * wanted * (1 + ROUNDING)
    return chosen, np.flatnonzero(follows[:-1] & follows[1:])


def _interpolate(
    stamps: Floats, wanted: float
) -> tuple[npt.NDArray[np.int64], Floats, npt.NDArray[np.int64], Floats]:
    """Return the points of a regular grid that lie between near neighbours."""
    steps = (stamps[-1] - stamps[0]) / wanted
    if steps > STEP_PLAN.largest_grid:
        raise InputError(
            f"a step interval of {wanted:.6g} s divides the {stamps[-1] - stamps[0]:.6g} s of "
            f"the recording into more than {STEP_PLAN.largest_grid} steps: choose a longer one "
            "(`step_interval`)"
        )
    index = np.arange(int(np.floor(steps + ROUNDING)) + 1)
    grid = stamps[0] + index * wanted
    left = np.clip(np.searchsorted(stamps, grid, side="right") - 1, 0, stamps.size - 2)
    width = stamps[left + 1] - stamps[left]
    weight = (grid - stamps[left]) / width
    on_right = weight > 1 - ROUNDING
    left, weight = left + on_right, np.where(on_right, 0.0, weight)
    weight[weight < ROUNDING] = 0.0
    known = (weight == 0.0) | (width <= STEP_PLAN.bridged_intervals * wanted * (1 + ROUNDING))
    follows = np.diff(index[known]) == 1
    triple = np.flatnonzero(follows[:-1] & follows[1:])
    return left[known], weight[known], triple, grid[known]


class StepChoicePolicy(NamedTuple):
    """Which longer step is suggested where many steps have no length."""

    zero_fraction: float = 0.05
    """Share of steps without a length above which the step interval is too short for the
    resolution of the file; chosen by hand."""
    longest_suggestion: int = 64
    """Samples of the longest step that is suggested; chosen by hand."""


_CHOICE: Final = StepChoicePolicy()


def steps(
    trajectory: xr.Dataset, *, body: str | None = None, step_interval: float | None = None
) -> xr.Dataset:
    """Return the step lengths and turning angles of one body.

    With positions p_i at constant interval: step length S_i = |p_{i+1} - p_i| and turning angle
    A_i, the signed angle from step i - 1 to step i, in (-pi, pi] (the paper's step angle); n
    samples without a gap give n - 2 pairs. `plan_steps` says which samples form a pair.

    Parameters
    ----------
    trajectory : xarray.Dataset
        A `trajectory`.
    body : str, optional
        Name of the body; may be left out when there is only one.
    step_interval : float, optional
        Time between the positions of a step [s]; default: the recording's median interval.

    Returns
    -------
    xarray.Dataset
        A `steps` dataset. ``attrs``: ``body``, ``step_interval_s``, ``mode`` ("exact" or
        "interpolated"), ``samples``, ``pairs``, ``zero_length`` (pairs left out because a step has
        no direction), ``gaps``, ``irregular_intervals``, ``warnings`` (JSON list of sentences).

    Raises
    ------
    InputError
        When there is no such body or no pair can be formed.

    Warns
    -----
    ComparisonWarning
        When more than 5 % of the pairs hold a step of zero length.

    Examples
    --------
    >>> from driftwalk.schema import build_trajectory
    >>> path = build_trajectory([0.0, 0.1, 0.2], [0.0, 0.01, 0.01], [0.0, 0.0, 0.02])
    >>> steps(path)["turning_angle"].values.round(4)
    array([1.5708])
    """
    track = body_track(trajectory, body)
    plan = plan_steps(track.time, step_interval=step_interval)
    applied = apply_steps(plan, track.x, track.y)
    if applied.step_length.size == 0:
        raise InputError(
            f"none of the {plan.pairs} step pairs has a direction: the body does not move at a "
            f"step_interval of {plan.step_interval:.6g} s: name {_advice(track, plan)}"
        )
    sentences = []
    zero = applied.zero_length / plan.pairs
    if zero > _CHOICE.zero_fraction:
        sentences.append(
            f"{100 * zero:.0f} % of the step pairs hold a step of zero length, which has no "
            f"direction, and were left out: the body rests, or {_advice(track, plan)} is needed "
            "for the file's resolution"
        )
        warnings.warn(sentences[0], ComparisonWarning, stacklevel=2)
    return build_steps(
        applied.step_length,
        applied.turning_angle,
        time=plan.time[applied.pair],
        attrs={
            "body": body or "",
            "step_interval_s": plan.step_interval,
            "mode": plan.mode,
            "samples": plan.samples,
            "pairs": int(applied.step_length.size),
            "zero_length": applied.zero_length,
            "gaps": plan.gaps,
            "irregular_intervals": plan.irregular,
            "warnings": json.dumps(sentences),
        },
    )


def _advice(track: Track, plan: StepPlan) -> str:
    """Return what to ask for: the first doubling at which few steps have zero length."""
    factor = 2
    while factor <= _CHOICE.longest_suggestion:
        try:
            longer = plan_steps(track.time, step_interval=factor * plan.step_interval)
        except InputError:
            break
        applied = apply_steps(longer, track.x, track.y)
        if applied.zero_length <= _CHOICE.zero_fraction * longer.pairs:
            return f"a step_interval of {np.round(longer.step_interval, 9):.6g} s or more"
        factor *= 2
    return "a longer step_interval"
