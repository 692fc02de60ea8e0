"""Model evidence: the summaries of a recording, matched with one of several models."""

from __future__ import annotations

from concurrent.futures import Executor

import numpy as np

from driftwalk.calibration.estimation import gauss_newton, regression_abc
from driftwalk.calibration.estimation.estimate import find_optima
from driftwalk.calibration.estimation.gauss_newton import rounded
from driftwalk.calibration.estimation.label_switching import label_order
from driftwalk.calibration.estimation.synthetic_likelihood import (
    SIMULATIONS,
    synthetic_likelihood_at,
)
from driftwalk.calibration.evolution.search import Tell
from driftwalk.calibration.held_out.candidates import Candidate, with_contact_clearance
from driftwalk.calibration.held_out.held_out_score import even_blocks
from driftwalk.calibration.held_out.recorded import RecordedMotion
from driftwalk.calibration.ranking.evidence_ranking import EVIDENCE, Evidence
from driftwalk.calibration.summaries.simulated import SummaryObjective
from driftwalk.core.arrays import Floats
from driftwalk.core.processors import one_blas_thread
from driftwalk.sweep import Store


def most_settings(parameters: int, replicates: int) -> int:
    """Return how many settings `estimate_evidence` simulates at most."""
    narrow = gauss_newton.simulations_of(parameters)[0] * gauss_newton.GAUSS_NEWTON.most_rounds
    return (
        regression_abc.REGRESSION.most_simulations
        + EVIDENCE.starts * narrow
        + SIMULATIONS
        + replicates
    )


@one_blas_thread()
def estimate_evidence(
    entry: Candidate,
    motion: RecordedMotion,
    answer: Floats,
    *,
    seed: int,
    replicates: int,
    executor: Executor | None,
    store: Store | None,
    tell: Tell,
) -> Evidence:
    """Match the summaries of a recording with a model, and say how well that went."""
    entry = entry._replace(model=with_contact_clearance(entry.model, motion))
    parameters = len(entry.ranges)
    objective = SummaryObjective(
        even_blocks(entry, motion, seed),
        motion,
        store=store,
        executor=executor,
        tell=tell,
        most=most_settings(parameters, replicates),
    )
    simulate = _Blurred(objective, seed)
    order = label_order(entry)
    optima = find_optima(
        simulate,
        parameters,
        lambda: answer[None],
        order=order,
        seed=seed,
        hopeless=EVIDENCE.hopeless,
        give_up=EVIDENCE.hopeless,
    )
    best = optima[0].solution
    found = synthetic_likelihood_at(
        lambda settings: simulate(settings)[:, 0],
        objective.recorded[0],
        rounded(np.clip(best.setting, 0.0, 1.0)),
        replicates,
    )
    return Evidence(
        discrepancy=found.discrepancy,
        median_discrepancy=float(np.median(found.own_discrepancies)),
        upper_discrepancy=float(np.quantile(found.own_discrepancies, EVIDENCE.typical_quantile)),
        # Laplace's approximation, with a prior that is even over the ranges.
        deviance=found.discrepancy
        + found.log_variance
        - best.log_volume
        - parameters * float(np.log(2.0 * np.pi)),
    )


class _Blurred:
    """Simulates and summarises as an objective does, and adds noise of its own."""

    def __init__(self, objective: SummaryObjective, seed: int) -> None:
        self.recorded = objective.recorded
        self._objective, self._seed = objective, seed

    def __call__(self, settings: Floats, *, parts: int = 1) -> Floats:
        """Return the summaries of settings, shape (settings, parts, summaries)."""
        random = np.random.default_rng([self._seed, self._objective.done])
        found = self._objective(settings, parts=parts)
        return found + EVIDENCE.blur * random.standard_normal(found.shape)
