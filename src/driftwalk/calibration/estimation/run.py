"""The calibration of a model with many parameters: estimate, uncertainty, and a held-out check.

The `model_calibration` dataset says how well the parameters are known and how good the model is.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.calibration.estimation.estimate import (
    MATCHING,
    Matched,
    match_summaries,
    most_simulations,
)
from driftwalk.calibration.estimation.identifiability import Determination, determination
from driftwalk.calibration.estimation.label_switching import label_order
from driftwalk.calibration.estimation.summaries import SummaryObjective
from driftwalk.calibration.evolution import Budget, CachedObjective, SearchResult, search_minimum
from driftwalk.calibration.held_out.candidates import (
    Candidate,
    prepare_candidates,
    with_contact_clearance,
)
from driftwalk.calibration.held_out.held_out_score import (
    HELD_OUT_REPLICATES,
    HeldOutScore,
    even_blocks,
    recording_parts,
    require_numbers,
    score_setting,
)
from driftwalk.calibration.held_out.law_findings import BoutDistance, bout_distances, law_findings
from driftwalk.calibration.held_out.recorded import RecordedMotion
from driftwalk.calibration.problem import Execution
from driftwalk.core.arrays import Floats
from driftwalk.core.processors import one_blas_thread
from driftwalk.motion import MotionModel, ParticleModel
from driftwalk.schema import Parameter
from driftwalk.schema.answers.facts import BOUNDS, AnswerParts, texts
from driftwalk.schema.answers.verdict import verdict_of, verdict_variables
from driftwalk.schema.check import build_dataset
from driftwalk.simulation.series import series_warnings

if TYPE_CHECKING:
    import xarray as xr


SEARCH: Final = Budget(design=256, starts=3, short=20, long=30, replicates=2, retest=8)
"""Budget of the search that gives the summaries a start; smaller than the default, whose answer
counts. Chosen by hand."""


@one_blas_thread()
def estimate(entry: Candidate, motion: RecordedMotion, how: Execution) -> Estimation:
    """Estimate the parameters of a model, and judge it on blocks of time that it has not seen.

    Two stages. One searches the even blocks of time by six two-dimensional KS distances. The other
    matches summaries of the whole recording. Where these are like the model's own recordings, the
    search is not needed. Where they are not, both are made, and the answer of the summaries counts
    only if it is as close in the six distances: summaries that a model cannot give at once pull it
    away from the motion. It determines parameters only if the discrepancy is not more than four
    times the usual one: values of another model are no measurement.
    """
    stages = _Stages(entry, motion, how)
    require_numbers(stages.even)
    order = stages.order
    matched = stages.matched() if motion.replicates > 1 else None
    if matched is None or not matched.discrepancy.usual:
        stages.optima()
    answers = {
        **({} if stages.best is None else {"searched": order(stages.best[None])[0]}),
        **({} if matched is None else {"matched": matched.point, "even": matched.even_point}),
    }
    scores = stages.weighed(answers)
    counts = _counts(matched, scores)
    if not counts and matched is not None:
        # The search's answer will stay: it is worth the usual search of a comparison.
        longer = {"longer": order(stages.longer()[None])[0]}
        score = stages.weighed(longer)["longer"]
        if score < scores["searched"]:
            answers["searched"], scores["searched"] = longer["longer"], score
    known = None
    if matched is not None and counts:
        confidence = motion.study.calibration.confidence
        known = determination(matched.sample, entry.ranges, confidence=confidence)
        open_ones = matched.ambiguous | matched.unsettled | matched.undetermined
        known = known._replace(determined=known.determined & ~open_ones)
    # The odd blocks judge the better answer that has not seen them.
    unseen = [name for name in ("searched", "even")[: 1 + counts] if name in answers]
    best = min(unseen, key=scores.__getitem__)
    how.tell("judged", 0, 1)
    point = answers["matched" if counts else "searched"]
    worlds = stages.even.simulated(point[None], HELD_OUT_REPLICATES, stage="judged")
    return Estimation(
        point=point,
        searched=answers.get("searched"),
        matched=matched,
        scores=scores,
        known=known,
        held_out=score_setting(stages.even, motion, answers[best]),
        bouts=bout_distances(motion, worlds),
    )


def _counts(matched: Matched | None, scores: Mapping[str, float]) -> bool:
    """Return whether the answer of the summaries counts.

    It does where the recording is like the model's own. The smallest of many thousand scores is
    always smaller than that of the truth, so that a search proves nothing there.
    """
    if matched is None:
        return False
    return matched.discrepancy.usual or scores["matched"] <= MATCHING.as_close * scores["searched"]


class _Stages:
    """Both stages, each made when it is asked for."""

    def __init__(self, entry: Candidate, motion: RecordedMotion, how: Execution) -> None:
        self.even, self.order = even_blocks(entry, motion), label_order(entry)
        self.best: Floats | None = None
        self._motion, self._how = motion, how
        self._optima: Floats | None = None

    def matched(self) -> Matched:
        """Return the setting whose summaries match; searches where it has no other start."""
        count, replicates = len(self.even.ranges), self._motion.replicates
        objective = SummaryObjective(
            self.even,
            self._motion,
            store=self._how.stores("summaries", {"worlds": replicates}),
            executor=self._how.executor,
            tell=lambda done, most: self._how.tell("summaries", done, most),
            most=most_simulations(count, replicates),
        )
        return match_summaries(
            objective,
            count,
            self.optima,
            order=self.order,
            replicates=replicates,
            seed=self.even.seed,
        )

    def optima(self) -> Floats:
        """Return the ends of the searches, the best first."""
        if self._optima is None:
            found = self._search("search", SEARCH)
            self.best = found.best
            self._optima = found.settings[np.argsort(found.optimum_scores, kind="stable")]
        return self._optima

    def longer(self) -> Floats:
        """Return the answer of a longer search."""
        return self._search("longer-search", Budget()).best

    def _search(self, stage: str, budget: Budget) -> SearchResult:
        count = len(self.even.ranges)
        most = budget.evaluations(count)
        return search_minimum(
            CachedObjective(self.even, self._how.stores(stage, {"budget": vars(budget)})),
            count,
            budget=budget,
            seed=self.even.seed,
            tell=lambda done, _: self._how.tell(stage, done, most),
        )

    def weighed(self, answers: Mapping[str, Floats]) -> dict[str, float]:
        """Return scores in the even blocks, of 20 replicates with common random numbers."""
        overall, distances = self.even.reference.overall, self.even.distances
        return {
            name: float(overall(distances(point[None], 20, stage="weighed")[0]).mean())
            for name, point in answers.items()
        }


def calibrate_many(motion: RecordedMotion, model: MotionModel, how: Execution) -> xr.Dataset:
    """Return the `model_calibration` of a model with any number of parameters.

    A self-propelled body without a clearance has that of the recording. The search runs in this
    process, whatever the executor.
    """
    (entry,), warnings = prepare_candidates([with_contact_clearance(model, motion)], motion)
    return build_model_calibration(estimate(entry, motion, how), entry, motion, warnings)


@dataclass(frozen=True)
class Estimation:
    """Everything that was found of a model's parameters.

    Attributes
    ----------
    point : ndarray, shape (parameters,)
        The estimate, in the unit cube.
    searched : ndarray or None
        The answer of the first stage; None where it was not needed.
    matched : Matched or None
        That of the second stage; None where it was not asked for.
    scores : mapping of str to float
        Mean of distance over floor in the even blocks of time, of each answer.
    known : Determination or None
        How well the parameters are determined; None where the second stage does not count.
    held_out : HeldOutScore
        The answer for the even blocks, judged on the odd ones.
    bouts : sequence of BoutDistance
        How long bouts last at the estimate, against the recording's.
    """

    point: Floats
    searched: Floats | None
    matched: Matched | None
    scores: Mapping[str, float]
    known: Determination | None
    held_out: HeldOutScore
    bouts: Sequence[BoutDistance]


def build_model_calibration(
    found: Estimation,
    entry: Candidate,
    motion: RecordedMotion,
    warnings: Sequence[str],
) -> xr.Dataset:
    """Return the dataset of a calibration of many parameters."""
    ranges, held_out = entry.ranges, found.held_out
    discrepancy = None if found.matched is None else found.matched.discrepancy
    against, unable = law_findings(
        entry, held_out, motion, discrepancy=discrepancy, bouts=found.bouts
    )
    if (ended := entry.at_range_end(found.point)) is not None:
        unable.append(ended)
    verdict = verdict_of(against, unable)
    count = len(ranges)
    # Where the summaries' answer does not count, nothing is known of the intervals.
    known = found.known or Determination(
        np.full((count, 2), np.nan), np.full(count, np.nan), np.zeros(count, dtype=bool)
    )
    about, named = recording_parts(motion), parameter_parts(ranges)
    data: dict[str, Any] = {
        **about.data,
        **named.data,
        "estimate": ("parameter", _values(entry, found.point[None])[0]),
        "interval": (("parameter", "bound"), known.interval),
        "determined": ("parameter", known.determined),
        "half_width": ("parameter", known.half_width),
        "range": (("parameter", "bound"), np.array([(one.low, one.high) for one in ranges])),
        "held_out_distance": ("aspect", held_out.held),
        "trained_distance": ("aspect", held_out.trained),
        "check_median": ("check", np.median(held_out.checks, axis=0)),
        "check_low": ("check", held_out.checks.min(axis=0)),
        "check_high": ("check", held_out.checks.max(axis=0)),
        "score": ((), held_out.score),
        "score_std": ((), held_out.score_std),
        **verdict_variables(verdict),
        **_stages(found, entry),
    }
    series = series_warnings(motion.like.flow, duration=motion.duration)
    said = [*warnings, *_said(found, entry), *series]
    coords = {**named.coords, **about.coords, "warning": ("warning", texts(said))}
    attrs: dict[str, Any] = {
        "model": entry.model.name,
        "estimate_from": "search" if found.known is None else "summaries",
        "fixed": json.dumps(_fixed(entry)),
        "confidence": motion.study.calibration.confidence,
        "position_noise_m": motion.like.camera.position_noise,
        **about.attrs,
    }
    return build_dataset("model_calibration", data, coords, attrs)


def parameter_parts(parameters: Sequence[Parameter]) -> AnswerParts:
    """Return what a dataset of estimates says of their parameters."""
    data = {
        "unit": ("parameter", texts([one.unit for one in parameters])),
        "scale": ("parameter", texts([one.scale for one in parameters])),
        "meaning": ("parameter", texts([one.meaning or one.label for one in parameters])),
    }
    names = texts([one.name for one in parameters])
    coords = {"parameter": ("parameter", names), "bound": ("bound", texts(BOUNDS))}
    return AnswerParts(data, coords, {})


def _stages(found: Estimation, entry: Candidate) -> dict[str, Any]:
    """Return what the two stages left, where they were made."""
    data: dict[str, Any] = {}
    if found.searched is not None:
        data["searched_estimate"] = ("parameter", _values(entry, found.searched[None])[0])
        data["searched_score"] = ((), found.scores["searched"])
    matched = found.matched
    if matched is not None:
        data |= {
            "posterior_sample": (("draw", "parameter"), _values(entry, matched.sample)),
            "matched_score": ((), found.scores["matched"]),
            "discrepancy": ((), matched.discrepancy.value),
            "discrepancy_median": ((), matched.discrepancy.median),
            "discrepancy_q95": ((), matched.discrepancy.upper),
            "interval_stretch": ((), matched.stretch),
        }
        if matched.profiles is not None:
            values = _values(entry, matched.profiles.place.T).T
            data["profile_value"] = (("parameter", "profile_point"), values)
            data["profile_discrepancy"] = (("parameter", "profile_point"), matched.profiles.rise)
    return data


def _values(entry: Candidate, points: Floats) -> Floats:
    """Return the values at points of the unit cube, shape (points, parameters)."""
    columns = [one.value_at(share) for one, share in zip(entry.ranges, points.T, strict=True)]
    return np.stack(columns, axis=1)


def _fixed(entry: Candidate) -> dict[str, float]:
    model = entry.model
    if not isinstance(model, ParticleModel):
        return {}
    return {**model.fixed, "clearance": model.clearance}


def _said(found: Estimation, entry: Candidate) -> list[str]:
    """Return the warnings of the estimate."""
    said: list[str] = []
    matched = found.matched
    if matched is None:
        return said
    if found.known is None:
        said.append(
            "the summaries of the motion lead to a worse fit: their estimate is "
            f"{found.scores['matched']:.2f} noise floors off in the six distances, the search's "
            f"{found.scores['searched']:.2f}; the values are the search's, and none is determined"
        )
        return said
    if not matched.discrepancy.usual:
        said.append(
            f"the intervals are {matched.stretch:.1f} times as wide as the posterior sample, "
            "because the model does not explain all of the "
            f"summaries{'; nothing is determined' if matched.undetermined else ''}"
        )
    names = np.array([one.name for one in entry.ranges])
    if matched.ambiguous.any():
        said.append(
            "other values fit the summaries of the motion as well: "
            f"{', '.join(names[matched.ambiguous])} not determined"
        )
    if matched.unsettled.any():
        said.append(
            "the draws had not come to rest when the simulations ended: "
            f"{', '.join(names[matched.unsettled])} not determined"
        )
    return said
