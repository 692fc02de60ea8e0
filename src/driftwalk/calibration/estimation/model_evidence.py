"""The summaries of a recording, matched with one of several models."""

from __future__ import annotations

from concurrent.futures import Executor

import numpy as np
import numpy.typing as npt

from driftwalk.calibration.estimation import gauss_newton, regression_abc
from driftwalk.calibration.estimation.estimate import find_ends
from driftwalk.calibration.estimation.gauss_newton import rounded
from driftwalk.calibration.estimation.label_switching import order_of
from driftwalk.calibration.estimation.synthetic_likelihood import SIMULATIONS, likeness
from driftwalk.calibration.estimation.wall_clearance import at_the_wall
from driftwalk.calibration.evolution.search import Tell
from driftwalk.calibration.held_out.candidates import Contestant
from driftwalk.calibration.held_out.held_out_score import even_blocks
from driftwalk.calibration.held_out.recorded import RecordedMotion
from driftwalk.calibration.ranking.evidence_ranking import EVIDENCE, Summarised
from driftwalk.calibration.summaries.simulated import SummaryObjective
from driftwalk.core.processors import one_blas_thread
from driftwalk.sweep import Store

Floats = npt.NDArray[np.float64]


def most_settings(parameters: int, worlds: int) -> int:
    """Return how many settings `summarised` simulates at most."""
    narrow = gauss_newton.simulations_of(parameters)[0] * gauss_newton.GAUSS_NEWTON.most_rounds
    return (
        regression_abc.REGRESSION.most_simulations + EVIDENCE.starts * narrow + SIMULATIONS + worlds
    )


@one_blas_thread()
def summarised(
    entry: Contestant,
    motion: RecordedMotion,
    answer: Floats,
    *,
    seed: int,
    worlds: int,
    executor: Executor | None,
    store: Store | None,
    tell: Tell,
) -> Summarised:
    """Match the summaries of a recording with a model, and say how well that went.

    Parameters
    ----------
    entry : Contestant
        The model, with its ranges and conditions.
    motion : RecordedMotion
        The recording.
    answer : ndarray, shape (parameters,)
        Another setting to begin at, in the unit cube: that of the comparison.
    seed : int
        Of all simulations.
    worlds : int
        Simulated recordings by which the misfit is judged.
    executor : concurrent.futures.Executor or None
        Simulates and summarises elsewhere; linear algebra is done here.
    store : Store or None
        Where finished simulations are kept.
    tell : callable
        Called with the settings done and the largest number of them.
    """
    entry = entry._replace(model=at_the_wall(entry.model, motion))
    parameters = len(entry.ranges)
    objective = SummaryObjective(
        even_blocks(entry, motion, seed),
        motion,
        store=store,
        executor=executor,
        tell=tell,
        most=most_settings(parameters, worlds),
    )
    simulate = _Blurred(objective, seed)
    order = order_of(entry)
    ends = find_ends(
        simulate,
        parameters,
        lambda: answer[None],
        order=order,
        seed=seed,
        hopeless=EVIDENCE.hopeless,
        give_up=EVIDENCE.hopeless,
    )
    best = ends[0].solved
    found = likeness(
        lambda settings: simulate(settings)[:, 0],
        objective.recorded[0],
        rounded(np.clip(best.setting, 0.0, 1.0)),
        worlds,
    )
    return Summarised(
        misfit=found.misfit,
        usual_misfit=float(np.median(found.own_misfits)),
        most_misfit=float(np.quantile(found.own_misfits, EVIDENCE.typical_quantile)),
        # Laplace's approximation, with a prior that is even over the ranges.
        unlikely=found.misfit
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
