"""Count missing frames from the intervals between frames, online."""

from __future__ import annotations

from bisect import bisect_right, insort
from typing import Final, NamedTuple


class FrameGapPolicy(NamedTuple):
    """When a frame is missing between two."""

    long: float = 1.5
    """Usual gaps that one has to last for a frame to be missing in it; chosen by hand."""
    learnt: int = 8
    """Gaps that teach the usual one; before them no frame is missing; chosen by hand."""
    same: float = 0.01
    """Relative change of the usual gap above which all gaps are counted again; chosen by hand."""


_GAPS: Final = FrameGapPolicy()


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
        if len(self._sorted) < _GAPS.learnt:
            return
        usual = self.usual
        if abs(usual - self._counted_by) > _GAPS.same * self._counted_by:
            self._count_anew(usual)
        elif gap > _GAPS.long * self._counted_by:
            self.missing += round(gap / self._counted_by) - 1

    def settle(self) -> None:
        """Count by the usual one of all gaps; one gap alone says nothing."""
        if len(self._sorted) > 1:
            self._count_anew(self.usual)

    def _count_anew(self, usual: float) -> None:
        long = self._sorted[bisect_right(self._sorted, _GAPS.long * usual) :]
        self.missing = sum(round(gap / usual) - 1 for gap in long)
        self._counted_by = usual
