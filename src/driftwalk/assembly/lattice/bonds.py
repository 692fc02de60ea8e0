"""The graph of bonds of many runs: which blocks a bond that breaks leaves together."""

from __future__ import annotations

from typing import Final

import numpy as np

from driftwalk.core.arrays import Bools, Integers

JOINING: Final = 0
"""Two assemblies became one: kinds of events, as the native core numbers them."""
PARTING: Final = 1
"""One assembly became two."""
OPENING: Final = 2
"""A bond of a loop broke; the loop holds its blocks together."""
CLOSING: Final = 3
"""A bond of a loop formed, of neighbours that a joining has brought together."""


class BondGraph:
    """Bonds between the blocks of runs, side by side.

    Parameters
    ----------
    runs, blocks : int
        At first there is no bond.
    """

    def __init__(self, runs: int, blocks: int) -> None:
        self.bonded: Bools = np.zeros((runs, blocks, blocks), dtype=bool)

    def put(self, run: Integers, block: Integers, bonded: bool) -> None:
        """Make or break the bonds of pairs of blocks (n, 2), one for each of some runs."""
        first, second = block.T
        self.bonded[run, first, second] = self.bonded[run, second, first] = bonded

    def reached(self, run: Integers, block: Integers) -> Bools:
        """Return which blocks bonds lead to from one block of each run, shape (n, blocks)."""
        bonded = self.bonded[run]
        found: Bools = np.arange(bonded.shape[1]) == block[:, None]
        while True:
            grown = found | (bonded & found[:, :, None]).any(axis=1)
            if (grown == found).all():
                return found
            found = grown
