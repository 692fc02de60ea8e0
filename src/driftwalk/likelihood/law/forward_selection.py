"""Numbers of departures from the model that a recording asks to be opened.

Score tests at the mode of a law (`driftwalk.likelihood.law.score_tests`) select them. A number is
closed again where opening it does not improve the fit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Set
from dataclasses import replace
from typing import Final

from driftwalk.likelihood.filter_pass import Point
from driftwalk.likelihood.law.assumptions import FLOATING, Assumptions
from driftwalk.likelihood.law.departures import DRAG_SHAPES, NUMBERS, PULSES, STRENGTHS
from driftwalk.likelihood.law.found import LawFound
from driftwalk.likelihood.law.modes import Modes, unless_broken
from driftwalk.likelihood.law.score_tests import Trial, find_pulses
from driftwalk.likelihood.newton import FROM_NEAR, Mode, Weights
from driftwalk.schema.answers.force_law import MEMORY_SIGMAS, OPENED_SIGMAS

KEPT_SIGMAS: Final = 3.0
"""An opened number stays open when the fit finds it so far from the model [standard deviations],
with half of what is worth it as an error of the filter;"""
KEPT_MEMORY_SIGMAS: Final = 3.4
"""the memory of the force so far: a flow with more detail than the spline acts like a memory of 0.1
s."""
OPENED_STRENGTH: Final = 50.0
"""Chi squared (6 degrees of freedom) of the strength of the flow from which on it is opened."""
ROUNDS: Final = 3


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


def is_kept(mode: Mode, name: str, least: Mapping[str, float]) -> bool:
    """Return whether an opened number is so far from the model that it stays open."""
    value, std = mode.value_of(name)
    error = math.hypot(std, 0.5 * least.get(name, 0.0))
    sigmas = KEPT_MEMORY_SIGMAS if name == "force_memory" else KEPT_SIGMAS
    return abs(value - NUMBERS[name].model) > sigmas * error


class Opening:
    """Opens numbers for the recordings of one fit."""

    def __init__(self, modes: Modes, assumptions: Assumptions) -> None:
        self.modes, self.assumptions = modes, assumptions
        self.worth = worth(modes.passes.body.side)

    def departed(self, found: LawFound) -> LawFound:
        """Return the law found, with the departures that the recording asks for."""
        mode, trial = found.mode, found.trial
        closed: set[str] = set()
        for index in range(ROUNDS):
            names = self._closed_names(mode, closed)
            if index > 0 or trial is None:
                trial = self.modes.tested(mode, names) if names else None
            asked = self._asked(mode, trial, closed)
            if not asked:
                break
            mode, dropped = self._opened_or_strongest(mode, asked, trial)
            closed |= dropped
        else:
            names = self._closed_names(mode, closed)
            trial = self.modes.tested(mode, names) if names else None
        return replace(found, mode=self._pruned(mode), trial=trial)

    def _pruned(self, mode: Mode) -> Mode:
        """Return the mode without numbers that are idle since others were opened."""
        names = set(mode.point.opened) - set(self.assumptions.opened)
        return self._without(mode, self._idle(mode, names)) or mode

    def _closed_names(self, mode: Mode, closed: Set[str]) -> list[str]:
        """Return the numbers that may still be opened."""
        names = [
            name
            for name in self.assumptions.tried
            if name not in mode.point.opened and name not in closed
        ]
        shaped = bool(set(DRAG_SHAPES) & set(mode.point.opened))
        return [name for name in names if not (shaped and name in DRAG_SHAPES)]

    def _opened_or_strongest(
        self, mode: Mode, asked: Mapping[str, float], trial: Trial | None
    ) -> tuple[Mode, set[str]]:
        """Return the mode with numbers opened, or where nothing comes of all together, with some.

        One large mistake makes others seem to be there, and no search finds them all. The numbers
        that were not opened alone are not counted as closed: without the mistake they are tested
        again.
        """
        found, dropped = self._opened(mode, asked)
        parts = [] if trial is None else _parts(asked, trial)
        if found is not mode or len(parts) < 2:
            return found, dropped
        for names in parts:
            alone, of_alone = self._opened(mode, {name: asked[name] for name in names})
            if alone is not mode:
                return alone, of_alone
        return found, dropped

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
            pulses = find_pulses(self.modes.passes, mode)
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
        dropped = self._idle(mode, set(asked))
        if dropped >= set(asked):
            return before, dropped
        return self._without(mode, dropped) or before, dropped

    def _idle(self, mode: Mode, names: Set[str]) -> set[str]:
        """Return those of some opened numbers that are too near the model to stay open."""
        idle = {
            name
            for name in names
            if name != "pulse_frequency" and not is_kept(mode, name, self.worth)
        }
        # The cosines of the strength, and the two parts of a pulse, stay or go together.
        strengths = set(STRENGTHS) & set(mode.point.opened)
        if strengths - idle:
            idle -= strengths
        if set(PULSES) & set(names) and not set(PULSES) <= idle:
            idle -= set(PULSES)
        return idle

    def _without(self, mode: Mode, idle: Set[str]) -> Mode | None:
        """Return the mode without some opened numbers; nothing where the search breaks down."""
        if not idle:
            return mode
        # Without pulses their frequency is the frequency of nothing.
        gone = {*idle, "pulse_frequency"} if set(PULSES) <= idle else idle
        kept = {name: value for name, value in mode.point.opened.items() if name not in gone}
        return self._short(replace(mode.point, opened=kept), mode.weights)

    def _short(self, point: Point, weights: Weights) -> Mode | None:
        """Return the mode near a point; nothing where the search does not soon come to its end.

        Opened numbers must not spoil a fit that has a solution without them.
        """
        mode = unless_broken(lambda: self.modes.soon().find(point, weights, held=FROM_NEAR))
        return mode if mode is not None and mode.converged else None


def _parts(asked: Mapping[str, float], trial: Trial) -> list[tuple[str, ...]]:
    """Return the numbers that are opened together, what the recording asks for most first."""
    gains: dict[tuple[str, ...], float] = {}
    strengths = tuple(name for name in STRENGTHS if name in asked)
    if strengths:
        gains[strengths] = trial.chi_squared(dict.fromkeys(strengths, 0.0)) - len(strengths)
    pulses = tuple(name for name in asked if name.startswith("pulse_"))
    if pulses:
        # Those have no score test, and may be what another departure leaves in the spectrum.
        gains[pulses] = 0.0
    for name in set(asked) - {*strengths, *pulses}:
        gains[(name,)] = trial.sigmas[name] ** 2 - 1.0
    return sorted(gains, key=lambda names: (-gains[names], names))


def _within(name: str, value: float) -> float:
    """Return a first value that is one step of the search away at most."""
    number = NUMBERS[name]
    value = min(max(value, number.model - number.most), number.model + number.most)
    return min(max(value, number.low), number.high)
