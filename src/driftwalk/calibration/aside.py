"""Work of the native core in a thread of its own, while this one does something else."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from driftwalk.calibration.search import Progress

Result = TypeVar("Result")


class _LeftOff(Exception):
    """Ends work whose result nobody waits for any more."""


def aside(work: Callable[[Progress], Result], meanwhile: Callable[[], object]) -> Result:
    """Return what some work gives; it goes on in another thread during `meanwhile`.

    Parameters
    ----------
    work : callable
        Takes a function that it calls often, with how much is done and the total. That call ends
        the work when `meanwhile`, or the waiting for the work, was ended by an error or Ctrl-C.
    meanwhile : callable
        Called in this thread.

    Examples
    --------
    >>> aside(lambda progress: 6 * 7, lambda: print("meanwhile"))
    meanwhile
    42
    """
    left_off = threading.Event()

    def go_on(_done: int, _total: int) -> None:
        if left_off.is_set():
            raise _LeftOff

    with ThreadPoolExecutor(1) as pool:
        future = pool.submit(work, go_on)
        try:
            meanwhile()
            return future.result()
        except BaseException:
            left_off.set()
            raise
