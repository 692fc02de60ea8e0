"""The playground of a motion model: bodies that go on where they are, and a knob per parameter."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest

import driftwalk as dw
from driftwalk.core.errors import InputError
from driftwalk.core.random_streams import world_keys
from driftwalk.model import apply_overrides
from driftwalk.motion import model_start
from driftwalk.simulation.backend import Camera
from driftwalk.viewer import ModelPlaySource
from driftwalk.viewer.play.model_playground import STRETCH_S, MovingBodies

ACTIVE = {"speed": 0.02, "rotational_diffusion": 0.5, "turn_rate": 0.1}


def source(values: dict[str, float] = ACTIVE, **options: Any) -> ModelPlaySource:
    return ModelPlaySource(dw.motion_model("active"), values, dw.Study(), **options)


def bodies(model: Any, values: dict[str, float], **options: Any) -> MovingBodies:
    usual: dict[str, Any] = {"bodies": 3, "interval": 0.1, "seed": 5}
    return MovingBodies(model, values, dw.Study(), None, **{**usual, **options})


def test_the_first_stretch_is_a_simulation_of_the_model() -> None:
    model = dw.motion_model("active")
    moving = bodies(model, ACTIVE)
    times = moving.sample_s * np.arange(101)
    keys = world_keys(5, trial=0, replicate=np.arange(3))
    start = model_start(model, dw.Study(), None, keys)
    whole = moving._times
    like = dw.conditions.Conditions(whole, start, Camera(), dw.Study().tank, None, None, threads=2)
    columns = {name: np.full(3, value) for name, value in ACTIVE.items()}
    expected = model.simulate(columns, like, keys)
    for sample in range(times.size):
        x, y, theta = moving.place()
        np.testing.assert_array_equal(x, expected.x[:, sample])
        np.testing.assert_array_equal(y, expected.y[:, sample])
        np.testing.assert_array_equal(theta, expected.theta[:, sample])
        assert moving.time == pytest.approx(times[sample])
        moving.next()


def test_a_body_goes_on_where_it_is_with_the_new_parameter() -> None:
    """A straight run at 1 cm/s, then at 3 cm/s, in the same direction; across stretches too."""
    straight = {"speed": 0.01, "rotational_diffusion": 0.0, "turn_rate": 0.0}
    moving = bodies(dw.motion_model("active"), straight)
    for _ in range(10):
        moving.next()
    before = np.array(moving.place())
    moving.change("speed", 0.03)
    np.testing.assert_allclose(np.array(moving.place()), before, atol=1e-6)
    path = [np.array(moving.place())]
    for _ in range(20):
        moving.next()
        path.append(np.array(moving.place()))
    step = np.diff(np.array(path)[:, :2], axis=0)
    inside = np.hypot(*np.array(path)[1:, :2].swapaxes(0, 1)) < 0.149
    speed = np.hypot(step[:, 0], step[:, 1]) / moving.sample_s
    assert inside.any()
    np.testing.assert_allclose(speed[inside], 0.03, rtol=1e-3)
    heading = np.arctan2(step[:, 1], step[:, 0])
    turned = np.angle(np.exp(1j * (heading - before[2])))
    np.testing.assert_allclose(turned[inside], 0.0, atol=1e-3)


def test_a_turning_body_does_not_jump_between_stretches() -> None:
    """On a circle of 1 cm, which it would leave if a stretch began with another heading."""
    circle = {"speed": 0.01, "rotational_diffusion": 0.0, "turn_rate": 1.0}
    study = apply_overrides(
        dw.Study(), {"simulation.start": {"x_m": 0.0, "y_m": -0.01, "theta_rad": 0.0}}
    )
    moving = MovingBodies(
        dw.motion_model("active"), circle, study, None, bodies=1, interval=0.1, seed=1
    )
    radii = []
    while moving.time < 2.2 * STRETCH_S:
        moving.next()
        radii.append(float(np.hypot(*(axis[0] for axis in moving.place()[:2]))))
    assert moving._stretch == 2
    np.testing.assert_allclose(radii, 0.01, rtol=0.02)


def test_a_model_that_fails_with_a_value_keeps_the_former_one() -> None:
    def brittle(scene, *, speed=(0.01, 0.1, "m/s")):
        if speed > 0.05:
            raise ValueError("too fast")
        x = scene.start.x[:, None] + speed * scene.times
        return x, np.broadcast_to(scene.start.y[:, None], x.shape)

    moving = bodies(dw.motion_model(brittle), {"speed": 0.02})
    with pytest.raises(InputError, match=r"speed=0\.06.*too fast"):
        moving.change("speed", 0.06)
    assert moving.values == {"speed": 0.02}
    moving.next()
    played = ModelPlaySource(dw.motion_model(brittle), {"speed": 0.02}, dw.Study())
    notes: list[Any] = []
    played._set("parameter:speed", 0.06)
    played._fulfil(notes.append)
    assert "too fast" in notes[0]["words"]
    shown = {item["name"]: item["value"] for item in played._controls()["items"]}
    assert shown["parameter:speed"] == 0.02
    # Functions give no orientation: JSON has no number for that.
    assert json.loads(json.dumps(played._tank_message(), allow_nan=False))["theta"] == [None] * 4


def test_a_knob_for_each_parameter() -> None:
    items = {item["name"]: item for item in source()._controls()["items"]}
    assert list(items) == [*(f"parameter:{name}" for name in ACTIVE), "bodies", "speed"]
    speed, turn = items["parameter:speed"], items["parameter:turn_rate"]
    assert (speed["unit"], speed["min"], speed["max"], speed["log"]) == ("m/s", 1e-6, 10.0, True)
    assert (turn["unit"], turn["min"], turn["max"], turn["log"]) == ("rad/s", -10.0, 10.0, False)
    assert [items[f"parameter:{name}"]["value"] for name in ACTIVE] == list(ACTIVE.values())


def test_a_parameter_without_a_value_begins_in_the_middle_of_its_scale() -> None:
    items = {item["name"]: item for item in source({})._controls()["items"]}
    assert items["parameter:speed"]["value"] == pytest.approx(math.sqrt(1e-6 * 10.0))
    assert items["parameter:turn_rate"]["value"] == 0.0


def test_a_value_beyond_the_range_is_on_the_slider() -> None:
    items = source({**ACTIVE, "speed": 20.0, "rotational_diffusion": 0.0})._controls()["items"]
    speed, diffusion = items[0], items[1]
    assert (speed["max"], speed["log"]) == (20.0, True)
    assert (diffusion["min"], diffusion["log"]) == (0.0, False)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("parameter:speed", 100.0),
        ("parameter:speed", -1.0),
        ("parameter:speed", "fast"),
        ("parameter:speed", math.nan),
        ("bodies", 1.5),
        ("bodies", 10_000),
        ("drag_coefficient", 0.4),
    ],
)
def test_values_that_are_refused(name: str, value: Any) -> None:
    with pytest.raises(InputError):
        source()._set(name, value)


def test_the_clock_the_steps_and_a_change_of_the_bodies() -> None:
    """The steps of 0.1 s at 2 cm/s are 2 mm long, but where the wall stops a body."""
    played = source()
    for duration in np.random.default_rng(1).uniform(0.0, 0.1, 400):
        played._advance(float(duration), until=math.inf)
    simulated = float(np.random.default_rng(1).uniform(0.0, 0.1, 400).sum())
    assert played.time == pytest.approx(simulated, abs=1e-6)
    points = played.motion.points()
    expected = 4 * (math.floor(simulated / 0.1) - 1)
    assert abs(len(points) - expected) <= 4
    assert np.median(points[:, 0]) == pytest.approx(0.002, rel=0.01)
    played._set("bodies", 7)
    played._fulfil(lambda content: pytest.fail(str(content)))
    message = played._tank_message()
    assert (len(message["x"]), len(message["theta"]), message["time_s"]) == (7, 7, 0.0)
    assert len(played.motion.points()) == 0


def test_next_to_a_recording() -> None:
    recording = dw.tank30_recording().isel(time=slice(0, 600))
    played = source(recording=recording, body=None)
    played._advance(60.0, until=math.inf)
    message = played.motion.message()
    assert message["steps"] > 1000
    assert 0.0 < message["ks_distance"] <= 1.0
    page = played.greeting()[0]["page"]
    assert [section["kind"] for section in page["sections"]] == ["tank", "controls", "density"]
    assert (page["sections"][0]["shape"], page["subtitle"][:6]) == ("dot", "active")


def test_a_flow_that_is_missing() -> None:
    with pytest.raises(InputError, match="give the flow of the water"):
        ModelPlaySource(dw.motion_model("active+flow"), ACTIVE, dw.Study())
