"""Of samples that cannot all be right the wrong ones go, in the cheapest way of all."""

from __future__ import annotations

from itertools import combinations, pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from driftwalk.record.cleaning.jumps import JUMPS, find_jumps
from driftwalk.record.raw import RawBody

COORDINATE = st.floats(-3.0, 3.0).map(lambda value: round(value, 3))


def body(time: Any, x: Any, y: Any = None) -> RawBody:
    x = np.array(x, dtype=float)
    return RawBody("0", np.array(time, dtype=float), x, x * 0 if y is None else np.array(y, float))


def cost(kept: tuple[int, ...], track: RawBody, max_speed: float) -> float:
    """Return the cost of keeping some samples; infinite where the body would be too fast."""
    total = float(track.x.size - len(kept))
    for one, other in pairwise(kept):
        way = np.hypot(track.x[other] - track.x[one], track.y[other] - track.y[one])
        share = way / (max_speed * (track.clock[other] - track.clock[one]))
        total += JUMPS.effort * (other - one) * share**2 if share <= 1.0 else np.inf
    return total


@pytest.mark.slow
@given(
    st.lists(st.tuples(st.floats(0.05, 0.5), COORDINATE, COORDINATE), min_size=2, max_size=9),
    st.floats(0.5, 10.0),
)
def test_no_other_way_is_cheaper(rows: list[tuple[float, float, float]], max_speed: float) -> None:
    """Against all subsets of the samples."""
    steps, x, y = zip(*rows, strict=True)
    track = body(np.cumsum(steps), x, y)
    removed = set(find_jumps(track, max_speed).tolist())
    kept = tuple(n for n in range(len(rows)) if n not in removed)
    others = (
        subset
        for size in range(1, len(rows) + 1)
        for subset in combinations(range(len(rows)), size)
    )
    least = min(cost(subset, track, max_speed) for subset in others)
    assert cost(kept, track, max_speed) == pytest.approx(least)


@pytest.mark.parametrize("run", [1, 2, 3])
@pytest.mark.parametrize("off", [0.05, 0.2, 5.0])
def test_the_wrong_samples_go_and_not_the_good_one_after_them(run: int, off: float) -> None:
    """0.3 m/s at 10 Hz are 30 mm a step: the second of two that are 50 mm off is within reach."""
    rng = np.random.default_rng(run)
    time = 0.1 * np.arange(600)
    x, y = 0.1 * np.cos(0.4 * time), 0.1 * np.sin(0.4 * time)
    wrong = np.zeros(600, dtype=bool)
    for first in range(20, 580, 20):
        wrong[first : first + run] = True
        direction = rng.uniform(0.0, 2.0 * np.pi)
        x[first : first + run] += off * np.cos(direction)
        y[first : first + run] += off * np.sin(direction)
    found = find_jumps(body(time, x, y), 0.3)
    assert found.tolist() == np.flatnonzero(wrong).tolist()


def test_what_is_within_reach_of_both_neighbours_stays() -> None:
    """Errors of 5 mm at 10 Hz need 0.1 m/s at most; a body that always goes to and fro at 1 m/s."""
    rng = np.random.default_rng(1)
    time = 0.1 * np.arange(2000)
    x = 0.05 * time + 5e-3 * (rng.uniform(size=2000) < 0.05)
    assert find_jumps(body(time, x), 0.3).size == 0
    assert find_jumps(body(time, 0.1 * (np.arange(2000) % 2)), 1.0 + 1e-9).size == 0


def test_a_jump_in_the_first_and_in_the_last_sample() -> None:
    assert find_jumps(body(range(4), [9.0, 0.0, 0.1, 0.2]), 0.5).tolist() == [0]
    assert find_jumps(body(range(4), [0.0, 0.1, 0.2, 9.0]), 0.5).tolist() == [3]
    assert find_jumps(body(range(2), [0.0, 9.0]), 0.5).tolist() == [1]
    assert find_jumps(body(range(1), [0.0]), 0.5).size == 0


def test_a_body_that_is_elsewhere_for_good_is_followed() -> None:
    """It is far away for longer than every single sample is tried, and comes back."""
    x = np.zeros(2000)
    x[500:1500] = 10.0
    assert find_jumps(body(range(2000), x), 2.0).tolist() == [*range(500, 504), *range(1500, 1504)]
    x = np.zeros(2000)
    x[600:1500] = 1e6
    assert find_jumps(body(range(2000), x), 2.0).tolist() == list(range(600, 1500))


def test_missing_samples_lie_between_and_are_not_compared() -> None:
    assert find_jumps(body(range(4), [0.0, np.nan, 0.9, 1.3]), 0.5).size == 0
