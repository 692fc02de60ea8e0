"""The dataset of a posterior from outcomes: intervals, verdict with its reasons, self-check."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.assembly.outcome_posterior.problem import (
    DESIGN_POLICY,
    Checked,
    Emulated,
    OutcomeProblem,
)
from driftwalk.assembly.outcome_posterior.records import BOTH, CLASSES, EARLY, JOINS, KINDS, TIMES
from driftwalk.assembly.outcome_posterior.region import REGION_POLICY, intervals_of, weights_of
from driftwalk.core.arrays import Floats
from driftwalk.core.study_keys import INFERRED_KEYS
from driftwalk.core.units import in_percent
from driftwalk.schema.answers.facts import texts
from driftwalk.schema.answers.outcome_posterior import (
    BOTH_ENDS,
    LOWER_END,
    NO_END,
    REFUSED,
    UPPER_END,
)
from driftwalk.schema.check import build_dataset
from driftwalk.schema.kinds.sensitivity import axis_number
from driftwalk.schema.shapes import short_class

if TYPE_CHECKING:
    import numpy.typing as npt
    import xarray as xr

PREFERRED = (BOTH, CLASSES, JOINS, TIMES, EARLY)
"""Kinds of data in the order in which the stated region is taken from those that cover."""


def posterior_dataset(problem: OutcomeProblem, emulated: Emulated, checked: Checked) -> xr.Dataset:
    """Return the dataset of a posterior."""
    low, span = problem.low, problem.high - problem.low
    coverage, policy = checked.coverage, REGION_POLICY
    explained = checked.explained
    offered = [
        kind for kind in PREFERRED if explained and kind in problem.kinds and coverage[kind].offered
    ]
    used = offered[0] if offered else None
    ends = np.full((len(KINDS), len(problem.names), 3), np.nan)
    weight = np.full(len(emulated.point), 1.0 / len(emulated.point))
    for at, kind in enumerate(KINDS):
        if kind in offered:
            own = weights_of(checked.log_likelihood[kind], power=coverage[kind].power)
            ends[at] = intervals_of(emulated.point, own)
            weight = own if kind == used else weight
    chosen = ends[KINDS.index(used)] if used else ends[0]
    limit = limits_of(chosen)
    value = low + emulated.point * span
    if not explained:
        # If the model were right: which class disagrees most, and where the search ended.
        weight = weights_of(checked.log_likelihood[problem.kinds[0]])
    names, observed, predicted = _classes(problem, emulated, weight)
    seen = observed / max(observed.sum(), 1)
    most = int(np.argmax(np.abs(seen - predicted)))
    worst = names[most] if names[most] == "rest" else short_class(names[most])
    unlike = (
        "widen the ranges, or the model is wrong"
        if not explained and _at_edge(intervals_of(emulated.point, weight)).any()
        else f"most in {worst}, {seen[most]:.3f} seen and {predicted[most]:.3f} predicted"
    )
    unit = [_unit(name) for name in problem.names]
    noise = emulated.noise[used or CLASSES]
    reasons = _reasons(problem, chosen, limit, checked, used, unlike)
    if used and noise >= DESIGN_POLICY.noise:
        reasons.append(
            f"the emulator's error is {in_percent(noise)} of the sampling error, and not below "
            f"{in_percent(DESIGN_POLICY.noise)}: give more runs of a node (runs)"
        )
    verdict = "determined"
    if not explained:
        verdict = REFUSED
    elif used is None:
        verdict = "cannot tell: no kind of data has regions that cover"
    elif not (limit == BOTH_ENDS).all():
        verdict = "partly determined" if (limit != NO_END).any() else "cannot tell"
    kinds = list(KINDS)
    data: dict[str, Any] = {
        "value": (("point", "parameter"), value),
        "weight": ("point", weight),
        "estimate": ("parameter", low + chosen[:, 1] * span),
        "interval": (("parameter", "bound"), low[:, None] + chosen[:, [0, 2]] * span[:, None]),
        "determined": ("parameter", limit == BOTH_ENDS),
        "limit": ("parameter", limit.astype(object)),
        "low": ("parameter", low),
        "high": ("parameter", problem.high),
        "observed": ("data", np.array([kind in problem.kinds for kind in kinds])),
        "offered": ("data", np.array([coverage[kind].offered for kind in kinds])),
        "power": ("data", np.array([coverage[kind].power for kind in kinds])),
        "coverage": ("data", np.array([coverage[kind].joint for kind in kinds])),
        "interval_coverage": (
            ("data", "parameter"), np.stack([coverage[kind].marginal for kind in kinds])
        ),
        "expected_width": (
            ("data", "parameter"), np.stack([coverage[kind].width for kind in kinds])
        ),
        "width": (("data", "parameter"), (ends[..., 2] - ends[..., 0]) / policy.confidence),
        "count": ("class", observed),
        "share": ("class", predicted),
        "node_value": (("node", "parameter"), low + emulated.node * span),
        "truth_value": (("truth", "parameter"), low + checked.truth * span),
        "reason": ("reason", texts(reasons)),
    }  # fmt: skip
    coords = {
        "parameter": ("parameter", np.array(problem.names, dtype=object)),
        "unit": ("parameter", np.array(unit, dtype=object)),
        "data": ("data", np.array(kinds, dtype=object)),
        "class": ("class", np.array(names, dtype=object)),
    }
    attrs = {
        "verdict": verdict,
        "used": used or "none",
        "runs": len(problem.observed.records),
        "blocks": problem.observed.blocks,
        "after_s": problem.study.assembly.duration_s,
        "p": checked.p,
        "emulator_noise": noise,
        "node_runs": problem.study.sensitivity.runs,
        "truths": problem.truths,
        "confidence": policy.confidence,
        "seed": problem.seed,
        "study": problem.study.to_toml(),
    }
    return build_dataset("outcome_posterior", data, coords, attrs)


def _classes(
    problem: OutcomeProblem, emulated: Emulated, weight: Floats
) -> tuple[list[str], Any, Floats]:
    """Return the final classes, how often they were seen, and their predicted mean shares."""
    from scipy.special import softmax

    categories = emulated.categories[CLASSES]
    mean, _ = emulated.emulators[CLASSES].predict(emulated.point)
    seen = categories.counts(problem.observed.records)
    return [str(label) for label in categories.labels], seen, weight @ softmax(mean, axis=1)


def _unit(name: str) -> str:
    from driftwalk.model import declared

    quantity = declared(INFERRED_KEYS[name]).quantity
    return "1" if quantity is None else quantity.unit


def limits_of(ends: Floats) -> npt.NDArray[Any]:
    """Return which ends of the intervals are limits: both, one, or none if wide or not stated.

    An end that is that of the range is none of the data's.

    Examples
    --------
    >>> limits_of(np.array([[0.3, 0.4, 0.5], [0.0, 0.2, 0.4], [0.0, 0.5, 0.9]])).tolist()
    ['both', 'upper', 'none']
    """
    policy = REGION_POLICY
    low, high = ends[:, 0], ends[:, 2]
    narrow = (high - low) / policy.confidence < policy.prior_like
    sides = [~narrow, low < policy.edge, high > 1.0 - policy.edge]
    return np.select(sides, [NO_END, UPPER_END, LOWER_END], BOTH_ENDS)


def _at_edge(ends: Floats) -> npt.NDArray[np.bool_]:
    """Return which intervals reach an end of their range."""
    edge = REGION_POLICY.edge
    return np.asarray((ends[:, 0] < edge) | (ends[:, 2] > 1.0 - edge))


def _reasons(
    problem: OutcomeProblem,
    ends: Floats,
    limit: Any,
    checked: Checked,
    used: str | None,
    unlike: str,
) -> list[str]:
    """Return sentences for what is not determined, and why; `unlike`: where the model fails."""
    policy, found = REGION_POLICY, []
    if not checked.explained:
        found.append(
            f"the outcomes agree with no setting of the ranges (p = {checked.p:.2g}): {unlike}"
        )
        return found
    if used is None:
        lacking = ", ".join(
            f"those of {kind} hold {in_percent(min(one.joint, *one.marginal))}"
            for kind, one in checked.coverage.items()
            if kind in problem.kinds
        )
        found.append(f"regions do not cover in the self-check ({lacking}): use narrower ranges")
        return found
    for name, side, (low, _, high) in zip(problem.names, limit, ends, strict=True):
        words = axis_number(name).plain
        if side == NO_END:
            found.append(
                f"cannot tell {words}: its interval is "
                f"{in_percent((high - low) / policy.confidence)} of the one without data"
            )
        elif side != BOTH_ENDS:
            other = "lower" if side == UPPER_END else "upper"
            found.append(
                f"{words}: a limit from one side, as the interval reaches the {other} end of its "
                "range; widen it if it can be wider"
            )
    return found
