"""Run any function over the units of a sweep, skip what is done, keep what gets done.

`driftwalk.core.files.shards` defines the files of a store on disk.
"""

from __future__ import annotations

import contextlib
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, as_completed, wait
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import ClusterError, DriftwalkError, InputError
from driftwalk.core.files.shards import Arrays, Unit, UnitT
from driftwalk.core.progress import Progress, ignore_progress
from driftwalk.sweep.design import WorkUnit
from driftwalk.sweep.workers import HANDOUT, Handout, UnitFunction, UnitFuture, handout, is_lost


class Store(Protocol):
    """Interface that `run_sweep` needs of a store; `ShardStore` is the one on disk."""

    def missing(self, units: Iterable[UnitT]) -> list[UnitT]:
        """Return the units that have no result yet, in their order."""

    def write(self, unit: Unit, arrays: Mapping[str, npt.NDArray[Any]]) -> None:
        """Keep what a unit gave."""

    def read(self, unit: Unit) -> Arrays:
        """Return what was kept for a unit."""


class MemoryStore:
    """The results of a sweep in memory, gone with the process.

    Examples
    --------
    >>> MemoryStore().missing([])
    []
    """

    def __init__(self) -> None:
        self._results: dict[str, Arrays] = {}

    def missing(self, units: Iterable[UnitT]) -> list[UnitT]:
        """Return the units that have no result yet, in their order."""
        return [unit for unit in units if unit.id not in self._results]

    def write(self, unit: Unit, arrays: Mapping[str, npt.NDArray[Any]]) -> None:
        """Keep what a unit gave; what is kept already stays."""
        self._results.setdefault(unit.id, {name: np.array(a) for name, a in arrays.items()})

    def read(self, unit: Unit) -> Arrays:
        """Return what was kept for a unit."""
        return dict(self._results[unit.id])


def collect(store: Store, units: Iterable[Unit]) -> Arrays:
    """Join the results of units along their first dimension, in the order of the units.

    Parameters
    ----------
    store : Store
        Where the results are.
    units : iterable of Unit
        The units, each with a result in the store.

    Returns
    -------
    dict of str to numpy.ndarray
        Shape (settings, ...) each.

    Raises
    ------
    InputError
        When there is no unit, or a unit has other arrays, types or trailing shapes than the first.
    RunDirectoryError
        When a unit's result is absent or damaged.

    Examples
    --------
    >>> collect(store, units)["ks_distance"].shape  # doctest: +SKIP
    (1681, 4)
    """
    results = [(unit.id, store.read(unit)) for unit in units]
    if not results:
        raise InputError("a sweep needs at least one work unit, got none")
    first_id, first = results[0]
    for unit_id, arrays in results[1:]:
        if _form(arrays) != _form(first):
            raise InputError(
                f"unit {unit_id} gave {_form(arrays)}, unit {first_id} gave {_form(first)}; "
                "expected the same names, types and shapes of one setting"
            )
    return {name: np.concatenate([arrays[name] for _, arrays in results]) for name in first}


def _form(arrays: Arrays) -> dict[str, str]:
    return {name: f"{a.dtype}{list(a.shape[1:])}" for name, a in sorted(arrays.items())}


class SweepError(RuntimeError):
    """The function of a sweep failed on a unit; the cause is the error that it raised.

    Attributes
    ----------
    unit_id : str
        The unit.
    """

    def __init__(self, message: str, *, unit_id: str) -> None:
        super().__init__(message)
        self.unit_id = unit_id


def run_sweep(
    function: UnitFunction,
    units: Sequence[WorkUnit],
    *,
    store: Store | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Arrays:
    """Compute every unit that a store lacks, and return the results of all, in order.

    The result depends on the function and the units alone: not on the executor, nor on the order
    in which units complete, nor on how often the sweep was interrupted.

    Parameters
    ----------
    function : callable
        Takes a `WorkUnit`; returns arrays by name, each with one entry per setting of the unit
        along its first dimension. Two calls with one unit must give the same bits: take random
        numbers from an address (seed, trial, replicate), not from a generator that moves on.
        A failed simulation is data (a status); an error ends the sweep.
    units : sequence of WorkUnit
        As from ``design.units(64)``; ids must differ.
    store : Store, optional
        Where results are kept as soon as they are there, by this process alone; memory when left
        out.
    executor : concurrent.futures.Executor, optional
        Workers: threads, processes (the function and its results must pickle), that of
        `driftwalk.cluster.connect`, or ``client.get_executor()`` of Dask, where the function
        travels once to each worker. One unit after the other in this thread when left out. It is
        not shut down.
    progress : callable, optional
        Called with the number of settings that are done and of all, at the start and after every
        unit.

    Returns
    -------
    dict of str to numpy.ndarray
        Shape (settings, ...) each; see `Design.unstack`.

    Raises
    ------
    SweepError
        When the function fails or returns something else; names the unit. Units that were under
        way are completed and kept, those that had not begun are cancelled.
    KeyboardInterrupt
        On Ctrl-C, at once; what had been completed is kept.
    ClusterError
        When the scheduler of the workers is gone, or a worker has another version of driftwalk;
        what had been completed is kept.
    RunDirectoryError
        When a result cannot be stored.

    Examples
    --------
    >>> from driftwalk.sweep import grid
    >>> units = grid(force_std=[0.0, 1e-3, 2e-3]).units(2)
    >>> run_sweep(lambda unit: {"variance": unit.settings["force_std"] ** 2}, units)
    {'variance': array([0.e+00, 1.e-06, 4.e-06])}
    """
    _require_distinct(units)
    kept: Store = MemoryStore() if store is None else store
    missing = kept.missing(units)
    tally = _Tally(units, missing, progress)
    if executor is None:
        for unit in missing:
            _keep(unit, partial(function, unit), kept, tally)
    else:
        _Elsewhere(handout(executor, function), missing, kept, tally).run()
    return collect(kept, units)


@dataclass
class SweepSeries:
    """Sweeps one after the other, each with a store of its own and all with one progress.

    Attributes
    ----------
    total : int
        Settings of all sweeps.
    store : callable or None
        Returns the store of a sweep by its name.
    executor, progress
        As for `run_sweep`.
    done : int
        Settings of the sweeps so far.
    """

    total: int
    store: Callable[[str], Store | None] | None
    executor: Executor | None
    progress: Progress | None
    done: int = 0

    def run(self, name: str, function: UnitFunction, units: Sequence[WorkUnit]) -> Arrays:
        """Return the results of the next sweep."""
        before = self.done
        self.done += sum(unit.size for unit in units)
        return run_sweep(
            function,
            units,
            store=None if self.store is None else self.store(name),
            executor=self.executor,
            progress=lambda done, _: (self.progress or ignore_progress)(before + done, self.total),
        )


class _Tally:
    """Counts finished units and reports progress."""

    def __init__(
        self, units: Sequence[WorkUnit], missing: Sequence[WorkUnit], progress: Progress | None
    ) -> None:
        self.units = len(units)
        self.units_done = len(units) - len(missing)
        self._total = sum(unit.size for unit in units)
        self._done = self._total - sum(unit.size for unit in missing)
        self._progress = progress
        self._tell()

    def add(self, unit: WorkUnit) -> None:
        self.units_done += 1
        self._done += unit.size
        self._tell()

    def _tell(self) -> None:
        if self._progress is not None:
            self._progress(self._done, self._total)


class _Handed(NamedTuple):
    """A unit that was handed out."""

    unit: WorkUnit
    since: float
    """When [s]."""
    again: bool
    """Whether it is under way elsewhere, too."""
    alone: bool
    """Whether no other unit is under way."""


class _Elsewhere:
    """Hands out units in a window, keeps what comes back, and hands out slow ones again.

    A worker holds a few units, and when it ends all of them are suspected. So those that were with
    too many such workers are handed out once more when all others are done, one at a time: one that
    ends its workers then is at fault.
    """

    def __init__(
        self, hand: Handout, missing: Sequence[WorkUnit], store: Store, tally: _Tally
    ) -> None:
        self._hand, self._store, self._tally = hand, store, tally
        self._queue = deque(missing)
        self._suspects: deque[WorkUnit] = deque()
        self._waiting: dict[UnitFuture, _Handed] = {}
        self._left = {unit.id for unit in missing}

    def run(self) -> None:
        """Have all units computed."""
        units = self._hand.units
        units.done, units.total = self._tally.units_done, self._tally.units
        try:
            while self._left:
                self._hand_out_some()
                done, _ = wait(self._waiting, timeout=1.0, return_when=FIRST_COMPLETED)
                for future in done:
                    self._take(self._waiting.pop(future), future)
                if not self._queue:
                    self._hand_out_slow_ones()
            self._cancel_rest()
        except SweepError:
            self._keep_rest(as_completed(self._cancel_rest()))
            raise
        except BaseException:
            # Ctrl-C and a full disk: nothing is waited for.
            self._keep_rest([future for future in self._cancel_rest() if future.done()])
            raise

    def _hand_out(self, unit: WorkUnit, *, again: bool = False, alone: bool = False) -> None:
        self._waiting[self._hand.submit(unit)] = _Handed(unit, time.monotonic(), again, alone)

    def _hand_out_some(self) -> None:
        """Fill the window; hand out a suspect where no other unit is left."""
        while self._queue and len(self._waiting) < self._hand.width:
            self._hand_out(self._queue.popleft())
        if not self._waiting:
            unit = self._suspects.popleft()
            if unit.id in self._left:
                self._hand_out(unit, alone=True)

    def _hand_out_slow_ones(self) -> None:
        """Hand out again what takes long and is under way once, to workers with nothing to do."""
        now = time.monotonic()
        handed = list(self._waiting.values())
        once = {one.unit.id for one in handed} - {one.unit.id for one in handed if one.again}
        for one in handed:
            known = one.unit.id in self._left and one.unit.id in once
            if known and not one.alone and self._hand.slow(now - one.since):
                self._hand_out(one.unit, again=True)
                self._hand.units.again += 1

    def _take(self, handed: _Handed, future: UnitFuture) -> None:
        """Keep what a unit gave, or suspect it."""
        unit = handed.unit
        if unit.id not in self._left:
            # It was handed out twice, and the other answer came first.
            return
        if self._hand.lost(future) and not handed.alone:
            self._suspect(unit)
            return
        # Before: what is told of progress names the units.
        self._hand.units.done = self._tally.units_done + 1
        _keep(unit, partial(self._hand.result, future), self._store, self._tally)
        self._left.discard(unit.id)

    def _suspect(self, unit: WorkUnit) -> None:
        if unit not in self._suspects:
            self._suspects.append(unit)
        # A unit that ends its workers makes suspects of as many as a worker holds; more
        # have another cause.
        if len(self._suspects) > 2 * HANDOUT.for_each_worker:
            first = self._suspects[0].id
            raise SweepError(
                f"{len(self._suspects)} units, the first of which is {first}, were each with "
                "several workers that ended (too little memory, or jobs that were cancelled): "
                "their logs say why; finished units are kept",
                unit_id=first,
            )

    def _cancel_rest(self) -> list[UnitFuture]:
        """Cancel what has not begun; return what has."""
        return [future for future in self._waiting if not future.cancel()]

    def _keep_rest(self, futures: Iterable[UnitFuture]) -> None:
        for future in futures:
            # The error that is under way is the one to report.
            with contextlib.suppress(SweepError, DriftwalkError):
                self._take(self._waiting[future], future)


def _keep(
    unit: WorkUnit,
    compute: Callable[[], Mapping[str, npt.NDArray[Any]]],
    store: Store,
    tally: _Tally,
) -> None:
    try:
        arrays = _checked(compute(), unit)
    except ClusterError:
        raise
    except CancelledError as error:
        raise ClusterError(
            "the scheduler of the workers is gone; what was finished is kept, and the same command "
            "continues"
        ) from error
    except Exception as error:
        settings = ", ".join(f"{name} = {values[0]}" for name, values in unit.settings.items())
        raise SweepError(
            f"unit {unit.id}, which begins with {settings}, {_failure_text(error)}; finished units "
            "are kept",
            unit_id=unit.id,
        ) from error
    store.write(unit, arrays)
    tally.add(unit)


def _failure_text(error: Exception) -> str:
    """Return what a unit failed by."""
    if is_lost(error):
        deaths = int(getattr(error, "allowed_failures", 0)) + 1
        return (
            f"ended all {deaths} workers that it met (too little memory, or a crash): their logs "
            "say why"
        )
    return f"failed: {type(error).__name__}: {error}"


def _checked(result: Mapping[str, npt.NDArray[Any]], unit: WorkUnit) -> Arrays:
    """Return what a unit gave as arrays, each with one entry per setting."""
    if not isinstance(result, Mapping):
        raise TypeError(f"expected arrays by name, got {type(result).__name__}")
    arrays = {name: np.asarray(values) for name, values in result.items()}
    for name, array in arrays.items():
        if array.shape[:1] != (unit.size,):
            raise ValueError(
                f"array '{name}': expected {unit.size} entries, one per setting, got shape "
                f"{array.shape}"
            )
    return arrays


def _require_distinct(units: Sequence[WorkUnit]) -> None:
    ids = [unit.id for unit in units]
    if len(set(ids)) != len(ids):
        twice = next(unit_id for unit_id in ids if ids.count(unit_id) > 1)
        raise InputError(f"work unit {twice} is given twice; every unit must be given once")
