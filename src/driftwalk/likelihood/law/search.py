"""Model selection: the force law and the departures that a recording supports.

The search of the likelihood is made for the paper's law, and for a floating body's where
score tests under the first cast doubt on it. At the better one, such tests say which further
numbers the recording asks for (`driftwalk.likelihood.law.score_tests`). Those are opened and
fitted, and closed again where nothing comes of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from driftwalk.core.units import in_percent
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.filter.series import Series
from driftwalk.likelihood.law.candidate_laws import DRAG_SHAPES, DRAGS, NUMBERS
from driftwalk.likelihood.law.confounders import LAW_NUMBERS, number_sentence, objections_to
from driftwalk.likelihood.law.force_law import FLOATING, Assumptions
from driftwalk.likelihood.law.forward_selection import ForwardSelection, LawResult, is_retained
from driftwalk.likelihood.law.score_tests import ScoreTests, score_tests
from driftwalk.likelihood.newton import (
    FROM_ANOTHER,
    FROM_NEAR,
    Mode,
    ModeSearch,
    beginning,
    converged,
    require_mode,
)
from driftwalk.likelihood.prior import Prior, Weights
from driftwalk.likelihood.refuse import BREAKDOWN
from driftwalk.likelihood.start import Starts
from driftwalk.schema.answers.force_law import FORWARD_SELECTION


class LawPolicy(NamedTuple):
    """When the law is in doubt, and when it is settled."""

    doubted_chi_squared: float = 30.0
    """The paper's law is in doubt when the numbers of a floating body are this far from its own,
    in chi squared of two degrees of freedom: chance exceeds it once in 3 million."""
    doubted_linear_sigmas: float = 3.0
    """It is also in doubt when its drag seems to have a linear part by this many standard
    deviations. Under the
    paper's law eight floating bodies had one of 3 to 18 (docs/explanation/likelihood.md)."""
    decisive_evidence: float = 100.0
    """Difference of the log evidences that no missing effect has imitated. Measured: pulses of the
    flow imitated 10; right laws are ahead by 130 and more where the recording tells them at all."""
    slight_sigmas: float = 4.0
    """A power of the drag that is too slight to be opened widens the intervals from this score test
    on [standard deviations]: chance exceeds it once in 16,000. A power of 2.12 had 5.4 in ten
    minutes, and the interval of C_d missed without it."""
    slight_drag: float = 0.1
    """Change of ln C_d by such a power from which on the verdict is "cannot tell": a tenth, as much
    as a stated C_d may be off. It was 0.10 to 0.17 in three of six recordings with such a power:
    one of them was said to be explained with a C_d 29 % too large (studies/verdict)."""
    without_orientation: float = 45.0
    """Log evidence for a floating body's law from which it is settled where the turning says
    nothing. Three discs of the paper's law had 19 to 28 for it, with a force 50 % too large; six
    that float had 67 and more (studies/bodies)."""
    lever_sigmas: float = 1.64
    """A lever of the force counts when it is above the notable one by this many standard
    deviations: by chance 5 % of the recordings whose lever is just notable."""
    notable_lever: float = 0.005
    """Lever of the force, in sides of the block, above which the turning does not follow the model.
    Measured: on recordings of the model it comes out at 0.001 to 0.004, with angles 5 degrees off
    at 0.015."""


LAW: Final = LawPolicy()


def evidence_of(mode: Mode, prior: Prior) -> float:
    """Return the logarithm of the evidence by Laplace's approximation, without its constant."""
    components = mode.point.coefficients.reshape(-1, len(prior.roughness)).shape[0]
    precision = prior.log_determinant(mode.weights, components)
    widths = sum(math.log(NUMBERS[name].prior_std) for name in mode.point.opened)
    return float(
        prior.log_scale(mode.point, mode.weights)
        - mode.deviance
        + 0.5 * np.linalg.slogdet(mode.covariance)[1]
        + 0.5 * precision
        - widths
    )


class LawSearch:
    """Searches over laws for the recordings of one fit."""

    def __init__(
        self,
        search: ModeSearch,
        assumptions: Assumptions,
        undisturbed: Callable[[], Sequence[Series]],
    ) -> None:
        """Keep the search, and what makes the series without contacts and outliers."""
        self.assumptions, self.search, self.undisturbed = assumptions, search, undisturbed
        self.selection = ForwardSelection(search, assumptions)

    def find(self, starts: Starts, weights: Weights) -> LawResult:
        """Return the law and the mode that the recording supports."""
        known = self.assumptions.fixed
        starts = Starts(
            replace(starts.paper, opened=self.assumptions.opened, fixed=known),
            tuple(
                replace(one, opened=self.assumptions.opened, fixed={**known, **FLOATING})
                for one in starts.floating
            ),
        )
        found = base = self._base(starts, weights)
        further: Sequence[tuple[str, Callable[[LawResult], LawResult]]] = (
            ("departures from it", self.selection.select),
            ("another power of the drag", lambda law: self._powered(law, base, starts, weights)),
            ("the other law", lambda law: self._reconsidered(law, starts)),
            ("other explanations", self._supported),
            ("a slight power of the drag", self._with_slight_power),
            ("the other law", lambda law: self._with_alternative(law, starts)),
        )
        for what, search in further:
            found = self._try_search(found, what, search)
        return found

    def _try_search(
        self, found: LawResult, what: str, search: Callable[[LawResult], LawResult]
    ) -> LawResult:
        """Return what a further search finds; the law found before it where it breaks down."""
        try:
            return replace(search(found), left_out=found.left_out)
        except BREAKDOWN:
            return replace(found, left_out=(*found.left_out, what))

    def _base(self, starts: Starts, weights: Weights) -> LawResult:
        if self.assumptions.pressure_gradient != "auto":
            on = self.assumptions.pressure_gradient == "on"
            tries = starts.floating if on else (starts.paper,)
            mode = require_mode(self._from_afar(tries, weights))
            return self._alone(mode, floating=on)
        paper = self.search.find_from_afar(starts.paper, weights)
        if paper is None:
            return self._compared(starts, weights, None)
        if paper.converged:
            tests = score_tests(self.search, paper, (*FLOATING, *self.assumptions.tried))
            if tests is not None and not self._is_doubted(tests, paper):
                return self._undoubted(paper, tests)
        alone = self._alone(paper, floating=False)
        return self._try_search(
            alone, "the other law", lambda law: self._compared(starts, weights, law.mode)
        )

    def _is_doubted(self, tests: ScoreTests, paper: Mode) -> bool:
        """Return whether the law may be another, from the mode of the paper's and its score tests.

        A body that floats seems, under the paper's law, to have a weak drag with a linear part. On
        a small orbit, where the flow is nearly linear in the place, another flow and a far smaller
        C_d imitate the water's push so well that its test finds nothing. They cannot imitate how
        the drag grows with the speed, nor how the block turns.
        """
        sigmas = tests.sigmas
        if tests.chi_squared(dict.fromkeys(self._floating_names, 0.0)) > LAW.doubted_chi_squared:
            return True
        linear = max(sigmas.get("linear_share", 0.0), -sigmas.get("drag_power", 0.0))
        if linear > LAW.doubted_linear_sigmas:
            return True
        numbers = set(sigmas) - set(FLOATING)
        if any(abs(sigmas[name]) > FORWARD_SELECTION.opened_sigmas for name in numbers):
            return True
        return self._turns_by_itself(paper) or self._stays_on_a_small_orbit()

    def _stays_on_a_small_orbit(self) -> bool:
        """Return whether the block is within a side of one place, as a standard deviation."""
        passes = self.search.passes
        return passes.flows == 1 and all(
            math.hypot(float(np.nanstd(one.x)), float(np.nanstd(one.y))) < passes.body.side
            for one in passes.series
        )

    @property
    def _floating_names(self) -> tuple[str, ...]:
        """The numbers of a floating body that the recording can test."""
        oriented = self.search.passes.body.orientation == "state"
        return tuple(FLOATING) if oriented else ("water_acceleration",)

    def _undoubted(self, paper: Mode, tests: ScoreTests) -> LawResult:
        """Return the paper's law, and whether a floating body's would do as well."""
        names = self._floating_names
        own = tests.chi_squared(dict.fromkeys(names, 0.0))
        other = tests.chi_squared({name: FLOATING[name] for name in names})
        apart = 0.5 * (other - own)
        settled_by = max(apart, 0.0) if apart < FORWARD_SELECTION.least_evidence else math.inf
        return replace(self._alone(paper, floating=False), settled_by=settled_by, tests=tests)

    def _compared(self, starts: Starts, weights: Weights, paper: Mode | None) -> LawResult:
        """Return the law with the larger evidence in the beginning of the recordings."""
        search = self.search
        series = beginning(search.passes)
        begin = search.of(series)
        tried = {
            "paper": _mode_in(begin, (starts.paper,), weights, near=paper),
            "floating": _mode_in(begin, starts.floating, weights),
        }
        found = {name: mode for name, mode in tried.items() if mode is not None}
        if not found:
            raise np.linalg.LinAlgError("no law has a solution")
        evidence = {name: evidence_of(mode, search.prior) for name, mode in found.items()}
        # Infinite where one law alone has a solution.
        ahead = evidence.get("floating", -math.inf) - evidence.get("paper", -math.inf)
        whole = series is search.passes.series
        held = FROM_NEAR if whole else FROM_ANOTHER
        if ahead >= FORWARD_SELECTION.least_evidence:
            near = found["floating"]
            mode: Mode | None = near
            if not (near.converged and whole):
                mode = search.find(near.point, near.weights, held=held)
            if mode is not None:
                return LawResult(mode, mode, True, evidence, ahead, None)
        if paper is None:
            near = found.get("paper", next(iter(found.values())))
            start = replace(near.point, fixed=starts.paper.fixed)
            paper = require_mode(search.find(start, near.weights, held=held))
        # Below zero where the other law has more evidence, but too little, or no solution on all.
        return LawResult(paper, paper, False, evidence, -ahead, None)

    def _from_afar(self, points: Sequence[Point], weights: Weights) -> Mode | None:
        """Return the mode from the first of some points from which a search converges."""
        return _first_converged(self.search.find_from_afar(point, weights) for point in points)

    def _alone(self, mode: Mode, *, floating: bool) -> LawResult:
        evidence = {"floating" if floating else "paper": evidence_of(mode, self.search.prior)}
        return LawResult(mode, mode, floating, evidence, math.inf, None)

    def _turns_by_itself(self, mode: Mode) -> bool:
        """Return whether the stochastic force seems to turn the block."""
        if mode.point.log_lever is None:
            return False
        value, std = mode.value_of("log_lever")
        lower = math.exp(value - LAW.lever_sigmas * std)
        return lower > LAW.notable_lever * self.search.passes.body.side

    def _powered(
        self, found: LawResult, base: LawResult, starts: Starts, weights: Weights
    ) -> LawResult:
        """Return the law with another power of the drag, where it explains why the block turns.

        A flow that was fitted under the power 2 can take up a drag of another one. Its score test
        is then blind, no search from there finds it, and what is left is a block whose turning its
        drag does not explain. So the search begins again. A marker that is off or pulses of the
        flow make the block turn as well: the law needs more evidence than one with them.
        """
        if "drag_power" not in self.assumptions.tried or not self._turns_by_itself(base.mode):
            return found
        start = starts.floating[0] if base.floating else starts.paper
        point = replace(start, opened={**start.opened, **DRAGS["power"].opened})
        mode = converged(self.search.find_from_afar(point, weights))
        if (
            mode is None
            or not is_retained(mode, "drag_power", self.selection.least)
            or self._ahead(mode, base.mode) <= FORWARD_SELECTION.least_evidence
        ):
            return found
        powered = self.selection.select(replace(base, mode=mode, tests=None))
        ahead = self._ahead(powered.mode, found.mode)
        return powered if ahead > FORWARD_SELECTION.least_evidence else found

    def _reconsidered(self, found: LawResult, starts: Starts) -> LawResult:
        """Return the law, or the other one where the departures that were found are in its favour.

        The laws were compared before anything was opened. Pulses of the flow, for example, may have
        decided for the wrong one.
        """
        mode = found.mode
        unchanged = set(mode.point.opened) <= set(self.assumptions.opened)
        if self.assumptions.pressure_gradient != "auto" or unchanged:
            return found
        if found.settled_by > LAW.decisive_evidence and not self._is_challenged(mode):
            return found
        alternative = self._other_law(found, starts)
        if alternative is None:
            return found
        ahead = self._ahead(alternative, mode)
        if ahead <= FORWARD_SELECTION.least_evidence:
            return found
        prior = self.search.prior
        paper, floating = (alternative, mode) if found.floating else (mode, alternative)
        evidence = {"paper": evidence_of(paper, prior), "floating": evidence_of(floating, prior)}
        other = LawResult(alternative, alternative, not found.floating, evidence, ahead, None)
        return self.selection.select(other)

    def _other_law(self, found: LawResult, starts: Starts) -> Mode | None:
        """Return the mode of the other law with the same numbers opened; nothing without one."""
        mode = found.mode
        fixed = {name: value for name, value in mode.point.fixed.items() if name not in FLOATING}
        fixed |= {} if found.floating else FLOATING
        tries = (starts.paper,) if found.floating else starts.floating
        points = [replace(one, opened=mode.point.opened, fixed=fixed) for one in tries]
        return converged(self._from_afar(points, mode.weights))

    def _supported(self, found: LawResult) -> LawResult:
        """Return the law without the numbers that other explanations account for."""
        mode, known = found.mode, self.assumptions.opened
        names = [name for name in LAW_NUMBERS if name in mode.point.opened and name not in known]
        objections = objections_to(mode, names, self.selection, self.undisturbed) if names else {}
        if not objections:
            return found
        closed = self.selection.without(mode, set(objections)) or found.base
        unsettled = (*found.unsettled, *objections.values())
        return replace(
            found, mode=closed, unsettled=unsettled, alternatives=(*found.alternatives, mode)
        )

    def _with_slight_power(self, found: LawResult) -> LawResult:
        """Return the law, and as an alternative the one whose drag has a slightly different power.

        A power below its least effect stays closed: it may be an error of the filter. It may be
        real as well, and then C_d is another one: a power of 2.12 made it 7.5 % too large, with an
        interval of 3 %. So the intervals hold what both laws give, and where C_d is quite another
        one the law is not settled.
        """
        tests, name = found.tests, "drag_power"
        shaped = set(DRAG_SHAPES) & set(found.mode.point.opened)
        if shaped or found.unsettled or name not in self.assumptions.tried:
            return found
        if tests is not None and name not in tests.names:
            # It, or a linear part, was opened and closed again.
            tests = score_tests(self.search, found.mode, [name])
        if tests is None or abs(tests.sigmas.get(name, 0.0)) <= LAW.slight_sigmas:
            return found
        value = NUMBERS[name].model + tests.of(name)[0]
        mode = self.selection.opened(found.mode, name, value)
        if mode is None:
            return found
        why = (
            f"{number_sentence(mode, name)} would fit better, but errors of the filter can imitate "
            "it: it was not opened, and the intervals of C_d and σ_F also cover the fit with it"
        )
        change = mode.point.log_drag - found.mode.point.log_drag
        found = replace(found, alternatives=(*found.alternatives, mode))
        if abs(change) <= LAW.slight_drag:
            return replace(found, noted=(*found.noted, why))
        size = "larger" if change > 0.0 else "smaller"
        why += f"; with it C_d is {in_percent(abs(math.expm1(change)))} {size}: state the law if "
        why += "you know it"
        return replace(found, unsettled=(*found.unsettled, why))

    def _with_alternative(self, found: LawResult, starts: Starts) -> LawResult:
        """Return the law, and the other one as well where the recording cannot tell them."""
        blind = found.floating and self.search.passes.body.orientation == "none"
        least = LAW.without_orientation if blind else FORWARD_SELECTION.least_evidence
        if self.assumptions.pressure_gradient != "auto" or found.settled_by >= least:
            return found
        alternative = self._other_law(found, starts)
        if alternative is None:
            return found
        why = (
            "the paper's force law and the law of a floating body fit the recording equally well: "
            "the intervals of C_d and σ_F cover both; state the law if you know it"
        )
        unsettled = (*found.unsettled, why)
        return replace(found, unsettled=unsettled, alternatives=(*found.alternatives, alternative))

    def _is_challenged(self, mode: Mode) -> bool:
        """Return whether the score tests of a floating body's numbers contradict the law."""
        names = self._floating_names
        tests = score_tests(self.search, mode, names)
        return tests is not None and (
            tests.chi_squared(dict.fromkeys(names, 0.0)) > LAW.doubted_chi_squared
        )

    def _ahead(self, mode: Mode, other: Mode) -> float:
        """Return the logarithm of the evidence for a mode over that for another."""
        prior = self.search.prior
        return evidence_of(mode, prior) - evidence_of(other, prior)


def _mode_in(
    begin: ModeSearch, starts: Sequence[Point], weights: Weights, *, near: Mode | None = None
) -> Mode | None:
    """Return the mode of a law in the beginning, from other points where the first one fails.

    Evidences are compared at the maxima: after as many steps as the paper's law takes, the right
    law of a small orbit was still hundreds of nats behind. Where none is reached the first steps
    have to do.
    """
    few = begin.shortened().find(starts[0], weights)
    if converged(few) is not None:
        return few
    tries = [(point, weights) for point in starts]
    if near is not None:
        tries.append((near.point, near.weights))
    mode = _first_converged(begin.find(point, known) for point, known in tries)
    if mode is not None and not mode.converged:
        mode = begin.find(mode.point, mode.weights, held=FROM_NEAR)
    return converged(mode) or few


def _first_converged(found: Iterable[Mode | None]) -> Mode | None:
    """Return the first mode that has converged, else the last one; nothing where there is none."""
    mode = None
    for one in found:
        mode = one or mode
        if mode is not None and mode.converged:
            break
    return mode
