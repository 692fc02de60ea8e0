"""Summaries of simulated recordings: each is what `summarise` gives of the world at its address."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from self_propelled import moving

import driftwalk as dw
from driftwalk.calibration.estimation.summaries import (
    ALIKE,
    SummaryObjective,
    plan_summaries,
    summarise,
)
from driftwalk.calibration.evolution import AspectObjective, wall_distance
from driftwalk.calibration.held_out.candidates import prepare_candidates
from driftwalk.calibration.held_out.held_out_score import even_blocks
from driftwalk.calibration.held_out.recorded import RecordedMotion, body_motion
from driftwalk.comparison.aspects import block_of
from driftwalk.motion.score import BROKEN
from driftwalk.sweep import MemoryStore, Store

TRUTH = {"speed": 0.03, "rotational_diffusion": 0.8, "turn_rate": 0.3}
STUDY = dw.apply_overrides(dw.Study(), {"observation.position_noise_m": 2e-4})


@pytest.fixture(scope="module")
def motion() -> RecordedMotion:
    recording = moving(dw.motion_model("active"), TRUTH, 60.0, seed=3, noise=2e-4)
    return body_motion(recording, STUDY, flow=None, body=None, threads=1)


@pytest.fixture(scope="module")
def worlds(motion: RecordedMotion) -> AspectObjective:
    (entry,), _ = prepare_candidates([dw.motion_model("active")], motion)
    return replace(even_blocks(entry, motion), seed=4)


def objective_of(
    worlds: AspectObjective, motion: RecordedMotion, store: Store | None = None
) -> SummaryObjective:
    def nobody(_done: int, _most: int) -> None:
        """Listen to nothing."""

    return SummaryObjective(worlds, motion, store=store, tell=nobody, most=1000)


def settings_of(count: int) -> np.ndarray:
    return np.random.default_rng(7).uniform(0.2, 0.8, (count, 3))


def test_summaries_are_those_of_worlds_at_their_addresses(worlds, motion):
    """Of the whole, and of the blocks of time with even numbers, by plans that are made here."""
    objective = objective_of(worlds, motion)
    settings = settings_of(7)
    objective(settings[:3])
    found = objective(settings[3:], parts=2)
    seen = worlds.simulated(settings[3:], 1, stage="estimation", first=3)
    parts = (
        lambda time: np.ones(time.shape, dtype=bool),
        lambda time: block_of(time, motion.duration) % 2 == 0,
    )
    wall = wall_distance(worlds.like)
    for part, counts in enumerate(parts):
        plan = plan_summaries(
            motion.plan, wall=wall, unit=motion.usual_step, depth=motion.depth, counts=counts
        )
        wanted = [summarise(plan, x, y) for x, y in zip(seen.x, seen.y, strict=True)]
        np.testing.assert_array_equal(found[:, part], wanted)
        own = summarise(plan, motion.track.x, motion.track.y)
        np.testing.assert_array_equal(objective.recorded[part], own)


def test_a_part_asked_for_or_not_changes_no_other(worlds, motion):
    settings = settings_of(4)
    one, two = (objective_of(worlds, motion)(settings, parts=parts) for parts in (1, 2))
    np.testing.assert_array_equal(one[:, 0], two[:, 0])
    assert not np.array_equal(two[:, 0], two[:, 1])


def test_the_same_setting_twice_has_new_random_numbers(worlds, motion):
    objective = objective_of(worlds, motion)
    setting = settings_of(1)
    assert not np.array_equal(objective(setting), objective(setting))


@pytest.mark.slow
def test_the_recording_is_like_its_own_model(worlds, motion):
    """Each summary lies within 5 standard deviations of 100 simulations of the truth."""
    truth = np.array(
        [
            (one.to_coordinate(TRUTH[one.name]) - one.to_coordinate(one.low))
            / (one.to_coordinate(one.high) - one.to_coordinate(one.low))
            for one in worlds.ranges
        ]
    )
    objective = objective_of(worlds, motion)
    seen = objective(np.tile(truth, (100, 1)), parts=2)
    apart = np.abs(objective.recorded - seen.mean(axis=0)) / np.maximum(seen.std(axis=0), 1e-9)
    assert apart.max() < 5.0
    other = objective(np.tile(np.clip(truth + 0.15, 0, 1), (100, 1)), parts=2)
    apart = np.abs(objective.recorded - other.mean(axis=0)) / np.maximum(other.std(axis=0), 1e-9)
    assert apart.max() > 10.0


@pytest.mark.slow
def test_cameras_differ_where_their_noise_is_estimated(worlds, motion):
    """Sixteen settings in a row have one camera, and all that may be have their turn."""
    assert motion.noises == (2e-4,)
    noises = (1e-4, 5e-4, 2e-4)
    unsure = replace(motion, noises=noises)
    count = ALIKE * (len(noises) + 1)
    settings = np.tile(settings_of(1), (count, 1))
    found = objective_of(worlds, unsure)(settings)
    for number in range(0, count, ALIKE):
        objective = objective_of(worlds, unsure)
        noise = noises[number // ALIKE % len(noises)]
        camera = replace(worlds.like.camera, position_noise=noise)
        alone = replace(worlds, like=replace(worlds.like, camera=camera))
        here = slice(number, number + ALIKE)
        seen = alone.simulated(settings[here], 1, stage="estimation", first=number)
        wanted = [
            summarise(objective.plans[0], *world) for world in zip(seen.x, seen.y, strict=True)
        ]
        np.testing.assert_array_equal(found[here, 0], wanted)


def test_threads_change_nothing(worlds, motion):
    settings = settings_of(6)
    two = replace(worlds, like=replace(worlds.like, threads=2))
    np.testing.assert_array_equal(
        objective_of(worlds, motion)(settings, parts=2),
        objective_of(two, motion)(settings, parts=2),
    )


def test_finished_units_are_read_again_and_progress_is_counted(worlds, motion):
    settings, store, told = settings_of(ALIKE + 6), MemoryStore(), []
    first = objective_of(worlds, motion, store)(settings)

    class Broken(AspectObjective):
        def simulated(self, *_args, **_options):
            raise AssertionError("computed twice")

    unable = Broken(**vars(worlds))
    again = SummaryObjective(
        unable, motion, store=store, tell=lambda done, most: told.append((done, most)), most=500
    )
    np.testing.assert_array_equal(again(settings), first)
    assert again.done == len(settings)
    assert told[-1] == (len(settings), 500)


def test_a_world_that_lost_its_numbers_is_like_none(worlds, motion):
    class Lost(AspectObjective):
        def simulated(self, settings, replicates, *, stage, first=0):
            seen = super().simulated(settings, replicates, stage=stage, first=first)
            status = seen.status.copy()
            status[1] |= BROKEN
            return seen._replace(status=status)

    settings = settings_of(3)
    whole = objective_of(worlds, motion)(settings)
    found = objective_of(Lost(**vars(worlds)), motion)(settings)
    assert not found[1].any()
    np.testing.assert_array_equal(found[[0, 2]], whole[[0, 2]])
