"""The summaries of a motion against plain loops, and what they must not depend on."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from plain_summaries import PlainMotion, plain_summaries

from driftwalk.calibration.estimation.summaries import (
    SummaryPlan,
    count_summaries,
    plan_summaries,
    summarise,
)
from driftwalk.comparison.aspects import plan_aspects

RADIUS = 0.15
INTERVAL = 0.1


def every_instant(_tick: int) -> bool:
    return True


def even_blocks(tick: int) -> bool:
    return (tick // 25) % 2 == 0


def walk(samples: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a walk in the tank that runs, rests, turns and comes to the wall."""
    rng = np.random.default_rng(seed)
    speed = 0.006 * np.exp(0.4 * rng.normal(size=samples))
    speed *= np.where(np.sin(np.arange(samples) / 4.0 + rng.uniform(0, 6)) > -0.4, 1.0, 0.08)
    heading = np.cumsum(0.5 * rng.normal(size=samples))
    path = np.cumsum(speed * np.exp(1j * heading))
    distance = np.abs(path)
    # Fold the distance from the centre into the tank: a smooth path stays one.
    folded = RADIUS * np.abs((distance / RADIUS + 1.0) % 2.0 - 1.0)
    inside = path / np.maximum(distance, 1e-9) * folded
    return inside.real, inside.imag


def planned(motion: PlainMotion) -> SummaryPlan:
    """Return the plan of a plain motion."""
    aspects = plan_aspects(INTERVAL * np.array(motion.tick), step_interval=INTERVAL)

    def counts(time: np.ndarray) -> np.ndarray:
        return np.array([motion.counts(round(one / INTERVAL)) for one in time], dtype=bool)

    def wall(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return motion.radius - np.hypot(x, y)

    return plan_summaries(aspects, wall=wall, unit=motion.unit, depth=motion.depth, counts=counts)


def plain(
    samples: int,
    seed: int,
    *,
    counts: Callable[[int], bool] = every_instant,
    gaps: tuple[int, ...] = (),
    unseen: tuple[int, ...] = (),
    still: tuple[int, ...] = (),
) -> PlainMotion:
    """Return a walk without some samples, not seen at others, without a step at others."""
    x, y = walk(samples, seed)
    for at in still:
        x[at + 1], y[at + 1] = x[at], y[at]
    for at in unseen:
        x[at] = y[at] = math.nan
    kept = [at for at in range(samples) if at not in gaps]
    return PlainMotion(
        tick=kept, x=x[kept].tolist(), y=y[kept].tolist(), counts=counts,
        radius=RADIUS, unit=0.006, depth=0.145,
    )  # fmt: skip


MOTIONS: dict[str, dict[str, Any]] = {
    "unbroken": {"samples": 400, "seed": 1},
    "gaps": {"samples": 420, "seed": 2, "gaps": (60, 61, 130, 133, 135, 300, 301, 302)},
    "not seen": {"samples": 400, "seed": 3, "unseen": (0, 17, 18, 19, 200, 202, 399)},
    "half of the blocks": {"samples": 600, "seed": 4, "counts": even_blocks},
    "everything": {
        "samples": 700, "seed": 5, "counts": even_blocks, "gaps": (101, 110, 404),
        "unseen": (50, 333, 334), "still": (20, 21, 22, 160, 210),
    },
    "one longer interval": {"samples": 150, "seed": 6, "gaps": (75,)},
    "no longer interval": {"samples": 60, "seed": 7},
    "very short": {"samples": 12, "seed": 8},
}  # fmt: skip


@pytest.mark.parametrize("name", MOTIONS)
def test_summaries_are_those_of_plain_loops(name: str) -> None:
    motion = plain(**MOTIONS[name])
    plan = planned(motion)
    found = summarise(plan, motion.x, motion.y).tolist()
    wanted = plain_summaries(motion)
    assert count_summaries(plan) == len(found) == sum(len(part) for part in wanted.values())
    for kind, part in wanted.items():
        here, found = found[: len(part)], found[len(part) :]
        assert here == pytest.approx(part, rel=1e-9, abs=1e-9), kind


def test_the_motions_show_what_they_are_for() -> None:
    """The oracle is of use only where the tracks have all kinds of steps."""
    intervals = {name: len(planned(plain(**one)).intervals) for name, one in MOTIONS.items()}
    assert intervals["one longer interval"] == 2
    assert intervals["no longer interval"] == intervals["very short"] == 1
    assert intervals["everything"] == 3
    whole = plain_summaries(plain(**MOTIONS["everything"]))
    for kind in ("changes", "memory", "place", "peaks", "bouts at 0.3"):
        assert all(abs(one) > 1e-6 for one in whole[kind]), kind


@pytest.mark.parametrize(
    ("samples", "seen"), [(100, 0), (100, 3), (100, 4), (100, 5), (100, 6), (6, 6), (3, 3)]
)
def test_a_motion_hardly_seen_has_numbers_all_the_same(samples: int, seen: int) -> None:
    motion = plain(samples, 9, unseen=tuple(range(seen, samples)))
    found = summarise(planned(motion), motion.x, motion.y)
    assert found.shape == (count_summaries(planned(motion)),)
    assert np.isfinite(found).all()
    steps = max(seen - 1, 0)
    assert (not found.any()) == (steps < 4)


def test_a_body_at_rest_has_numbers() -> None:
    motion = plain(100, 10, still=tuple(range(99)))
    found = summarise(planned(motion), motion.x, motion.y)
    assert np.isfinite(found).all()
    np.testing.assert_allclose(found[:7], math.log(0.02))


@pytest.mark.parametrize(
    ("first", "last", "matters"), [(1, 24, False), (0, 24, True), (1, 25, True)]
)
def test_only_instants_that_count_matter(first: int, last: int, matters: bool) -> None:
    """A step of an even block may end where an odd one begins; a turn may begin where it ends.

    What lies between does not matter, but for longer steps, which reach into it.
    """
    motion = plain(600, 11, counts=even_blocks)
    x, y = np.array(motion.x), np.array(motion.y)
    plan = planned(motion)
    before = summarise(plan, x, y)
    for start in range(25, 600, 50):
        inside = slice(start + first, start + last)
        x[inside], y[inside] = 0.4 * x[inside], -0.7 * y[inside]
    after = summarise(plan, x, y)
    longer = slice(7 + 6, 7 + 6 + 2 * 11)
    assert not np.array_equal(after[longer], before[longer])
    same = np.array_equal(np.delete(after, longer), np.delete(before, longer))
    assert same != matters


def sines(plan: SummaryPlan) -> np.ndarray:
    """Return which summaries are means of a sine: those that a mirror turns round."""
    found = np.zeros(count_summaries(plan), dtype=bool)
    at = 7
    for index in range(len(plan.intervals)):
        found[at + 1] = True
        at += 6 if index == 0 else 11
    return found


@pytest.mark.slow
@settings(max_examples=25)
@given(
    seed=st.integers(0, 10_000),
    angle=st.floats(-4.0, 4.0),
    mirrored=st.booleans(),
    gap=st.integers(1, 390),
)
def test_the_centre_has_no_direction(seed: int, angle: float, mirrored: bool, gap: int) -> None:
    motion = plain(400, seed, gaps=(gap, gap + 1), unseen=(gap // 2,))
    plan = planned(motion)
    there = np.array(motion.x) + 1j * np.array(motion.y)
    turned = np.exp(1j * angle) * (there.conj() if mirrored else there)
    before = summarise(plan, there.real, there.imag)
    after = summarise(plan, turned.real, turned.imag)
    sign = np.where(sines(plan) & mirrored, -1.0, 1.0)
    np.testing.assert_allclose(after, sign * before, rtol=1e-7, atol=1e-9)
    assert np.abs(before[sines(plan)]).max() > 1e-3


@pytest.mark.slow
@settings(max_examples=25)
@given(seed=st.integers(0, 10_000), factor=st.floats(1e-4, 1e4))
def test_lengths_have_no_unit(seed: int, factor: float) -> None:
    motion = plain(400, seed, gaps=(77,), unseen=(200,))
    larger = PlainMotion(
        tick=motion.tick,
        x=[factor * one for one in motion.x],
        y=[factor * one for one in motion.y],
        counts=motion.counts,
        radius=factor * motion.radius,
        unit=factor * motion.unit,
        depth=factor * motion.depth,
    )
    np.testing.assert_allclose(
        summarise(planned(larger), larger.x, larger.y),
        summarise(planned(motion), motion.x, motion.y),
        rtol=1e-7,
        atol=1e-9,
    )


@settings(max_examples=25)
@given(
    samples=st.integers(30, 700),
    factor=st.sampled_from([1, 2, 5]),
    gap=st.integers(5, 25),
)
def test_there_are_as_many_summaries_as_are_counted(samples: int, factor: int, gap: int) -> None:
    x, y = walk(samples, samples)
    time = INTERVAL * np.delete(np.arange(samples), gap)
    plan = plan_summaries(
        plan_aspects(time, step_interval=factor * INTERVAL),
        wall=lambda x, y: RADIUS - np.hypot(x, y),
        unit=0.006,
        depth=0.15,
        counts=lambda stamps: np.ones(stamps.shape, dtype=bool),
    )
    found = summarise(plan, np.delete(x, gap), np.delete(y, gap))
    assert found.size == count_summaries(plan)
    assert np.isfinite(found).all()
