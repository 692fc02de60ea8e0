"""The calibration of a model with many parameters: estimate, uncertainty, and a held-out check."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

import numpy as np

from driftwalk.calibration.estimation.estimate import (
    MATCHING,
    Matched,
    match_summaries,
    most_simulations,
)
from driftwalk.calibration.estimation.identifiability import determination
from driftwalk.calibration.estimation.label_switching import label_order
from driftwalk.calibration.estimation.result import Estimation, build_model_calibration
from driftwalk.calibration.estimation.summary_objective import SummaryObjective
from driftwalk.calibration.evolution import Budget, CachedObjective, SearchResult, search_minimum
from driftwalk.calibration.held_out.bouts import bout_distances
from driftwalk.calibration.held_out.candidates import (
    Candidate,
    prepare_candidates,
    with_contact_clearance,
)
from driftwalk.calibration.held_out.held_out_score import (
    HELD_OUT_REPLICATES,
    even_blocks,
    require_numbers,
    score_setting,
)
from driftwalk.calibration.held_out.recorded import RecordedMotion
from driftwalk.calibration.problem import Execution
from driftwalk.core.arrays import Floats
from driftwalk.core.processors import one_blas_thread
from driftwalk.motion import MotionModel

if TYPE_CHECKING:
    import xarray as xr


SEARCH: Final = Budget(design=256, starts=3, short=20, long=30, replicates=2, retest=8)


@one_blas_thread()
def estimate(entry: Candidate, motion: RecordedMotion, how: Execution) -> Estimation:
    """Estimate the parameters of a model, and judge it on blocks of time that it has not seen.

    Two stages. One searches the even blocks of time by six two-dimensional KS distances. The other
    matches summaries of the whole recording. Where these are like those of the model's own
    recordings, the search is not needed. Where they are not, both are made, and the answer of the
    summaries counts only if it is as close in the six distances: summaries that a model cannot give
    at once pull it away from the motion. It determines parameters only if the discrepancy is not
    more than four times the usual one: values of another model are no measurement.
    """
    stages = _Stages(entry, motion, how)
    require_numbers(stages.even)
    order = stages.order
    matched = stages.matched() if motion.replicates > 1 else None
    if matched is None or not matched.misfit.usual:
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
        open_ones = matched.ambiguous | matched.unsettled | matched.unlike
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
    return matched.misfit.usual or scores["matched"] <= MATCHING.as_close * scores["searched"]


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
