"""The playground: its knobs, the steps it takes from the tank, and its stream."""

from __future__ import annotations

import asyncio
import json
import math
import time
from collections import Counter
from typing import Any

import numpy as np
import pytest
import xarray as xr

import driftwalk as dw
from driftwalk.core.errors import InputError
from driftwalk.model import Study
from driftwalk.schema import build_trajectory
from driftwalk.viewer.play.motion import MotionWindow, beside
from driftwalk.viewer.play.playground import PlaySource, frame_line, hello_line, joined_faces
from driftwalk.viewer.play.playground_base import flow_arrows
from driftwalk.viewer.play.settings import FILLED, KNOBS

STILL = dw.uniform_flow(0.0, 0.0)
KNOB = {knob.name: knob for knob in KNOBS}


def circle(step: float, radius: float, number: int, *, interval: float = 0.1) -> xr.Dataset:
    """Return a block on a circle: every step as long, every turn the same."""
    angle = step / radius * np.arange(number)
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    return build_trajectory(interval * np.arange(number), x, y, 0 * angle)


def exact() -> Study:
    """Return a study of a camera without noise."""
    return dw.apply_overrides(
        Study(), {"observation.position_noise_m": 0.0, "observation.position_quantum_m": 0.0}
    )


@pytest.mark.parametrize(
    ("name", "value", "read"),
    [
        ("drag_coefficient", 0.4, 0.4),
        ("drag_coefficient", 0, 0.0),
        ("force_std", 1e-3, 1e-3),
        ("blocks", 12, 12),
        ("blocks", 12.0, 12),
        ("latching", "none", "none"),
        ("hidden_face_drag", "full", "full"),
        ("stirring_length", 0.06, 0.06),
    ],
)
def test_values_that_a_knob_takes(name: str, value: Any, read: Any) -> None:
    found = KNOB[name].read(value)
    assert (found, type(found)) == (read, type(read))


@pytest.mark.parametrize("shape", ["disc:4cm", "rectangle:4x2cm"])
def test_what_latches_as_it_lies_has_no_faces_and_a_disc_no_heading(shape: str) -> None:
    study = dw.apply_overrides(Study(), {"block.shape": shape, "block.mass_kg": 0.024})
    source = PlaySource(study, dw.tank30_flow(), blocks=6)
    message = source.greeting()[0]
    tank = message["page"]["sections"][0]
    size = (0.04, None if study.block.is_round else 0.02)
    assert (tank["side"], tank["width"]) == size
    hello = hello_line(source.tank)
    assert (hello["block_side_m"], hello["block_width_m"]) == size
    source.tank.advance(60.0)
    controls = next(one for one in message["page"]["sections"] if one["kind"] == "controls")
    items = {item["name"]: item for item in controls["items"]}
    assert not {"hidden_face_drag", "faces", "magnets"} & set(items)
    assert items["latching"]["choices"] == ["collision", "none"]
    now = source._tank_message()
    turned = [None] * 6 if study.block.is_round else np.round(source.tank.theta, 4).tolist()
    assert now["theta"] == turned
    assert now["outcome"] == source.tank.outcome
    line = frame_line(source.tank, 0, source.tank.events())
    assert line["joined"] is None
    assert [body["theta_rad"] is None for body in line["bodies"]] == [study.block.is_round] * 6
    assert line["events"][-1]["outcome"] == source.tank.outcome
    json.dumps(line, allow_nan=False)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *[("drag_coefficient", v) for v in (-0.1, 1.6, math.nan, math.inf, "0.4", None, True, [])],
        *[("force_std", v) for v in (-1e-9, 1.0, {}, "1mN")],
        *[("blocks", v) for v in (0, 2.5, 10**9, "3")],
        # Whole numbers that no float can hold, as JSON may have them.
        *[(name, v) for name in ("drag_coefficient", "blocks") for v in (10**400, -(10**400))],
        *[("latching", v) for v in ("", "glue", 1, None, ["none"])],
        *[("speed", v) for v in (0.0, 61.0, 0.2)],
    ],
)
def test_values_that_it_refuses(name: str, value: Any) -> None:
    with pytest.raises(InputError, match="expected"):
        KNOB[name].read(value)


def test_a_knob_reaches_the_study_s_value() -> None:
    study = dw.apply_overrides(Study(), {"forces.drag_coefficient": 4.0})
    source = PlaySource(study, STILL, blocks=1)
    assert source.knobs["drag_coefficient"].most == 4.0
    assert source.knobs["force_std"].most == KNOB["force_std"].most


def test_arrows_are_the_flow() -> None:
    arrows = flow_arrows(dw.uniform_flow(0.1, -0.2))
    assert arrows is not None
    for name, value in (("u", 0.1), ("v", -0.2)):
        found = dw.page.decode_array(arrows[name])
        assert found.shape == (len(arrows["y"]), len(arrows["x"]))
        np.testing.assert_allclose(found, value, rtol=1e-6)


def test_blocks_offered_have_room() -> None:
    source = PlaySource(Study(), STILL, blocks=1)
    # 40 % of a circle of 30 cm, in squares of 3 cm.
    assert source.knobs["blocks"].most == int(FILLED * math.pi * 0.15**2 / 0.03**2)
    source.tank.set(blocks=int(source.knobs["blocks"].most))
    source.tank.advance(2.0)
    assert source.tank.waiting == 0


def test_steps_of_a_circle() -> None:
    window = MotionWindow(None, seed=1)
    path = circle(0.002, 0.05, 50)
    for x, y in zip(path["x"].values, path["y"].values, strict=True):
        window.add(x, y, np.zeros(1, np.int32))
    points = window.points()
    # A chord, and the angle at the centre; two points are lost to the first step.
    assert points.shape == (48, 2)
    np.testing.assert_allclose(points[:, 0], 2 * 0.05 * math.sin(0.02))
    np.testing.assert_allclose(points[:, 1], 0.04)


def test_only_single_blocks_count() -> None:
    window = MotionWindow(None, seed=1)
    place = np.linspace(0.0, 0.1, 20)
    for index, at in enumerate(place):
        # Blocks 0 and 1 join at sample 10; block 2 stays alone.
        joined = [0, 0, 2] if index >= 10 else [0, 1, 2]
        window.add(np.array([at, at, at]), np.zeros(3), np.array(joined, np.int32))
    assert len(window.points()) == 8 + 8 + 18


def test_clear_forgets() -> None:
    window = MotionWindow(None, seed=1)
    for at in range(10):
        window.add(np.array([0.01 * at]), np.zeros(1), np.zeros(1, np.int32))
    assert len(window.points()) == 8
    window.clear()
    assert window.points().shape == (0, 2)
    assert window.message()["steps"] == 0


@pytest.mark.slow
def test_the_window_keeps_the_newest() -> None:
    window = MotionWindow(None, seed=1)
    for at in range(25_000):
        window.add(np.array([1e-6 * at**2]), np.zeros(1), np.zeros(1, np.int32))
    lengths = window.points()[:, 0]
    assert lengths.max() == pytest.approx(1e-6 * (24_999**2 - 24_998**2))
    assert 9_000 < lengths.size <= 20_000


def test_the_same_motion_is_near_and_another_far() -> None:
    study = exact()
    random = np.random.default_rng(2)
    walks = np.cumsum(random.normal(0.0, 1e-3, (3, 2, 2000)), axis=2)
    time = 0.1 * np.arange(2000)
    recording = build_trajectory(time, walks[0, 0], walks[0, 1], 0 * time)
    found = {}
    for name, scale, walk in (("same", 1.0, walks[1]), ("other", 2.0, walks[2])):
        window = MotionWindow(beside(recording, study), seed=1)
        for x, y in (scale * walk).T:
            window.add(np.array([x]), np.array([y]), np.zeros(1, np.int32))
        found[name] = window.message()
    # The two-sample test at n = m = 2000: D of the same is about the floor, twice the step is not.
    assert found["same"]["ks_distance"] < 2.0 * found["same"]["noise_floor"]
    assert found["other"]["ks_distance"] > 5.0 * found["other"]["noise_floor"]
    points = dw.comparison.apply_steps(dw.comparison.plan_steps(time), *walks[1])
    by_hand = dw.ks_distance(
        np.column_stack([points.step_length, points.turning_angle]),
        beside(recording, study).steps.points,
    )
    assert found["same"]["ks_distance"] == pytest.approx(by_hand, abs=1e-12)
    for density in ("simulated", "recording"):
        assert dw.page.decode_array(found["same"][density]).sum() == pytest.approx(1.0)


def test_the_camera_s_noise_is_added() -> None:
    """A block at rest before a camera of 0.3 mm has steps with a Rayleigh distribution."""
    study = dw.apply_overrides(
        Study(), {"observation.position_noise_m": 3e-4, "observation.position_quantum_m": 0.0}
    )
    window = MotionWindow(beside(circle(0.002, 0.05, 200), study), seed=1)
    for _ in range(5000):
        window.add(np.zeros(1), np.zeros(1), np.zeros(1, np.int32))
    lengths = window.points()[:, 0]
    # A difference of two positions: sigma sqrt(2), mean of a Rayleigh sigma sqrt(pi/2).
    mean = 3e-4 * math.sqrt(2.0) * math.sqrt(math.pi / 2.0)
    # Standard error 0.52 mean / sqrt(5000) = 0.7 %, twice that for shared points: 5 sigma.
    assert lengths.mean() == pytest.approx(mean, rel=0.05)


@pytest.mark.parametrize("interval", [0.1, 0.04, 1 / 30])
def test_positions_are_taken_at_the_recording_s_interval(interval: float) -> None:
    """Against the path of the same run at every time step, interpolated."""
    study, flow = exact(), dw.flow.random_tank_flow(1)
    source = PlaySource(
        study, flow, blocks=2, recording=circle(0.002, 0.05, 200, interval=interval)
    )
    for duration in np.random.default_rng(1).uniform(0.0, 0.05, 200):
        source._advance(duration, until=math.inf)
    path = dw.assembly_path(
        study, flow, blocks=2, seed=1, duration=source.tank.time, sample_interval=1e-9,
        backend="reference",
    )  # fmt: skip
    taken = source.motion._place[: source.motion._count]
    instants = interval * np.arange(len(taken))
    assert 0.0 <= source.tank.time - instants[-1] < interval + 0.01
    for part, name in enumerate("xy"):
        for block in range(2):
            known = np.isfinite(taken[:, block, part])
            wanted = np.interp(instants, path["time"].values, path[name].values[0, :, block])
            assert known.sum() > 20
            np.testing.assert_allclose(taken[known, block, part], wanted[known], atol=1e-9)


@pytest.mark.slow
def test_messages_and_actions() -> None:
    async def run() -> list[Any]:
        source = PlaySource(Study(), dw.flow.random_tank_flow(1), blocks=3)
        source.watched(1)
        heard: list[Any] = []
        task = asyncio.create_task(source.run(heard.append))

        async def until(ready: Any) -> None:
            async with asyncio.timeout(10):
                while not ready():
                    await asyncio.sleep(0.01)

        def tanks() -> list[Any]:
            return [content for content in heard if content["type"] == "tank"]

        await until(lambda: len(tanks()) > 5)
        await source.receive({"type": "action", "name": "pause"}, heard.append)
        await until(lambda: tanks()[-1]["paused"])
        stopped = tanks()[-1]["time_s"]
        await asyncio.sleep(0.2)
        assert tanks()[-1]["time_s"] == stopped
        await source.receive({"type": "set", "name": "blocks", "value": 5}, heard.append)
        await source.receive({"type": "set", "name": "latching", "value": "none"}, heard.append)
        await source.receive({"type": "action", "name": "run"}, heard.append)
        await until(lambda: len(tanks()[-1]["x"]) == 5)
        # All browsers are told what holds, once the knobs are at rest.
        await until(lambda: any(content["type"] == "section" for content in heard))
        items = next(c for c in heard if c["type"] == "section")["section"]["items"]
        assert {i["name"]: i["value"] for i in items}["blocks"] == 5
        await source.receive({"type": "set", "name": "blocks", "value": 0}, heard.append)
        await source.receive({"type": "set", "name": "nothing", "value": 0}, heard.append)
        for odd in ({}, {"type": "set"}, {"type": "action", "name": ["x"]}, {"type": 5}):
            await source.receive(odd, heard.append)
        await until(lambda: tanks()[-1]["time_s"] > stopped + 0.1)
        before = len(tanks())
        await source.receive({"type": "action", "name": "restart"}, heard.append)
        # Its first picture is at most one advance old, whenever it is looked at.
        await until(lambda: min([c["time_s"] for c in tanks()[before:]], default=1) <= 0.1)
        await until(lambda: any(content["type"] == "density" for content in heard))
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        return heard

    heard = asyncio.run(run())
    words = [content["words"] for content in heard if content["type"] == "note"]
    assert any("from 1 to" in one for one in words)
    assert any("no setting 'nothing'" in one for one in words)
    json.dumps(heard, allow_nan=False)


@pytest.mark.slow
def test_a_flood_of_wishes_is_one_wish(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever presses a button ten thousand times must not stop the tank for the others."""
    done: list[str] = []

    def counted(work: Any) -> Any:
        def call(**values: Any) -> None:
            done.append(work.__name__)
            work(**values)

        return call

    async def run() -> list[Any]:
        source = PlaySource(Study(), STILL, blocks=12)
        heard: list[Any] = []
        monkeypatch.setattr(source.tank, "restart", counted(source.tank.restart))
        monkeypatch.setattr(source.tank, "set", counted(source.tank.set))
        for number in range(10_000):
            await source.receive({"type": "action", "name": "restart"}, heard.append)
            wanted = {"type": "set", "name": "blocks", "value": 1 + number % 12}
            await source.receive(wanted, heard.append)
        source.watched(1)
        task = asyncio.create_task(source.run(heard.append))
        async with asyncio.timeout(60):
            while not heard or heard[-1].get("time_s", 0.0) < 0.05:
                await asyncio.sleep(0.01)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        return heard

    heard = asyncio.run(run())
    # The last of them holds: 10,000 is 4 more than a multiple of 12.
    assert len(heard[-1]["x"]) == 4
    assert done == ["restart", "set"]


@pytest.mark.slow
def test_the_tank_rests_while_nobody_watches() -> None:
    async def run() -> None:
        source = PlaySource(Study(), STILL, blocks=2)
        heard: list[Any] = []
        task = asyncio.create_task(source.run(heard.append))

        def pictures() -> int:
            return sum(content["type"] == "tank" for content in heard)

        async def it_moves() -> None:
            heard.clear()
            before = source.tank.time
            async with asyncio.timeout(30):
                while pictures() < 20 or source.tank.time == before:
                    await asyncio.sleep(0.01)

        async def it_rests() -> None:
            # What is on its way to a browser that has just gone still arrives.
            await asyncio.sleep(0.1)
            heard.clear()
            before = source.tank.time
            await asyncio.sleep(0.9)
            # One picture may have been under way.
            assert pictures() <= 1
            assert source.tank.time - before <= 0.11

        await it_rests()
        begin = time.perf_counter()
        source.watched(2)
        await it_moves()
        source.watched(1)
        await it_moves()
        source.watched(0)
        moved = time.perf_counter() - begin
        await it_rests()
        begin = time.perf_counter()
        source.watched(1)
        await it_moves()
        moved += time.perf_counter() - begin
        # A rest of a second is not caught up with.
        assert source.tank.time < moved + 0.4
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)

    asyncio.run(run())


@pytest.mark.parametrize(
    "change",
    [
        {"force_std": 0.0},
        {"force_std": 0.0, "drag_coefficient": 0.0},
        {"force_std": 0.0, "flow_scale": 0.0},
        {"flow_scale": 3.0, "drag_coefficient": 1.5},
        {"blocks": 31, "latching": "connector"},
        {"latching": "none", "hidden_face_drag": "full"},
    ],
)
def test_every_corner_of_the_knobs_has_a_picture_and_a_density(change: dict[str, Any]) -> None:
    """Motion without end, motion without steps: what is sent stays finite and of one shape."""
    source = PlaySource(Study(), dw.flow.random_tank_flow(1), blocks=4)
    for name, value in change.items():
        source._set(name, value)
    source._fulfil(lambda content: pytest.fail(str(content)))
    for _ in range(30):
        source._advance(0.5, until=math.inf)
    lone = Counter(source.tank.outcome.split("+"))
    assert source._tank_message()["counts"] == lone
    sent = [source._tank_message(), source.motion.message(), source._controls()]
    json.dumps(sent, allow_nan=False)
    assert sent[0]["time_s"] == pytest.approx(15.0, abs=0.02)
    assert len(sent[0]["x"]) + sent[0]["waiting"] == change.get("blocks", 4)
    assert np.hypot(sent[0]["x"], sent[0]["y"]).max() < 0.15
    values = {item["name"]: item["value"] for item in sent[2]["items"]}
    assert {name: values[name] for name in change} == change
    shares = dw.page.decode_array(sent[1]["simulated"])
    assert shares.sum() == pytest.approx(1.0 if sent[1]["steps"] else 0.0)


def test_latching_off_parts_what_is_joined_and_says_so() -> None:
    source = PlaySource(dw.apply_overrides(exact(), {"forces.force_std_N": 1e-3}), STILL, blocks=12)
    while source.tank.outcome.count("+") > 8:
        source.tank.advance(1.0)
    assert "separate" in source._controls()["note"]
    source._set("latching", "none")
    source._fulfil(lambda content: pytest.fail(str(content)))
    source._advance(0.5, until=math.inf)
    assert source.tank.outcome == "+".join(12 * ["1"])
    source._advance(20.0, until=math.inf)
    assert source.tank.outcome == "+".join(12 * ["1"])


@pytest.mark.slow
def test_whoever_comes_gets_a_picture_of_one_moment() -> None:
    """A greeting is asked for while another thread moves the tank: as many x as angles."""
    source = PlaySource(Study(), STILL, blocks=2)
    source.watched(1)

    async def run() -> None:
        heard: list[Any] = []
        task = asyncio.create_task(source.run(heard.append))
        sent = []
        for number in range(400):
            blocks = {"type": "set", "name": "blocks", "value": 2 + 20 * (number % 2)}
            await source.receive(blocks, heard.append)
            sent.append(source.greeting()[1])
            await asyncio.sleep(0.002)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        pictures = [content for content in heard if content["type"] == "tank"]
        assert len({len(one["x"]) for one in sent}) > 1
        # It is one of those that all have seen, not another look in the middle of a step.
        assert all(one in [sent[0], *pictures] for one in sent)

    asyncio.run(run())


@pytest.mark.slow
def test_real_time_is_kept() -> None:
    async def run() -> list[float]:
        source = PlaySource(Study(), STILL, blocks=2)
        source.watched(1)
        heard: list[Any] = []
        task = asyncio.create_task(source.run(heard.append))
        await asyncio.sleep(0.5)
        speeds: list[float] = []
        while len(speeds) < 20 and max(speeds, default=0.0) < 0.5:
            # The clock is read first and last: a pause between two lines only adds to its time.
            wall, begin = time.perf_counter(), source.tank.time
            await asyncio.sleep(1.0)
            simulated, passed = source.tank.time - begin, time.perf_counter() - wall
            # It may fall behind on a machine that is busy, never run ahead.
            assert simulated < 1.1 * passed + 0.05
            speeds.append(simulated / passed)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        return speeds

    # The best of some seconds: other work only slows it down.
    assert max(asyncio.run(run())) > 0.5


def test_joined_faces_of_a_built_assembly() -> None:
    """An L of three blocks, each turned by quarters, the whole by 30 degrees."""
    side, turn = 0.03, math.radians(30.0)
    cells = np.array([(0, 0), (1, 0), (1, 1)]) * side
    x = cells @ [math.cos(turn), -math.sin(turn)]
    y = cells @ [math.sin(turn), math.cos(turn)]
    theta = turn + 0.5 * math.pi * np.array([0, 1, 2])
    found = joined_faces(x, y, theta, np.zeros(3, np.int32), side=side)
    # Block 1 is turned by a quarter: its -x face of the lattice is its own +y; block 2 by a half.
    assert found == [(0, 0, 1, 1), (1, 0, 2, 1)]
    apart = joined_faces(x, y, theta, np.array([0, 1, 2], np.int32), side=side)
    assert apart == []


def test_stream_has_every_key_of_the_page() -> None:
    from pathlib import Path

    text = (Path(__file__).parents[3] / "docs" / "reference" / "live-stream.md").read_text()
    tank = dw.LiveTank(dw.apply_overrides(Study(), {"forces.force_std_N": 2e-3}), STILL, blocks=12)
    events: list[Any] = []
    while not events:
        tank.advance(1.0)
        events = tank.events()
    frame, hello = frame_line(tank, 3, events), hello_line(tank)
    for part in (frame, hello, frame["bodies"][0], frame["events"][0]):
        assert not [key for key in part if f"`{key}`" not in text]
    assert len(frame["bodies"]) == 12
    assert frame["outcome"] == tank.outcome
    sizes = dw.assembly.class_shapes(frame["outcome"])
    assert 12 - len(sizes) <= len(frame["joined"])
    event = frame["events"][0]
    assert event["bodies"] == [str(b) for b in events[0].blocks]
    first, second = event["bodies"]
    f, g = event["faces"]
    assert [first, f, second, g] in frame["joined"] or [second, g, first, f] in frame["joined"]
    json.dumps([frame, hello], allow_nan=False)
