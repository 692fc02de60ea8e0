"""How the units of a sweep are handed to an executor: a window of them, and the slow ones again."""

from __future__ import annotations

import time
import uuid
import warnings
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future
from statistics import median
from typing import Any, Final, Protocol

import numpy.typing as npt

from driftwalk.sweep.design import WorkUnit
from driftwalk.sweep.remote import packed, run_unit

UnitFuture = Future[Mapping[str, "npt.NDArray[Any]"]]
UnitFunction = Callable[[WorkUnit], Mapping[str, "npt.NDArray[Any]"]]

FOR_EACH_WORKER: Final = 3
"""Units handed out for each worker: one to compute, others so that it need not wait."""
FEWEST: Final = 64
"""Units handed out at least, where an executor does not say how many workers it has."""
SLOW: Final = 4.0
"""A unit is slow where it takes so many times the usual time, with nothing left to hand out."""
SLOW_S: Final = 10.0
"""No unit is slow before [s]."""


class Handout(Protocol):
    """Hands units to workers."""

    def submit(self, unit: WorkUnit) -> UnitFuture:
        """Have a unit computed."""

    @property
    def width(self) -> int:
        """How many units are handed out at a time."""

    def slow(self, age_s: float, /) -> bool:
        """Return whether a unit of this age should be handed out again."""

    def finished(self, age_s: float, /) -> None:
        """Hear that a unit has come back, and how long it took."""


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


def handout(executor: Executor, function: UnitFunction) -> Handout:
    """Return how an executor gets the units of a sweep.

    Parameters
    ----------
    executor : concurrent.futures.Executor
        Threads, processes, or ``client.get_executor()`` of Dask.
    function : callable
        The function of the sweep.
    """
    client = getattr(executor, "_client", None)
    if client is not None and type(executor).__module__.startswith("distributed"):
        return _OnDask(executor, client, function)
    return _OnExecutor(executor, function)


class _OnExecutor:
    """Threads or processes of this machine: none is slower than the others."""

    def __init__(self, executor: Executor, function: UnitFunction) -> None:
        self._executor, self._function = executor, function
        workers = getattr(executor, "_max_workers", 0)
        self.width = max(FOR_EACH_WORKER * workers, FEWEST)

    def submit(self, unit: WorkUnit) -> UnitFuture:
        return self._executor.submit(self._function, unit)

    def slow(self, _age_s: float, /) -> bool:
        return False

    def finished(self, _age_s: float, /) -> None:
        """Do nothing."""


class _OnDask:
    """Workers of a Dask cluster: the function travels once to each, the units as they come."""

    def __init__(self, executor: Any, client: Any, function: UnitFunction) -> None:
        self._executor, self._client = executor, client
        self._token = uuid.uuid4().hex
        # A task, unlike data that is scattered, is made again when all who held it have died.
        with warnings.catch_warnings():
            # A recording and a flow are some MB: sent once, they are no large graph.
            warnings.filterwarnings("ignore", message="Sending large graph")
            self._parcel = client.submit(
                _as_it_is,
                packed(function, self._token),
                key=f"driftwalk-function-{self._token}",
                pure=False,
            )
        self._again = 0
        self._ages: list[float] = []
        self._seen = (-float("inf"), 0)

    @property
    def width(self) -> int:
        return max(FOR_EACH_WORKER * self._workers(), FOR_EACH_WORKER)

    def submit(self, unit: WorkUnit) -> UnitFuture:
        self._again += 1
        key = f"driftwalk-unit-{unit.id}-{self._token[:8]}-{self._again}"
        future: UnitFuture = self._executor.submit(
            run_unit, self._parcel, unit, key=key, pure=False
        )
        return future

    def slow(self, age_s: float, /) -> bool:
        return bool(self._ages) and age_s > max(SLOW * median(self._ages), SLOW_S)

    def finished(self, age_s: float, /) -> None:
        self._ages.append(age_s)

    def _workers(self) -> int:
        """Return how many workers there are; asked for at most once a second."""
        when, count = self._seen
        if time.monotonic() - when > 1.0:
            count = len(self._client.scheduler_info(n_workers=-1)["workers"])
            self._seen = (time.monotonic(), count)
        return count


def _as_it_is(parcel: Any) -> Any:
    return parcel
