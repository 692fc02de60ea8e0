"""Maps against the public functions, windows against hand-made maps."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import driftwalk as dw
from driftwalk.calibration.problem import prepare_problem
from driftwalk.calibration.search import (
    MOST_REFINED_WORLDS,
    WINDOW_STEPS,
    Map,
    recentre,
    refined_replicates,
    refined_window,
    run_map,
)
from driftwalk.calibration.surface import Optimum
from driftwalk.comparison import apply_steps
from driftwalk.conditions import recorded_camera
from driftwalk.core.errors import InputError
from driftwalk.core.seeds import world_keys
from driftwalk.schema import Track, body_track
from driftwalk.simulation import Start
from driftwalk.simulation.backend import Camera

STEPS = (0.01, 2e-5)


@pytest.fixture(scope="module")
def track():
    recording = dw.tank30_recording()
    return body_track(recording.isel(time=slice(0, 1200)))


@pytest.fixture(scope="module")
def problem(track):
    camera = Camera(3e-4, 0.0, 0.0)
    return prepare_problem(track, dw.Study(), dw.tank30_flow(), camera=camera, threads=1)


def hand_made(minimum=(0.4, 6e-4), floor=0.02, slope=0.3):
    drag, force = np.arange(41) * 0.05, np.arange(41) * 5e-5
    distance = floor + slope * np.hypot(
        (drag[:, None] - minimum[0]) / 0.2, (force[None, :] - minimum[1]) / 4e-4
    )
    return Map((drag, force), np.clip(distance, 0, 1)[..., None], {})


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
    from driftwalk.simulation.backend import native_model, world_table

    worlds = world_table(**problem.like.start._asdict(), drag_coefficient=0.5, force_std=4e-4)
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


def test_the_window_holds_the_minimum_and_ten_steps_around_it():
    window = refined_window(hand_made(), STEPS, margin=0.0)
    assert window[0][0] <= 0.4 - WINDOW_STEPS * STEPS[0] + 1e-12
    assert window[0][-1] >= 0.4 + WINDOW_STEPS * STEPS[0] - 1e-12
    assert np.diff(window[0]) == pytest.approx(STEPS[0])
    assert np.diff(window[1]) == pytest.approx(STEPS[1])
    assert np.isclose(window[1], 6e-4).any()


def test_a_wide_valley_gets_a_wide_window():
    narrow = refined_window(hand_made(slope=0.3), STEPS, margin=0.02)
    wide = refined_window(hand_made(slope=0.03), STEPS, margin=0.02)
    assert np.ptp(wide[0]) > np.ptp(narrow[0])
    cells = wide[0].size * wide[1].size
    assert refined_replicates(wide, 8) * cells <= max(MOST_REFINED_WORLDS, 2 * cells)


def test_the_window_stays_within_the_coarse_grid():
    window = refined_window(hand_made(minimum=(0.0, 2e-3)), STEPS, margin=0.02)
    assert window[0][0] == 0.0
    assert window[1][-1] == pytest.approx(2e-3)


def test_an_optimum_near_the_edge_of_the_window_recentres_it():
    coarse = hand_made()
    window = refined_window(coarse, STEPS, margin=0.0)
    middle = Optimum((0.4, 6e-4), 0.02)
    same = recentre(window, middle, coarse, STEPS)
    assert all(np.array_equal(a, b) for a, b in zip(window, same, strict=True))
    edge = Optimum((float(window[0][-1]), 6e-4), 0.02)
    moved = recentre(window, edge, coarse, STEPS)
    assert np.median(moved[0]) == pytest.approx(edge.point[0])
    np.testing.assert_array_equal(moved[1], window[1])


def test_an_optimum_at_the_end_of_the_coarse_grid_does_not_move_the_window():
    coarse = hand_made(minimum=(0.0, 6e-4))
    window = refined_window(coarse, STEPS, margin=0.0)
    same = recentre(window, Optimum((0.0, 6e-4), 0.02), coarse, STEPS)
    np.testing.assert_array_equal(same[0], window[0])


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
