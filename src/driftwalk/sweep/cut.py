"""Size of work units, by their cost alone.

Results do not depend on the cut, but the names of the shards do: a run that was begun on a cluster
can only go on at home if both cut alike. So the cut follows from the work alone.
"""

from __future__ import annotations

from typing import Final, NamedTuple


class CutPolicy(NamedTuple):
    """How long a work unit takes."""

    block_steps_per_second: float = 25e6
    """Steps of single blocks, or bodies, that one core makes: 12 to 40 million, by its
    instruction set (docs/explanation/performance.md); chosen by hand."""
    largest_s: float = 40.0
    """Longest unit [s of one core]: as much is lost where its worker dies; chosen by hand."""
    many: int = 256
    """Units of a sweep at least, so that many workers are busy; chosen by hand."""
    smallest_s: float = 1.0
    """Shortest unit [s], even if there are then fewer: to hand one out takes some hundredths of
    a second; chosen by hand."""
    fewest: int = 16
    """Units of a sweep at least, however short they are; chosen by hand."""


CUT: Final = CutPolicy()


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
    each = max(block_steps, 1.0) / CUT.block_steps_per_second
    total = settings * each
    unit = min(CUT.largest_s, max(total / CUT.many, CUT.smallest_s), total / CUT.fewest)
    return max(int(unit / each) // multiple, 1) * multiple
