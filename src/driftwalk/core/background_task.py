"""A background task: work of the native core in another thread, while this one goes on."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from driftwalk.core.run_stages import Progress

Result = TypeVar("Result")


class Cancelled(Exception):
    """Ends work whose result nobody waits for any more."""


class CancelOnError:
    """A block that waits for work of other threads, and ends it when an error or Ctrl-C ends it.

    Examples
    --------
    >>> with CancelOnError() as cancellation:
    ...     cancellation.raise_if_cancelled()
    """

    def __init__(self) -> None:
        self._cancelled = threading.Event()

    def __enter__(self) -> CancelOnError:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is not None:
            self._cancelled.set()

    def raise_if_cancelled(self) -> None:
        """Raise `Cancelled` where nobody waits any more; the work calls it often."""
        if self._cancelled.is_set():
            raise Cancelled


def run_in_background(
    work: Callable[[Progress], Result], meanwhile: Callable[[], object]
) -> Result:
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
    >>> run_in_background(lambda progress: 6 * 7, lambda: print("meanwhile"))
    meanwhile
    42
    """
    with ThreadPoolExecutor(1) as pool, CancelOnError() as cancellation:
        future = pool.submit(work, lambda _done, _total: cancellation.raise_if_cancelled())
        meanwhile()
        return future.result()
