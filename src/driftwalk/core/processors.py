"""Processors, memory and threads: how many there are to use, and work in the background."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from threading import Event, Lock
from typing import Any, TypeVar

from driftwalk.core.progress import Progress

ItemT = TypeVar("ItemT")
FoundT = TypeVar("FoundT")

_lock = Lock()
_callers = 0
"""Calls under way that need one thread of BLAS; the last one lifts the limit."""
_limits: Any = None


def default_threads() -> int:
    """Return how many threads to use: the processors that this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def machine_memory() -> int | None:
    """Return the memory of this machine [bytes]; None where the system does not say."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, OSError, ValueError):
        return None


def map_in_threads(
    function: Callable[[ItemT], FoundT], items: Iterable[ItemT], threads: int
) -> list[FoundT]:
    """Return what a function gives for each item, in their order.

    Parameters
    ----------
    function : callable
        Spends most of its time outside of Python.
    items : iterable
        Its arguments.
    threads : int
        How many to use; with one, everything is done in the calling thread.

    Examples
    --------
    >>> map_in_threads(abs, [-1, 2], 2)
    [1, 2]
    """
    if threads < 2:
        return [function(item) for item in items]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(function, items))


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Let linear algebra run on one processor; for matrices of a few hundred rows.

    More threads mostly wait for each other there, and change the last digits of results.

    Examples
    --------
    >>> import numpy as np
    >>> with one_blas_thread():
    ...     solved = np.linalg.solve(2.0 * np.eye(2), np.ones(2))
    >>> solved
    array([0.5, 0.5])
    """
    # Loaded before, as a library that is loaded later is not limited.
    import scipy.linalg  # noqa: F401
    from threadpoolctl import threadpool_limits

    # Calls in several threads may overlap: the first one limits, the last one to end restores.
    global _callers, _limits
    with _lock:
        if _callers == 0:
            _let_any_thread_limit()
            _limits = threadpool_limits(limits=1, user_api="blas")
        _callers += 1
    try:
        yield
    finally:
        with _lock:
            _callers -= 1
            if _callers == 0:
                _let_any_thread_limit()
                _limits.restore_original_limits()
                _let_any_thread_limit()


def _let_any_thread_limit() -> None:
    """Let the next thread that limits OpenBLAS do so, whichever did before.

    From version 3.7 on threadpoolctl obeys the first thread that sets a limit, for as long as that
    thread lives, and passes over the calls of all others without a word.
    """
    import threadpoolctl

    openblas = getattr(threadpoolctl, "OpenBLASController", None)
    if (clear := getattr(openblas, "clear_controlling_thread", None)) is not None:
        clear(force=True)


class Cancelled(Exception):
    """Ends work whose result is no longer needed."""


class CancelOnError(AbstractContextManager["CancelOnError"]):
    """A block that waits for work of other threads, and ends it when an error or Ctrl-C ends it.

    Examples
    --------
    >>> with CancelOnError() as cancellation:
    ...     cancellation.raise_if_cancelled()
    """

    def __init__(self) -> None:
        self._cancelled = Event()

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is not None:
            self._cancelled.set()

    def raise_if_cancelled(self) -> None:
        """Raise `Cancelled` where the result is no longer needed; the work calls it often."""
        if self._cancelled.is_set():
            raise Cancelled


def run_in_background(
    work: Callable[[Progress], FoundT], meanwhile: Callable[[], object]
) -> FoundT:
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
