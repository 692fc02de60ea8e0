"""Model evidence from summaries of the motion ranks the models that distances leave tied."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from typing import Final, NamedTuple

import numpy as np

from driftwalk.calibration.estimation.estimate import find_optima
from driftwalk.calibration.estimation.gauss_newton import GAUSS_NEWTON, simulations_of
from driftwalk.calibration.estimation.label_switching import label_order
from driftwalk.calibration.estimation.regression_abc import REGRESSION
from driftwalk.calibration.estimation.summaries import SummaryObjective
from driftwalk.calibration.estimation.synthetic_likelihood import (
    SYNTHETIC,
    synthetic_likelihood_at,
)
from driftwalk.calibration.evolution import rounded
from driftwalk.calibration.held_out.candidates import Candidate
from driftwalk.calibration.held_out.held_out_score import (
    HELD_OUT_REPLICATES,
    HeldOutScore,
    even_blocks,
    held_out_differences,
    score_setting,
)
from driftwalk.calibration.held_out.law_findings import BoutDistance, Discrepancy, bout_distances
from driftwalk.calibration.held_out.recorded import RecordedMotion
from driftwalk.core.arrays import Floats
from driftwalk.core.processors import one_blas_thread
from driftwalk.core.progress import Progress
from driftwalk.sweep import Store


class EvidencePolicy(NamedTuple):
    """Which models are compared by their evidence, and when one is ahead."""

    tied_sigmas: float = 4.0
    """Models tie within this many standard errors. With ten blocks, errors are known to a quarter,
    and one of six models is far off; chosen by hand."""
    most_models: int = 5
    """Most models that are matched: a bound on the time; chosen by hand."""
    not_rejected_within: float = 20.0
    """Difference of deviance below which a model is not rejected: two standard errors. A deviance
    has one of 6.6, as 512 simulations give the covariance of a hundred summaries; chosen by
    hand."""
    doubt: float = 10.0
    """Difference from which a model with more numbers leaves open whether the simpler one is right:
    one standard error. The price of the numbers is in the deviance; chosen by hand."""
    give_up_above: float = 3.0
    """Discrepancy per summary above which a search is given up. The true model has 0.7 to 1.2;
    wrong ones would take three times as long; chosen by hand."""
    starts: int = 2
    """Starts: from the regression, and from the answer of the distances; chosen by hand."""
    blur: float = 1e-3
    """Noise added to simulated summaries. At a wall without camera noise some vary by less, and a
    micrometre of clearance would count as another motion; chosen by hand."""


EVIDENCE: Final = EvidencePolicy()


class Evidence(NamedTuple):
    """The summaries of the motion, as one model gives them."""

    discrepancy: Discrepancy
    """How far the summaries are from the model's own recordings."""
    deviance: float
    """-2 log of the evidence, but for a constant that all models share."""
    matched: HeldOutScore | None = None
    """The setting of the summaries, judged as that of the distances; where these are usual."""
    bouts: tuple[BoutDistance, ...] = ()
    """How long bouts last there, against the model's own recordings."""


class EvidenceRanking(NamedTuple):
    """The answer of the summaries of the motion."""

    best: int | None
    """The model that they speak for; None where no model gives them."""
    alternatives: tuple[int, ...]
    """Others that are about as likely."""

    def as_good(self, entries: Sequence[Candidate], evidence: Mapping[int, Evidence]) -> list[int]:
        """Return the alternatives that are likelier than the best or have no more parameters.

        One with more of them has to be likelier than by chance.
        """
        if self.best is None:
            return []
        numbers = entries[self.best].numbers
        clearly_less = evidence[self.best].deviance - EVIDENCE.doubt
        return [
            k
            for k in self.alternatives
            if evidence[k].deviance < clearly_less or entries[k].numbers <= numbers
        ]


class Shortlist(NamedTuple):
    """Models whose summaries are asked, in turn."""

    models: tuple[int, ...]
    """Those that tie first, the closest before the others; their places among all models."""
    tied: int
    """How many are asked in any case. The others are asked until one with no more numbers gives the
    summaries: a search by distances may have missed the place of the true model."""


def shortlist_models(entries: Sequence[Candidate], held_out: Sequence[HeldOutScore]) -> Shortlist:
    """Return the models whose summaries are matched; walks of recorded steps are none."""
    order = np.argsort([one.score for one in held_out], kind="stable")
    able = [int(k) for k in order if not entries[k].baseline]
    closest = held_out[able[0]]

    def is_tied(k: int) -> bool:
        difference, error = held_out[k].behind(closest)
        return difference <= EVIDENCE.tied_sigmas * error

    tied = [k for k in able if is_tied(k)]
    behind = [k for k in able if not is_tied(k)]
    return Shortlist(
        tuple([*tied, *behind][: EVIDENCE.most_models]), min(len(tied), EVIDENCE.most_models)
    )


def rank_by_evidence(
    entries: Sequence[Candidate], evidence: Mapping[int, Evidence]
) -> EvidenceRanking:
    """Return which model the summaries speak for.

    Among those that their discrepancy does not speak against it is the one of the largest evidence,
    which has a price for each parameter. Where others are equally likely, it is the one with the
    fewest numbers.
    """
    possible = [
        k for k, one in evidence.items() if not (one.discrepancy.against or entries[k].baseline)
    ]
    if not possible:
        return EvidenceRanking(None, ())
    least = min(evidence[k].deviance for k in possible)
    left = [k for k in possible if evidence[k].deviance < least + EVIDENCE.not_rejected_within]
    best = min(left, key=lambda k: (entries[k].numbers, evidence[k].deviance))
    return EvidenceRanking(best, tuple(k for k in left if k != best))


def with_matched_settings(
    held_out: Sequence[HeldOutScore], evidence: Mapping[int, Evidence], motion: RecordedMotion
) -> list[HeldOutScore]:
    """Return the scores, of the summaries' setting where only that one has no difference.

    A search by distances may miss the optimum of the true model.
    """
    found = list(held_out)
    for k, one in evidence.items():
        if one.matched is None or not held_out_differences(held_out[k], motion):
            continue
        if not held_out_differences(one.matched, motion):
            found[k] = one.matched._replace(
                optimum_scores=held_out[k].optimum_scores, evaluations=held_out[k].evaluations
            )
    return found


def ranking_sentence(
    names: Sequence[str], evidence: Mapping[int, Evidence], answer: EvidenceRanking
) -> str:
    """Return what the summaries of the motion say, in a sentence."""
    discrepancies = {k: f"{names[k]} {one.discrepancy.value:.0f}" for k, one in evidence.items()}
    if answer.best is None:
        return (
            "No model reproduces the summaries of the motion: the discrepancies are "
            f"{', '.join(discrepancies.values())}, in the models' own recordings below "
            f"{max(one.discrepancy.upper for one in evidence.values()):.0f}"
        )
    best = evidence[answer.best].discrepancy
    sentence = (
        f"{names[answer.best]} is named by the summaries of the motion: discrepancy "
        f"{best.value:.0f}, in its own recordings below {best.upper:.0f}"
    )
    if answer.alternatives:
        alternatives = ", ".join(names[k] for k in answer.alternatives)
        sentence += f"; no clear difference from {alternatives}, with as many numbers or more"
    others = [k for k in evidence if k != answer.best and k not in answer.alternatives]
    if others:
        sentence += f"; less likely are {', '.join(discrepancies[k] for k in others)}"
    return sentence


def most_settings(parameters: int, replicates: int) -> int:
    """Return how many settings `estimate_evidence` simulates at most."""
    if not parameters:
        return SYNTHETIC.simulations + replicates
    narrow = EVIDENCE.starts * simulations_of(parameters)[0] * GAUSS_NEWTON.most_rounds
    return REGRESSION.most_simulations + narrow + SYNTHETIC.simulations + replicates


@one_blas_thread()
def estimate_evidence(
    entry: Candidate,
    motion: RecordedMotion,
    answer: Floats,
    *,
    executor: Executor | None,
    store: Store | None,
    tell: Progress,
) -> Evidence:
    """Match the summaries of a recording with a model, and say how well that went."""
    parameters, replicates = len(entry.ranges), motion.replicates
    objective = _Blurred(
        even_blocks(entry, motion),
        motion,
        store=store,
        executor=executor,
        tell=tell,
        most=most_settings(parameters, replicates),
    )
    setting, log_volume = np.empty(0), 0.0
    if parameters:
        optima = find_optima(
            objective,
            parameters,
            lambda: answer[None],
            order=label_order(entry),
            seed=motion.seed,
            give_up=EVIDENCE.give_up_above,
        )
        best = optima[0].solution
        setting, log_volume = rounded(np.clip(best.setting, 0.0, 1.0)), best.log_volume
    found = synthetic_likelihood_at(
        lambda settings: objective(settings)[:, 0], objective.recorded[0], setting, replicates
    )
    # Laplace's approximation, with a prior that is even over the ranges.
    log_constant = parameters * float(np.log(2.0 * np.pi))
    deviance = found.discrepancy + found.log_variance - log_volume - log_constant
    discrepancy = Discrepancy.of(found.discrepancy, found.own_discrepancies)
    evidence = Evidence(discrepancy, deviance)
    if entry.baseline or evidence.discrepancy.against:
        return evidence
    worlds = objective.worlds.simulated(setting[None], HELD_OUT_REPLICATES, stage="judged")
    return evidence._replace(
        matched=score_setting(objective.worlds, motion, setting),
        bouts=bout_distances(motion, worlds),
    )


class _Blurred(SummaryObjective):
    """Adds noise to the summaries of simulated worlds."""

    def __call__(self, settings: Floats, *, parts: int = 1) -> Floats:
        """Return the summaries of settings, shape (settings, parts, summaries)."""
        random = np.random.default_rng([self.worlds.seed, self.done])
        found = super().__call__(settings, parts=parts)
        return found + EVIDENCE.blur * random.standard_normal(found.shape)
