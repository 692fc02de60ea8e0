"""Hundreds of blocks: events replayed run after run, classes that are numbers, limits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from kernel_worlds import assemble, deepest_overlap, random_starts
from lattice_runs import random_run, raw_arrays
from single_block import SIDE, model, swirl

import driftwalk as dw
from driftwalk.assembly import assembly_sizes, replay_events
from driftwalk.assembly.lattice import events, replayed_worlds
from driftwalk.assembly.lattice.events import replay_contacts
from driftwalk.assembly.lattice.polyomino import shape_size
from driftwalk.assembly.outcomes.outcome_classes import sort_classes, world_class
from driftwalk.assembly.outcomes.sizes import compactness
from driftwalk.core.errors import InputError
from driftwalk.schema import build_trajectory
from driftwalk.schema.shapes import all_single, counts_of_shape, is_one_assembly
from driftwalk.viewer.play.playground import shape_counts

BLOCKS = 40


def events_of(seed: int = 3) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    return raw_arrays([random_run(BLOCKS, rng, stop=1.0) for _ in range(6)], BLOCKS)


def test_what_is_counted_is_as_what_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shapes of the same size and perimeter, as many assemblies."""
    raw = events_of()
    names = replay_events(**raw)
    for module in (events, replayed_worlds):
        monkeypatch.setattr(module, "MOST_NAMED", BLOCKS - 1)
    counted = replay_events(**raw)
    np.testing.assert_array_equal(counted.event_assembly, names.event_assembly)
    assert any(counts_of_shape(name)[0] > 8 for name in counted.shapes)
    real = names.event_shape >= 0
    np.testing.assert_array_equal(counted.event_shape >= 0, real)
    for of in (shape_size, compactness):
        pair = [
            np.array([of(name) for name in made.shapes])[made.event_shape[real]]
            for made in (names, counted)
        ]
        np.testing.assert_array_equal(*pair)
    small = np.array([shape_size(name) <= 8 for name in names.shapes])[names.event_shape[real]]
    for one, other in zip(
        names.event_shape[real][small], counted.event_shape[real][small], strict=True
    ):
        assert names.shapes[one] == counted.shapes[other]
    for own, number in ((names.outcome, counted.outcome), (names.event_class, counted.event_class)):
        assemblies = [1 + names.classes[one].count("+") for one in own[own >= 0]]
        assert [int(counted.classes[one].split()[0]) for one in number[own >= 0]] == assemblies


def test_many_blocks_that_part_are_replayed() -> None:
    bar = np.zeros((2, 70, 2), dtype=int)
    made = replay_events(
        [3, 2],
        [[[0, 1], [0, 1], [4, 2]], [[0, 1], [1, 0], [0, 0]]],
        [[[0, 2], [0, 2], [0, 2]], [[0, 2], [2, 0], [0, 0]]],
        event_kind=[[0, 1, 0], [0, 1, 0]],
        cell=np.where(np.arange(70)[:, None] == 2, [[[1, 0]], [[0, 0]]], bar),
        quarter=np.zeros((2, 70), dtype=int),
        assembly=[[0, 1, 2, 3, 2, *range(5, 70)], list(range(70))],
    )
    assert [made.classes[one] for one in made.event_class[0]] == [
        *("69 assemblies", "70 assemblies", "69 assemblies")
    ]
    assert [made.classes[one] for one in made.outcome] == ["69 assemblies", "70 assemblies"]
    assert [made.shapes[one] for one in made.event_shape[0, 1]] == ["1", "1", "2"]


def test_the_class_of_the_start_is_listed_and_classes_are_in_order() -> None:
    raw = raw_arrays([random_run(70, np.random.default_rng(5), stop=1.0)], 70)
    assert "70 assemblies" in replay_events(**raw).classes
    names = ["70 assemblies", "9 assemblies", "1 assembly", "12 assemblies"]
    assert sort_classes(names) == ("1 assembly", "9 assemblies", "12 assemblies", "70 assemblies")


def test_a_recording_of_many_blocks_is_classified() -> None:
    x = 0.1 * np.arange(70) * np.ones((3, 1))
    x[:, 1] = 0.03
    none = np.zeros_like(x)
    found = dw.classify(build_trajectory(np.arange(3.0), x, none, none), side=0.03)
    assert found["class"].values[found["outcome"].values].tolist() == ["69 assemblies"] * 3
    assert found["shape"].values.tolist() == ["1", "2"]


def test_what_cannot_be_names_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (events, replayed_worlds):
        monkeypatch.setattr(module, "MOST_NAMED", BLOCKS - 1)
    raw = events_of()
    twice = {name: values.copy() for name, values in raw.items()}
    twice["event_block"][2, 1] = twice["event_block"][2, 0]
    with pytest.raises(InputError, match="run 2, event 1: joins two blocks of one assembly"):
        replay_events(**twice)
    other = {name: values.copy() for name, values in raw.items()}
    other["event_face"][4, 0, 0] ^= 1
    with pytest.raises(InputError, match="run 4"):
        replay_events(**other)


def test_the_class_of_many_blocks_is_how_many_assemblies_they_make() -> None:
    cells = [(k, 0) for k in range(70)]
    assert world_class(cells, [0] * 70) == "1 assembly"
    assert world_class(cells, [*range(69), 0]) == "69 assemblies"
    assert all_single(500) == "500 assemblies"
    assert is_one_assembly("1 assembly")
    assert not is_one_assembly(all_single(65))


@pytest.mark.slow
def test_five_hundred_blocks_from_the_call_to_the_answer() -> None:
    study = dw.Study(
        tank={"diameter_m": 2.0}, assembly={"blocks": 500, "duration_s": 8.0, "runs": 3}
    )
    flow = dw.flow.stretch_flow(dw.tank30_flow(), diameter=2.0)
    found = dw.assemble(study, flow)
    sizes = assembly_sizes(found)
    assert found["event_count"].min() > 50
    # As counted at the end, block by block.
    labels = found["assembly"].values
    counts = [np.unique(row, return_counts=True)[1] for row in labels]
    end = sizes.isel(time=-1)
    assert float(end["largest_share"]) == pytest.approx(np.mean([c.max() for c in counts]) / 500)
    assert float(end["free_share"]) == pytest.approx(
        np.mean([(c == 1).sum() for c in counts]) / 500
    )
    assert float(end["compactness"]) == pytest.approx(sizes.attrs["compactness"])
    names = [str(found["class"].values[one]) for one in found["outcome"].values]
    assert names == [f"{c.size} assemblies" for c in counts]


def test_discs_in_hundreds() -> None:
    study = dw.Study(
        block={"shape": "disc", "side_m": 0.03, "mass_kg": 0.012},
        tank={"diameter_m": 0.6},
        assembly={"blocks": 100, "duration_s": 2.0, "runs": 2},
    )
    found = dw.assemble(study, dw.flow.stretch_flow(dw.tank30_flow(), diameter=0.6))
    assert found["event_count"].min() > 5
    x, y, label = (found[name].values for name in ("x", "y", "assembly"))
    for run in range(2):
        # Contacts of what became the last time, counted over all pairs.
        event = int(found["event_count"][run]) - 1
        name = str(found["shape"].values[found["event_shape"].values[run, event, 2]])
        lowest = int(found["event_assembly"].values[run, event].min())
        own = np.flatnonzero(label[run] == lowest)
        apart = np.hypot(x[run, own, None] - x[run, own], y[run, own, None] - y[run, own])
        assert shape_size(name) == own.size
        if own.size > 8:
            assert name.endswith(f", {(np.triu(apart < 0.0303, 1)).sum()} contacts")


def test_a_ring_of_many_discs_has_its_name() -> None:
    turn = np.arange(12) * np.pi / 6
    places = np.stack([10.0 + np.arange(70), np.zeros(70)], axis=1)
    places[:12] = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    pairs = [(k, k + 1) for k in range(11)]
    made = replay_contacts(
        [11], [pairs], pose=places[None], assembly=[[0] * 12 + list(range(12, 70))],
        diameter=2 * np.sin(np.pi / 12),
    )  # fmt: skip
    became = [made.shapes[one] for one in made.event_shape[0, 7:, 2]]
    assert became == ["chain9", "chain10", "chain11", "ring12"]


def test_nothing_is_in_anything_among_three_hundred() -> None:
    native = model(swirl, times=[0.0], radius=0.45)
    start, own_keys = random_starts(native, 300, 1, seed=4)
    assert len(start) == 1
    run = assemble(
        native, start, own_keys, steps=150, force=2e-3, latching="collision", sample_every=50
    )
    assert run["event_count"][0] > 20
    assert deepest_overlap(run["sample_pose"]) < 1.001e-4


def test_more_than_two_thousand_are_refused() -> None:
    with pytest.raises(InputError, match="at most 2000"):
        dw.Study(assembly={"blocks": 2001})
    native = model(swirl, times=[0.0])
    with pytest.raises(ValueError, match="a world has 1 to 2000 blocks"):
        assemble(native, np.zeros((1, 2001, 3)), np.zeros(1, np.uint64), steps=1)


def test_two_of_five_hundred_given_blocks_that_overlap_are_named() -> None:
    study = dw.Study(tank={"diameter_m": 3.0}, assembly={"blocks": 500, "runs": 1})
    flow = dw.flow.stretch_flow(dw.tank30_flow(), diameter=3.0)
    place = np.arange(500)
    start = np.stack([0.05 * (place % 25 - 12), 0.05 * (place // 25 - 10), 0.0 * place], axis=1)
    start[321, :2] = start[17, :2] + 0.9 * SIDE
    with pytest.raises(InputError, match="blocks 17 and 321 of run 0 overlap"):
        dw.assembly_path(study, flow, start=start, duration=1.0)


def test_a_playground_of_many_blocks_counts_sizes() -> None:
    flow = dw.flow.stretch_flow(dw.tank30_flow(), diameter=0.6)
    study = dw.Study(tank={"diameter_m": 0.6}, assembly={"blocks": 120})
    source = dw.viewer.PlaySource(study, flow)
    source.tank.advance(2.0)
    labels = source.tank.assembly
    found = shape_counts(source.tank.outcome, labels)
    assert sum(found.values()) == np.unique(labels).size
    assert sum(int(name.split()[0]) * count for name, count in found.items()) == 120
    assert found["1"] < 120


@pytest.mark.parametrize("ratio", [0.5, 10.0])
def test_a_stretched_flow_has_the_speeds_of_the_same_shares_of_the_radius(ratio: float) -> None:
    flow = dw.tank30_flow()
    wide = dw.flow.stretch_flow(flow, diameter=0.3 * ratio)
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-0.1, 0.1, (2, 200))
    np.testing.assert_allclose(
        dw.flow.bilinear(wide, ratio * x, ratio * y), dw.flow.bilinear(flow, x, y), atol=1e-12
    )
    assert wide.attrs["stretched_by"] == pytest.approx(ratio)


@pytest.mark.parametrize(
    ("change", "words"),
    [({"arena": "{}"}, "from one round tank to another"), ({}, "diameter must be above 0 m")],
)
def test_what_cannot_be_stretched_is_refused(change: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        dw.flow.stretch_flow(dw.tank30_flow().assign_attrs(change), diameter=0.0)
