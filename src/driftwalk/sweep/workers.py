"""Executors in other processes: of this machine, and on a Dask cluster.

Each worker of a cluster is checked and gets a function once, then units. A unit is a few numbers;
the function of a sweep holds a flow, a recording, a model. On a Dask cluster the function is
therefore a separate object, which a worker fetches with its first unit.
The scheduling of units: a window of submitted ones, and slow ones submitted again.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from multiprocessing.connection import Connection
import hashlib
import pickle
import platform
import sys
import time
import warnings
from collections import OrderedDict
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from statistics import median
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import ClusterError
from driftwalk.core.provenance import package_versions
from driftwalk.sweep.design import WorkUnit

KEPT: Final = 4
"""Functions that a process keeps ready: one for each stage that may be under way; chosen by
hand."""


Guard = Callable[[], None]
"""Raises `ClusterError` in a process that must not compute."""

_ready: OrderedDict[str, Any] = OrderedDict()
_passed: set[Guard] = set()


class Parcel(NamedTuple):
    """The function of a sweep, as it travels."""

    token: str
    """Hash of the content: the same function twice is one."""
    content: bytes
    """The function, pickled."""
    versions: dict[str, str]
    """Of the packages that must be the same where it runs."""
    guard: Guard | None
    """Has to pass where it runs."""


class Answer(NamedTuple):
    """Result of a unit on a worker."""

    arrays: dict[str, npt.NDArray[Any]]
    seconds: float
    """By the worker's clock."""


def packed(function: Any, guard: Guard | None = None) -> Parcel:
    """Return a function as it travels.

    Parameters
    ----------
    function : callable
        The function of a sweep. Where it has a true attribute ``linear_algebra`` its results
        depend on numpy and scipy, and these must be the same where it runs.
    guard : callable, optional
        Called once in each process, before the function.

    Raises
    ------
    ClusterError
        When it does not pickle.
    """
    import cloudpickle

    for name, module in list(sys.modules.items()):
        # A model from a file of the user's: no worker has that module.
        if name.startswith("_driftwalk_"):
            cloudpickle.register_pickle_by_value(module)
    linear_algebra = ("numpy", "scipy") if getattr(function, "linear_algebra", False) else ()
    try:
        content = cloudpickle.dumps(function)
    except Exception as error:
        raise ClusterError(
            f"this work cannot be sent to workers: {error}; run it without a cluster"
        ) from error
    token = hashlib.sha256(content).hexdigest()
    return Parcel(token, content, package_versions(("driftwalk", *linear_algebra)), guard)


def run_unit(parcel: Parcel, unit: WorkUnit) -> Answer:
    """Run a function that has travelled, on a worker.

    Raises
    ------
    ClusterError
        When the worker has another version of a package that the result depends on, or does not
        pass the guard.
    """
    refuse_others(parcel.versions, package_versions(parcel.versions), this_worker())
    if parcel.guard is not None and parcel.guard not in _passed:
        parcel.guard()
        _passed.add(parcel.guard)
    if parcel.token not in _ready:
        _ready[parcel.token] = pickle.loads(parcel.content)
        while len(_ready) > KEPT:
            _ready.popitem(last=False)
    _ready.move_to_end(parcel.token)
    began = time.perf_counter()
    found = _ready[parcel.token](unit)
    arrays = {name: np.asarray(values) for name, values in found.items()}
    return Answer(arrays, time.perf_counter() - began)


def this_worker() -> str:
    """Return how a worker calls itself in a message.

    Examples
    --------
    >>> this_worker().startswith("a worker on ")
    True
    """
    return f"a worker on {platform.node()}"


def refuse_others(wanted: Mapping[str, str], found: Mapping[str, str | None], who: str) -> None:
    """Raise where versions differ.

    Parameters
    ----------
    wanted, found : mapping of str to str
        Versions by package.
    who : str
        Who has found them, for the message.

    Raises
    ------
    ClusterError
        Names the package and both versions.

    Examples
    --------
    >>> refuse_others({"driftwalk": "0.1.0"}, {"driftwalk": "0.1.0"}, "a worker on node7")
    """
    for name, version in wanted.items():
        if found.get(name) != version:
            there = found.get(name) or "none"
            raise ClusterError(
                f"{who} has {name} {there}, this machine has {version}: install {name} {version} "
                "there, so that the numbers are the same"
            )


UnitFunction = Callable[["WorkUnit"], Mapping[str, "npt.NDArray[Any]"]]


@dataclass
class UnitCounts:
    """Units of the sweep that is under way, and of all sweeps.

    Attributes
    ----------
    done, total : int
        Of the present sweep.
    again : int
        Units that took long, and were handed to a second worker, in all sweeps.
    """

    done: int = 0
    total: int = 0
    again: int = 0


class WorkerExecutor(Executor):
    """An executor whose tasks run on the workers of a Dask cluster.

    Parameters
    ----------
    client : distributed.Client
        Of the cluster.
    guard : callable, optional
        Called once in every process before its first unit; raises `ClusterError` where that must
        not compute.

    Attributes
    ----------
    units : UnitCounts
        What has been done.
    """

    def __init__(self, client: Any, guard: Guard | None = None) -> None:
        self.client = client
        self.units = UnitCounts()
        self._guard = guard
        self._executor = client.get_executor(pure=False)
        self._parcels: OrderedDict[str, Any] = OrderedDict()
        self._submitted = 0
        self._counted = (-float("inf"), 0)

    @property
    def workers(self) -> int:
        """How many workers there are; counted at most once a second."""
        when, count = self._counted
        if time.monotonic() - when > 1.0:
            count = len(self.client.scheduler_info(n_workers=-1)["workers"])
            self._counted = (time.monotonic(), count)
        return count

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Have a function called by a worker."""
        future: Future[Any] = self._executor.submit(fn, *args, **kwargs)
        return future

    def sent(self, function: UnitFunction) -> Any:
        """Return the function of a sweep as what workers fetch: the same one twice is one."""
        parcel = packed(function, self._guard)
        if parcel.token not in self._parcels:
            # A task, unlike data that is scattered, is made again when all who held it have died.
            with warnings.catch_warnings():
                # A recording and a flow are some MB: sent once, they are no large graph.
                warnings.filterwarnings("ignore", message="Sending large graph")
                self._parcels[parcel.token] = self.client.submit(
                    _as_it_is, parcel, key=f"driftwalk-function-{parcel.token}", pure=False
                )
            while len(self._parcels) > KEPT:
                self._parcels.popitem(last=False)
        self._parcels.move_to_end(parcel.token)
        return self._parcels[parcel.token]

    def run(self, parcel: Any, unit: WorkUnit) -> Future[Answer]:
        """Have a unit computed with a function that was sent."""
        self._submitted += 1
        key = f"driftwalk-unit-{unit.id}-{parcel.key[-8:]}-{self._submitted}"
        future: Future[Answer] = self._executor.submit(run_unit, parcel, unit, key=key, pure=False)
        return future


def _as_it_is(parcel: Any) -> Any:
    return parcel


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
    """Hands units to threads or processes of this machine."""

    def __init__(self, executor: Executor, function: UnitFunction) -> None:
        self._executor, self._function = executor, function
        self.units = UnitCounts()
        self.seconds: list[float] = []
        """Durations of units, where workers report them: others are not slower than each other."""

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

    def lost(self, future: UnitFuture) -> bool:
        """Whether a unit was with several workers that ended, so that none takes it."""
        return not future.cancelled() and is_lost(future.exception())

    def slow(self, age_s: float) -> bool:
        """Return whether a unit of this age should be handed out again."""
        if not self.seconds:
            return False
        # It may have waited for those that its worker got before.
        return age_s > max(
            (HANDOUT.for_each_worker - 1 + HANDOUT.slow) * median(self.seconds), HANDOUT.slow_s
        )


class _OnWorkers(Handout):
    """Hands units to workers elsewhere: they may be slow, go and come."""

    def __init__(self, executor: WorkerExecutor, function: UnitFunction) -> None:
        super().__init__(executor, function)
        self.units = executor.units
        self._workers, self._parcel = executor, executor.sent(function)

    @property
    def width(self) -> int:
        return HANDOUT.for_each_worker * max(self._workers.workers, 1)

    def submit(self, unit: WorkUnit) -> UnitFuture:
        return self._workers.run(self._parcel, unit)

    def result(self, future: UnitFuture) -> Found:
        answer: Answer = future.result()
        self.seconds.append(answer.seconds)
        return answer.arrays


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


LINEAR_ALGEBRA_THREADS: Final = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)


@contextmanager
def single_threaded_processes(count: int) -> Iterator[ProcessPoolExecutor]:
    """Give an executor of `count` processes whose linear algebra has one thread each.

    Results then have the same bits whatever the number of processes. The processes end with the
    block, also when it is left by an error or when this process is killed; Ctrl-C is for this
    process alone.

    Parameters
    ----------
    count : int
        Number of processes, at least 1.

    Yields
    ------
    concurrent.futures.ProcessPoolExecutor
        Functions and their arguments must pickle. A script that comes here needs
        ``if __name__ == "__main__":`` around what it does, as for every use of processes.

    Examples
    --------
    >>> with single_threaded_processes(2) as executor:  # doctest: +SKIP
    ...     list(executor.map(abs, [-1, 2]))
    [1, 2]
    """
    import multiprocessing

    context = multiprocessing.get_context("spawn")
    reader, writer = context.Pipe(duplex=False)
    with _environment(dict.fromkeys(LINEAR_ALGEBRA_THREADS, "1")):
        executor = ProcessPoolExecutor(
            count, mp_context=context, initializer=_begin, initargs=(reader,)
        )
        try:
            yield executor
            executor.shutdown()
        except BaseException:
            executor.shutdown(wait=False, cancel_futures=True)
            raise
        finally:
            writer.close()
            reader.close()


@contextmanager
def _environment(values: dict[str, str]) -> Iterator[None]:
    """Set variables of the environment, which processes inherit; restore them after."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _begin(alive: Connection) -> None:
    """Leave Ctrl-C to the parent, and end when its end of the pipe is closed or it is dead."""
    import signal
    import threading

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(alive,), daemon=True).start()


def _end_with(alive: Any) -> None:
    try:
        alive.poll(None)
    finally:
        os._exit(1)
