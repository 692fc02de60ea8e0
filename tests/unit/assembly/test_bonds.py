"""Bonds that break: their law in time and under load, their loops, and what a run keeps of it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from kernel_worlds import assemble, keys
from scipy.stats import kstest
from single_block import SIDE, Floats, model, numbers_of
from twin.block import drag
from twin_assembly import rules as twin_rules, study

import driftwalk as dw
from driftwalk.assembly.runs import plan as plans
from driftwalk.core.errors import InputError

STEP = 0.01
TOUCHING = 0.9995 * SIDE
NEVER = {"latching": "collision", "event_rows": 40, "hidden_face_drag": "none"}


def row(count: int, worlds: int) -> Floats:
    """Blocks in a row along x, face to face, so that they latch in the first step."""
    start = np.zeros((worlds, count, 3))
    start[:, :, 0] = TOUCHING * (np.arange(count) - (count - 1) / 2)
    return start


def strain(rate: float) -> Any:
    """Water that is drawn out along x."""
    return lambda x, y: (rate * x, -rate * y)


def first_partings(run: dict[str, Any]) -> tuple[Floats, Any]:
    """Return the steps between the last joining at the start and the first parting, and where."""
    kind = run["event_kind"]
    first = (kind == 1).argmax(axis=1)
    assert (np.take_along_axis(kind, first[:, None], axis=1) == 1).all()
    step = np.take_along_axis(run["event_step"], first[:, None], axis=1)[:, 0]
    at = np.arange(len(first))
    return (step - run["event_step"][:, 0]).astype(float), run["event_block"][at, first]


@pytest.mark.slow
def test_lifetimes_are_exponential() -> None:
    # False alarms: 1 in 1000 seeds. A lifetime ends with a step: half of one is taken off.
    rate, worlds = 2.0, 2000
    run = assemble(
        model(times=[0.0]), row(2, worlds), keys(worlds), steps=1200, bonds=(rate, 0.0, 0.0, 1.25),
        **NEVER,
    )  # fmt: skip
    steps, _ = first_partings(run)
    lifetime = STEP * (steps - 0.5)
    assert kstest(lifetime, "expon", args=(0, 1 / rate)).pvalue > 1e-3
    assert lifetime.mean() == pytest.approx(1 / rate, rel=0.08)


@pytest.mark.slow
@pytest.mark.parametrize("load", ["paper", "linear drag"])
def test_a_constant_pull_shortens_lifetimes_as_bell_says(load: str) -> None:
    # Water that is drawn out holds a dimer in the middle and pulls at its ends. The pull on one is
    # the twin's drag on a block with a covered face. The hazard of each bond is the same draw.
    forces = {"paper": {}, "linear drag": {"linear_drag_kg_s": 4e-3}}[load]
    strength, rate, worlds = 0.8, 0.5, 200
    flow_model = model(strain(strength), times=[0.0], **numbers_of(forces))
    nodes = dw.uniform_flow(0.0, 0.0).isel(x=slice(None, None, 8), y=slice(None, None, 8))
    x, y = np.meshgrid(nodes["x"].values, nodes["y"].values)
    water = nodes.assign(u=(("y", "x"), strength * x), v=(("y", "x"), -strength * y))
    twin = twin_rules(study(forces=forces), water, drag_coefficient=0.45).model
    covered = np.array([[False], [False], [True], [False]])
    pull, *_ = drag(
        twin, np.array([0.45]), np.array([[SIDE / 2], [0.0], [0.0]]), np.zeros((3, 1)), covered
    )
    steps = {}
    for scale in (0.0, float(pull[0]) / np.log(3.0)):
        run = assemble(
            flow_model, row(2, worlds), keys(worlds), steps=1500, **NEVER,
            bonds=(rate, scale, 0.0, 1.25),
        )  # fmt: skip
        # A pair that parts is drawn away and does not meet again.
        kind = run["event_kind"]
        assert (kind[:, 1] <= 1).all()
        steps[scale > 0] = np.where(kind[:, 1] == 1, run["event_step"][:, 1], -1) - 1.0
    both = (steps[False] > 50) & (steps[True] > 50)
    assert both.sum() > 50
    assert (steps[False][both] / steps[True][both]).mean() == pytest.approx(3.0, rel=0.02)


def test_a_pulled_chain_breaks_in_the_middle() -> None:
    # Of six blocks the middle bond carries the pull of three, the next that of two: of strengths
    # by which anything breaks, the largest is reached there.
    def broken(strength: float) -> list[list[int]]:
        run = assemble(
            model(strain(0.5), times=[0.0]), row(6, 1), keys(1), steps=300, **NEVER,
            bonds=(0.0, 0.0, strength, 1.25),
        )  # fmt: skip
        parted = run["event_block"][0][run["event_kind"][0] == 1]
        return [sorted(pair) for pair in parted.tolist()]

    holds, breaks = 1.0, 1e-6
    for _ in range(20):
        middle = np.sqrt(holds * breaks)
        holds, breaks = (holds, middle) if broken(middle) else (middle, breaks)
    assert broken(breaks)[0] == [2, 3]
    assert not broken(holds)


@pytest.mark.slow
def test_a_ring_is_held_until_two_of_its_bonds_are_broken() -> None:
    # The mean time to the second of four breaks is 1/4 + 1/3 of a bond's. False alarms: 0.3 %.
    rate, worlds = 1.0, 600
    start = np.zeros((worlds, 4, 3))
    start[:, :, :2] = TOUCHING * (np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) - 0.5)
    run = assemble(
        model(times=[0.0]), start, keys(worlds), steps=1500, bonds=(rate, 0.0, 0.0, 1.25), **NEVER
    )
    steps, _ = first_partings(run)
    expected, spread = 1 / 4 + 1 / 3, np.hypot(1 / 4, 1 / 3)
    mean = STEP * (steps - 0.5).mean()
    assert mean == pytest.approx(expected, abs=3 * spread / np.sqrt(worlds))
    kind = run["event_kind"]
    assert ((kind == 3).sum(axis=1) >= 1).all()
    first = np.argmax(kind == 1, axis=1)
    opened = np.array([(one[:at] == 2).sum() for one, at in zip(kind, first, strict=True)])
    assert (opened == 1).all()


@pytest.mark.slow
def test_two_blocks_reach_the_markov_solution() -> None:
    # Two states: the share of time bound is r / (r + k), with the model's own rate of latching r.
    # 2 % are three standard errors of 19,000 partings.
    rate = 1.0
    small = dw.Study(
        tank={"diameter_m": 0.09},
        forces={"force_std_N": 6e-3},
        assembly={"bond_rate_per_s": rate, "relatch_clearance": 1.1},
    )
    flow = dw.vortex_flow(angular_velocity=0.3, core_radius=0.04, arena=small.tank.to_arena())
    found = dw.steady_state(dw.assemble(small, flow, blocks=2, runs=300, duration=120.0))
    one = found.sel({"class": "2"})
    other = found.sel({"class": "1+1"})
    assert int(one["parting_count"]) > 10_000
    assert float(one["parting_rate"]) == pytest.approx(rate, rel=0.02)
    latch = float(other["joining_rate"])
    assert float(one["time_share"]) == pytest.approx(latch / (latch + rate), rel=0.02)
    assert found.attrs["steady"] == "yes"
    # Of an exponential law the median is ln 2 of the mean.
    assert float(one["lifetime_median"]) == pytest.approx(np.log(2) / rate, rel=0.03)


@pytest.fixture(scope="module")
def four() -> xr.Dataset:
    return dw.assemble(
        dw.Study(assembly={"bond_rate_per_s": 0.1}), dw.tank30_flow(), runs=16, duration=60.0
    )


@pytest.mark.slow
def test_a_run_with_more_events_than_there_was_room_is_simulated_again(
    four: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(plans.Plan, "event_rows", 4)
    again = dw.assemble(
        dw.Study(assembly={"bond_rate_per_s": 0.1}), dw.tank30_flow(), runs=16, duration=60.0
    )
    assert int(four["event_count"].max()) > 4
    xr.testing.assert_identical(again, four)


def test_events_tell_a_run_to_its_end(four: xr.Dataset) -> None:
    # That they lead to the blocks' places at the end is checked where the dataset is made.
    kind, count = four["event_kind"].values, four["event_count"].values
    parts = 4 - (kind == 0).sum(axis=1) + (kind == 1).sum(axis=1)
    last = [len(set(row)) for row in four["assembly"].values.tolist()]
    assert parts.tolist() == last
    assert (four["end_time"] == 60.0).all()
    assert ((kind >= 0).sum(axis=1) == count).all()
    threads = dw.assemble(
        dw.Study(assembly={"bond_rate_per_s": 0.1}), dw.tank30_flow(), runs=16, duration=60.0,
        threads=2,
    )  # fmt: skip
    xr.testing.assert_identical(four, threads)


def test_sizes_and_classes_over_time_follow_partings(four: xr.Dataset) -> None:
    sizes = dw.assembly_sizes(four, times=[60.0])
    labels = four["assembly"].values.tolist()
    found = [sorted(row.count(label) for label in set(row)) for row in labels]
    number = [np.mean([one.count(size) for one in found]) for size in range(1, 5)]
    assert sizes["number"].values.tolist() == pytest.approx(number)
    assert float(sizes["largest_share"][0]) == pytest.approx(
        np.mean([one[-1] for one in found]) / 4
    )
    assert float(sizes["free_share"][0]) == pytest.approx(number[0] / 4)
    times = dw.class_times(four, times=[60.0])
    end = dw.outcome_distribution(four)
    np.testing.assert_allclose(times["proportion"].values[0], end["proportion"].values)
    # Whether all blocks had been one assembly once is not undone by a parting.
    complete = [name for name in end["class"].values if "+" not in name]
    at_end = float(end["proportion"].sel({"class": complete}).sum())
    assert float(1 - times["completion"][0]) > at_end


def test_permanent_bonds_have_no_kinds_of_events() -> None:
    found = dw.assemble(dw.Study(), dw.uniform_flow(0.0, 0.0), blocks=2, runs=2, duration=1.0)
    assert "event_kind" not in found
    assert "bond_rate_per_s" not in found.attrs
    with pytest.raises(InputError, match="event_kind"):
        dw.steady_state(found)


@pytest.mark.slow
def test_discs_part_too() -> None:
    discs = dw.Study(block={"shape": "disc"}, assembly={"bond_rate_per_s": 0.2})
    found = dw.assemble(discs, dw.tank30_flow(), blocks=5, runs=30, duration=60.0)
    kind = found["event_kind"].values
    assert {0, 1} <= set(kind[kind >= 0].tolist())


def test_a_strength_takes_a_force_with_memory_and_length() -> None:
    flow = dw.tank30_flow()
    strong = {"bond_strength_N": 8e-3}
    for forces in ({}, {"force_memory_s": 0.05}, {"stirring_length_m": 0.1}):
        with pytest.raises(InputError, match="a threshold on a white force depends on the time st"):
            dw.assemble(dw.Study(assembly=strong, forces=forces), flow, runs=1, duration=1.0)
    forces = {"force_memory_s": 0.05, "stirring_length_m": 0.1}
    dw.assemble(dw.Study(assembly=strong, forces=forces), flow, runs=1, duration=1.0)
    with pytest.raises(InputError, match="bonds have none"):
        dw.assemble(dw.Study(assembly={"bond_force_N": 1e-3}), flow, runs=1, duration=1.0)


def test_a_live_tank_tells_of_partings() -> None:
    tank = dw.assembly.LiveTank(
        dw.Study(tank={"diameter_m": 0.15}), dw.uniform_flow(0.0, 0.0), blocks=6
    )
    tank.set(force_std=2e-3)
    tank.advance(40.0)
    joined = tank.events()
    assert joined
    assert not any(event.is_parting for event in joined)
    tank.set(bond_rate=5.0)
    tank.advance(5.0)
    events = tank.events()
    assert any(event.is_parting for event in events)
    assert events[-1].outcome == tank.outcome
    tank.set(bond_rate=0.0)
    tank.advance(1.0)
    tank.events()
    tank.advance(20.0)
    assert not any(event.is_parting for event in tank.events())


@pytest.mark.slow
def test_classify_reads_joinings_and_partings_of_a_simulated_recording() -> None:
    # Blocks that have parted and stay within the tolerances of a join for half a second count as
    # joined again: a tenth more at most.
    rule = dw.Study(assembly={"bond_rate_per_s": 0.02})
    runs, flow = 6, dw.tank30_flow()
    path = dw.assembly_path(rule, flow, runs=range(runs), duration=300.0)
    truth = dw.assemble(rule, flow, runs=runs, duration=300.0)
    seen = [dw.classify(dw.path_recording(path, run=run), side=0.03) for run in range(runs)]
    for name, number in (("joining", 0), ("parting", 1)):
        happened = int((truth["event_kind"] == number).sum())
        found = sum(int(one[f"{name}_count"].sum()) for one in seen)
        assert happened <= found <= 1.1 * happened + 1
    one = seen[0]
    time = one["proportion"] * one.attrs["known_s"]
    came = time.values > 0
    np.testing.assert_allclose(
        one["parting_rate"].values[came], (one["parting_count"] / time).values[came]
    )
    assert np.isnan(one["parting_rate"].values[~came]).all()


@pytest.mark.slow
@pytest.mark.parametrize("shape", ["square", "disc", "rectangle"])
def test_many_blocks_part_as_few_do(shape: str, monkeypatch: pytest.MonkeyPatch) -> None:
    # Worlds of more than 64 blocks have counted classes, and the same shapes of few blocks.
    from driftwalk.assembly.lattice import events, replayed_worlds

    rule = dw.Study(
        tank={"diameter_m": 0.25},
        block={"shape": shape} | ({"width_m": 0.02} if shape == "rectangle" else {}),
        assembly={"bond_rate_per_s": 0.2},
    )
    flow = dw.vortex_flow(angular_velocity=0.6, core_radius=0.04, arena=rule.tank.to_arena())
    few = dw.assemble(rule, flow, blocks=12, runs=3, duration=30.0)
    for module in (events, replayed_worlds):
        monkeypatch.setattr(module, "MOST_NAMED", 8)
    many = dw.assemble(rule, flow, blocks=12, runs=3, duration=30.0)
    assert (few["event_kind"] == 1).any()
    xr.testing.assert_equal(few["event_assembly"], many["event_assembly"])
    names = [one["shape"].values[one["event_shape"].values] for one in (few, many)]
    real = few["event_shape"].values >= 0
    np.testing.assert_array_equal(real, many["event_shape"].values >= 0)
    np.testing.assert_array_equal(names[0][real], names[1][real])


def test_a_pull_is_the_same_in_a_world_of_many_blocks() -> None:
    # A dimer in the middle of drawn-out water: alone, and with 24 blocks far from it, which lie in
    # the lanes of the same world.
    water = model(
        strain(0.3), times=[0.0], radius=1.5, nodes=np.arange(-31, 32) * 0.05
    )  # fmt: skip
    start = np.zeros((12, 26, 3))
    start[:, :2] = row(2, 12)
    other = np.arange(24)
    start[:, 2:, 0] = 0.5 * np.where(other % 2, 1, -1)
    start[:, 2:, 1] = 0.08 * (other // 2 - 5.5)
    parted = []
    for poses in (start[:, :2], start):
        run = assemble(water, poses, keys(12), steps=300, bonds=(0.5, 1e-4, 0.0, 1.25), **NEVER)
        own = (run["event_kind"] == 1) & (run["event_block"] < 2).all(axis=2)
        parted.append(np.where(own, run["event_step"], -1).max(axis=1).tolist())
    assert parted[0] == parted[1]
    assert sum(step > 0 for step in parted[0]) > 5
