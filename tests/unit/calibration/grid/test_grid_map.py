"""Maps against the public functions."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import driftwalk as dw
from driftwalk.calibration.grid.bootstrap_region import simulated_steps
from driftwalk.calibration.grid.grid_map import MapSimulator, SweepProgress
from driftwalk.calibration.problem import prepare_problem
from driftwalk.comparison import apply_steps
from driftwalk.conditions import recorded_camera
from driftwalk.core.calibration_stages import share_of_map
from driftwalk.core.errors import InputError
from driftwalk.core.random_streams import world_keys
from driftwalk.schema import Track, body_track
from driftwalk.simulation import Start
from driftwalk.simulation.backend import Camera


@pytest.fixture(scope="module")
def track():
    recording = dw.tank30_recording()
    return body_track(recording.isel(time=slice(0, 1200)))


@pytest.fixture(scope="module")
def problem(track):
    camera = Camera(3e-4, 0.0, 0.0)
    return prepare_problem(track, dw.Study(), dw.tank30_flow(), camera=camera, threads=1)


def run_map(problem, axes, *, stage, replicates, only=None, apart=False, **each):
    maps = MapSimulator(problem, stage, apart=apart, **each)
    return maps.full(tuple(map(np.asarray, axes)), replicates, only)


def add_replicates(problem, found, chosen, *, stage, replicates, apart=False, **each):
    return MapSimulator(problem, stage, apart=apart, **each).more(found, chosen, replicates)


def test_a_map_is_what_simulating_and_comparing_each_setting_gives(problem):
    found = run_map(
        problem, ([0.3, 0.5], [4e-4, 8e-4]), stage="coarse", replicates=2, details="all"
    )
    study = dw.Study()
    model = dw.model.apply_overrides(
        study,
        {
            "forces.drag_coefficient": 0.5,
            "forces.force_std_N": 4e-4,
            "observation.position_noise_m": 3e-4,
        },
    )
    # The address of setting 2 of the coarse stage, replicate 1.
    key = world_keys(1, trial=(1 << 40) + 2, replicate=1)
    from driftwalk import _core
    from driftwalk.simulation.backend import native_model
    from driftwalk.simulation.initial import world_table

    worlds = world_table(problem.like.start, key, drag_coefficient=0.5, force_std=4e-4)
    native = native_model(model, problem.like.flow, problem.like.sample_time, problem.like.camera)
    x, y, _, _ = _core.simulate(native, worlds, key, threads=1, precision="single")
    steps = apply_steps(problem.reference.plan, x[0].astype(float), y[0].astype(float))
    sample = np.column_stack([steps.step_length, steps.turning_angle])
    assert found.distance[1, 0, 1] == dw.ks_distance(problem.steps, sample)
    np.testing.assert_array_equal(
        found.arrays["excerpt_x"].shape, (2, 2, int(np.sum(problem.like.sample_time <= 30.0)))
    )
    assert found.arrays["step_density"].sum(axis=(2, 3)) == pytest.approx(np.ones((2, 2)))


def test_a_map_does_not_depend_on_the_order_or_company_of_its_settings(problem):
    # The address is the index within the stage, so a grid that begins the same way agrees.
    small = run_map(problem, ([0.3], [4e-4, 8e-4]), stage="coarse", replicates=2, details="none")
    large = run_map(
        problem, ([0.3, 0.5], [4e-4, 8e-4]), stage="coarse", replicates=2, details="none"
    )
    np.testing.assert_array_equal(small.distance[0], large.distance[0])


def test_a_setting_in_which_nothing_moves_is_as_far_as_can_be(track):
    still = dw.uniform_flow(0.0, 0.0, arena=dw.Study().tank.to_arena())
    rest = Track(track.time, track.x, track.y, track.theta)
    problem = prepare_problem(rest, dw.Study(), still, camera=Camera(3e-4, 0.0, 0.0), threads=1)
    like = dataclasses.replace(problem.like, start=Start(0.0, 0.0, 0.0))
    problem = dataclasses.replace(problem, like=like)
    found = run_map(problem, ([1.0], [0.0, 5e-4]), stage="coarse", replicates=2, details="none")
    assert (found.arrays["status"][0, 0] & 4).all()
    assert (found.distance[0, 0] == 1.0).all()
    assert (found.arrays["status"][0, 1] == 0).all()
    assert (found.distance[0, 1] < 1.0).all()


def test_more_replicates_are_those_of_a_map_that_has_them_everywhere(problem):
    axes = ([0.3, 0.5], [4e-4, 8e-4])
    each = {"stage": "coarse", "details": "all"}
    every = run_map(problem, axes, replicates=3, **each)
    once = run_map(problem, axes, replicates=1, **each)
    chosen = np.array([[False, True], [True, False]])
    found = add_replicates(problem, once, chosen, replicates=3, **each)
    assert found.replicates.tolist() == [[1, 3], [3, 1]]
    np.testing.assert_array_equal(found.simulated.sum(axis=-1), found.replicates)
    np.testing.assert_array_equal(found.distance[chosen], every.distance[chosen])
    np.testing.assert_array_equal(found.distance[~chosen][:, 0], every.distance[~chosen][:, 0])
    assert np.isnan(found.distance[~chosen][:, 1:]).all()
    assert (found.arrays["ks_quadrant"][~chosen][:, 1:] == -1).all()
    for name in ("step_density", "pairs", "ks_step_length", "excerpt_x"):
        np.testing.assert_allclose(
            found.arrays[name][chosen], every.arrays[name][chosen], atol=1e-7, err_msg=name
        )
    np.testing.assert_allclose(found.mean[chosen], every.mean[chosen])
    np.testing.assert_allclose(found.standard_error[chosen], every.standard_error[chosen])
    assert np.isnan(found.standard_error[~chosen]).all()


def test_a_map_and_its_more_replicates_say_how_far_they_are_and_never_go_back(problem):
    shares = []
    progress = SweepProgress(lambda done, total: shares.append(done / total), share_of_map)
    maps = MapSimulator(problem, "coarse", apart=False, progress=progress)
    axes = tuple(np.array(values) for values in ([0.3, 0.5], [4e-4, 8e-4]))
    once = maps.full(axes, 1)
    assert (shares[0], shares[-1]) == (0.0, 0.9)
    maps.more(once, np.array([[False, True], [True, False]]), 3)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_none_chosen_or_none_wanted_leaves_a_map_as_it_is(problem):
    once = run_map(problem, ([0.3], [4e-4]), stage="coarse", replicates=1)
    none, all_of_it = np.zeros((1, 1), dtype=bool), np.ones((1, 1), dtype=bool)
    assert add_replicates(problem, once, none, stage="coarse", replicates=4) is once
    assert add_replicates(problem, once, all_of_it, stage="coarse", replicates=1) is once


def test_replicates_of_a_setting_are_apart_as_two_recordings_are(problem):
    """Measured again from the steps of the same worlds."""
    found = run_map(problem, ([0.3], [4e-4, 8e-4]), stage="refined", replicates=4, apart=True)
    steps, _ = simulated_steps(problem, ([0.3, 0.3], [4e-4, 8e-4]), stage="refined", replicates=4)
    matrix = problem.statistic.matrix(steps, steps)
    expected = [matrix[:2, 2:4].mean(), matrix[4:6, 6:8].mean()]
    np.testing.assert_allclose(found.apart[0], expected)


def test_one_more_replicate_leaves_what_the_first_are_apart(problem):
    first = run_map(problem, ([0.3], [4e-4, 8e-4]), stage="refined", replicates=2, apart=True)
    chosen = np.array([[True, False]])
    more = add_replicates(problem, first, chosen, stage="refined", replicates=3, apart=True)
    assert more.replicates.tolist() == [[3, 2]]
    np.testing.assert_array_equal(more.apart, first.apart)


def test_a_setting_that_does_not_move_gets_no_allowance(problem):
    still = dw.uniform_flow(0.0, 0.0, arena=dw.Study().tank.to_arena())
    like = dataclasses.replace(problem.like, flow=still, start=Start(0.0, 0.0, 0.0))
    resting = dataclasses.replace(problem, like=like)
    found = run_map(resting, ([1.0], [0.0]), stage="refined", replicates=2, apart=True)
    assert (found.mean[0, 0], found.apart[0, 0]) == (1.0, 0.0)


def test_settings_that_are_left_out_are_as_far_as_can_be(problem):
    axes = ([0.3, 0.5], [4e-4, 8e-4])
    only = np.array([[False, True], [True, False]])
    every = run_map(problem, axes, stage="first_half", replicates=1)
    found = run_map(problem, axes, stage="first_half", replicates=1, only=only)
    np.testing.assert_array_equal(found.mean[only], every.mean[only])
    assert (found.mean[~only] == 1.0).all()


def test_the_camera_takes_what_rounding_adds_off_the_estimate():
    random = np.random.default_rng(3)
    time = np.arange(4000) * 0.1
    x, y = (0.01 * time + random.normal(0.0, 4e-4, time.size) for _ in range(2))
    track = Track(time, x, y, np.full(time.size, np.nan))
    plain = recorded_camera(track, dw.Study(), position_quantum=0.0)
    rounded = recorded_camera(track, dw.Study(), position_quantum=5e-4)
    assert plain.position_noise == pytest.approx(4e-4, rel=0.1)
    expected = np.sqrt(plain.position_noise**2 - (5e-4) ** 2 / 12)
    assert rounded.position_noise == pytest.approx(expected)


def test_a_recording_too_short_for_steps_is_refused(track):
    short = Track(*(values[:20] for values in track))
    with pytest.raises(InputError, match="pairs of steps"):
        prepare_problem(short, dw.Study(), dw.tank30_flow(), camera=Camera())
