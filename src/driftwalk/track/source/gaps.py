"""How many frames are missing, from the times between those there are, while they come."""

from __future__ import annotations

from bisect import bisect_right, insort
from typing import Final

_LONG: Final = 1.5
"""How many times the usual gap one has to be for a frame to be missing in it."""
_LEARNT: Final = 8
"""Gaps that teach the usual one: before, no frame is said to be missing."""
_SAME: Final = 0.01
"""Change of the usual gap, as a share of it, above which all gaps are counted again."""


class FrameGaps:
    """The times between frames.

    Frames that are missing are counted with each gap, by the usual gap up to then. When the usual
    gap turns out to be another one, all are counted again; ``settle`` does so at the end.

    Examples
    --------
    >>> gaps = FrameGaps()
    >>> for gap in [0.1] * 8 + [0.3]:
    ...     gaps.add(gap)
    >>> gaps.missing
    2
    """

    def __init__(self) -> None:
        self._sorted: list[float] = []
        self._counted_by = 0.0
        self.missing = 0

    @property
    def usual(self) -> float:
        """The median of the gaps [s]; 0 where there is none."""
        number = len(self._sorted)
        if not number:
            return 0.0
        return (self._sorted[(number - 1) // 2] + self._sorted[number // 2]) / 2

    def add(self, gap: float) -> None:
        """Take in the time between a frame and the one before [s], above zero."""
        insort(self._sorted, gap)
        if len(self._sorted) < _LEARNT:
            return
        usual = self.usual
        if abs(usual - self._counted_by) > _SAME * self._counted_by:
            self._count_anew(usual)
        elif gap > _LONG * self._counted_by:
            self.missing += round(gap / self._counted_by) - 1

    def settle(self) -> None:
        """Count by the usual one of all gaps; one gap alone says nothing."""
        if len(self._sorted) > 1:
            self._count_anew(self.usual)

    def _count_anew(self, usual: float) -> None:
        long = self._sorted[bisect_right(self._sorted, _LONG * usual) :]
        self.missing = sum(round(gap / usual) - 1 for gap in long)
        self._counted_by = usual
