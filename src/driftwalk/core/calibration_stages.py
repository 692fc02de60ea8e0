"""The stages of a calibration, whose names begin those of its sweeps."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final, NamedTuple


class Stage(NamedTuple):
    """A stage of a calibration."""

    words: str
    """Name for people."""
    begin: float
    end: float
    """Its share of the time of the calibration: from, to [%]."""

    def percent(self, share: float) -> float:
        """Return how much of the calibration is done when a share of this stage is [%].

        Examples
        --------
        >>> CALIBRATION_STAGES["refined"].percent(0.5)
        43.0
        """
        return self.begin + share * (self.end - self.begin)


CALIBRATION_STAGES: Final[dict[str, Stage]] = {
    "coarse": Stage("map", 0.0, 26.0),
    "refined": Stage("refined map", 26.0, 60.0),
    "bootstrap": Stage("bootstrap", 60.0, 80.0),
    "validation": Stage("halves and figures", 80.0, 100.0),
    # of more than two parameters: the search is made only where the summaries find no match
    "summaries": Stage("summaries", 0.0, 90.0),
    "search": Stage("search", 40.0, 60.0),
    "longer-search": Stage("longer search", 90.0, 95.0),
    "judged": Stage("held-out blocks", 95.0, 98.0),
}
MORE: Final = "more-"
"""Stands before the name of a map where some of its settings are simulated again."""
ONCE: Final = 0.9
"""Share of a map's time until every setting has been simulated once; chosen by hand."""


def share_of_map(done: Iterable[float]) -> float:
    """Return how much of a map is done: every setting once, then some settings more often.

    Parameters
    ----------
    done : iterable of float
        Share of each of the two sweeps that is done, from 0 to 1; the second may be missing.

    Examples
    --------
    >>> share_of_map([0.5]), share_of_map([1.0, 1.0])
    (0.45, 1.0)
    """
    once, more = (*done, 0.0)[:2]
    return ONCE * once + (1.0 - ONCE) * more


def share_of_windows(done: Iterable[float]) -> float:
    """Return how much of a search through an unknown number of windows is done.

    Each finished window takes half of what was left, and the window under way its part of the next
    half: the share never goes back.

    Parameters
    ----------
    done : iterable of float
        Share of each window that is done, from 0 to 1.

    Examples
    --------
    >>> share_of_windows([0.5]), share_of_windows([1.0]), share_of_windows([1.0, 0.5])
    (0.25, 0.5, 0.625)
    """
    shares = list(done)
    left = 0.5 ** sum(one >= 1.0 for one in shares)
    under_way = max((one for one in shares if one < 1.0), default=0.0)
    return 1.0 - left + 0.5 * left * under_way
