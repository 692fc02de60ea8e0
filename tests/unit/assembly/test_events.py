"""Replay of events, against runs made with complex numbers."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings, strategies as st
from lattice_runs import Run, random_run, raw_arrays, small_name

from driftwalk.assembly.lattice.events import ReplayedEvents, replay_events
from driftwalk.assembly.outcomes.distribution import class_at
from driftwalk.assembly.outcomes.outcome_classes import outcome_classes, sort_classes
from driftwalk.core.errors import InputError

Chirality = Literal["merged", "distinct"]


def replay(raw: dict[str, np.ndarray], chirality: Chirality = "merged") -> ReplayedEvents:
    names = ("event_count", "event_block", "event_face")
    rest: dict[str, Any] = {name: raw[name] for name in ("cell", "quarter", "assembly")}
    return replay_events(*(raw[name] for name in names), **rest, chirality=chirality)


def random_runs(blocks: int, count: int, seed: int, *, stop: float = 0.3) -> list[Run]:
    rng = np.random.default_rng(seed)
    return [random_run(blocks, rng, stop=stop) for _ in range(count)]


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("chirality", ["merged", "distinct"])
@pytest.mark.parametrize("blocks", [1, 2, 3, 4])
def test_small_worlds(blocks: int, chirality: Chirality) -> None:
    runs, mirror = random_runs(blocks, 300, blocks), chirality == "merged"
    made = replay(raw_arrays(runs, blocks), chirality)
    assert made.classes == outcome_classes(blocks, chirality=chirality)
    for number, run in enumerate(runs):
        count = len(run.blocks)
        assert made.event_assembly[number, :count].tolist() == [list(own) for own in run.labels]
        after = [world.small_class(mirror=mirror) for world in run.worlds]
        assert [made.classes[i] for i in made.event_class[number, :count]] == after[1:]
        assert made.classes[made.outcome[number]] == after[-1]
        for event, labels in enumerate(run.labels):
            before, later = run.worlds[event], run.worlds[event + 1]
            members = [
                *(before.assemblies[label] for label in labels),
                later.assemblies[min(labels)],
            ]
            shapes = [
                small_name([cell for cell, _ in group.values()], mirror=mirror) for group in members
            ]
            assert [made.shapes[i] for i in made.event_shape[number, event]] == shapes
        for padded in (made.event_assembly, made.event_shape, made.event_class):
            assert (padded[number, count:] == -1).all()


@pytest.mark.slow
@pytest.mark.parametrize("blocks", [7, 12, 64])
def test_larger_worlds(blocks: int) -> None:
    """Two worlds have one class exactly when they have the same multiset of forms."""
    runs = random_runs(blocks, 12, blocks, stop=1.0)
    made = replay(raw_arrays(runs, blocks))
    apart = made.classes.index("+".join("1" * blocks))
    seen: dict[Any, int] = {}
    for number, run in enumerate(runs):
        history = [apart, *made.event_class[number, : len(run.blocks)].tolist()]
        for world, found in zip(run.worlds, history, strict=True):
            key = tuple(sorted(world.forms(mirror=True).items()))
            assert seen.setdefault(key, found) == found
        assert made.outcome[number] == history[-1]
    assert len(set(seen.values())) == len(seen) > 12
    # Up to eight blocks all classes are listed, beyond that those that occurred.
    listed = outcome_classes(blocks) if blocks <= 8 else sort_classes(made.classes)
    assert made.classes == listed
    assert blocks <= 8 or len(listed) == len(seen)


@pytest.mark.slow
@settings(deadline=None)
@given(st.integers(2, 6), st.integers(0, 2**32))
def test_lattice_of_the_end_may_be_any(blocks: int, seed: int) -> None:
    """The cells at the end say the same when each assembly is turned and shifted."""
    rng = np.random.default_rng(seed)
    raw = raw_arrays([random_run(blocks, rng) for _ in range(5)], blocks)
    made = replay(raw)
    turn = rng.integers(0, 4, (5, blocks))[np.arange(5)[:, None], raw["assembly"]]
    shift = rng.integers(-9, 9, (5, blocks, 2))[np.arange(5)[:, None], raw["assembly"]]
    z = (raw["cell"][..., 0] + 1j * raw["cell"][..., 1]) * 1j**turn
    cell = np.stack([z.real, z.imag], axis=-1).round().astype(int) + shift
    other = replay({**raw, "cell": cell, "quarter": (raw["quarter"] + turn) % 4})
    assert (other.event_class == made.event_class).all()


@pytest.mark.slow
@settings(deadline=None)
@given(st.integers(2, 6), st.integers(0, 2**32))
def test_classes_do_not_depend_on_the_numbers_of_the_blocks(blocks: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    raw = raw_arrays([random_run(blocks, rng)], blocks)
    number = rng.permutation(blocks)  # block b is called number[b]
    back = np.argsort(number)
    label = raw["assembly"][0]
    lowest = np.array([min(number[label == own]) for own in label])
    renamed = {
        "event_count": raw["event_count"],
        "event_block": np.where(raw["event_block"] < 0, -1, number[raw["event_block"]]),
        "event_face": raw["event_face"],
        "cell": raw["cell"][:, back],
        "quarter": raw["quarter"][:, back],
        "assembly": lowest[back][None],
    }
    assert (replay(renamed).event_class == replay(raw).event_class).all()


def one_run() -> dict[str, np.ndarray]:
    """Return a run of three blocks in a row."""
    return {
        "event_count": np.array([2]),
        "event_block": np.array([[[0, 1], [1, 2]]]),
        "event_face": np.array([[[0, 2], [0, 2]]]),
        "cell": np.array([[(0, 0), (1, 0), (2, 0)]]),
        "quarter": np.array([[0, 0, 0]]),
        "assembly": np.array([[0, 0, 0]]),
    }


def test_a_row_of_three() -> None:
    made = replay(one_run())
    assert [made.classes[i] for i in made.event_class[0]] == ["2+1", "I3"]
    assert [[made.shapes[i] for i in parts] for parts in made.event_shape[0]] == [
        ["1", "1", "2"],
        ["2", "1", "I3"],
    ]


@pytest.mark.parametrize(
    ("name", "at", "value", "says"),
    [
        ("cell", (0, 2, 0), 1, "do not lead block 2"),
        ("cell", (0, 1, 0), -1, "do not lead block 1"),
        ("quarter", (0, 1), 2, "do not lead block 1"),
        ("assembly", (0, 2), 2, "do not lead block 2"),
        ("event_count", (0,), 1, "do not lead block 2"),
        ("event_count", (0,), 3, "3 events among 3 blocks"),
        ("event_count", (0,), -1, "-1 events"),
        ("event_block", (0, 1, 1), 0, "event 1: joins two blocks of one assembly"),
        ("event_block", (0, 1, 1), 3, "event 1: no block 3"),
        ("event_block", (0, 0, 1), -1, "event 0: no block -1"),
        ("event_face", (0, 1, 0), 4, "event 1: no face 4"),
        ("event_face", (0, 1, 0), 2, "event 1: puts two blocks into one cell"),
        ("event_face", (0, 1, 0), 1, "do not lead block 2"),
        ("event_face", (0, 1, 1), 1, "do not lead block 2"),
    ],
)
def test_a_contradiction_is_found(name: str, at: tuple[int, ...], value: int, says: str) -> None:
    raw = one_run()
    assert replay(raw).outcome.tolist() == [0]
    raw[name][at] = value
    with pytest.raises(InputError, match=says):
        replay(raw)


def test_the_run_of_a_contradiction_is_named() -> None:
    raw = {name: np.concatenate([values] * 3) for name, values in one_run().items()}
    raw["cell"][1, 2] = (1, 1)
    with pytest.raises(InputError, match="run 1: "):
        replay(raw)


def test_arrays_that_do_not_fit_together_are_refused() -> None:
    raw = one_run()
    with pytest.raises(InputError, match="do not fit together"):
        replay({**raw, "cell": raw["cell"][:, :2]})
    with pytest.raises(InputError, match="whole numbers"):
        replay({**raw, "cell": raw["cell"] + 0.5})


def test_no_runs_at_all() -> None:
    raw = {name: values[:0] for name, values in one_run().items()}
    assert replay(raw).outcome.shape == (0,)


@pytest.fixture
def assembly() -> xr.Dataset:
    """Three synthetic runs of two blocks and 10 s: they join at 2 s, never, and lose numbers."""
    return xr.Dataset(
        {
            "event_time": (("run", "event"), [[2.0], [np.nan], [np.nan]]),
            "event_class": (("run", "event"), [[0], [-1], [-1]]),
            "outcome": ("run", [0, 1, -1]),
            "theta": (("run", "block"), np.zeros((3, 2))),
        },
        coords={"class": np.array(["2", "1+1"], dtype=object)},
        attrs={"kind": "assembly", "blocks": 2, "duration_s": 10.0},
    )


def test_class_at_a_time(assembly: xr.Dataset) -> None:
    assert class_at(assembly, 0.0).tolist() == [1, 1, -1]
    assert class_at(assembly, [1.999, 2.0, 10.0]).tolist() == [[1, 1, -1], [0, 1, -1], [0, 1, -1]]


def test_class_at_a_time_of_random_runs() -> None:
    runs, rng = random_runs(4, 50, 9), np.random.default_rng(2)
    made = replay(raw_arrays(runs, 4))
    clock = np.sort(rng.uniform(0, 10, (50, 3)), axis=1)
    counts = np.array([len(run.blocks) for run in runs])
    clock[np.arange(3) >= counts[:, None]] = np.nan
    dataset = xr.Dataset(
        {
            "event_time": (("run", "event"), clock),
            "event_class": (("run", "event"), made.event_class),
            "outcome": ("run", made.outcome),
            "theta": (("run", "block"), np.zeros((50, 4))),
        },
        coords={"class": np.array(made.classes, dtype=object)},
        attrs={"kind": "assembly", "blocks": 4, "duration_s": 10.0},
    )
    times = np.linspace(0, 10, 7)
    found = class_at(dataset, times)
    for time, row in zip(times, found, strict=True):
        for run, own, index in zip(runs, clock, row, strict=True):
            happened = sum(bool(event <= time) for event in own)
            assert made.classes[index] == run.worlds[happened].small_class(mirror=True)


@pytest.mark.parametrize("time", [-1.0, 10.1, np.nan])
def test_times_outside_the_runs_are_refused(assembly: xr.Dataset, time: float) -> None:
    with pytest.raises(InputError, match="outside the runs, which last 10 s"):
        class_at(assembly, time)


def test_another_kind_is_refused(assembly: xr.Dataset) -> None:
    with pytest.raises(InputError, match="got trajectory"):
        class_at(assembly.assign_attrs(kind="trajectory"), 0.0)
