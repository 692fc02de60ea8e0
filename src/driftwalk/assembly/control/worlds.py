"""A controller, and worlds that follow it as a real tank would: with latency and missed frames.

A controller turns what is seen into modes, in simulated worlds and in real ones.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.control.decision_process import Decisions, age_bin, phase_of
from driftwalk.assembly.control.modes import Modes
from driftwalk.core.arrays import Bools, Floats, Integers
from driftwalk.core.errors import InputError
from driftwalk.core.files.shards import Arrays
from driftwalk.sweep import WorkUnit

UNKNOWN = -1
"""In place of the class of a world where it is not known."""


@dataclass(frozen=True)
class Rules:
    """A policy and how it is carried out.

    Attributes
    ----------
    action : ndarray of int, shape (policy, phase, class, age bin)
        Modes by the time left, the class and the time in it. Worlds take the policies in turn,
        where there are several.
    safe : int
        Mode where nothing is known: at the start without a class, and when the stream stops.
    dwell : int
        Periods for which a mode is held at least, from 1.
    """

    action: Integers
    safe: int = 0
    dwell: int = 1


class Controller:
    """Modes of some worlds, decision after decision.

    Parameters
    ----------
    rules : Rules
        The policy.
    world : ndarray of int, shape (worlds,)
        Their numbers.

    Examples
    --------
    >>> action = np.broadcast_to(np.array([2, 1])[:, None], (1, 3, 2, 6))
    >>> rules = Rules(action, safe=0)
    >>> controller = Controller(rules, np.arange(2))
    >>> controller.decide(np.array([1, UNKNOWN]), np.array([0, 0]), left=1).tolist()
    [1, 0]
    """

    def __init__(self, rules: Rules, world: Integers) -> None:
        self._rules, self._policy = rules, world % rules.action.shape[0]
        self.mode = np.full(world.size, rules.safe)
        self._held = np.full(world.size, rules.dwell)
        self.free = np.zeros(world.size, dtype=bool)
        """Whether the last decision of each world was open: a class was seen, no dwell held it."""

    def decide(
        self, seen: Integers, age: Integers, *, left: int, wish: npt.ArrayLike = -1
    ) -> Integers:
        """Return the modes for the next period.

        A mode that has not been held for its dwell stays, and so does that of a world whose class
        is not known.

        Parameters
        ----------
        seen : ndarray of int, shape (worlds,)
            Classes; `UNKNOWN` where no class is known, or the policy has none like it.
        age : ndarray of int, shape (worlds,)
            Whole periods since they were entered.
        left : int
            Decisions that are left, this one too; from 1.
        wish : array_like of int, shape (worlds,), optional
            Modes in place of the policy's, where not negative.

        Returns
        -------
        ndarray of int, shape (worlds,)
            The modes.
        """
        action, wished = self._rules.action[:, phase_of(left)], np.asarray(wish) >= 0
        wanted = action[self._policy, np.maximum(seen, 0), age_bin(age)]
        wanted = np.where(wished, wish, wanted)
        self.free = ((seen != UNKNOWN) | wished) & (self._held >= self._rules.dwell)
        changed = self.free & (wanted != self.mode)
        self.mode = np.where(changed, wanted, self.mode)
        self._held = np.where(changed, 1, self._held + 1)
        return self.mode


STREAM = 1
"""Of the random numbers of a world, apart from those of a round of planning."""


@dataclass(frozen=True)
class Wanted:
    """A target and its deadline, and how late and how well the tank is seen.

    Attributes
    ----------
    target : str
        Outcome class.
    by_s : float
        Deadline [s].
    every_s : float
        Period of the decisions [s].
    latency_s : float
        From a look at the tank until the pumps have changed [s], below a period.
    missed : float
        Share of the observations that give no class.
    dwell_s : float
        Shortest time for which a mode is held [s].
    """

    target: str
    by_s: float
    every_s: float
    latency_s: float = 0.0
    missed: float = 0.0
    dwell_s: float = 0.0

    @property
    def periods(self) -> int:
        """Decisions up to the deadline."""
        return round(self.by_s / self.every_s)

    @property
    def dwell(self) -> int:
        """Periods for which a mode is held at least."""
        return max(int(np.ceil(self.dwell_s / self.every_s - 1e-6)), 1)

    def require_in_range(self) -> None:
        """Refuse a latency or a share of missed looks out of range."""
        if not 0.0 <= self.latency_s < self.every_s:
            raise InputError(
                f"the latency has to be below the {self.every_s:g} s between two decisions, got "
                f"{self.latency_s:g} s"
            )
        if not 0.0 <= self.missed < 1.0:
            raise InputError(f"the share of missed looks is from 0 to below 1, got {self.missed:g}")


@dataclass(frozen=True)
class Worlds:
    """Simulates worlds; a work unit is some of them.

    Attributes
    ----------
    modes : Modes
        The modes.
    classes : tuple of str
        Outcome classes that are known; others have the number `UNKNOWN`.
    wanted : Wanted
        Decisions, latency and missed looks.
    rules : Rules
        The policy.
    seed : int
        Of the starts, the forces and what is missed.
    first : int
        Number of the world that has the first of several policies, from where they are counted.
    turn : int
        Worlds that share a draw of the parameters: those that take modes or policies in turn. So
        each of these meets the same draws.
    arm : {"policy", "constant", "random"}
        The policy, one mode for each world in turn, or another random mode at each decision.
    only : int or None
        The constant mode, where it is one.
    force_factor : float
        Factor on sigma_F of the worlds, to try a model that is wrong.
    """

    modes: Modes
    classes: tuple[str, ...]
    wanted: Wanted
    rules: Rules
    seed: int
    first: int = 0
    turn: int = 1
    arm: Literal["policy", "constant", "random"] = "policy"
    only: int | None = None
    force_factor: float = 1.0

    def __call__(self, unit: WorkUnit) -> Arrays:
        """Return what the worlds of a unit did, shapes (world, period).

        ``seen`` and ``after`` are true classes before and after a period, ``age`` whole periods in
        the class, ``mode`` the mode from the latency on, ``entered`` whether a class was entered,
        ``free`` whether the decision was open: a class was seen and no dwell held the mode.
        """
        from driftwalk.assembly.tank_batch import TankBatch

        world = np.asarray(unit.settings["world"], dtype=np.int64)
        every, latency, periods = self.wanted.every_s, self.wanted.latency_s, self.wanted.periods
        batch = TankBatch(
            self.modes.study, self.modes.flows, worlds=world.size, seed=self.seed,
            first=int(world[0]), workers=1, complete="rests",
        )  # fmt: skip
        wishes, missed = self._drawn(world)
        controller = Controller(self.rules, world - self.first)
        draw = (world - self.first) // self.turn + self.first // self.turn
        number = {name: at for at, name in enumerate(self.classes)}
        found: dict[str, list[Integers | Bools]] = defaultdict(list)
        seen = numbers(batch.outcome, number)
        for period in range(periods):
            since = np.asarray(batch.class_since)
            age = ages(period * every - since, every)
            known = np.where(missed[:, period], UNKNOWN, seen)
            mode = controller.decide(known, age, left=periods - period, wish=wishes[:, period])
            if latency > 0.0 and period > 0:
                batch.advance(latency)
            batch.set(**self.modes.settings(mode, draw, force_factor=self.force_factor))
            batch.advance(every - (latency if period > 0 else 0.0))
            after = numbers(batch.outcome, number)
            entered = (after != seen) | (np.asarray(batch.class_since) > since)
            for name, values in {
                "seen": seen, "age": age, "mode": mode, "after": after,
                "entered": entered, "free": controller.free,
            }.items():  # fmt: skip
                found[name].append(values)
            seen = after
        return {name: np.stack(row, axis=1).astype(np.int16) for name, row in found.items()}

    def _drawn(self, world: Integers) -> tuple[Integers, Integers]:
        """Return the modes that are wished for, and where the look gives no class."""
        periods, modes = self.wanted.periods, self.modes.size
        wish = np.full((world.size, periods), -1)
        lost = np.zeros((world.size, periods), dtype=bool)
        if self.arm == "constant":
            wish[:] = (world % modes)[:, None] if self.only is None else self.only
        if self.arm == "random" or self.wanted.missed > 0.0:
            for row, number in enumerate(world.tolist()):
                random = np.random.default_rng([self.seed, number, STREAM])
                lost[row] = random.random(periods) < self.wanted.missed
                if self.arm == "random":
                    wish[row] = random.integers(modes, size=periods)
        return wish, lost


def numbers(outcome: object, number: dict[str, int]) -> Integers:
    """Return the classes of worlds by number, `UNKNOWN` for those without one."""
    return np.array([number.get(str(name), UNKNOWN) for name in np.asarray(outcome)])


def ages(time_in_class: Floats, every_s: float) -> Integers:
    """Return whole periods that classes have lasted, from their times [s].

    Examples
    --------
    >>> ages(np.array([0.0, 4.9, 5.0]), 5.0).tolist()
    [0, 0, 1]
    """
    # What is a period but for rounding counts as one.
    return np.floor(np.maximum(time_in_class, 0.0) / every_s + 1e-6).astype(np.int64)


def decisions_of(found: Arrays) -> Decisions:
    """Return the decisions of worlds in known classes, one after the other."""
    kept = (found["seen"] != UNKNOWN) & (found["after"] != UNKNOWN)
    return Decisions(
        *(
            np.asarray(found[name][kept], dtype=np.int64)
            for name in ("seen", "age", "mode", "after", "entered")
        )
    )
