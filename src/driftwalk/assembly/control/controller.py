"""A controller: it turns what is seen of worlds into modes, in simulated and in real ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from driftwalk.assembly.control.decision_process import age_bin, phase_of
from driftwalk.core.arrays import Integers

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
        self, seen: Integers, age: Integers, *, left: int, wish: Integers | None = None
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
        wish : ndarray of int, shape (worlds,), optional
            Modes in place of the policy's, where not negative.

        Returns
        -------
        ndarray of int, shape (worlds,)
            The modes.
        """
        action = self._rules.action[:, phase_of(left)]
        wanted = action[self._policy, np.maximum(seen, 0), age_bin(age)]
        if wish is not None:
            wanted = np.where(wish >= 0, wish, wanted)
        looked = seen != UNKNOWN if wish is None else (seen != UNKNOWN) | (wish >= 0)
        self.free = looked & (self._held >= self._rules.dwell)
        changed = self.free & (wanted != self.mode)
        self.mode = np.where(changed, wanted, self.mode)
        self._held = np.where(changed, 1, self._held + 1)
        return self.mode
