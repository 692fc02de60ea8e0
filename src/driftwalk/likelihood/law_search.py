"""The force law and the departures from the model that a recording supports.

The search of the likelihood is made for the paper's law, and for that of a floating body where
score tests under the first cast doubt on it. At the better one, such tests say which further
numbers the recording asks for (`driftwalk.likelihood.trial`). Those are opened and fitted, and
closed again where nothing comes of them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from driftwalk.likelihood.assumptions import FLOATING, Assumptions
from driftwalk.likelihood.departures import DRAG_SHAPES, NUMBERS, PULSES, STRENGTHS
from driftwalk.likelihood.filter_pass import Passes, Point, Series
from driftwalk.likelihood.newton import NOTABLE_LEVER, Mode, Prior, Tell, Weights, find_mode
from driftwalk.likelihood.solution import BREAKDOWN
from driftwalk.likelihood.trial import Trial, find_pulses, try_numbers

DOUBTED_CHI_SQUARED: Final = 30.0
"""The paper's law is in doubt when the numbers of a floating body are so far from its own,"""
DOUBTED_LINEAR_SIGMAS: Final = 3.0
"""when its drag seems to have a linear part, or when another number is to be opened."""
LAW_SAMPLES: Final = 3000
"""Laws are compared on so many samples from the beginning of the recordings."""
TRIAL_ITERATIONS: Final = 12
"""Most steps of the searches of such a comparison."""
CANNOT_TELL: Final = 3.0
"""Difference of the logarithms of the evidence below which two laws may both be right."""
OPENED_SIGMAS: Final = 6.0
"""A number is opened when its score test finds it so far from the model,"""
MEMORY_SIGMAS: Final = 4.0
"""or so far for the memory of the force, of which a fit says more than its test,"""
KEPT_SIGMAS: Final = 3.0
"""and stays open when the fit does, with half of what is worth it as an error of the filter."""
OPENED_STRENGTH: Final = 50.0
"""Chi squared (6 degrees of freedom) of the strength of the flow from which on it is opened."""
LEVER_SIGMAS: Final = 1.64
"""A lever of the force counts when it is so far above what is notable."""
FIRST_POWER: Final = 1.7
"""Power of the drag with which a search begins."""
ROUNDS: Final = 3


@dataclass(frozen=True, eq=False)
class LawFound:
    """Result of a search over laws."""

    mode: Mode
    base: Mode
    """The mode of the law alone, without departures."""
    floating: bool
    """Whether the water's own acceleration pushes the body."""
    evidence: Mapping[str, float]
    """Logarithm of the evidence for each law that was fitted, without its constant."""
    settled_by: float
    """Difference of the logarithms of the evidence; infinite where one law alone was fitted."""
    trial: Trial | None
    """The last score tests of what is closed; nothing where they broke down."""


def worth(side: float) -> dict[str, float]:
    """Return from which size on a departure is worth a number, by name, for a block's side [m].

    Below it the filter's own errors may be what is seen.
    """
    return {
        "linear_share": 0.15,
        "drag_power": 0.15,
        "force_memory": 0.04,
        "time_variance": 0.003**2,
        "angle_offset": math.radians(0.7),
        "marker_x": 0.012 * side,
        "marker_y": 0.012 * side,
        **dict.fromkeys(STRENGTHS, 0.01),
        **dict.fromkeys(PULSES, 0.02),
    }


def evidence_of(mode: Mode, prior: Prior) -> float:
    """Return the logarithm of the evidence by Laplace's approximation, without its constant."""
    components = mode.point.coefficients.reshape(-1, len(prior.roughness)).shape[0]
    precision = np.linalg.slogdet(prior.matrix(mode.weights))[1]
    return float(
        -mode.deviance
        + 0.5 * np.linalg.slogdet(mode.covariance)[1]
        + 0.5 * components * float(precision)
    )


def beginning(passes: Passes) -> Sequence[Series]:
    """Return the first series, with some `LAW_SAMPLES` samples together; all with several flows."""
    total = sum(one.time.size for one in passes.series)
    if passes.flows > 1 or total <= 1.2 * LAW_SAMPLES:
        return passes.series
    found, count = [], 0
    for one in passes.series:
        if count >= LAW_SAMPLES:
            break
        found.append(one.first(LAW_SAMPLES - count))
        count += found[-1].time.size
    return found


class LawSearch:
    """Searches over laws for the recordings of one fit."""

    def __init__(
        self, passes: Passes, prior: Prior, assumptions: Assumptions, iterations: int, tell: Tell
    ) -> None:
        self.passes, self.prior, self.assumptions = passes, prior, assumptions
        self.iterations, self.tell = iterations, tell
        self.worth = worth(passes.body.side)

    def find(self, start: Point, weights: Weights) -> LawFound:
        """Return the law and the mode that the recording supports."""
        start = replace(start, opened=self.assumptions.opened, fixed=self.assumptions.fixed)
        found = self._base(start, weights)
        if "drag_power" in self.assumptions.tried and self._turns_by_itself(found.mode):
            found = self._with_power(found, start, weights)
        return self._with_departures(found)

    def _mode(self, start: Point, weights: Weights, *, hold_first: bool = True) -> Mode:
        return find_mode(
            self.passes,
            start,
            weights,
            self.prior,
            iterations=self.iterations,
            tell=self.tell,
            hold_first=hold_first,
        )

    def _base(self, start: Point, weights: Weights) -> LawFound:
        floating = replace(start, fixed={**start.fixed, **FLOATING})
        if self.assumptions.pressure_gradient == "on":
            mode = self._mode(floating, weights)
            return self._alone(mode, floating=True)
        if self.assumptions.pressure_gradient == "off":
            return self._alone(self._mode(start, weights), floating=False)
        paper = self._try_mode(self.passes, start, weights, self.iterations)
        if paper is not None and paper.converged:
            trial = self._try(paper, (*FLOATING, *self.assumptions.tried))
            if trial is not None and not self._is_doubted(trial):
                return self._undoubted(paper, trial)
        return self._compared({"paper": start, "floating": floating}, weights, paper)

    def _try(self, mode: Mode, names: Sequence[str]) -> Trial | None:
        """Return the score tests of numbers; nothing where they break down."""
        try:
            return try_numbers(self.passes, mode, self.prior, names)
        except BREAKDOWN:
            return None

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
            tuple(FLOATING) if self.passes.body.orientation == "state" else ("water_acceleration",)
        )

    def _undoubted(self, paper: Mode, trial: Trial) -> LawFound:
        """Return the paper's law, and whether that of a floating body would do as well."""
        names = self._floating_names
        own = trial.chi_squared(dict.fromkeys(names, 0.0))
        other = trial.chi_squared({name: FLOATING[name] for name in names})
        apart = 0.5 * (other - own)
        found = self._alone(paper, floating=False)
        return replace(
            found, settled_by=max(apart, 0.0) if apart < CANNOT_TELL else math.inf, trial=trial
        )

    def _compared(
        self, starts: Mapping[str, Point], weights: Weights, paper: Mode | None
    ) -> LawFound:
        """Return the law with the larger evidence in the beginning of the recordings."""
        begin = replace(self.passes, series=beginning(self.passes))
        tried = {
            name: self._try_mode(begin, point, weights, min(self.iterations, TRIAL_ITERATIONS))
            for name, point in starts.items()
        }
        found = {name: mode for name, mode in tried.items() if mode is not None}
        if not found:
            raise np.linalg.LinAlgError("no law has a solution")
        evidence = {name: evidence_of(mode, self.prior) for name, mode in found.items()}
        best = max(evidence, key=evidence.__getitem__)
        rest = [value for name, value in evidence.items() if name != best]
        apart = evidence[best] - rest[0] if rest else math.inf
        if apart < CANNOT_TELL and "paper" in found:
            best = "paper"
        mode: Mode | None = found[best]
        if best == "floating" and (
            not found[best].converged or begin.series is not self.passes.series
        ):
            near = found[best]
            mode = self._try_mode(
                self.passes, near.point, near.weights, self.iterations, hold_first=False
            )
        if best == "floating" and mode is not None:
            return LawFound(mode, mode, True, evidence, apart, None)
        if paper is None:
            near = found.get("paper", found[best])
            start = replace(near.point, fixed=starts["paper"].fixed)
            paper = self._mode(start, near.weights, hold_first=False)
        return LawFound(paper, paper, False, evidence, apart, None)

    def _alone(self, mode: Mode, *, floating: bool) -> LawFound:
        name = "floating" if floating else "paper"
        return LawFound(mode, mode, floating, {name: evidence_of(mode, self.prior)}, math.inf, None)

    def _try_mode(
        self,
        passes: Passes,
        start: Point,
        weights: Weights,
        iterations: int,
        *,
        hold_first: bool = True,
    ) -> Mode | None:
        """Return the mode; nothing where the search breaks down, as under a wrong law it may."""
        try:
            with np.errstate(all="ignore"):
                return find_mode(
                    passes,
                    start,
                    weights,
                    self.prior,
                    iterations=iterations,
                    tell=self.tell,
                    hold_first=hold_first,
                )
        except (*BREAKDOWN, ValueError):
            return None

    def _turns_by_itself(self, mode: Mode) -> bool:
        """Return whether the stochastic force seems to turn the block."""
        if mode.point.log_lever is None:
            return False
        at = mode.point.coefficients.size + 1 + list(mode.point.noises).index("log_lever")
        std = math.sqrt(float(mode.covariance[at, at]))
        lower = math.exp(mode.point.log_lever - LEVER_SIGMAS * std)
        return lower > NOTABLE_LEVER * self.passes.body.side

    def _with_power(self, found: LawFound, start: Point, weights: Weights) -> LawFound:
        """Return the law with another power of the drag, where it explains why the block turns.

        A flow that was fitted under the power 2 can take up a drag of another one. Its score test
        is then blind, no search from there finds it, and what is left is a block that turns
        otherwise than its drag makes it. So the search begins again.
        """
        fixed = {**start.fixed, **(FLOATING if found.floating else {})}
        point = replace(start, opened={**start.opened, "drag_power": FIRST_POWER}, fixed=fixed)
        mode = self._try_mode(self.passes, point, weights, self.iterations)
        if mode is None or not mode.converged or not self._is_kept(mode, "drag_power"):
            return found
        better = evidence_of(mode, self.prior) - evidence_of(found.mode, self.prior)
        return replace(found, mode=mode, trial=None) if better > CANNOT_TELL else found

    def _with_departures(self, found: LawFound) -> LawFound:
        """Return the law found, with the departures that the recording asks for."""
        mode, trial = found.mode, found.trial
        closed: set[str] = set()
        for index in range(ROUNDS):
            names = [
                name
                for name in self.assumptions.tried
                if name not in mode.point.opened and name not in closed
            ]
            if set(DRAG_SHAPES) & set(mode.point.opened):
                names = [name for name in names if name not in DRAG_SHAPES]
            if index > 0 or trial is None:
                trial = self._try(mode, names) if names else None
            asked = self._asked(mode, trial, closed)
            if not asked:
                break
            mode, dropped = self._opened_or_strongest(mode, asked, trial)
            closed |= dropped
        return replace(found, mode=mode, trial=trial)

    def _opened_or_strongest(
        self, mode: Mode, asked: Mapping[str, float], trial: Trial | None
    ) -> tuple[Mode, set[str]]:
        """Return the mode with numbers opened, or where nothing comes of all together, with one.

        One large mistake makes others seem to be there, and no search finds them all. The numbers
        that were not opened alone are not counted as closed: without the mistake they are tested
        again.
        """
        found, dropped = self._opened(mode, asked)
        names = [] if trial is None else [name for name in asked if name in trial.names]
        single = [name for name in names if name not in STRENGTHS]
        if found is not mode or trial is None or not single or len(asked) == 1:
            return found, dropped
        strongest = max(single, key=lambda name: abs(trial.sigmas[name]))
        alone, of_alone = self._opened(mode, {strongest: asked[strongest]})
        return (found, dropped) if alone is mode else (alone, of_alone)

    def _asked(self, mode: Mode, trial: Trial | None, closed: Set[str]) -> dict[str, float]:
        """Return the numbers to open, with the values to begin with.

        Those of `closed` were opened before, and nothing came of them.
        """
        asked: dict[str, float] = {}
        if trial is None:
            return asked
        for name, sigmas in trial.sigmas.items():
            estimate, _ = trial.of(name)
            if name not in (*STRENGTHS, *FLOATING) and self._is_asked(name, sigmas, estimate):
                asked[name] = _within(name, NUMBERS[name].model + estimate)
        rivals = sorted(set(DRAG_SHAPES) & set(asked), key=lambda name: abs(trial.sigmas[name]))
        for name in rivals[:-1]:
            del asked[name]
        strengths = [name for name in STRENGTHS if name in trial.names]
        if strengths:
            joint = trial.chi_squared(dict.fromkeys(strengths, 0.0))
            estimates = {name: trial.of(name)[0] for name in strengths}
            largest = max(map(abs, estimates.values()))
            if joint > OPENED_STRENGTH and largest > self.worth[strengths[0]]:
                asked.update({name: _within(name, value) for name, value in estimates.items()})
        if self.assumptions.pulses and not set(PULSES) & {*mode.point.opened, *closed}:
            pulses = find_pulses(self.passes, mode)
            if (
                pulses is not None
                and pulses.significant
                and pulses.amplitude > self.worth[PULSES[0]]
            ):
                asked.update(zip(PULSES, (pulses.cosine, pulses.sine), strict=True))
                asked["pulse_frequency"] = pulses.frequency
        return asked

    def _is_asked(self, name: str, sigmas: float, estimate: float) -> bool:
        if name in ("force_memory", "time_variance", "linear_share") and estimate < 0.0:
            return False
        least = MEMORY_SIGMAS if name == "force_memory" else OPENED_SIGMAS
        return abs(sigmas) > least and abs(estimate) > self.worth.get(name, 0.0)

    def _opened(self, mode: Mode, asked: Mapping[str, float]) -> tuple[Mode, set[str]]:
        """Return the mode with numbers opened, and those that were closed again."""
        asked = dict(asked)
        fixed = dict(mode.point.fixed)
        frequency = asked.pop("pulse_frequency", None)
        if frequency is not None:
            fixed["pulse_frequency"] = frequency
        before = mode
        point = replace(mode.point, opened={**mode.point.opened, **asked}, fixed=fixed)
        found = self._short(point, mode.weights)
        if found is not None and frequency is not None:
            # A frequency has a derivative only once there are pulses.
            fixed.pop("pulse_frequency")
            opened = {**found.point.opened, "pulse_frequency": frequency}
            point = replace(found.point, opened=opened, fixed=fixed)
            found = self._short(point, found.weights)
        if found is None:
            return before, set(asked)
        mode = found
        dropped = {name for name in asked if not self._is_kept(mode, name)}
        strengths = set(STRENGTHS) & set(mode.point.opened)
        if strengths - dropped:
            dropped -= strengths
        if set(PULSES) & set(asked) and not set(PULSES) <= dropped:
            dropped -= set(PULSES)
        if dropped:
            if dropped >= set(asked):
                return before, dropped
            if set(PULSES) <= dropped:
                # Without pulses their frequency is the frequency of nothing.
                dropped.add("pulse_frequency")
            kept = {name: value for name, value in mode.point.opened.items() if name not in dropped}
            found = self._short(replace(mode.point, opened=kept), mode.weights)
            mode = before if found is None else found
        return mode, dropped

    def _short(self, point: Point, weights: Weights) -> Mode | None:
        """Return the mode near a point; nothing where the search does not soon come to its end.

        Opened numbers must not spoil a fit that has a solution without them.
        """
        most = min(self.iterations, TRIAL_ITERATIONS)
        mode = self._try_mode(self.passes, point, weights, most, hold_first=False)
        return mode if mode is not None and mode.converged else None

    def _is_kept(self, mode: Mode, name: str) -> bool:
        value, std = opened_number(mode, name)
        error = math.hypot(std, 0.5 * self.worth.get(name, 0.0))
        return abs(value - NUMBERS[name].model) > KEPT_SIGMAS * error


def opened_number(mode: Mode, name: str) -> tuple[float, float]:
    """Return the value of an opened number and its standard deviation by theory."""
    names: Sequence[str] = list(mode.point.extras)
    at = mode.point.coefficients.size + 1 + names.index(name)
    return mode.point.opened[name], math.sqrt(float(mode.covariance[at, at]))


def _within(name: str, value: float) -> float:
    """Return a first value that is one step of the search away at most."""
    number = NUMBERS[name]
    value = min(max(value, number.model - number.most), number.model + number.most)
    return min(max(value, number.low), number.high)
