"""The stages of a calibration, whose names begin those of its sweeps."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from itertools import accumulate
from typing import Final, NamedTuple

Progress = Callable[[int, int], None]
"""Called with how much is done, and with all of it."""


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


WHOLE: Final = 1000
"""A `Course` counts in thousandths of the work."""
USUAL_SHARE: Final = 0.75
"""A search of unknown length goes evenly up to this share of the usual one."""
MORE: Final = "more-"
"""Stands before the name of a map where some of its settings are simulated again."""
ONCE: Final = 0.9
"""Share of a map's time until every setting has been simulated once."""


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
    """Return how much of a search through windows is done, whose number nobody knows before.

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


def share_of_search(done: float) -> float:
    """Return how much of a search is done whose length nobody knows before.

    Up to three quarters of the usual length it is what is done over that; then it goes on ever more
    slowly, and never comes to its end.

    Parameters
    ----------
    done : float
        Work done over that of a usual search.

    Examples
    --------
    >>> share_of_search(0.5), share_of_search(1.0), round(share_of_search(2.0), 2)
    (0.5, 0.875, 0.96)
    """
    if done <= USUAL_SHARE:
        return done
    left = 1.0 - USUAL_SHARE
    return 1.0 - left**2 / (left + done - USUAL_SHARE)


class Course:
    """How far work of several stages is: one share of all of it, which never goes back.

    Parameters
    ----------
    tell : callable
        Called as ``tell(done, WHOLE, words)``.
    parts : mapping of str to float
        The stages in their order, and the part of the time that each usually takes, in any unit.

    Examples
    --------
    >>> course = Course(print, {"fit": 3.0, "check": 1.0})
    >>> fit = course.stage("fit")
    >>> fit(1, 2)
    375 1000 fit
    >>> fit(0, 2, "once more")
    375 1000 once more
    >>> course.begin("check")
    750 1000 check
    """

    def __init__(self, tell: Callable[[int, int, str], None], parts: Mapping[str, float]) -> None:
        self._tell, self._parts = tell, parts
        self._before = dict(zip(parts, accumulate(parts.values(), initial=0.0), strict=False))
        self._all = sum(parts.values())
        self._told = 0

    def stage(self, name: str) -> Callable[..., None]:
        """Return what a stage calls with what is done of it, with all of it, and with words.

        Parameters
        ----------
        name : str
            The stage; also what is said where it gives no words.
        """

        def hear(done: float, total: float, words: str = "") -> None:
            share = min(done / total, 1.0) if total > 0 else 1.0
            parts = self._before[name] + share * self._parts[name]
            self._told = max(self._told, round(WHOLE * parts / self._all))
            self._tell(self._told, WHOLE, words or name)

        return hear

    def begin(self, name: str) -> None:
        """Say that a stage begins, which itself tells nothing.

        Parameters
        ----------
        name : str
            The stage.
        """
        self.stage(name)(0, 1)


def tell_nobody(*_: object) -> None:
    """Leave progress unsaid: what long work calls where nobody asks how far it is."""
