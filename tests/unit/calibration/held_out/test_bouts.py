"""The lengths of bouts against those of a model's own recordings."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import ks_2samp, t

from driftwalk.calibration.held_out.law_findings import bout_distances, bout_sentences
from driftwalk.comparison.aspects import plan_aspects

STEPS = 6000
PLAN = plan_aspects(0.1 * np.arange(STEPS + 1))
Draw = Callable[[np.random.Generator], float]


def resting(
    random: np.random.Generator, rest: Draw, noise: float = 1e-4
) -> tuple[np.ndarray, list[int]]:
    """Return positions of a body that runs and rests in turn, and the lengths of whole rests."""
    moves: list[int] = []
    rests: list[int] = []
    while len(moves) < STEPS:
        moves += [1] * (1 + random.geometric(0.05))
        rests.append(max(round(rest(random)), 1))
        moves += [0] * rests[-1]
    ended = len(moves) > STEPS or moves[STEPS - 1] == 0
    x = np.concatenate([[0.0], np.cumsum(0.005 * np.array(moves[:STEPS]))])
    return x + noise * random.normal(size=x.size), rests[:-1] if ended else rests


def camera(noise: float) -> Any:
    return SimpleNamespace(camera=SimpleNamespace(position_noise=noise))


def exponential(random: np.random.Generator) -> float:
    return random.exponential(20.0)


def power_law(random: np.random.Generator) -> float:
    """The same mean, but none below 8 and one in a hundred above 170."""
    return 8.0 * (1.0 + random.pareto(1.67))


def compared(recorded: Draw, seed: int, *, noise: float = 1e-4) -> tuple[Any, list[list[int]]]:
    random = np.random.default_rng(seed)
    x, rests = resting(random, recorded, noise)
    worlds = [resting(random, exponential, noise) for _ in range(20)]
    length = np.abs(np.diff(x))
    motion: Any = SimpleNamespace(
        steps=SimpleNamespace(points=length[:, None]),
        own_plan=PLAN,
        plan=PLAN,
        track=SimpleNamespace(x=x, y=0.0 * x),
        like=camera(noise),
    )
    seen: Any = SimpleNamespace(x=np.array([one for one, _ in worlds]), y=np.zeros((20, STEPS + 1)))
    return bout_distances(motion, seen), [rests, *(one for _, one in worlds)]


@pytest.mark.slow
def test_rests_of_the_law_itself_are_like_its_own_and_a_power_law_is_not() -> None:
    for seed in range(6):
        found, _ = compared(exponential, seed)
        assert [one.kind for one in found] == ["slow", "fast"]
        assert all(one.distance < one.limit for one in found)
        (slow, fast), _ = compared(power_law, seed)
        assert slow.distance > slow.limit
        assert fast.distance < fast.limit
        assert max(one.tail / one.tail_limit for one in found) < 1.0


def test_one_rest_that_lasts_for_long_counts() -> None:
    """Two rests in a hundred of a minute each, where the others last for 2 s."""

    def sometimes_long(random: np.random.Generator) -> float:
        return 600.0 if random.random() < 0.02 else exponential(random)

    (slow, _), (rests, *others) = compared(sometimes_long, 5)
    assert slow.tail == pytest.approx(share_of_longest(rests), abs=0.01)
    # The last rest of a recording is cut off, which may count one more or less.
    logs = np.log([share_of_longest(one) for one in others])
    limit = np.exp(logs.mean() + t.isf(0.002, 19) * np.sqrt(1.05) * logs.std(ddof=1))
    assert slow.tail_limit == pytest.approx(limit, rel=0.05)
    assert slow.tail > slow.tail_limit
    assert "slow bouts have a heavier tail: the longest twentieth takes" in " ".join(
        bout_sentences((slow,))
    )


def share_of_longest(rests: list[int]) -> float:
    """Return the share of the time in the longest twentieth of the rests."""
    longest = sorted(rests, reverse=True)[: max(round(len(rests) / 20), 1)]
    return sum(longest) / sum(rests)


def test_the_distance_is_that_of_kolmogorov_and_smirnov() -> None:
    (slow, _), rests = compared(power_law, 9)
    pooled = np.concatenate(rests[1:])
    # The last rest of a recording is cut off, which may count one more or less.
    assert slow.distance == pytest.approx(ks_2samp(rests[0], pooled).statistic, abs=0.01)


def test_the_noise_of_the_camera_does_not_cut_up_rests() -> None:
    """With a noise of a half of the level, a step of a body at rest is beyond it once in six."""
    (slow, _), _ = compared(power_law, 9, noise=1.2e-3)
    assert slow.distance > slow.limit
    (slow, _), _ = compared(exponential, 9, noise=1.2e-3)
    assert slow.distance < slow.limit


def test_of_a_body_that_never_rests_nothing_is_said() -> None:
    found, _ = compared(lambda _: 1.0, 3)
    moving: Any = SimpleNamespace(
        steps=SimpleNamespace(points=np.full((STEPS, 1), 0.005)),
        own_plan=PLAN,
        plan=PLAN,
        track=SimpleNamespace(x=0.005 * np.arange(STEPS + 1), y=np.zeros(STEPS + 1)),
        like=camera(1e-4),
    )
    line = np.tile(moving.track.x, (20, 1))
    assert bout_distances(moving, SimpleNamespace(x=line, y=0.0 * line)) == ()
    assert len(found) == 2
