"""A search whose calls are kept: what is read again, and a search that was interrupted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from driftwalk.calibration.evolution import Budget, CachedObjective, SearchResult, search_minimum
from driftwalk.sweep import MemoryStore, ShardStore, Store, SweepError

QUICK = Budget(design=32, starts=2, short=6, long=8)


class Counted:
    """A noisy bowl that counts its calls, and fails after some of them."""

    def __init__(self, fails_after: int | None = None) -> None:
        self.calls: list[tuple[int, int, int]] = []
        self.fails_after = fails_after

    def __call__(self, settings: np.ndarray, first: int, replicates: int) -> np.ndarray:
        if self.fails_after is not None and len(self.calls) >= self.fails_after:
            raise RuntimeError("the machine was switched off")
        self.calls.append((first, len(settings), replicates))
        noise = [np.random.default_rng([4, first + k]).normal() for k in range(len(settings))]
        return ((settings - [0.3, 0.6, 0.4]) ** 2).sum(axis=1) + 0.05 * np.array(noise)


def store_in(folder: Path) -> ShardStore:
    return ShardStore(folder, fingerprint={"seed": 1})


def search(objective: Counted, store: Store | None) -> SearchResult:
    return search_minimum(CachedObjective(objective, store), 3, budget=QUICK, seed=1)


def assert_same(first: SearchResult, second: SearchResult) -> None:
    for one, other in zip(first, second, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.fixture(scope="module")
def plain() -> tuple[SearchResult, Counted]:
    """Return the answer without anything kept, and its objective."""
    objective = Counted()
    return search_minimum(objective, 3, budget=QUICK, seed=1), objective


@pytest.mark.parametrize("kind", ["nothing", "memory", "disk"])
def test_keeping_changes_no_answer(kind, plain, tmp_path):
    stores = {"nothing": None, "memory": MemoryStore(), "disk": store_in(tmp_path)}
    objective = Counted()
    assert_same(search(objective, stores[kind]), plain[0])
    assert objective.calls == plain[1].calls


def test_a_call_is_computed_once_and_read_again(tmp_path):
    settings = np.random.default_rng(2).random((5, 3))
    objective = Counted()
    kept = CachedObjective(objective, store_in(tmp_path))
    first = kept(settings, 40, 2)
    again = kept(settings, 40, 2)
    another = CachedObjective(Counted(fails_after=0), store_in(tmp_path))(settings, 40, 2)
    np.testing.assert_array_equal(first, again)
    np.testing.assert_array_equal(first, another)
    assert objective.calls == [(40, 5, 2)]
    later = kept(settings, 45, 2)
    assert objective.calls == [(40, 5, 2), (45, 5, 2)]
    assert not np.array_equal(first, later)


def test_a_search_that_is_made_again_computes_nothing(tmp_path, plain):
    search(Counted(), store_in(tmp_path))
    none = Counted(fails_after=0)
    assert_same(search(none, store_in(tmp_path)), plain[0])
    assert none.calls == []


@pytest.mark.parametrize("calls", [0, 1, 5, 9, 20])
def test_an_interrupted_search_goes_on_where_it_was(calls, tmp_path, plain):
    """After the design, in a short search, between two searches, in the long one."""
    whole, every_call = plain[0], plain[1].calls
    assert calls < len(every_call)
    broken = Counted(fails_after=calls)
    with pytest.raises(SweepError, match="the machine was switched off"):
        search(broken, store_in(tmp_path))
    assert broken.calls == every_call[:calls]
    rest = Counted()
    assert_same(search(rest, store_in(tmp_path)), whole)
    assert rest.calls == every_call[calls:]


def test_without_a_store_everything_is_computed_again():
    objective = Counted()
    kept = CachedObjective(objective, None)
    for _ in range(2):
        kept(np.full((1, 3), 0.5), 0, 1)
    assert len(objective.calls) == 2
