"""Functions of the user: what they are given, what is made of what they return."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import driftwalk as dw
from driftwalk.conditions import Conditions
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.core.random_streams import world_keys
from driftwalk.motion import motion_model, observe_worlds
from driftwalk.simulation import Start
from driftwalk.simulation.backend import STATUS, Camera

TIMES = np.arange(50) / 10.0
LIKE = Conditions(
    sample_time=TIMES,
    start=Start(0.01, 0.02, np.nan, 0.0, 0.0, 0.0),
    camera=Camera(),
    tank=dw.Study().tank,
    view=None,
    flow=None,
    threads=1,
)
KEYS = world_keys(1, trial=[0, 0, 1], replicate=[0, 1, 0])


def line(scene, *, speed, turn=0.0):
    """Straight on, without chance."""
    x = scene.start.x[:, None] + speed * np.cos(turn) * scene.times
    y = scene.start.y[:, None] + speed * np.sin(turn) * scene.times
    return np.broadcast_to(x, (scene.worlds, scene.times.size)), y + np.zeros_like(x)


def test_what_a_function_returns_comes_out_where_the_camera_adds_nothing():
    model = motion_model(line, speed=(0, 1, "m/s"))
    worlds = model.simulate({"speed": np.array([0.1, 0.1, 0.3])}, LIKE, KEYS)
    np.testing.assert_array_equal(worlds.x, 0.01 + np.array([[0.1], [0.1], [0.3]]) * TIMES)
    np.testing.assert_array_equal(worlds.y, 0.02 + np.zeros_like(worlds.x))
    assert np.isnan(worlds.theta).all()
    assert (worlds.status == 0).all()


def test_worlds_of_a_call_share_one_setting_unless_many_are_allowed():
    calls = []

    def told(scene, *, speed):
        calls.append((scene.worlds, speed))
        return line(scene, speed=speed)

    values = {"speed": np.array([0.1, 0.1, 0.3])}
    motion_model(told, speed=(0, 1)).simulate(values, LIKE, KEYS)
    assert calls == [(2, 0.1), (1, 0.3)]
    calls.clear()
    motion_model(told, settings="many", speed=(0, 1)).simulate(values, LIKE, KEYS)
    assert [worlds for worlds, _ in calls] == [3]
    np.testing.assert_array_equal(calls[0][1], [[0.1], [0.1], [0.3]])


def test_a_start_without_orientation_draws_one_for_every_world():
    seen = []

    def told(scene, *, speed):
        seen.append(scene.start)
        return line(scene, speed=speed)

    motion_model(told, settings="many", speed=(0, 1)).simulate(
        {"speed": np.full(3, 0.1)}, LIKE, KEYS
    )
    assert len(set(seen[0].theta.tolist())) == 3
    assert seen[0].x.tolist() == [0.01] * 3


def test_noise_is_what_the_camera_says():
    camera = Camera(position_noise=1e-3, orientation_noise=0.05)
    time = np.arange(4000) / 10.0
    like = replace(LIKE, sample_time=time, camera=camera)
    still = np.full((3, time.size), 0.05)
    seen = observe_worlds(still, 2 * still, 3 * still, like, KEYS)
    # 12 000 numbers: the standard deviation is known to 1 / sqrt(24 000); 4.5 of these, each way,
    # are left by one in 100 000 of such tests.
    for values, true, noise in (
        (seen.x, 0.05, 1e-3),
        (seen.y, 0.1, 1e-3),
        (seen.theta, 0.15, 0.05),
    ):
        assert np.std(values - true) == pytest.approx(noise, rel=4.5 / np.sqrt(24_000))
        assert abs(np.mean(values - true)) < 4.5 * noise / np.sqrt(12_000)
    assert (seen.status == STATUS["no_motion"]).all()


def test_samples_outside_the_field_of_view_are_missing():
    from driftwalk.model import FieldOfView

    view = FieldOfView(shape="rectangle", width_m=0.1, height_m=0.1, center_m=(0.05, 0.0))
    x = np.broadcast_to(np.linspace(-0.1, 0.2, TIMES.size), (3, TIMES.size))
    seen = observe_worlds(x, 0 * x, 0 * x, replace(LIKE, view=view), KEYS)
    np.testing.assert_array_equal(np.isfinite(seen.x), (x >= 0.0) & (x <= 0.1))
    circle = FieldOfView(diameter_m=0.1, center_m=(0.05, 0.0))
    seen = observe_worlds(x, 0 * x, 0 * x, replace(LIKE, view=circle), KEYS)
    np.testing.assert_array_equal(np.isfinite(seen.x), np.abs(x - 0.05) <= 0.05)
    assert (seen.status == 0).all()


def test_a_world_that_lost_its_numbers_has_a_status_and_the_others_go_on():
    def fails(scene, *, speed):
        x, y = line(scene, speed=speed)
        x = np.array(x)
        x[0, -1] = np.nan
        return x, y

    worlds = motion_model(fails, speed=(0, 1)).simulate({"speed": np.full(3, 0.1)}, LIKE, KEYS)
    assert worlds.status.tolist() == [STATUS["non_finite"], 0, 0]


@pytest.mark.parametrize(
    ("returned", "message"),
    [
        (lambda scene: np.zeros((scene.worlds, scene.times.size)), "returned ndarray: return x, y"),
        (lambda scene: (scene.times, scene.times), r"shape \(50,\), expected \(3, 50\)"),
        (lambda scene: (np.zeros((3, 50)), [["a"] * 50] * 3), "a y that is no array of numbers"),
        (lambda scene: 1 / 0, "failed: ZeroDivisionError: division by zero"),
    ],
)
def test_a_function_that_gives_no_positions_is_named(returned, message):
    def wrong(scene, *, speed):
        return returned(scene)

    model = motion_model(wrong, speed=(0, 1))
    with pytest.raises(InputError, match=rf"the model wrong\(speed=0.1\) .*{message}"):
        model.simulate({"speed": np.full(3, 0.1)}, LIKE, KEYS)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: motion_model("line", speed=(0, 1)), "there is no motion model 'line'"),
        (lambda: motion_model(line), "needs a parameter"),
        (lambda: motion_model(line, speed=0.1), "expected a range such as"),
        (lambda: motion_model(line, speed=("a", "b")), "no two numbers"),
        (lambda: motion_model(line, speed=(1, 0)), "ends at 0, below its beginning 1"),
        (lambda: motion_model(line, sped=(0, 1)), "cannot be called with a scene and sped"),
        (lambda: motion_model(line, settings="few", speed=(0, 1)), "one of one, many, got 'few'"),
        (
            lambda: motion_model(line, dw.motion.Parameter("speed", "1", 0, 1), speed=(0, 1)),
            "given twice: speed, speed",
        ),
    ],
)
def test_what_makes_no_model_is_refused(make, message):
    with pytest.raises(ConfigurationError, match=message):
        make()


def test_a_model_is_described_by_its_parameters_and_its_source():
    one, other = (motion_model(line, speed=(0, high)).describe() for high in (1, 2))
    assert one["name"] == "line"
    assert one["source_sha256"] == other["source_sha256"]
    assert one["parameters"] != other["parameters"]
