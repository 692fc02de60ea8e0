"""Into how many work units a sweep is cut: by what it costs, whoever computes it.

Results do not depend on the cut, but the names of the shards do: a run that was begun on a cluster
can only go on at home if both cut alike. So the cut follows from the work alone.
"""

from __future__ import annotations

from typing import Final

BLOCK_STEPS_PER_SECOND: Final = 25e6
"""Steps of single blocks, or bodies, that one core makes: 12 to 40 million, by its instruction set
(docs/explanation/performance.md)."""
LARGEST_S: Final = 40.0
"""A unit takes at most so many seconds of one core: as much is lost where its worker dies."""
MANY: Final = 256
"""Units are smaller where there would be fewer than so many, so that many workers are busy,"""
SMALLEST_S: Final = 1.0
"""though no smaller than this: handing one out and keeping it takes some hundredths of a second,"""
FEWEST: Final = 16
"""unless there would then be fewer than so many."""


def settings_per_unit(settings: int, block_steps: float, *, multiple: int = 1) -> int:
    """Return how many settings of a sweep make a work unit.

    Parameters
    ----------
    settings : int
        All settings of the sweep.
    block_steps : float
        Time steps of single blocks that one setting takes, with its replicates; at most, where runs
        may end early.
    multiple : int
        Settings that belong together: a unit has a whole number of such groups.

    Examples
    --------
    >>> settings_per_unit(1681, 4 * 225_000)  # a map of 30 minutes, 1 s each
    27
    >>> settings_per_unit(1000, 4 * 30_000, multiple=25)  # four blocks for 5 minutes
    50
    """
    each = max(block_steps, 1.0) / BLOCK_STEPS_PER_SECOND
    total = settings * each
    unit = min(LARGEST_S, max(total / MANY, SMALLEST_S), total / FEWEST)
    return max(int(unit / each) // multiple, 1) * multiple
