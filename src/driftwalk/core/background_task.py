"""Work of the native core in a thread of its own, while this one does something else."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Progress = Callable[[int, int], None]
Result = TypeVar("Result")


class LeftOff(Exception):
    """Ends work whose result nobody waits for any more."""


class Waiting:
    """A block that waits for work of other threads, and ends it when an error or Ctrl-C ends it.

    Examples
    --------
    >>> with Waiting() as waiting:
    ...     waiting.go_on()
    """

    def __init__(self) -> None:
        self._left_off = threading.Event()

    def __enter__(self) -> Waiting:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is not None:
            self._left_off.set()

    def go_on(self) -> None:
        """Raise `LeftOff` where nobody waits any more; the work calls it often."""
        if self._left_off.is_set():
            raise LeftOff


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
    with ThreadPoolExecutor(1) as pool, Waiting() as waiting:
        future = pool.submit(work, lambda _done, _total: waiting.go_on())
        meanwhile()
        return future.result()
