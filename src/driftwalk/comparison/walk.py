"""From a trajectory to its steps: the Correlated Random Walk description of a motion."""

from __future__ import annotations

import json
import warnings
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from driftwalk.comparison.ks import ComparisonWarning
from driftwalk.comparison.plan import AppliedSteps, StepPlan, apply_steps, plan_steps
from driftwalk.core.errors import InputError
from driftwalk.schema import body_track
from driftwalk.schema.trajectory import Track, build_steps

if TYPE_CHECKING:
    import xarray as xr


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
    sentences = _warnings(track, plan, applied)
    for sentence in sentences:
        warnings.warn(sentence, ComparisonWarning, stacklevel=2)
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


def _warnings(track: Track, plan: StepPlan, applied: AppliedSteps) -> list[str]:
    zero = applied.zero_length / plan.pairs
    if zero <= _CHOICE.zero_fraction:
        return []
    return [
        f"{100 * zero:.0f} % of the step pairs hold a step of zero length, which has no direction, "
        f"and were left out: the body rests, or {_advice(track, plan)} is needed for the file's "
        "resolution"
    ]


def _advice(track: Track, plan: StepPlan) -> str:
    longer = _longer_interval(track, plan.step_interval)
    return f"a step_interval of {longer:.6g} s or more" if longer else "a longer step_interval"


def _longer_interval(track: Track, step_interval: float) -> float | None:
    """Return the first doubling of the interval at which few steps have zero length."""
    factor = 2
    while factor <= _CHOICE.longest_suggestion:
        try:
            plan = plan_steps(track.time, step_interval=factor * step_interval)
        except InputError:
            return None
        applied = apply_steps(plan, track.x, track.y)
        if applied.zero_length <= _CHOICE.zero_fraction * plan.pairs:
            return float(np.round(plan.step_interval, 9))
        factor *= 2
    return None
