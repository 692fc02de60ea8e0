"""The force law and the departures from the model that a recording supports.

The search of the likelihood is made for the paper's law, and for that of a floating body where
score tests under the first cast doubt on it. At the better one, such tests say which further
numbers the recording asks for (`driftwalk.likelihood.law.score_tests`). Those are opened and
fitted, and closed again where nothing comes of them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

from driftwalk.likelihood.excerpt import beginning
from driftwalk.likelihood.filter_pass import Passes, Point
from driftwalk.likelihood.law.assumptions import FLOATING, Assumptions
from driftwalk.likelihood.law.departures import DRAG_SHAPES, DRAGS, NUMBERS
from driftwalk.likelihood.law.forward_selection import Opening, is_kept
from driftwalk.likelihood.law.found import LawFound
from driftwalk.likelihood.law.modes import Modes, unless_broken
from driftwalk.likelihood.law.score_tests import Trial
from driftwalk.likelihood.newton import (
    FROM_ANOTHER,
    FROM_NEAR,
    NOTABLE_LEVER,
    Mode,
    Passed,
    Prior,
    Weights,
)
from driftwalk.schema.answers.force_law import LEAST_EVIDENCE, OPENED_SIGMAS

DOUBTED_CHI_SQUARED: Final = 30.0
"""The paper's law is in doubt when the numbers of a floating body are so far from its own,"""
DOUBTED_LINEAR_SIGMAS: Final = 3.0
"""when its drag seems to have a linear part, or when another number is to be opened."""
DECISIVE_EVIDENCE: Final = 100.0
"""Evidence for a law that nothing missing has feigned: pulses of the flow feigned 10, and right
laws are ahead by 130 and more where the recording tells them at all."""
LEVER_SIGMAS: Final = 1.64
"""A lever of the force counts when it is so far above what is notable."""


def evidence_of(mode: Mode, prior: Prior) -> float:
    """Return the logarithm of the evidence by Laplace's approximation, without its constant."""
    components = mode.point.coefficients.reshape(-1, len(prior.roughness)).shape[0]
    precision = np.linalg.slogdet(prior.matrix(mode.weights))[1]
    widths = sum(math.log(NUMBERS[name].prior_std) for name in mode.point.opened)
    return float(
        -mode.deviance
        + 0.5 * np.linalg.slogdet(mode.covariance)[1]
        + 0.5 * components * float(precision)
        - widths
    )


class LawSearch:
    """Searches over laws for the recordings of one fit."""

    def __init__(
        self,
        passes: Passes,
        prior: Prior,
        assumptions: Assumptions,
        iterations: int,
        passed: Passed,
    ) -> None:
        self.assumptions = assumptions
        self.modes = Modes(passes, prior, iterations, passed)
        self.opening = Opening(self.modes, assumptions)

    def find(self, start: Point, weights: Weights) -> LawFound:
        """Return the law and the mode that the recording supports."""
        start = replace(start, opened=self.assumptions.opened, fixed=self.assumptions.fixed)
        base = self._base(start, weights)
        found = self.opening.departed(base)
        if "drag_power" in self.assumptions.tried and self._turns_by_itself(base.mode):
            powered = self._with_power(base, start, weights)
            if powered is not None and self._ahead(powered.mode, found.mode) > LEAST_EVIDENCE:
                found = powered
        return self._reconsidered(found, start)

    def _base(self, start: Point, weights: Weights) -> LawFound:
        floating = replace(start, fixed={**start.fixed, **FLOATING})
        if self.assumptions.pressure_gradient == "on":
            return self._alone(self.modes.find_from_afar(floating, weights), floating=True)
        if self.assumptions.pressure_gradient == "off":
            return self._alone(self.modes.find_from_afar(start, weights), floating=False)
        paper = unless_broken(lambda: self.modes.find_from_afar(start, weights))
        if paper is not None and paper.converged:
            trial = self.modes.tested(paper, (*FLOATING, *self.assumptions.tried))
            if trial is not None and not self._is_doubted(trial):
                return self._undoubted(paper, trial)
        return self._compared({"paper": start, "floating": floating}, weights, paper)

    def _is_doubted(self, trial: Trial) -> bool:
        """Return whether the law may be another, from the score tests under the paper's.

        A body that floats seems, under the paper's law, to have a weak drag with a linear part.
        """
        sigmas = trial.sigmas
        if trial.chi_squared(dict.fromkeys(self._floating_names, 0.0)) > DOUBTED_CHI_SQUARED:
            return True
        if sigmas.get("linear_share", 0.0) > DOUBTED_LINEAR_SIGMAS:
            return True
        if sigmas.get("drag_power", 0.0) < -DOUBTED_LINEAR_SIGMAS:
            return True
        numbers = set(sigmas) - set(FLOATING) - set(DRAG_SHAPES)
        return any(abs(sigmas[name]) > OPENED_SIGMAS for name in numbers)

    @property
    def _floating_names(self) -> tuple[str, ...]:
        """The numbers of a floating body that the recording can test."""
        return (
            tuple(FLOATING)
            if self.modes.passes.body.orientation == "state"
            else ("water_acceleration",)
        )

    def _undoubted(self, paper: Mode, trial: Trial) -> LawFound:
        """Return the paper's law, and whether that of a floating body would do as well."""
        names = self._floating_names
        own = trial.chi_squared(dict.fromkeys(names, 0.0))
        other = trial.chi_squared({name: FLOATING[name] for name in names})
        apart = 0.5 * (other - own)
        found = self._alone(paper, floating=False)
        return replace(
            found, settled_by=max(apart, 0.0) if apart < LEAST_EVIDENCE else math.inf, trial=trial
        )

    def _compared(
        self, starts: Mapping[str, Point], weights: Weights, paper: Mode | None
    ) -> LawFound:
        """Return the law with the larger evidence in the beginning of the recordings."""
        modes = self.modes
        series = beginning(modes.passes)
        begin = modes.of(series).soon()
        tried = {
            name: unless_broken(partial(begin.find, start, weights))
            for name, start in starts.items()
        }
        found = {name: mode for name, mode in tried.items() if mode is not None}
        if not found:
            raise np.linalg.LinAlgError("no law has a solution")
        evidence = {name: evidence_of(mode, modes.prior) for name, mode in found.items()}
        # Infinite where one law alone has a solution.
        ahead = evidence.get("floating", -math.inf) - evidence.get("paper", -math.inf)
        whole = series is modes.passes.series
        held = FROM_NEAR if whole else FROM_ANOTHER
        if ahead >= LEAST_EVIDENCE:
            near = found["floating"]
            mode: Mode | None = near
            if not (near.converged and whole):
                mode = unless_broken(lambda: modes.find(near.point, near.weights, held=held))
            if mode is not None:
                return LawFound(mode, mode, True, evidence, ahead, None)
        if paper is None:
            near = found.get("paper", next(iter(found.values())))
            start = replace(near.point, fixed=starts["paper"].fixed)
            paper = modes.find(start, near.weights, held=held)
        # Below zero where the other law has more evidence, but too little, or no solution on all.
        return LawFound(paper, paper, False, evidence, -ahead, None)

    def _alone(self, mode: Mode, *, floating: bool) -> LawFound:
        name = "floating" if floating else "paper"
        return LawFound(
            mode, mode, floating, {name: evidence_of(mode, self.modes.prior)}, math.inf, None
        )

    def _turns_by_itself(self, mode: Mode) -> bool:
        """Return whether the stochastic force seems to turn the block."""
        if mode.point.log_lever is None:
            return False
        value, std = mode.value_of("log_lever")
        lower = math.exp(value - LEVER_SIGMAS * std)
        return lower > NOTABLE_LEVER * self.modes.passes.body.side

    def _with_power(self, base: LawFound, start: Point, weights: Weights) -> LawFound | None:
        """Return the law with another power of the drag, where it explains why the block turns.

        A flow that was fitted under the power 2 can take up a drag of another one. Its score test
        is then blind, no search from there finds it, and what is left is a block that turns
        otherwise than its drag makes it. So the search begins again. A marker that is off or pulses
        of the flow make the block turn as well: the caller compares the law with them.
        """
        fixed = {**start.fixed, **(FLOATING if base.floating else {})}
        point = replace(start, opened={**start.opened, **DRAGS["power"].opened}, fixed=fixed)
        mode = unless_broken(lambda: self.modes.find_from_afar(point, weights))
        if (
            mode is None
            or not mode.converged
            or not is_kept(mode, "drag_power", self.opening.worth)
            or self._ahead(mode, base.mode) <= LEAST_EVIDENCE
        ):
            return None
        return self.opening.departed(replace(base, mode=mode, trial=None))

    def _reconsidered(self, found: LawFound, start: Point) -> LawFound:
        """Return the law, or the other one where the departures that were found are in its favour.

        The laws were compared before anything was opened. Pulses of the flow, for example, may have
        decided for the wrong one.
        """
        mode = found.mode
        if self.assumptions.pressure_gradient != "auto" or set(mode.point.opened) <= set(
            self.assumptions.opened
        ):
            return found
        if found.settled_by > DECISIVE_EVIDENCE and not self._is_challenged(mode):
            return found
        fixed = {name: value for name, value in mode.point.fixed.items() if name not in FLOATING}
        fixed |= {} if found.floating else FLOATING
        point = replace(start, opened=mode.point.opened, fixed=fixed)
        rival = unless_broken(lambda: self.modes.find_from_afar(point, mode.weights))
        if rival is None or not rival.converged:
            return found
        ahead = self._ahead(rival, mode)
        if ahead <= LEAST_EVIDENCE:
            return found
        prior = self.modes.prior
        paper, floating = (rival, mode) if found.floating else (mode, rival)
        evidence = {
            "paper": evidence_of(paper, prior),
            "floating": evidence_of(floating, prior),
        }
        other = LawFound(rival, rival, not found.floating, evidence, ahead, None)
        return self.opening.departed(other)

    def _is_challenged(self, mode: Mode) -> bool:
        """Return whether the numbers of a floating body seem to be others than those of the law."""
        names = self._floating_names
        trial = self.modes.tested(mode, names)
        return trial is not None and (
            trial.chi_squared(dict.fromkeys(names, 0.0)) > DOUBTED_CHI_SQUARED
        )

    def _ahead(self, mode: Mode, other: Mode) -> float:
        """Return the logarithm of the evidence for a mode over that for another."""
        prior = self.modes.prior
        return evidence_of(mode, prior) - evidence_of(other, prior)
