"""The live tank: what it says of itself, what it refuses, and what changes while it runs."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from single_block import BEYOND_PAPER
from twin.assembly import advance, block_normals, make_rules, start_world
from twin.block import next_force
from twin.latch import Latch
from twin_assembly import study as tank_study, swirl

import driftwalk as dw
from driftwalk.assembly.runs.plan import stream_keys
from driftwalk.core.errors import InputError

STILL = dw.uniform_flow(0.0, 0.0)
STATE = ("x", "y", "theta", "vx", "vy", "omega", "assembly")
# Two pairs near each other, three blocks in a row, and one on its own.
START = [(-0.06, 0, 0.2), (-0.025, 0, 0.1), (0.03, -0.05, 0), (0.03, 0.0, 0.4), (0.06, 0.05, 1.0)]


def state(tank: dw.LiveTank) -> dict[str, Any]:
    return {name: getattr(tank, name) for name in STATE}


def same(one: dw.LiveTank, other: dw.LiveTank) -> bool:
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in STATE)


def row(count: int, gap: float = 0.0) -> list[tuple[float, float, float]]:
    """Blocks side by side; without a gap they latch in the first step."""
    return [((0.03 + gap) * (k - (count - 1) / 2), 0.0, 0.0) for k in range(count)]


def test_still_water_without_force_moves_nothing() -> None:
    tank = dw.LiveTank(tank_study(forces={"force_std_N": 0.0}), STILL, blocks=5, start=START)
    tank.advance(3.0)
    assert tank.time == 3.0
    assert np.array_equal(np.stack([tank.x, tank.y, tank.theta], axis=1), START)
    assert not np.any([tank.vx, tank.vy, tank.omega])
    assert tank.assembly.tolist() == [0, 1, 2, 3, 4]
    assert (tank.outcome, tank.blocks, tank.events()) == ("1+1+1+1+1", 5, [])


def test_events_are_told_once_with_the_class_after_them() -> None:
    study = tank_study(0.2, forces={"force_std_N": 2e-3})
    tank = dw.LiveTank(study, swirl(study), blocks=8)
    told = []
    while len(told) < 6:
        tank.advance(0.1)
        events = tank.events()
        assert all(tank.time - 0.1 < event.time <= tank.time for event in events)
        if events:
            assert events[-1].outcome == tank.outcome
        told += events
    assert tank.events() == []
    assert [event.time for event in told] == sorted(event.time for event in told)
    labels = tank.assembly
    assert all(labels[one] == labels[other] for _, (one, other), *_ in told)
    assert len(np.unique(labels)) == 8 - len(told) == len(tank.outcome.split("+"))


def test_time_goes_by_whole_steps_and_keeps_the_rest() -> None:
    tank = dw.LiveTank(tank_study(), STILL, blocks=1)
    seen = []
    for _ in range(6):
        tank.advance(0.004)
        seen.append(tank.time)
    assert seen == [0.0, 0.0, 0.01, 0.01, 0.02, 0.02]
    for _ in range(300):
        tank.advance(1 / 30)
    assert tank.time == 10.02


@pytest.mark.parametrize("duration", [-0.1, math.nan, math.inf, 1e12])
def test_refuses_durations_that_are_none(duration: float) -> None:
    tank = dw.LiveTank(tank_study(), STILL, blocks=1)
    with pytest.raises(InputError):
        tank.advance(duration)
    assert tank.time == 0.0
    tank.advance(0.01)
    assert tank.time == 0.01


@pytest.mark.parametrize(
    "values",
    [
        {"drag_coefficient": -1.0},
        {"drag_coefficient": math.nan},
        {"force_std": -1e-3},
        {"flow_scale": -1.0},
        {"flow_scale": math.inf},
        {"latching": "magnet"},
        {"hidden_face_drag": "some"},
        {"blocks": 0},
        {"blocks": 257},
        {"blocks": 200},
    ],
)
def test_refuses_values_out_of_range_and_keeps_the_others(values: dict[str, Any]) -> None:
    tank = dw.LiveTank(tank_study(), STILL, blocks=2)
    tank.set(drag_coefficient=0.7)
    with pytest.raises(InputError):
        tank.set(**{"force_std": 5e-3, "flow_scale": 2.0} | values)
    assert tank.study.forces.drag_coefficient == 0.7
    assert tank.study.forces.force_std_N == tank_study().forces.force_std_N
    assert (tank.flow_scale, tank.study.assembly.blocks) == (1.0, 2)


def test_refuses_what_assemble_refuses() -> None:
    with pytest.raises(InputError, match="do not fit"):
        dw.LiveTank(tank_study(), STILL, blocks=100)
    with pytest.raises(InputError, match="overlap"):
        dw.LiveTank(tank_study(), STILL, blocks=2, start=[(0, 0, 0), (0.01, 0, 0)])
    with pytest.raises(InputError, match="does not cover"):
        dw.LiveTank(tank_study(2.0), dw.tank30_flow())


def test_numbers_that_are_lost_are_told_and_a_restart_helps() -> None:
    study = tank_study(simulation={"time_step_s": 0.01}, forces={"force_interval_s": 0.01})
    tank = dw.LiveTank(study, STILL, blocks=2)
    tank.set(flow_scale=1e300)
    moving = dw.LiveTank(study, dw.uniform_flow(1.0, 0.0), blocks=2)
    moving.set(flow_scale=1e300)
    with pytest.raises(InputError, match="lost"):
        moving.advance(1.0)
    with pytest.raises(InputError, match="lost"):
        moving.advance(1.0)
    moving.set(flow_scale=0.0)
    moving.restart()
    moving.advance(1.0)
    tank.advance(1.0)  # no water moves, whatever its velocity is multiplied by
    assert np.isfinite([moving.x, tank.x]).all()


def test_a_restart_is_the_same_run_or_another() -> None:
    study = tank_study(forces={"force_std_N": 1e-3})
    tank = dw.LiveTank(study, swirl(study), blocks=4, seed=7)
    begin = state(tank)
    tank.advance(2.0)
    tank.set(blocks=3, drag_coefficient=1.0)
    after = state(tank)
    tank.restart()
    assert (tank.time, tank.blocks, tank.events()) == (0.0, 3, [])
    tank.set(blocks=4, drag_coefficient=study.forces.drag_coefficient)
    tank.restart()
    assert all(np.array_equal(begin[name], getattr(tank, name)) for name in STATE)
    tank.advance(2.0)
    assert all(np.array_equal(after[name], getattr(tank, name)) for name in STATE)
    tank.restart(seed=8)
    assert not np.array_equal(tank.x, begin["x"])
    assert same(tank, dw.LiveTank(study, swirl(study), blocks=4, seed=8))
    tank.restart(start=START[:4])
    assert tank.x.tolist() == [pose[0] for pose in START[:4]]


def test_still_water_is_a_flow_times_zero() -> None:
    study = tank_study(forces={"force_std_N": 2e-3})
    still, stopped = dw.LiveTank(study, STILL, blocks=5), dw.LiveTank(study, swirl(study), blocks=5)
    stopped.set(flow_scale=0.0)
    for tank in (still, stopped):
        tank.advance(20.0)
    assert same(still, stopped)
    assert still.events() == stopped.events()


def test_a_flow_times_two_is_a_flow_twice_as_fast() -> None:
    study = tank_study(forces={"force_std_N": 1e-3})
    slow, fast = (
        dw.LiveTank(study, swirl(study, angular_velocity=rate), blocks=5) for rate in (0.4, 0.8)
    )
    slow.set(flow_scale=2.0)
    for tank in (slow, fast):
        tank.advance(10.0)
    assert same(slow, fast)


def test_changes_wait_for_the_next_force_interval() -> None:
    study = tank_study(forces={"force_std_N": 1e-3, "force_interval_s": 0.05})

    def run(first: float) -> dw.LiveTank:
        tank = dw.LiveTank(study, swirl(study), blocks=3)
        tank.advance(first)
        tank.set(drag_coefficient=2.0, force_std=3e-3, flow_scale=0.5, blocks=2)
        tank.advance(0.31 - first)
        return tank

    assert same(run(0.06), run(0.1))
    assert same(run(0.08), run(0.1))
    assert not np.array_equal(run(0.05).x, run(0.1).x)


def test_without_drag_forces_before_and_after_a_change_add_up() -> None:
    # C_d = 0, nothing in reach: positions are linear in the forces of all intervals.
    study = tank_study(6.0, forces={"drag_coefficient": 0.0, "force_interval_s": 0.02})
    still = dw.uniform_flow(0.0, 0.0, arena=study.tank.to_arena())
    paths = []
    for before, after in ((1e-3, 1e-3), (1e-3, 0.0), (0.0, 1e-3)):
        tank = dw.LiveTank(study, still, blocks=3)
        begin = np.stack([tank.x, tank.y])
        tank.set(force_std=before)
        tank.advance(0.3)
        tank.set(force_std=after)
        tank.advance(0.7)
        paths.append(np.stack([tank.x, tank.y]) - begin)
    whole, early, late = paths
    assert np.abs(late).min() > 1e-6
    np.testing.assert_allclose(early + late, whole, rtol=0, atol=1e-13)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("hidden_face_drag", "law"), [("none", "paper"), ("full", "paper"), ("none", "all")]
)
def test_changes_are_those_of_the_twin(hidden_face_drag: Any, law: str) -> None:
    # The NumPy twin with other rules from the same step on; two seconds, in which rounding does not
    # grow to the tolerance.
    forces = {"force_interval_s": 0.03, "drag_coefficient": 0.4, **BEYOND_PAPER.get(law, {})}
    connector = {"connector_distance_m": 0.02, "connector_axis_rad": 0.4}
    study = tank_study(forces=forces, assembly=connector)
    flow = swirl(study)
    tank = dw.LiveTank(study, flow, blocks=5, seed=3, start=START)
    rules = make_rules(
        study, flow, latch=Latch("collision", 0.0, 0.0), drag_coefficient=0.4,
        hidden_face_drag="none", block_restitution=0.5, block_friction=0.0,
    )  # fmt: skip
    world = start_world(rules, np.array(START))
    key = int(stream_keys("run", seed=3, trial=0, index=[0])[0])
    slower = replace(rules.model, flow_u=rules.model.flow_u * 0.5, flow_v=rules.model.flow_v * 0.5)
    changed = replace(
        rules, model=slower, drag_coefficient=1.3, hidden_face_drag=hidden_face_drag,
        latch=Latch("connector", 0.02, 0.4),
    )  # fmt: skip
    tank.set(force_std=1e-3)
    force = None
    for step in range(200):
        if step == 99:
            world.rules = changed
        if step % 3 == 0:
            force = next_force(rules.model, force, block_normals(key, step // 3, 5))
        if step == 98:
            tank.set(
                drag_coefficient=1.3, force_std=4e-3, flow_scale=0.5, latching="connector",
                hidden_face_drag=hidden_face_drag,
            )  # fmt: skip
        advance(world, (4e-3 if step >= 99 else 1e-3) * force)
        tank.advance(0.01)
        pose = world.gather("pose")
        np.testing.assert_allclose(np.stack([tank.x, tank.y], axis=1), pose[:, :2], atol=1e-9)
        np.testing.assert_allclose(np.cos(tank.theta - pose[:, 2]), 1.0, atol=1e-14)
        assert np.array_equal(tank.assembly, world.gather("assembly"))


def test_switching_latching_off_parts_nothing_and_part_parts_all() -> None:
    study = tank_study(forces={"force_std_N": 0.0})
    tank = dw.LiveTank(study, STILL, blocks=4, start=row(4, gap=-1e-10))
    tank.advance(0.01)
    assert (tank.outcome, len(tank.events())) == ("I", 3)
    tank.set(latching="none", force_std=1e-3)
    tank.advance(1.0)
    assert tank.outcome == "I"
    before = state(tank)
    tank.part()
    assert tank.outcome == "1+1+1+1"
    for name in ("x", "y", "theta", "vx", "vy", "omega"):
        np.testing.assert_allclose(getattr(tank, name), before[name], rtol=0, atol=1e-14)
    tank.advance(1.0)
    assert (tank.outcome, tank.events()) == ("1+1+1+1", [])
    tank.set(latching="connector", force_std=0.0)
    tank.part()
    tank.advance(0.5)
    assert tank.events()


def test_parting_with_a_change_waits_for_it_and_nothing_latches_again() -> None:
    study = tank_study(forces={"force_std_N": 0.0, "force_interval_s": 0.04})
    tank = dw.LiveTank(study, STILL, blocks=4, start=row(4, gap=-1e-10))
    tank.advance(0.02)
    tank.set(latching="none", part=True)
    # A later change does not undo what is still to come.
    tank.set(drag_coefficient=0.5)
    tank.advance(0.02)
    assert tank.outcome == "I"
    tank.events()
    tank.advance(0.01)
    assert (tank.outcome, tank.events()) == ("1+1+1+1", [])
    # It happens once: from then on what latches stays together.
    tank.set(latching="connector")
    tank.advance(0.5)
    assert (tank.outcome, len(tank.events())) == ("I", 3)
    tank.set(drag_coefficient=0.6)
    tank.advance(0.5)
    assert (tank.outcome, tank.events()) == ("I", [])


def test_no_change_is_lost_when_two_threads_make_them(monkeypatch: pytest.MonkeyPatch) -> None:
    """Both look at what is wanted before either has changed it, if nothing keeps them apart."""
    from driftwalk.model import apply_overrides

    def slow(*given: Any) -> Any:
        found = apply_overrides(*given)
        time.sleep(0.05)
        return found

    tank = dw.LiveTank(tank_study(), STILL, blocks=2)
    monkeypatch.setattr("driftwalk.model.apply_overrides", slow)
    changes: list[Callable[[], None]] = [
        lambda: tank.set(drag_coefficient=0.77),
        lambda: tank.set(force_std=3e-4),
        lambda: tank.set(flow_scale=2.0),
        lambda: tank.set(blocks=5),
        lambda: tank.restart(seed=9),
        lambda: tank.advance(0.5),
    ]
    threads = [threading.Thread(target=change) for change in changes]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    wanted = tank.study
    assert (wanted.forces.drag_coefficient, wanted.forces.force_std_N) == (0.77, 3e-4)
    assert (tank.flow_scale, wanted.assembly.blocks, wanted.assembly.seed) == (2.0, 5, 9)
    tank.advance(0.1)
    assert tank.blocks + tank.waiting == 5


def test_a_change_does_not_wait_for_an_advance() -> None:
    study = tank_study(forces={"force_std_N": 1e-3})
    tank = dw.LiveTank(study, swirl(study), blocks=4)
    thread = threading.Thread(target=tank.advance, args=(400.0,))
    thread.start()
    tank.set(flow_scale=2.0)
    assert thread.is_alive()
    assert tank.flow_scale == 2.0
    thread.join()


def test_a_restart_that_is_refused_loses_no_change() -> None:
    tank = dw.LiveTank(tank_study(forces={"force_std_N": 0.0}), STILL, blocks=2, start=START[:2])
    tank.set(force_std=1e-3)
    with pytest.raises(InputError):
        tank.restart(start=[(0.0, 0.0)])
    tank.advance(0.1)
    assert np.abs(tank.vx).min() > 0.0


def test_what_is_left_of_an_assembly_is_one_or_several() -> None:
    # Block 3 is the middle of a cross: without it the arms are on their own. Its force is drawn
    # from the same addresses, so the force of others is not moved.
    a = 0.03 - 1e-10
    start = [(-a, 0, 0), (a, 0, 0), (0, a, 0), (0, 0, 0)]
    study = tank_study(forces={"force_std_N": 0.0})
    tank = dw.LiveTank(study, STILL, blocks=4, start=start)
    tank.advance(0.01)
    assert tank.outcome == "T"
    tank.set(blocks=3)
    assert tank.blocks == 4  # from the next interval on
    tank.advance(0.01)
    assert tank.outcome == "1+1+1"
    tank.restart(start=[(-a, 0, 0), (0, 0, 0), (a, 0, 0)])
    tank.advance(0.01)
    tank.set(blocks=2)
    tank.advance(0.01)
    assert (tank.outcome, tank.assembly.tolist()) == ("2", [0, 0])


def test_blocks_are_added_at_free_places_and_the_rest_waits() -> None:
    study = tank_study(0.1, forces={"force_std_N": 1e-3})
    tank = dw.LiveTank(study, STILL, blocks=1)
    tank.set(blocks=8, latching="none")
    assert (tank.blocks, tank.waiting) == (1, 7)
    tank.advance(2.0)
    assert 1 < tank.blocks < 8
    assert tank.blocks + tank.waiting == 8
    assert np.hypot(tank.x, tank.y).max() < 0.05
    there = tank.blocks
    tank.set(blocks=there)
    tank.advance(0.1)
    assert (tank.blocks, tank.waiting) == (there, 0)


def test_what_is_added_is_the_same_in_whatever_pieces_it_is_advanced() -> None:
    study = tank_study(0.16, forces={"force_std_N": 1e-3, "force_interval_s": 0.03})

    def run(pieces: int) -> dw.LiveTank:
        tank = dw.LiveTank(study, swirl(study), blocks=3)
        tank.advance(0.1)
        tank.set(blocks=14)
        for _ in range(pieces):
            tank.advance(3.0 / pieces)
        return tank

    assert same(run(1), run(100))


def test_the_state_that_was_read_stays_as_it_was() -> None:
    tank = dw.LiveTank(tank_study(forces={"force_std_N": 1e-3}), STILL, blocks=2)
    before = tank.x
    copy = before.copy()
    tank.advance(1.0)
    assert np.array_equal(before, copy)
    tank.x[:] = 0.0
    tank.assembly[:] = 0
    assert tank.x.all()
    assert tank.assembly.tolist() == [0, 1]


def test_others_run_while_it_advances() -> None:
    study = tank_study(forces={"force_std_N": 1e-3})
    tank, alone = (dw.LiveTank(study, swirl(study), blocks=4) for _ in range(2))
    thread = threading.Thread(target=tank.advance, args=(400.0,))
    looks = 0
    thread.start()
    while thread.is_alive():
        assert np.isfinite(tank.x).all()
        assert tank.outcome
        looks += 1
    thread.join()
    alone.advance(400.0)
    assert same(tank, alone)
    # With the lock held until the end there would be one look, or two.
    assert looks > 20
