"""The aspects of a motion, against plain loops over the samples."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from driftwalk.comparison.aspects import form_aspects, plan_aspects

SAMPLES = 400


def wall(x, y):
    return 50.0 - np.hypot(x, y)


@pytest.fixture
def walk():
    """Return a random walk at 10 Hz that rests now and then, with a gap."""
    random = np.random.default_rng(3)
    moves = random.normal(size=(2, SAMPLES)) * (random.random(SAMPLES) < 0.7)
    x, y = np.cumsum(moves, axis=1)
    time = np.arange(SAMPLES) / 10.0
    kept = (time < 12.0) | (time > 15.0)
    return time[kept], x[kept], y[kept]


def runs_of(time, x, y):
    """Return the gap-free parts as lists of points."""
    runs, now = [], [(x[0], y[0])]
    for k in range(1, time.size):
        if time[k] - time[k - 1] > 0.15:
            runs.append(now)
            now = []
        now.append((x[k], y[k]))
    return [*runs, now]


def steps_by_hand(points):
    """Return length and turning angle of each pair of steps."""
    found = []
    for a, b, c in zip(points, points[1:], points[2:], strict=False):
        first, second = (b[0] - a[0], b[1] - a[1]), (c[0] - b[0], c[1] - b[1])
        if math.hypot(*first) > 0 and math.hypot(*second) > 0:
            cross = first[0] * second[1] - first[1] * second[0]
            dot = first[0] * second[0] + first[1] * second[1]
            found.append((math.hypot(*second), math.atan2(cross, dot)))
    return found


def frame_by_hand(points):
    """Return the displacements along and across the latest step that was one."""
    found, ahead = [], None
    for k in range(1, len(points) - 1):
        dx, dy = points[k][0] - points[k - 1][0], points[k][1] - points[k - 1][1]
        if math.hypot(dx, dy) > 0:
            ahead = dx / math.hypot(dx, dy), dy / math.hypot(dx, dy)
        ex, ey = points[k + 1][0] - points[k][0], points[k + 1][1] - points[k][1]
        if ahead is not None:
            found.append((ex * ahead[0] + ey * ahead[1], ey * ahead[0] - ex * ahead[1]))
    return found


def wall_by_hand(points):
    """Return the distance of each step's middle from the wall, and its length."""
    found = []
    for a, b in itertools.pairwise(points):
        middle = (a[0] + b[0]) / 2, (a[1] + b[1]) / 2
        found.append((50.0 - math.hypot(*middle), math.hypot(b[0] - a[0], b[1] - a[1])))
    return found


def memory_by_hand(points):
    """Return the lengths of each step and of that three steps later."""
    lengths = [math.hypot(b[0] - a[0], b[1] - a[1]) for a, b in itertools.pairwise(points)]
    return list(zip(lengths, lengths[3:], strict=False))


BY_HAND = {
    "steps": steps_by_hand,
    "steps_3": lambda points: steps_by_hand(points[::3]),
    "frame": frame_by_hand,
    "wall": wall_by_hand,
    "memory": memory_by_hand,
}


@pytest.mark.parametrize("name", BY_HAND)
def test_an_aspect_is_that_of_a_plain_loop(walk, name):
    time, x, y = walk
    found = {one.name: one for one in form_aspects(plan_aspects(time), x, y, wall=wall)}
    expected = [point for run in runs_of(time, x, y) for point in BY_HAND[name](run)]
    assert len(expected) > 30
    np.testing.assert_allclose(found[name].points, expected, atol=1e-12)
    assert found[name].time.shape == (len(expected),)
    assert (np.diff(found[name].time) > 0).all()


def test_all_aspects_have_a_name(walk):
    time, x, _y = walk
    plan = plan_aspects(np.arange(SAMPLES) / 10.0)
    whole = np.interp(np.arange(SAMPLES) / 10.0, time, x)
    assert [one.name for one in form_aspects(plan, whole, whole, wall=wall)] == [
        *("steps", "steps_3", "steps_9"),
        *("frame", "wall", "memory"),
    ]
    assert "wall" not in [one.name for one in form_aspects(plan, whole, whole)]


def test_steps_of_the_paper_are_among_them(walk):
    from driftwalk.comparison import apply_steps, plan_steps

    time, x, y = walk
    first = form_aspects(plan_aspects(time), x, y)[0]
    found = apply_steps(plan_steps(time), x, y)
    np.testing.assert_array_equal(first.points[:, 0], found.step_length)
    np.testing.assert_array_equal(first.points[:, 1], found.turning_angle)


def test_a_missing_position_leaves_out_what_needs_it(walk):
    time, x, y = walk
    x = x.copy()
    x[50] = np.nan
    whole = form_aspects(plan_aspects(time), walk[1], y, wall=wall)
    holed = form_aspects(plan_aspects(time), x, y, wall=wall)
    for before, after in zip(whole, holed, strict=True):
        assert np.isfinite(after.points).all(), after.name
        assert len(after.points) <= len(before.points)
    # Of the middles of two steps, and of the steps that begin or end there, none is left.
    by_name = {one.name: len(one.points) for one in whole}
    assert {one.name: len(one.points) for one in holed}["wall"] == by_name["wall"] - 2


def test_interpolated_points_lie_between_samples():
    time = np.cumsum(np.random.default_rng(1).uniform(0.05, 0.15, 300))
    plan = plan_aspects(time, step_interval=0.1)
    assert plan.short.mode == "interpolated"
    # At a steady speed of 1 m/s each step is 0.1 m long, whatever the stamps.
    memory = form_aspects(plan, time, 0 * time)[-1]
    np.testing.assert_allclose(memory.points, 0.1, atol=1e-9)


def test_a_short_recording_has_no_long_steps():
    names = [one.name for one in form_aspects(plan_aspects(np.arange(60.0)), *np.ones((2, 60)))]
    assert names == ["steps", "frame", "memory"]
