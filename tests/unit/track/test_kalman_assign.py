"""The filter against closed forms, the assignment against all assignments there are."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

from driftwalk.track.follow.assign import assign, connected_groups
from driftwalk.track.follow.kalman import Motion, predict, start_state, update
from driftwalk.track.follow.settings import TrackerSettings

STILL = Motion(1e-30, 1e-30)


def test_fit_of_a_line_is_that_of_least_squares() -> None:
    """Without process noise and with a wide prior the filter is the regression of x on time."""
    random = np.random.default_rng(0)
    time = np.cumsum(random.uniform(0.05, 0.3, 40))
    x = 0.3 + 0.7 * time + 0.01 * random.normal(size=40)
    noise = np.diag([1e-4, 1e-4, 1e-4])[None]
    first = np.array([[x[0], 0.0, 0.0]])
    # Three standard deviations are as fast as a body can be.
    wide = TrackerSettings(max_speed=3e3, max_turn_rate=3e3)
    mean, spread = start_state(first, noise, wide)
    for step, value in zip(np.diff(time), x[1:], strict=True):
        mean, spread = predict(mean, spread, np.array([step]), STILL)
        mean, spread = update(mean, spread, np.array([[value, 0.0, 0.0]]), noise)
    slope, height = np.polyfit(time - time[-1], x, 1)
    assert mean[0, 0] == pytest.approx(height, rel=1e-5)
    assert mean[0, 3] == pytest.approx(slope, rel=1e-5)
    design = np.column_stack([np.ones(40), time - time[-1]])
    expected = 1e-4 * np.linalg.inv(design.T @ design)
    np.testing.assert_allclose(spread[0][np.ix_([0, 3], [0, 3])], expected, rtol=1e-3)


def test_uncertainty_grows_with_time_and_not_with_frames() -> None:
    """White acceleration over T: variance q T^3 / 3 of the place, q T of the velocity."""
    motion = Motion(0.02, 0.5)
    mean, spread = np.zeros((1, 6)), np.zeros((1, 6, 6))
    once = predict(mean, spread, np.array([0.7]), motion)[1][0]
    for _ in range(7):
        mean, spread = predict(mean, spread, np.array([0.1]), motion)
    np.testing.assert_allclose(spread[0], once, rtol=1e-9, atol=1e-18)
    assert once[0, 0] == pytest.approx(0.02 * 0.7**3 / 3)
    assert once[0, 3] == pytest.approx(0.02 * 0.7**2 / 2)
    assert once[5, 5] == pytest.approx(0.5 * 0.7)


def test_angle_goes_the_short_way_round() -> None:
    mean, spread = np.zeros((2, 6)), np.tile(np.eye(6), (2, 1, 1))
    mean[:, 2] = 3.1, -3.1
    measured = np.array([[0.0, 0.0, -3.1], [0.0, 0.0, 3.1]])
    after, _ = update(mean, spread, measured, np.tile(np.eye(3), (2, 1, 1)))
    np.testing.assert_allclose(np.abs(after[:, 2]), math.pi, atol=1e-12)


def test_measurement_without_angle_leaves_it() -> None:
    mean, spread = np.full((1, 6), 0.5), np.eye(6)[None]
    after, left = update(mean, spread, np.array([[0.0, 0.0, math.nan]]), np.eye(3)[None])
    assert after[0].tolist() == [0.25, 0.25, 0.5, 0.5, 0.5, 0.5]
    assert left[0, 2, 2] == 1.0


def every_assignment(cost: np.ndarray) -> list[tuple[float, tuple[int, ...]]]:
    tracks, detections = cost.shape
    found = []
    for choice in product(range(-1, detections), repeat=tracks):
        taken = [j for j in choice if j >= 0]
        total = sum(cost[i, j] for i, j in enumerate(choice) if j >= 0)
        if len(set(taken)) == len(taken) and math.isfinite(total):
            found.append((float(total), choice))
    return sorted(found)


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(
    st.integers(1, 4),
    st.integers(1, 4),
    st.randoms(use_true_random=False),
)
def test_assignment_is_the_best_of_all(tracks: int, detections: int, random) -> None:
    cost = np.array(
        [
            [random.uniform(-10, 5) if random.random() < 0.6 else np.inf for _ in range(detections)]
            for _ in range(tracks)
        ]
    )
    found = assign(cost)
    best = every_assignment(cost)
    # Of two that are as good, either will do.
    assume(len(best) < 2 or best[1][0] - best[0][0] > 1e-9)
    taken = tuple(found.detection.tolist())
    assert taken == best[0][1]
    for track in range(tracks):
        mine = taken[track]
        owner = {j: i for i, j in enumerate(taken) if j >= 0}
        # Others that give this track another detection, or its detection to another track.
        rivals = [
            total
            for total, other in best
            if (other[track] >= 0 and other[track] != mine)
            or (mine >= 0 and any(o == mine and i != track for i, o in enumerate(other)))
        ]
        assert owner.get(mine, track) == track
        expected = math.exp(-(min(rivals) - best[0][0])) if rivals else 0.0
        expected = 0.0 if expected < math.exp(-12) else expected
        assert found.score[track] == pytest.approx(expected, abs=1e-9)


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**20 - 1))
def test_groups_are_those_of_the_graph(bits: int) -> None:
    from scipy.sparse import bmat
    from scipy.sparse.csgraph import connected_components

    edges = np.array([bool(bits >> k & 1) for k in range(20)]).reshape(4, 5)
    whole = bmat([[None, edges.astype(int)], [edges.astype(int).T, None]])
    label = connected_components(whole, directed=False)[1]
    found = connected_groups(edges)
    assert sorted(track for rows, _ in found for track in rows) == list(range(4))
    for rows, columns in found:
        assert len({*label[rows], *(label[4 + j] for j in columns)}) == 1
        assert columns == [j for j in range(5) if label[4 + j] == label[rows[0]]]


def test_one_lost_body_does_not_move_two_distant_ones() -> None:
    """Dearer in sum, but nothing connects the pair on the left with the one on the right."""
    cost = np.full((3, 2), np.inf)
    cost[0, 0], cost[2, 1] = -5.0, -5.0
    assert assign(cost).detection.tolist() == [0, -1, 1]
    assert assign(np.zeros((0, 3))).detection.size == 0
    assert assign(np.zeros((2, 0))).detection.tolist() == [-1, -1]
