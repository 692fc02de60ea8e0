"""The wall rule: what it leaves out, and that it looks at the past only."""

from __future__ import annotations

import numpy as np
import pytest

from driftwalk.flow.arena import Circle, outline_of
from driftwalk.likelihood.filter.series import _continued, wall_intervals
from driftwalk.model import Block

TANK = Circle(0.15)
BLOCK = Block(side_m=0.03)


def intervals(x: np.ndarray, theta: np.ndarray | None, time: np.ndarray | None = None) -> list[int]:
    time = 0.1 * np.arange(x.size) if time is None else time
    found = wall_intervals(time, x, np.zeros(x.size), theta, outline=TANK, block=BLOCK)
    return np.flatnonzero(found).tolist()


def test_an_interval_begins_near_the_wall() -> None:
    """With a face towards the wall the corners are at x + 0.015, y = 0.015: 0.1493 m out.

    The margin is reached at a distance of 0.148 m: x = sqrt(0.148^2 - 0.015^2) - 0.015 = 0.13224.
    """
    x = np.full(6, 0.1322)
    x[3] = 0.1323
    # At 5 the motion from 2 to 4 is none, at 4 that from 1 to 3 leads on to 0.13235.
    assert intervals(x, np.zeros(6)) == [4]


def test_an_interval_leads_to_the_wall() -> None:
    x = 0.12 + 0.005 * np.arange(6)
    # Outward at 5 mm a sample: 0.13 leads to 0.135, beyond 0.13224.
    assert intervals(x, np.zeros(6)) == [3, 4, 5]


def test_a_corner_reaches_farther_than_a_face() -> None:
    """Turned by 45 degrees the corner is at x + 0.0212: the margin is at x = 0.12679."""
    for place, near in ((0.1267, []), (0.1269, [1, 2, 3])):
        assert intervals(np.full(4, place), np.full(4, np.pi / 4)) == near
        assert intervals(np.full(4, place), None) == near


def test_the_motion_is_not_continued_over_a_gap() -> None:
    x = 0.11 + 0.004 * np.arange(6)
    time = np.array([0.0, 0.1, 0.2, 5.0, 5.1, 5.2])
    # The last pose is at 0.13; without the gap the third of them, 0.126 + 0.004, would be followed.
    assert intervals(x, np.zeros(6), time) == []
    assert intervals(x, np.zeros(6)) == []
    assert intervals(x + 0.004, np.zeros(6)) == [5]
    assert intervals(x + 0.004, np.zeros(6), time) == []


def test_a_steady_motion_is_continued_over_uneven_intervals() -> None:
    time = np.array([0.0, 0.1, 0.3, 0.35, 0.5])
    # The first two have no change before them, so they stay.
    assert _continued(time, 2.0 * time) == pytest.approx([0.0, 0.2, 0.7, 1.0])


def test_a_corner_may_swing_into_the_wall() -> None:
    """The centre rests at x = 0.1265, where a corner can come to 0.1477 and to 0.1487 at 0.1275.

    Corners by complex numbers; the turning of two intervals is taken to go on for a third.
    """
    turned = 0.13 * np.arange(60) + 0.5
    for place, some in ((0.1265, False), (0.1275, True)):
        found = intervals(np.full(60, place), np.angle(np.exp(1j * turned)))
        for rate in (0.0, 0.13):
            quarter = np.exp(0.5j * np.pi * np.arange(4))[:, None]
            angle = turned[:-1] + np.where(np.arange(59) >= 2, rate, 0.0)
            corners = place + (0.015 + 0.015j) * quarter * np.exp(1j * angle)
            near = 1 + np.flatnonzero(np.abs(corners).max(axis=0) > 0.148)
            assert set(near.tolist()) <= set(found)
            # Where the block is now is not enough to tell all of them.
            assert (near.size < len(found)) == some
        assert bool(found) == some
        assert len(found) < 59


def test_turning_is_not_continued_over_a_gap() -> None:
    """A face towards the wall, turned by 0.3 a sample: its corner is near the wall one later."""
    turned = np.array([-0.6, -0.3, 0.0, 0.3, 0.6])
    x = np.full(5, 0.13)
    reach = [np.abs(0.13 + (0.015 + 0.015j) * np.exp(1j * one)) for one in turned]
    assert reach[2] < 0.148 < reach[1]
    time = np.array([0.0, 0.1, 0.2, 0.3, 0.4])
    assert intervals(x, turned, time) == [1, 2, 3, 4]
    gap = np.array([0.0, 0.1, 0.2, 5.0, 5.1])
    # What the pose at 0.2 s may become is not asked over five seconds; nor what it was before.
    assert intervals(x, turned, gap) == [1, 2, 4]


def test_the_future_does_not_matter() -> None:
    generator = np.random.default_rng(5)
    time = np.cumsum(generator.uniform(0.05, 0.2, 400))
    x, y = 0.1 * np.cos(time) + 0.04, 0.1 * np.sin(1.3 * time)
    theta = 0.7 * time
    arena = outline_of({"shape": "rectangle", "width_m": 0.3, "height_m": 0.24})
    options = {"outline": arena, "block": BLOCK}
    whole = wall_intervals(time, x, y, theta, **options)
    assert 0.05 < whole.mean() < 0.95
    for last in (50, 177, 300):
        moved_x = np.concatenate([x[:last], generator.uniform(-0.2, 0.2, 400 - last)])
        changed = wall_intervals(time, moved_x, y, theta, **options)
        # The flag of sample `last` itself depends on the samples before it.
        assert (changed[: last + 1] == whole[: last + 1]).all()


@pytest.mark.parametrize("count", [1, 2, 3])
def test_very_short_tracks(count: int) -> None:
    assert intervals(np.zeros(count), np.zeros(count)) == []
