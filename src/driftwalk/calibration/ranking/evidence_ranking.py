"""Which of several models, between which distances decide nothing, the summaries speak for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np

from driftwalk.calibration.held_out.candidates import Contestant
from driftwalk.calibration.held_out.held_out_score import Judged, without_error


class EvidencePolicy(NamedTuple):
    """Which models are compared by their evidence, and when one is ahead."""

    tied_sigmas: float = 4.0
    """Models tie within this many standard errors. With ten blocks, errors are known to a quarter,
    and one of six models is far off."""
    most_models: int = 5
    """Most models that are matched: a bound on the time."""
    rival: float = 10.0
    """Difference of deviance below which models are equally likely: a discrepancy of a hundred has
    an error of some 5, from the simulated covariance."""
    typical_quantile: float = 0.99
    """One recording of the model itself in a hundred is called unlike it."""
    hopeless: float = 3.0
    """Discrepancy per summary above which a search is given up. The true model has 0.7 to 1.2;
    wrong ones would take three times as long."""
    starts: int = 2
    """Starts: from the regression, and from the answer of the distances."""
    blur: float = 1e-3
    """Noise added to simulated summaries. At a wall without camera noise some vary by less, and a
    micrometre of clearance would count as another motion."""


EVIDENCE: Final = EvidencePolicy()


class Summarised(NamedTuple):
    """The summaries of the motion, as one model gives them."""

    misfit: float
    """Sum of squares of the summaries' deviations, in standard deviations."""
    usual_misfit: float
    """Its median over simulated recordings of the model,"""
    most_misfit: float
    """and their 99 % quantile."""
    unlikely: float
    """-2 log of the evidence, but for a constant that all models share."""

    @property
    def usual(self) -> bool:
        """Whether the summaries are like those of the model's own recordings."""
        return self.misfit <= self.most_misfit


class Naming(NamedTuple):
    """The answer of the summaries of the motion."""

    named: int | None
    """The model that they speak for; None where no model gives them."""
    rivals: tuple[int, ...]
    """Others that give them as well."""


class Asked(NamedTuple):
    """Models whose summaries are asked, in turn."""

    models: tuple[int, ...]
    """Those that tie first, the closest before the others; their places among all models."""
    tied: int
    """How many are asked in any case. The others are asked until one gives the summaries: a search
    by distances may have missed the place of the true model."""


def asked_models(entries: Sequence[Contestant], judged: Sequence[Judged]) -> Asked:
    """Return the models whose summaries decide; none where there are not two to choose from.

    Walks of recorded steps are never asked, nor are models without parameters.
    """
    order = np.argsort([one.score for one in judged], kind="stable")
    able = [int(k) for k in order if not entries[k].baseline and entries[k].ranges]
    if len(able) < 2:
        return Asked((), 0)
    closest = judged[able[0]]

    def ties(k: int) -> bool:
        error = without_error(judged[k].without - closest.without)
        return judged[k].score - closest.score <= EVIDENCE.tied_sigmas * error

    tied = [k for k in able if ties(k)]
    behind = [k for k in able if not ties(k)]
    return Asked(
        tuple([*tied, *behind][: EVIDENCE.most_models]), min(len(tied), EVIDENCE.most_models)
    )


def naming(entries: Sequence[Contestant], said: Mapping[int, Summarised]) -> Naming:
    """Return which model the summaries speak for.

    Among those whose misfit is usual it is the one of the largest evidence, which has a price for
    each parameter. Where others are equally likely, it is the one with the fewest numbers.
    """
    usual = [k for k, one in said.items() if one.usual]
    if not usual:
        return Naming(None, ())
    least = min(said[k].unlikely for k in usual)
    left = [k for k in usual if said[k].unlikely < least + EVIDENCE.rival]
    named = min(left, key=lambda k: (entries[k].numbers, said[k].unlikely))
    return Naming(named, tuple(k for k in left if k != named))


def said_of(one: Summarised) -> str | None:
    """Return how far a model's summaries are from the recording's; None where they are like them.

    Examples
    --------
    >>> said_of(Summarised(812.3, 101.0, 140.2, 900.0))
    "summaries of the motion: a misfit of 812, that of the model's own recordings is below 140"
    """
    if one.usual:
        return None
    return (
        f"summaries of the motion: a misfit of {one.misfit:.0f}, that of the model's own "
        f"recordings is below {one.most_misfit:.0f}"
    )


def tie_sentence(names: Sequence[str], said: Mapping[int, Summarised], answer: Naming) -> str:
    """Return what the summaries of the motion say, in a sentence."""
    misfits = {k: f"{names[k]} {one.misfit:.0f}" for k, one in said.items()}
    if answer.named is None:
        return (
            "The summaries of the motion tell nothing more, for no model gives them: the misfits "
            f"are {', '.join(misfits.values())}, those of the models' own recordings below "
            f"{max(one.most_misfit for one in said.values()):.0f}"
        )
    best = said[answer.named]
    sentence = (
        f"{names[answer.named]} is named by the summaries of the motion: a misfit of "
        f"{best.misfit:.0f}, that of its own recordings is below {best.most_misfit:.0f}"
    )
    if answer.rivals:
        rivals = ", ".join(names[k] for k in answer.rivals)
        sentence += f"; no clear difference from {rivals}, with as many numbers or more"
    others = [k for k in said if k != answer.named and k not in answer.rivals]
    if others:
        sentence += f"; less likely are {', '.join(misfits[k] for k in others)}"
    return sentence
