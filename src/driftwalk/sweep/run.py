"""Run any function over the units of a sweep, skip what is done, keep what gets done."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor, Future, as_completed
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import DriftwalkError, InputError
from driftwalk.core.shards import Arrays
from driftwalk.sweep.design import WorkUnit
from driftwalk.sweep.store import MemoryStore, Store, collect

UnitFuture = Future[Mapping[str, npt.NDArray[Any]]]
UnitFunction = Callable[[WorkUnit], Mapping[str, npt.NDArray[Any]]]
Progress = Callable[[int, int], None]


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
        Workers: threads, processes (the function and its results must pickle), Dask. One
        unit after the other in this thread when left out. It is not shut down.
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
        _run_in(executor, function, missing, kept, tally)
    return collect(kept, units)


class _Tally:
    """Counts what is done and tells it to whoever listens."""

    def __init__(
        self, units: Sequence[WorkUnit], missing: Sequence[WorkUnit], progress: Progress | None
    ) -> None:
        self._total = sum(unit.size for unit in units)
        self._done = self._total - sum(unit.size for unit in missing)
        self._progress = progress
        self._tell()

    def add(self, unit: WorkUnit) -> None:
        self._done += unit.size
        self._tell()

    def _tell(self) -> None:
        if self._progress is not None:
            self._progress(self._done, self._total)


def _run_in(
    executor: Executor,
    function: UnitFunction,
    missing: Sequence[WorkUnit],
    store: Store,
    tally: _Tally,
) -> None:
    waiting: dict[UnitFuture, WorkUnit] = {}
    try:
        for unit in missing:
            waiting[executor.submit(function, unit)] = unit
        for future in as_completed(list(waiting)):
            _keep(waiting[future], future.result, store, tally)
            del waiting[future]
    except SweepError:
        _keep_rest(waiting, as_completed(_cancel_rest(waiting)), store, tally)
        raise
    except BaseException:
        # Ctrl-C and a full disk: nothing is waited for.
        done = [future for future in _cancel_rest(waiting) if future.done()]
        _keep_rest(waiting, done, store, tally)
        raise


def _cancel_rest(waiting: Iterable[UnitFuture]) -> list[UnitFuture]:
    """Cancel what has not begun; return what has."""
    return [future for future in waiting if not future.cancel()]


def _keep_rest(
    waiting: Mapping[UnitFuture, WorkUnit],
    futures: Iterable[UnitFuture],
    store: Store,
    tally: _Tally,
) -> None:
    for future in futures:
        # The error that is under way is the one to report.
        with contextlib.suppress(SweepError, DriftwalkError):
            _keep(waiting[future], future.result, store, tally)


def _keep(
    unit: WorkUnit,
    compute: Callable[[], Mapping[str, npt.NDArray[Any]]],
    store: Store,
    tally: _Tally,
) -> None:
    try:
        arrays = _checked(compute(), unit)
    except Exception as error:
        settings = ", ".join(f"{name} = {values[0]}" for name, values in unit.settings.items())
        raise SweepError(
            f"unit {unit.id}, which begins with {settings}, failed: "
            f"{type(error).__name__}: {error}; finished units are kept",
            unit_id=unit.id,
        ) from error
    store.write(unit, arrays)
    tally.add(unit)


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
