"""The objective of a search, its ranges, and a model found again from its own motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import driftwalk as dw
from driftwalk.calibration.evolution import (
    AspectObjective,
    Budget,
    search_minimum,
    wall_distance,
)
from driftwalk.calibration.held_out.recorded import Scales, recorded_ranges, scales_of
from driftwalk.comparison.aspects import aspect_reference, form_aspects, plan_aspects
from driftwalk.conditions import Conditions
from driftwalk.core.errors import InputError
from driftwalk.core.random_streams import world_keys
from driftwalk.model import Tank
from driftwalk.schema import Parameter
from driftwalk.schema.trajectory import Track
from driftwalk.simulation.backend import Camera
from driftwalk.simulation.initial import Start

SCALES = Scales(speed=0.02, fastest=0.06, interval=0.2, duration=600.0, size=0.1)
TRUTH = {"speed": 0.02, "rotational_diffusion": 0.5}


@pytest.fixture(scope="module")
def conditions() -> Conditions:
    return Conditions(
        sample_time=np.arange(3000) / 5.0,
        start=Start(0.0, 0.0, 0.3),
        camera=Camera(position_noise=3e-4),
        tank=Tank(diameter_m=0.3),
        view=None,
        flow=None,
        threads=1,
    )


@pytest.fixture(scope="module")
def objective(conditions) -> AspectObjective:
    """Return the objective of an active particle on a synthetic recording of one."""
    model = dw.motion_model("active", turn_rate=0.0)
    keys = world_keys(77, trial=0, replicate=np.arange(1))
    truth = model.simulate({name: np.array([v]) for name, v in TRUTH.items()}, conditions, keys)
    plan = plan_aspects(conditions.sample_time)
    aspects = form_aspects(plan, truth.x[0], truth.y[0], wall=wall_distance(conditions))
    reference = aspect_reference(aspects, duration=conditions.sample_time[-1])
    ranges = recorded_ranges(model.parameters, SCALES)
    return AspectObjective(model, ranges, conditions, plan, reference, seed=5)


@pytest.mark.slow
def test_a_model_is_found_again_from_its_own_motion(objective):
    """Ten minutes hold 300 times in which the heading forgets: the diffusion has an error of 8 %.

    The end of a search adds as much again; four standard deviations are 45 %. The speed is known
    from 3000 steps, within less than 1 %.
    """
    found = search_minimum(objective, 2, budget=Budget(design=64, starts=2, short=12, long=20))
    values = {name: float(value[0]) for name, value in objective.values(found.best).items()}
    assert values["speed"] == pytest.approx(TRUTH["speed"], rel=0.03)
    assert values["rotational_diffusion"] == pytest.approx(TRUTH["rotational_diffusion"], rel=0.45)
    assert found.score < 2.0


def test_the_truth_scores_better_than_another_setting(objective):
    at = [
        (one.to_coordinate(TRUTH[one.name]) - one.to_coordinate(one.low))
        / (one.to_coordinate(one.high) - one.to_coordinate(one.low))
        for one in objective.ranges
    ]
    truth = np.array(at, dtype=float)
    scores = objective(np.array([truth, np.clip(truth + 0.1, 0, 1)]), 0, 4)
    assert scores[0] < 2.0 < scores[1]


def test_the_number_of_an_evaluation_is_its_address(objective):
    settings = np.array([[0.3, 0.4], [0.5, 0.6]])
    both = objective.distances(settings, 2, stage="evolution", first=7)
    second = objective.distances(settings[1:], 2, stage="evolution", first=8)
    np.testing.assert_array_equal(both[1:], second)
    again = objective.distances(settings[1:], 2, stage="evolution", first=9)
    assert not np.array_equal(second, again)


def test_ranges_follow_the_scales_of_the_recording():
    found = {one.name: one for one in recorded_ranges(
        dw.motion_model("run_rest+wall+slow+stroke+diffusion").parameters, SCALES
    )}  # fmt: skip
    assert found["speed"].low < SCALES.speed < SCALES.fastest < found["speed"].high
    assert found["run_time"].high == pytest.approx(60.0)
    assert found["wall_range"].high == pytest.approx(SCALES.size)
    assert found["stroke_frequency"].high == pytest.approx(10.0)
    # A body that only slides along the wall has to be near the range: in ten minutes a rate of
    # 0.2 rad/s takes it off the wall several times as fast as its diffusion does.
    assert found["wall_turn"].low == pytest.approx(1.0 / 60.0)
    # A number without a unit keeps its range.
    assert (found["speed_cv"].low, found["speed_cv"].high) == (0.01, 2.0)


def test_a_rate_of_either_sign_is_searched_on_both_sides():
    turn = next(one for one in dw.motion_model("active").parameters if one.name == "turn_rate")
    found = recorded_ranges([turn], SCALES)[0]
    assert found.low == -found.high < 0.0


def test_a_range_that_the_recording_does_not_meet_stays():
    far = Parameter("speed", "m/s", 100.0, 200.0, scale="log")
    assert recorded_ranges([far], SCALES) == (far,)


def test_a_recording_at_rest_has_no_scales():
    time = np.arange(100) / 10.0
    track = Track(time, 0 * time, 0 * time, 0 * time)
    with pytest.raises(InputError, match="does not move"):
        scales_of(track, step_interval=0.1, steps=np.zeros(99))


def test_the_wall_is_where_the_tank_says(conditions):
    circle = wall_distance(conditions)
    np.testing.assert_allclose(circle(np.array([0.0, 0.1]), np.array([0.0, 0.0])), [0.15, 0.05])
    box = Tank(shape="rectangle", width_m=0.4, height_m=0.2)
    square = wall_distance(replace(conditions, tank=box))
    np.testing.assert_allclose(
        square(np.array([0.0, 0.15, 0.0]), np.array([0.0, 0.0, -0.08])), [0.1, 0.05, 0.02]
    )
