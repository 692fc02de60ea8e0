"""Progress of long work: the callback, and one share over several stages."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import accumulate
from typing import Final

Progress = Callable[[int, int], None]
"""Called with how much is done, and with all of it."""
WHOLE: Final = 1000
"""A `StagedProgress` counts in thousandths of the work."""
USUAL_SHARE: Final = 0.75
"""A search of unknown length goes evenly up to this share of the usual one; chosen by hand."""


def share_of_search(done: float) -> float:
    """Return how much of a search of unknown length is done.

    Up to three quarters of the usual length it is what is done over that; then it goes on ever more
    slowly, and never comes to its end.

    Parameters
    ----------
    done : float
        Work done, over the work of a usual search.

    Examples
    --------
    >>> share_of_search(0.5), share_of_search(1.0), round(share_of_search(2.0), 2)
    (0.5, 0.875, 0.96)
    """
    if done <= USUAL_SHARE:
        return done
    left = 1.0 - USUAL_SHARE
    return 1.0 - left**2 / (left + done - USUAL_SHARE)


class StagedProgress:
    """How far work of several stages is: one share of all of it, which never goes back.

    Parameters
    ----------
    tell : callable
        Called as ``tell(done, WHOLE, words)``.
    parts : mapping of str to float
        The stages in their order, and the part of the time that each usually takes, in any unit.

    Examples
    --------
    >>> staged = StagedProgress(print, {"fit": 3.0, "check": 1.0})
    >>> fit = staged.stage("fit")
    >>> fit(1, 2)
    375 1000 fit
    >>> fit(0, 2, "once more")
    375 1000 once more
    >>> staged.begin("check")
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


def ignore_progress(*_: object) -> None:
    """Ignore progress: the default callback of long work."""
