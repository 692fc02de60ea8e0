"""Modes of a flow whose shape changes: layers of splines with amplitudes periodic in time.

    u(x, t) = u_0(x) + sqrt(2) (u_1(x) cos(2 pi f t + p) + u_2(x) sin(2 pi f t + p))

The frequency begins at the line in the spectra of the cells (`shape_changes`) and is a parameter
like the others. With both modes the flow at a place goes round an ellipse, as where a jet turns;
where the second one is not needed, as for eddies that are strong in turn, the phase p of the first
one is a parameter. Their number is that with the most evidence.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final, Literal, NamedTuple

import numpy as np

from driftwalk.core.errors import InputError, argument_text
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.law.score_tests import StrengthScores
from driftwalk.likelihood.law.search import evidence_of
from driftwalk.likelihood.law.shape_changes import ShapeChange, shape_change
from driftwalk.likelihood.newton import FROM_NEAR, Mode, ModeSearch, thinned
from driftwalk.likelihood.preparation import Estimate, PreparedRecordings
from driftwalk.likelihood.prior import Prior, Weights
from driftwalk.schema.answers.force_law import FORWARD_SELECTION

Wanted = Literal["none", "auto", "1", "2"]


class FlowModesPolicy(NamedTuple):
    """Where the search of the modes begins."""

    weakness: float = 4.0
    """First factor of the prior's precision for the modes: half as strong as the mean flow. Chosen
    by hand; the search finds it."""

    few_steps: int = 5
    """Steps of the search with each frequency that may be the right one. Chosen by hand."""


FLOW_MODES: Final = FlowModesPolicy()


NO_LINE: Final = (
    "modes of the flow in time are not determined: the errors of a steady flow have no line in "
    "their spectra"
)
NO_SOLUTION: Final = (
    "modes of the flow in time are not determined: the search for them has no solution"
)
NO_EVIDENCE: Final = "modes of the flow in time have no more evidence than a steady flow"
NEEDED: Final = "record for longer, or with several bodies in the tank"


class FlowModes(NamedTuple):
    """Modes with which the law is searched, or why there are none."""

    start: Mode | None = None
    """Where the search of the law with these modes begins."""
    unsettled: str = ""
    """Why no modes were found, in a sentence."""


def require_one_flow(ready: PreparedRecordings, before: Estimate | None = None) -> None:
    """Refuse modes in time of several recordings or flows, or in a flow that was measured.

    `before` is the earlier fit of glued blocks, which have no modes at all.
    """
    if before is not None and max(before.point.layers, ready.passes.layers) > 1:
        raise InputError(
            "glued blocks are fitted in a steady flow, and this one changes in time: leave out the "
            "measured flow, or take an earlier fit without modes"
        )
    if ready.study.fit.flow_modes == "none":
        return
    if len(ready.tracks) > 1 or not ready.intervals.steady:
        raise InputError(
            f"{argument_text('flow_modes', ready.study.fit.flow_modes)} is for one recording in "
            "one flow: leave it out, or fit the recordings one by one"
        )
    if ready.measured is not None:
        raise InputError(
            f"{argument_text('flow_modes', ready.study.fit.flow_modes)} does not go with a "
            "measured flow, which says itself how it changes: leave one of them out"
        )


def with_layers(search: ModeSearch, layers: int) -> ModeSearch:
    """Return the search for a flow of several layers."""
    passes = replace(search.passes, layers=layers)
    return replace(search, passes=passes, prior=Prior(passes))


def find_flow_modes(
    search: ModeSearch, start: Point, weights: Weights, wanted: Wanted
) -> FlowModes:
    """Return the modes that the recording asks for under the paper's law.

    Whether the flow changes its shape, and how, hardly depends on the law; the law depends on it.
    """
    if wanted == "none":
        return FlowModes()
    search = replace(search, passes=thinned(search.passes))
    steady = search.find_from_afar(start, weights)
    line = None if steady is None else shape_change(StrengthScores(search.passes), steady)
    return modes_at(search, steady, line, wanted)


def modes_at(
    search: ModeSearch, steady: Mode | None, line: ShapeChange | None, wanted: Wanted
) -> FlowModes:
    """Return the modes with the frequency of a line, from the mode of a steady flow."""
    if steady is None or line is None or not line.significant:
        # Without a line a steady flow is the answer, unless modes are asked for.
        return FlowModes(unsettled="" if wanted == "auto" else f"{NO_LINE}; {NEEDED}")
    frequency = _best_of(search, steady, line.candidates)
    both = None if frequency is None else _both(search, steady, frequency)
    if both is None:
        return FlowModes(unsettled=f"{NO_SOLUTION}; {NEEDED}")
    found = {2: both}
    one = _one(search, both)
    if one is not None:
        found[1] = one
    evidence = {
        number: evidence_of(mode, with_layers(search, 1 + number).prior)
        for number, mode in found.items()
    }
    ahead = max(evidence.values()) - evidence_of(steady, search.prior)
    if wanted == "auto" and ahead < FORWARD_SELECTION.least_evidence:
        return FlowModes(unsettled=f"{NO_EVIDENCE}; {NEEDED}")
    # The smaller number where the evidence does not settle it.
    one_does = one is not None and evidence[2] - evidence[1] < FORWARD_SELECTION.least_evidence
    number = int(wanted) if wanted != "auto" else 1 if one_does else 2
    if number not in found:
        return FlowModes(unsettled=f"{NO_SOLUTION}; {NEEDED}")
    return FlowModes(found[number])


def _best_of(search: ModeSearch, steady: Mode, candidates: Sequence[float]) -> float | None:
    """Return the frequency whose modes come nearest to the recording in a few steps."""
    if len(candidates) < 2:
        return candidates[0] if candidates else None
    few = replace(search, iterations=FLOW_MODES.few_steps)
    tried = {one: _both(few, steady, one) for one in candidates}
    found = {one: mode.deviance for one, mode in tried.items() if mode is not None}
    return min(found, key=found.__getitem__) if found else None


def _both(search: ModeSearch, steady: Mode, frequency: float) -> Mode | None:
    """Return the mode of the likelihood with two modes of the flow in quadrature."""
    mean = steady.point.coefficients
    point = replace(
        steady.point,
        coefficients=np.concatenate([mean[np.newaxis], np.zeros((2, *mean.shape))]),
        opened={**steady.point.opened, "mode_frequency": frequency},
    )
    weights = replace(steady.weights, modes=FLOW_MODES.weakness)
    return with_layers(search, 3).coarse().find(point, weights, held=FROM_NEAR)


def _one(search: ModeSearch, both: Mode) -> Mode | None:
    """Return that with one mode, from the larger axis of the ellipse of the two."""
    coefficients = both.point.coefficients
    left, sizes, right = np.linalg.svd(coefficients[1:].reshape(2, -1), full_matrices=False)
    # u cos(w t) + v sin(w t) with (u, v) along one axis is one mode with a phase.
    phase = -math.atan2(float(left[1, 0]), float(left[0, 0]))
    layer = (sizes[0] * right[0]).reshape(coefficients[:1].shape)
    point = replace(
        both.point,
        coefficients=np.concatenate([coefficients[:1], layer]),
        opened={**both.point.opened, "mode_phase": phase},
    )
    return with_layers(search, 2).coarse().find(point, both.weights, held=FROM_NEAR)
