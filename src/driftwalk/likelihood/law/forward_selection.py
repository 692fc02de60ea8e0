"""Forward selection of the numbers of departures, with backward elimination.

Score tests at the mode of a law (`driftwalk.likelihood.law.score_tests`) select them. A number is
closed again where opening it does not improve the fit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Set
from dataclasses import dataclass, replace

import numpy as np

from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.law.candidate_laws import CHANGES, DRAG_SHAPES, NUMBERS, PULSES, STRENGTHS
from driftwalk.likelihood.law.force_law import FLOATING, Assumptions
from driftwalk.likelihood.law.score_tests import (
    Pulses,
    ScoreTests,
    StrengthScores,
    find_pulses,
    score_tests,
)
from driftwalk.likelihood.newton import FROM_NEAR, Mode, ModeSearch
from driftwalk.likelihood.prior import Weights
from driftwalk.schema.answers.force_law import FORWARD_SELECTION


@dataclass(frozen=True, eq=False)
class LawResult:
    """Result of a search over laws."""

    mode: Mode
    base: Mode
    """The mode of the law alone, without departures."""
    floating: bool
    """Whether the water's own acceleration pushes the body."""
    evidence: Mapping[str, float]
    """Logarithm of the evidence for each law that was fitted, without its constant."""
    settled_by: float
    """Logarithm of the evidence for the law over the other; infinite where one law alone was
    fitted."""
    tests: ScoreTests | None
    """The last score tests of closed numbers; None where they broke down."""
    left_out: tuple[str, ...] = ()
    """Further searches that broke down, in words."""
    unsettled: tuple[str, ...] = ()
    """Reasons why a number of the law was not opened, or why another law may be right."""
    alternatives: tuple[Mode, ...] = ()
    """Modes of the laws that may be right as well."""
    noted: tuple[str, ...] = ()
    """Laws among the alternatives that leave the verdict alone, in sentences."""


def least_effects(side: float) -> dict[str, float]:
    """Return the least effect of each number, for a block's side [m]: below it none is opened."""
    return {
        "linear_share": FORWARD_SELECTION.linear_share,
        "drag_power": FORWARD_SELECTION.drag_power,
        "force_memory": FORWARD_SELECTION.force_memory,
        "time_variance": FORWARD_SELECTION.time_noise**2,
        "angle_offset": math.radians(FORWARD_SELECTION.angle_offset_deg),
        "marker_x": FORWARD_SELECTION.marker * side,
        "marker_y": FORWARD_SELECTION.marker * side,
        **dict.fromkeys(STRENGTHS, FORWARD_SELECTION.strength),
        **dict.fromkeys(PULSES, FORWARD_SELECTION.pulse),
    }


def is_retained(mode: Mode, name: str, least: Mapping[str, float]) -> bool:
    """Return whether an opened number is so far from the model that it stays open."""
    value, std = mode.value_of(name)
    error = math.hypot(std, 0.5 * least.get(name, 0.0))
    memory = name == "force_memory"
    sigmas = (
        FORWARD_SELECTION.retained_memory_sigmas if memory else FORWARD_SELECTION.retained_sigmas
    )
    return abs(value - NUMBERS[name].model) > sigmas * error


class ForwardSelection:
    """Opens numbers for the recordings of one fit."""

    def __init__(self, search: ModeSearch, assumptions: Assumptions) -> None:
        self.search, self.assumptions = search, assumptions
        self.least = least_effects(search.passes.body.side)
        self.scores = StrengthScores(search.passes)

    def select(self, found: LawResult) -> LawResult:
        """Return the law found, with the departures that the recording asks for."""
        mode, tests = found.mode, found.tests
        rejected: set[str] = set()
        for index in range(FORWARD_SELECTION.rounds):
            if index > 0 or tests is None:
                tests = self._tests_of_closed(mode, rejected)
            if tests is None:
                break
            pulses = None
            if self.assumptions.pulses and not set(PULSES) & {*mode.point.opened, *rejected}:
                pulses = find_pulses(self.search.passes.series, self.scores.at(mode))
            candidates = self._candidates(tests, pulses)
            if not candidates:
                break
            mode, idle = self._open_together_or_singly(mode, candidates, tests)
            rejected |= idle
        else:
            tests = self._tests_of_closed(mode, rejected)
        # Backward elimination: numbers that are idle since others were opened.
        opened = set(mode.point.opened) - set(self.assumptions.opened)
        mode = self.without(mode, self._idle(mode, opened)) or mode
        return replace(found, mode=mode, tests=tests)

    def _tests_of_closed(self, mode: Mode, closed: Set[str]) -> ScoreTests | None:
        """Return the score tests of the numbers that may still be opened; None without any."""
        gone = {*mode.point.opened, *closed}
        # One shape of the drag at most is opened.
        if set(DRAG_SHAPES) & set(mode.point.opened):
            gone.update(DRAG_SHAPES)
        names = [name for name in self.assumptions.tried if name not in gone]
        return score_tests(self.search, mode, names) if names else None

    def _open_together_or_singly(
        self, mode: Mode, candidates: Mapping[str, float], tests: ScoreTests
    ) -> tuple[Mode, set[str]]:
        """Return the mode with numbers opened, or where nothing comes of all together, with some.

        One large mistake makes others seem to be there, and no search finds them all. The numbers
        that were not opened alone are not counted as closed: without the mistake they are tested
        again.
        """
        found, idle = self._open(mode, candidates)
        parts = _parts(candidates, tests)
        if found is not mode or len(parts) < 2:
            return found, idle
        for names in parts:
            alone, of_alone = self._open(mode, {name: candidates[name] for name in names})
            if alone is not mode:
                return alone, of_alone
        return found, idle

    def _candidates(self, tests: ScoreTests, pulses: Pulses | None) -> dict[str, float]:
        """Return the numbers to open, with the values to begin with."""
        candidates: dict[str, float] = {}
        for name, sigmas in tests.sigmas.items():
            estimate, _ = tests.of(name)
            if name not in (*STRENGTHS, *FLOATING) and self._is_candidate(name, sigmas, estimate):
                candidates[name] = _within(name, NUMBERS[name].model + estimate)
        alternatives = set(DRAG_SHAPES) & set(candidates)
        for name in sorted(alternatives, key=lambda name: abs(tests.sigmas[name]))[:-1]:
            del candidates[name]
        strengths = [name for name in STRENGTHS if name in tests.names]
        if strengths:
            joint = tests.chi_squared(dict.fromkeys(strengths, 0.0))
            largest = max(abs(tests.of(name)[0]) for name in strengths)
            if (
                joint > FORWARD_SELECTION.strength_chi_squared
                and largest > FORWARD_SELECTION.strength
            ):
                found = tests.together(strengths)
                candidates.update({name: _within(name, value) for name, value in found.items()})
        if pulses is not None and pulses.significant and pulses.amplitude > FORWARD_SELECTION.pulse:
            candidates.update(zip(PULSES, (pulses.cosine, pulses.sine), strict=True))
            candidates["pulse_frequency"] = pulses.frequency
        return candidates

    def _is_candidate(self, name: str, sigmas: float, estimate: float) -> bool:
        if name in ("force_memory", "time_variance", "linear_share") and estimate < 0.0:
            return False
        memory = name == "force_memory"
        least = FORWARD_SELECTION.memory_sigmas if memory else FORWARD_SELECTION.opened_sigmas
        return abs(sigmas) > least and abs(estimate) > self.least.get(name, 0.0)

    def _open(self, mode: Mode, candidates: Mapping[str, float]) -> tuple[Mode, set[str]]:
        """Return the mode with numbers opened, and those that were closed again."""
        candidates = dict(candidates)
        fixed = dict(mode.point.fixed)
        frequency = candidates.pop("pulse_frequency", None)
        if frequency is not None:
            fixed["pulse_frequency"] = frequency
        point = replace(mode.point, opened={**mode.point.opened, **candidates}, fixed=fixed)
        found = self._near(point, mode.weights)
        if found is not None and frequency is not None:
            # A frequency has a derivative only once there are pulses. Where it does not settle, the
            # one of the spectrum stands.
            free = {name: value for name, value in fixed.items() if name != "pulse_frequency"}
            opened = {**found.point.opened, "pulse_frequency": frequency}
            point = replace(found.point, opened=opened, fixed=free)
            found = self._near(point, found.weights) or found
        if found is None:
            return mode, set(candidates)
        closed = set(candidates) - set(found.point.opened)
        idle = closed | self._idle(found, set(candidates) - closed)
        if idle >= set(candidates):
            return mode, idle
        return self.without(found, idle) or mode, idle

    def opened(self, mode: Mode, name: str, value: float) -> Mode | None:
        """Return the mode with a number opened, whatever comes of it; nothing without one."""
        point = replace(mode.point, opened={**mode.point.opened, name: _within(name, value)})
        return self._near(point, mode.weights)

    def _idle(self, mode: Mode, names: Set[str]) -> set[str]:
        """Return which of some opened numbers are too near the model to stay open."""
        idle = {
            name
            for name in names
            if name != "pulse_frequency" and not is_retained(mode, name, self.least)
        }
        # The line and the cosines of the strength, and the two parts of a pulse, stay or go
        # together.
        if set(STRENGTHS) <= set(mode.point.opened) and self._has_changed(mode):
            idle -= set(STRENGTHS)
        if set(PULSES) & set(names) and not set(PULSES) <= idle:
            idle -= set(PULSES)
        return idle

    def _has_changed(self, mode: Mode) -> bool:
        """Return whether the slow change of the flow's strength is more than chance.

        Line and cosines are alike: each alone may be within its error where all of them are not,
        or the change from the first sample to the last is not.
        """
        values, covariance = mode.values_of(STRENGTHS)
        ends = np.array([name in CHANGES for name in STRENGTHS], dtype=np.float64)
        error = math.hypot(math.sqrt(ends @ covariance @ ends), 0.5 * FORWARD_SELECTION.strength)
        if abs(ends @ values) > FORWARD_SELECTION.retained_sigmas * error:
            return True
        covariance = covariance + (0.5 * FORWARD_SELECTION.strength) ** 2 * np.eye(values.size)
        chi_squared = float(values @ np.linalg.solve(covariance, values))
        return chi_squared > FORWARD_SELECTION.retained_chi_squared

    def without(self, mode: Mode, idle: Set[str]) -> Mode | None:
        """Return the mode without some opened numbers; nothing where the search breaks down."""
        if not idle:
            return mode
        # Without pulses their frequency is the frequency of nothing.
        gone = {*idle, "pulse_frequency"} if set(PULSES) <= idle else idle
        retained = {name: value for name, value in mode.point.opened.items() if name not in gone}
        return self._near(replace(mode.point, opened=retained), mode.weights)

    def _near(self, point: Point, weights: Weights) -> Mode | None:
        """Return the mode near a point; nothing where the search does not soon come to its end.

        Opened numbers must not spoil a fit that has a solution without them.
        """
        mode = self.search.shortened().find(point, weights, held=FROM_NEAR)
        if mode is None or mode.converged:
            return mode
        # A number that another one makes idle may end at the edge of its range, where no search
        # converges: a memory of the force that was really a pulse of the flow.
        inside = {
            name: value
            for name, value in mode.point.opened.items()
            if NUMBERS[name].low < value < NUMBERS[name].high
        }
        if not inside or len(inside) == len(mode.point.opened):
            return None
        return self._near(replace(mode.point, opened=inside), mode.weights)


def _parts(candidates: Mapping[str, float], tests: ScoreTests) -> list[tuple[str, ...]]:
    """Return the numbers that are opened together, what the recording asks for most first."""
    gains: dict[tuple[str, ...], float] = {}
    strengths = tuple(name for name in STRENGTHS if name in candidates)
    if strengths:
        gains[strengths] = tests.chi_squared(dict.fromkeys(strengths, 0.0)) - len(strengths)
    pulses = tuple(name for name in candidates if name.startswith("pulse_"))
    if pulses:
        # Those have no score test, and may be what another departure leaves in the spectrum.
        gains[pulses] = 0.0
    for name in set(candidates) - {*strengths, *pulses}:
        gains[(name,)] = tests.sigmas[name] ** 2 - 1.0
    return sorted(gains, key=lambda names: (-gains[names], names))


def _within(name: str, value: float) -> float:
    """Return a first value that is one step of the search away at most."""
    number = NUMBERS[name]
    value = min(max(value, number.model - number.most), number.model + number.most)
    return min(max(value, number.low), number.high)
