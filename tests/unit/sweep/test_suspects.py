"""Units whose workers end: which one is at fault, on synthetic workers that hold three units each.

The real ones are in tests/integration/cli/test_cluster.py.
"""

from __future__ import annotations

from collections import Counter
from concurrent.futures import Executor, Future
from typing import Any

import numpy as np
import pytest

from driftwalk.sweep import MemoryStore, SweepError, WorkUnit, grid, run_sweep
from driftwalk.sweep.workers import HANDOUT, UnitCounts, is_lost

UNITS = grid(a=np.arange(60.0)).units(1)
ENDED = 4


class KilledWorker(Exception):
    """By the name that Dask gives it."""

    allowed_failures = ENDED - 1


class Workers:
    """A scheduler as Dask's: a unit that was with four workers when they ended is given up.

    A worker that computes a unit of `fatal` ends. All units that it holds count that, and are dealt
    again.
    """

    def __init__(self, fatal: set[int], workers: int, seed: int) -> None:
        self.width = HANDOUT.for_each_worker * workers
        self.seen: Counter[int] = Counter()
        self.alone: list[int] = []
        self._fatal = fatal
        self._random = np.random.default_rng(seed)
        self.units = UnitCounts()
        self._under_way: list[tuple[WorkUnit, Future[Any]]] = []
        self._ended: Counter[Future[Any]] = Counter()

    def submit(self, unit: WorkUnit) -> Future[Any]:
        future: Future[Any] = Future()
        self._under_way.append((unit, future))
        return future

    def work(self) -> None:
        """Have every worker compute the first of the units that it gets."""
        if len(self._under_way) == 1:
            self.alone.append(self._under_way[0][0].start)
        order = self._random.permutation(len(self._under_way))
        held = [self._under_way[k] for k in order]
        for first in range(0, len(held), HANDOUT.for_each_worker):
            own = held[first : first + HANDOUT.for_each_worker]
            unit, future = own[0]
            self.seen[unit.start] += 1
            if unit.start in self._fatal:
                for _, other in own:
                    self._ended[other] += 1
                    if self._ended[other] == ENDED:
                        other.set_exception(KilledWorker())
            else:
                future.set_result({"square": unit.settings["a"] ** 2})
        self._under_way = [one for one in self._under_way if not one[1].done()]

    def lost(self, future: Future[Any], /) -> bool:
        return is_lost(future.exception())

    def result(self, future: Future[Any], /) -> Any:
        return future.result()

    def slow(self, _age_s: float, /) -> bool:
        return False


def swept(
    monkeypatch: pytest.MonkeyPatch, fatal: set[int], *, workers: int = 4, seed: int = 0
) -> tuple[Workers, MemoryStore, SweepError | None]:
    """Run a sweep on such workers."""
    on, store = Workers(fatal, workers, seed), MemoryStore()

    def waits(waiting: Any, **_: object) -> tuple[list[Future[Any]], None]:
        on.work()
        return [future for future in waiting if future.done()], None

    monkeypatch.setattr("driftwalk.sweep.run.handout", lambda _executor, _function: on)
    monkeypatch.setattr("driftwalk.sweep.run.wait", waits)
    monkeypatch.setattr("driftwalk.sweep.run.as_completed", lambda futures: iter(futures))
    monkeypatch.setattr("driftwalk.sweep.run._Elsewhere._cancel_rest", lambda _: [])
    try:
        run_sweep(lambda unit: {}, UNITS, store=store, executor=Executor())
    except SweepError as error:
        return on, store, error
    return on, store, None


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("workers", [1, 2, 5])
def test_the_unit_that_ends_its_workers_is_named_and_no_other(
    monkeypatch: pytest.MonkeyPatch, workers: int, seed: int
) -> None:
    guilty = 7 * seed % 60
    on, store, error = swept(monkeypatch, {guilty}, workers=workers, seed=seed)
    assert error is not None
    assert error.unit_id == UNITS[guilty].id
    assert f"unit {error.unit_id}, which begins with a = {guilty:.1f}, ended all 4" in str(error)
    assert on.alone[-1] == guilty
    # It makes suspects of two others at most, which wait for their turn.
    assert len(store.missing(UNITS)) <= HANDOUT.for_each_worker
    assert all(count == 1 for unit, count in on.seen.items() if unit != guilty)


def test_where_many_units_end_their_workers_the_run_does_not_go_through_all(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    on, _, error = swept(monkeypatch, set(range(60)))
    assert error is not None
    assert "7 units, the first of which is" in str(error)
    assert on.seen.total() < 40


def test_without_such_units_all_are_done(monkeypatch: pytest.MonkeyPatch) -> None:
    _, store, error = swept(monkeypatch, set())
    assert error is None
    assert store.missing(UNITS) == []
