"""Scheduling of work units: a window of submitted units, and slow ones submitted again."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor, Future
from statistics import median
from typing import Any, Final, NamedTuple

import numpy.typing as npt

from driftwalk.sweep.design import WorkUnit
from driftwalk.sweep.workers import UnitFunction, WorkerExecutor

UnitFuture = Future[Any]
Found = Mapping[str, "npt.NDArray[Any]"]


class HandoutPolicy(NamedTuple):
    """How many units are under way, and which are computed again."""

    for_each_worker: int = 3
    """Units handed out for each worker: it computes one and need not wait for the next; chosen
    by hand."""
    fewest: int = 64
    """Units handed out at least, where an executor does not say how many workers it has; chosen
    by hand."""
    slow: float = 4.0
    """Usual durations after which a unit is slow, when no other is left to hand out; chosen by
    hand."""
    slow_s: float = 10.0
    """Duration below which no unit is slow [s]; chosen by hand."""


HANDOUT: Final = HandoutPolicy()


def threads_of_unit(threads: int | None, executor: Executor | None) -> int | None:
    """Return the threads of a work unit: one where an executor has units at the same time.

    Parameters
    ----------
    threads : int or None
        What was asked for.
    executor : concurrent.futures.Executor or None
        Where units run.

    Examples
    --------
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> threads_of_unit(None, None), threads_of_unit(None, ThreadPoolExecutor(2))
    (None, 1)
    """
    return 1 if threads is None and executor is not None else threads


def is_lost(error: BaseException | None) -> bool:
    """Return whether an error says that every worker that had a unit has ended."""
    # By its name: Dask is not imported where it is not used.
    return type(error).__name__ == "KilledWorker"


class Handout:
    """Hands units to threads or processes of this machine: none is slower than the others."""

    def __init__(self, executor: Executor, function: UnitFunction) -> None:
        self._executor, self._function = executor, function

    @property
    def width(self) -> int:
        """How many units are handed out at a time."""
        workers = getattr(self._executor, "_max_workers", 0)
        return max(HANDOUT.for_each_worker * workers, HANDOUT.fewest)

    def submit(self, unit: WorkUnit) -> UnitFuture:
        """Have a unit computed."""
        return self._executor.submit(self._function, unit)

    def result(self, future: UnitFuture) -> Found:
        """Return what a unit gave, or raise what it failed by."""
        found: Found = future.result()
        return found

    def lost(self, future: UnitFuture) -> bool:  # noqa: ARG002
        """Whether a unit was with several workers that ended, so that none takes it."""
        return False

    def slow(self, age_s: float) -> bool:  # noqa: ARG002
        """Return whether a unit of this age should be handed out again."""
        return False

    def again(self) -> None:
        """Hear that a unit was handed out again."""

    def tell(self, done: int, total: int) -> None:
        """Hear how many units of the sweep are done, and how many there are."""


class _OnWorkers(Handout):
    """Hands units to workers elsewhere: they may be slow, go and come."""

    def __init__(self, executor: WorkerExecutor, function: UnitFunction) -> None:
        self._workers = executor
        self._parcel = executor.sent(function)
        self._seconds: list[float] = []

    @property
    def width(self) -> int:
        return max(HANDOUT.for_each_worker * self._workers.workers, HANDOUT.for_each_worker)

    def submit(self, unit: WorkUnit) -> UnitFuture:
        return self._workers.run(self._parcel, unit)

    def result(self, future: UnitFuture) -> Found:
        answer = future.result()
        self._seconds.append(answer.seconds)
        found: Found = answer.arrays
        return found

    def lost(self, future: UnitFuture) -> bool:
        return not future.cancelled() and is_lost(future.exception())

    def slow(self, age_s: float) -> bool:
        if not self._seconds:
            return False
        # It may have waited for those that its worker got before.
        return age_s > max(
            (HANDOUT.for_each_worker - 1 + HANDOUT.slow) * median(self._seconds), HANDOUT.slow_s
        )

    def again(self) -> None:
        self._workers.units.again += 1

    def tell(self, done: int, total: int) -> None:
        self._workers.units.done, self._workers.units.total = done, total


def handout(executor: Executor, function: UnitFunction) -> Handout:
    """Return how an executor gets the units of a sweep.

    Parameters
    ----------
    executor : concurrent.futures.Executor
        Threads, processes, or ``client.get_executor()`` of Dask.
    function : callable
        The function of the sweep.
    """
    if isinstance(executor, WorkerExecutor):
        return _OnWorkers(executor, function)
    client = getattr(executor, "_client", None)
    if client is not None and type(executor).__module__.startswith("distributed"):
        return _OnWorkers(WorkerExecutor(client), function)
    return Handout(executor, function)
