"""Improve a policy by what whole runs of the microscopic engine reach, without a model.

Each world has a mode of its own in every cell: a phase of the run, a class, and an age. Whether it
reached the target counts for all cells that it visited, each with the mode it had there (Monte
Carlo control; Sutton and Barto, Reinforcement learning, chapter 5). The probability that a mode of
a cell reaches the target has a Beta law. Modes are drawn in proportion to their probability of
being the best (Thompson 1933), so that most worlds soon try what may be better.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from driftwalk.assembly.control.decision_process import PROCESS_POLICY, age_bin, phase_of
from driftwalk.core.arrays import Floats, Integers
from driftwalk.core.files.shards import Arrays


class ImprovementPolicy(NamedTuple):
    """How much a plan and earlier runs count."""

    weight: float = 150.0
    """Worlds that value iteration counts for in each cell; 20 took twice as many rounds."""
    kept: float = 0.9
    """Share of what earlier rounds count for: the policy around a cell was another one. By hand."""
    greedy: int = 4
    """Every such world follows the best policy so far; chosen by hand."""


IMPROVEMENT_POLICY = ImprovementPolicy()


class Cells(NamedTuple):
    """Worlds that reached the target and that did not, (phase, class, age bin, mode)."""

    reached: Floats
    failed: Floats

    def best(self) -> Integers:
        """Return the mode of each cell with the largest mean, shape (phase, class, age bin)."""
        best: Integers = (self.reached / (self.reached + self.failed)).argmax(axis=-1)
        return best

    def drawn(self, worlds: int, random: np.random.Generator) -> Integers:
        """Return modes for worlds, shape (world, phase, class, age bin)."""
        made = np.broadcast_to(self.best(), (worlds, *self.reached.shape[:-1])).copy()
        for at in np.flatnonzero(np.arange(worlds) % IMPROVEMENT_POLICY.greedy):
            made[at] = random.beta(self.reached, self.failed).argmax(axis=-1)
        return made

    def updated(self, found: Arrays, modes: Integers, hit: Floats) -> Cells:
        """Return what is known after worlds that had these modes.

        A cell counts where its mode was taken: not after a missed look, nor in the dwell of another
        mode.

        Parameters
        ----------
        found : dict of str to ndarray
            What the worlds did, as `Worlds` returns it.
        modes : ndarray of int, shape (world, phase, class, age bin)
            Their modes.
        hit : ndarray, shape (world,)
            1 where the target was reached, else 0.
        """
        seen, periods = found["seen"], found["seen"].shape[1]
        known = (seen >= 0) & (found["free"] > 0)
        world = np.nonzero(known)[0]
        phase = np.array([phase_of(left) for left in range(periods, 0, -1)])
        cell = np.stack([
            world, np.broadcast_to(phase, seen.shape)[known], seen[known],
            age_bin(found["age"][known]),
        ])  # fmt: skip
        own = np.unique(cell, axis=1)
        place = (*own[1:], modes[tuple(own)])
        counts = np.zeros((2, *self.reached.shape))
        np.add.at(counts[0], place, hit[own[0]])
        np.add.at(counts[1], place, 1.0 - hit[own[0]])
        return Cells(self.reached + counts[0], self.failed + counts[1])

    def faded(self, prior: Cells) -> Cells:
        """Return what is known when the worlds count for less, and the prior as before."""
        kept = IMPROVEMENT_POLICY.kept
        return Cells(*(own + kept * (now - own) for own, now in zip(prior, self, strict=True)))


def prior_of(gain: Floats, *, scale: float) -> Cells:
    """Return what value iteration says of the cells.

    Parameters
    ----------
    gain : ndarray, shape (phase, class, age bin, mode)
        As `gains` returns it.
    scale : float
        Factor on it: what its best policy reached over what it promised.
    """
    mean = np.clip(scale * gain, 0.01, 0.99)
    return Cells(IMPROVEMENT_POLICY.weight * mean, IMPROVEMENT_POLICY.weight * (1.0 - mean))


def cells_like(classes: int) -> tuple[int, int, int]:
    """Return the shape of a policy: phases, classes, bins of age."""
    return len(PROCESS_POLICY.phase_starts), classes, len(PROCESS_POLICY.age_starts)
