"""Sweeps: the same arrays in every way of running them, and nothing done is lost."""

from __future__ import annotations

import multiprocessing
import threading
import time
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from driftwalk.core.errors import InputError, RunDirectoryError
from driftwalk.sweep import ShardStore, SweepError, WorkUnit, grid, run_sweep

DESIGN = grid(drag_coefficient=[0.1, 0.5, 0.9], force_std=[0.0, 1e-3, 2e-3, 3e-3])
UNITS = DESIGN.units(2)
Arrays = dict[str, npt.NDArray[np.generic]]


def noisy(unit: WorkUnit) -> Arrays:
    """Random numbers with an address, as a simulation draws them."""
    draws = [np.random.default_rng([7, i]).normal(size=4) for i in range(unit.start, unit.stop)]
    return {
        "mean": unit.settings["drag_coefficient"] + np.array(draws).mean(axis=1),
        "draws": np.array(draws) * unit.settings["force_std"][:, None],
    }


def slow_first(unit: WorkUnit) -> Arrays:
    time.sleep(0.03 if unit.start == 0 else 0.0)
    return noisy(unit)


def fails_in_the_middle(unit: WorkUnit) -> Arrays:
    if unit.start == 4:
        raise ZeroDivisionError("no block")
    return noisy(unit)


def same(one: Arrays, other: Arrays) -> bool:
    return one.keys() == other.keys() and all(
        one[name].dtype == other[name].dtype
        and one[name].shape == other[name].shape
        and one[name].tobytes() == other[name].tobytes()
        for name in one
    )


EXPECTED = noisy(WorkUnit(0, DESIGN.size, DESIGN.settings()))


def executor_of(kind: str) -> Executor:
    if kind == "threads":
        return ThreadPoolExecutor(3)
    # A fork of a process with threads may hang; spawned workers import this module by its name.
    context = multiprocessing.get_context("forkserver")
    return ProcessPoolExecutor(2, mp_context=context)


def test_serial_run_matches_one_call() -> None:
    assert same(run_sweep(noisy, UNITS), EXPECTED)


@pytest.mark.parametrize("size", [1, 5, 12, 100])
def test_size_of_units_does_not_matter(size: int) -> None:
    assert same(run_sweep(noisy, DESIGN.units(size)), EXPECTED)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["threads", "processes"])
def test_executors_give_the_same_arrays(kind: str, tmp_path: Path) -> None:
    store = ShardStore(tmp_path, fingerprint={})
    with executor_of(kind) as executor:
        assert same(run_sweep(slow_first, UNITS, store=store, executor=executor), EXPECTED)
    assert store.missing(UNITS) == []


def test_order_of_completion_does_not_matter() -> None:
    order: list[int] = []
    gates = {unit.start: threading.Event() for unit in UNITS}
    gates[UNITS[-1].start].set()

    def backwards(unit: WorkUnit) -> Arrays:
        assert gates[unit.start].wait(60)
        order.append(unit.start)
        if unit.start > 0:
            gates[unit.start - 2].set()
        return noisy(unit)

    with ThreadPoolExecutor(len(UNITS)) as executor:
        assert same(run_sweep(backwards, UNITS, executor=executor), EXPECTED)
    assert order == sorted(order, reverse=True)


def test_what_is_done_is_not_done_again(tmp_path: Path) -> None:
    store = ShardStore(tmp_path, fingerprint={})
    run_sweep(noisy, UNITS[:4], store=store)
    (tmp_path / f"{UNITS[1].id}.npz").write_bytes(b"damaged")
    calls: list[str] = []

    def counted(unit: WorkUnit) -> Arrays:
        calls.append(unit.id)
        return noisy(unit)

    again = ShardStore(tmp_path, fingerprint={})
    assert same(run_sweep(counted, UNITS, store=again), EXPECTED)
    assert calls == [UNITS[1].id, UNITS[4].id, UNITS[5].id]


def test_progress_counts_settings(tmp_path: Path) -> None:
    store = ShardStore(tmp_path, fingerprint={})
    run_sweep(noisy, UNITS[:2], store=store)
    seen: list[tuple[int, int]] = []
    run_sweep(noisy, UNITS, store=store, progress=lambda done, total: seen.append((done, total)))
    assert seen == [(done, 12) for done in (4, 6, 8, 10, 12)]


@pytest.mark.parametrize("kind", ["serial", "threads", "processes"])
def test_failing_unit_is_named_and_the_rest_kept(kind: str, tmp_path: Path) -> None:
    store = ShardStore(tmp_path, fingerprint={})
    executor = None if kind == "serial" else executor_of(kind)
    with pytest.raises(SweepError, match=r"drag_coefficient = 0\.5, force_std = 0\.0") as caught:
        run_sweep(fails_in_the_middle, UNITS, store=store, executor=executor)
    if executor is not None:
        executor.shutdown()
    assert caught.value.unit_id == UNITS[2].id
    assert f"unit {UNITS[2].id}" in str(caught.value)
    assert isinstance(caught.value.__cause__, ZeroDivisionError)
    assert not store.has(UNITS[2])
    if kind == "serial":
        assert store.missing(UNITS) == UNITS[2:]
    assert same(run_sweep(noisy, UNITS, store=store), EXPECTED)


def test_units_under_way_are_kept_and_waiting_ones_cancelled(tmp_path: Path) -> None:
    """Whoever computes goes on until the last unit has been cancelled, however late that is."""
    store = ShardStore(tmp_path, fingerprint={})
    under_way, cancelled = threading.Event(), threading.Event()
    started: list[int] = []

    class Pool(ThreadPoolExecutor):
        def submit(self, function: Any, *words: Any) -> Future[Any]:
            future = super().submit(function, *words)
            if words[0] == UNITS[-1]:
                future.add_done_callback(lambda done: done.cancelled() and cancelled.set())
            return future

    def function(unit: WorkUnit) -> Arrays:
        started.append(unit.start)
        if unit.start == 2:
            assert under_way.wait(60)
            raise ValueError("fault")
        under_way.set()
        assert cancelled.wait(60)
        return noisy(unit)

    with Pool(2) as executor, pytest.raises(SweepError, match="fault"):
        run_sweep(function, UNITS, store=store, executor=executor)
    assert store.has(UNITS[0])
    assert UNITS[-1].start not in started


@pytest.mark.parametrize("kind", ["serial", "threads"])
def test_interrupt_keeps_what_is_done(kind: str, tmp_path: Path) -> None:
    store = ShardStore(tmp_path, fingerprint={})

    def interrupted(done: int, total: int) -> None:
        if done == 6:
            raise KeyboardInterrupt

    executor = None if kind == "serial" else ThreadPoolExecutor(1)
    with pytest.raises(KeyboardInterrupt):
        run_sweep(noisy, UNITS, store=store, executor=executor, progress=interrupted)
    if executor is not None:
        executor.shutdown()
    assert len(store.missing(UNITS)) <= 3
    assert all(store.has(unit) for unit in UNITS[:3])
    assert same(run_sweep(noisy, UNITS, store=store), EXPECTED)


def test_store_that_cannot_be_written_says_so(tmp_path: Path) -> None:
    store = ShardStore(tmp_path / "shards", fingerprint={})
    (tmp_path / "shards").rename(tmp_path / "gone")
    with pytest.raises(RunDirectoryError, match="its folder does not exist"):
        run_sweep(noisy, UNITS, store=store)


@pytest.mark.parametrize(
    ("result", "message"),
    [
        ({"a": np.zeros(3)}, "expected 2 entries, one per setting"),
        ({"a": 1.0}, "expected 2 entries"),
        ([1.0], "expected arrays by name, got list"),
    ],
)
def test_wrong_results_name_the_unit(result: object, message: str) -> None:
    with pytest.raises(SweepError, match=f"unit {UNITS[0].id}.*{message}"):
        run_sweep(lambda unit: result, UNITS)  # type: ignore[arg-type, return-value]


def test_unit_given_twice() -> None:
    with pytest.raises(InputError, match=f"{UNITS[0].id} is given twice"):
        run_sweep(noisy, [*UNITS, UNITS[0]])
