"""The tracker against simulated bodies whose identities are known."""

from __future__ import annotations

import itertools
import json
import math
import time as clock
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pytest

from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.track.follow.settings import TrackerSettings
from driftwalk.track.follow.tracker import Tracker
from driftwalk.track.types import Detection

NOISE = np.array([0.15e-3, 0.15e-3, math.radians(0.5)])
RADIUS = 0.15
Floats = npt.NDArray[np.float64]


@dataclass
class World:
    """Poses (time, body, 3) and their times."""

    time: Floats
    pose: Floats


def wander(
    seed: int, *, bodies: int, frames: int, apart: float, jitter: float = 0.0, speed: float = 0.05
) -> World:
    """Let bodies wander in a round tank; they keep a distance, 0 to let them cross."""
    random = np.random.default_rng(seed)
    interval = 0.1 * (1.0 + jitter * random.uniform(-1, 1, frames))
    time = np.cumsum(interval)
    angle = 2 * math.pi * np.arange(bodies) / bodies
    place = 0.08 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    velocity = random.normal(0, speed, (bodies, 2))
    theta, turn = random.uniform(-3, 3, bodies), random.normal(0, 0.5, bodies)
    pose = np.empty((frames, bodies, 3))
    for frame, step in enumerate(interval):
        pull = -2.0 * place * (np.hypot(*place.T) > 0.1)[:, None]
        push = np.zeros_like(place)
        if apart > 0:
            gap = place[:, None] - place[None]
            distance = np.hypot(gap[..., 0], gap[..., 1]) + np.eye(bodies)
            near = np.maximum(0.0, 2 * apart - distance)[..., None] * gap / distance[..., None]
            push = 60.0 * near.sum(axis=1)
        kick = random.normal(0, speed * math.sqrt(2 * step), (bodies, 2))
        velocity += step * (pull + push - velocity) + kick
        velocity *= np.minimum(1.0, 0.25 / np.hypot(*velocity.T))[:, None]
        place = place + step * velocity
        turn += -step * turn + random.normal(0, 0.7 * math.sqrt(2 * step), bodies)
        theta = theta + step * turn
        pose[frame] = np.column_stack([place, theta])
    return World(time, pose)


def seen(pose: Floats, random: np.random.Generator, *, angle: bool = True) -> Detection:
    """Return what a camera makes of a pose."""
    x, y, theta = pose + NOISE * random.normal(size=3)
    return Detection(x, y, 0.0, 0.0, theta if angle else math.nan, np.diag(NOISE**2), 100.0)


def clutter(random: np.random.Generator, mean: float) -> list[Detection]:
    """Return detections of nothing, anywhere in the tank."""
    places = random.uniform(-RADIUS, RADIUS, (random.poisson(mean), 2))
    return [
        Detection(x, y, 0.0, 0.0, random.uniform(-3, 3), np.diag(NOISE**2), 30.0) for x, y in places
    ]


def owners(found: Floats, world: World) -> npt.NDArray[np.int64]:
    """Return which true body each sample of a recording shows, (time, track); -1 for none."""
    apart = found[:, :, None, :2] - world.pose[:, None, :, :2]
    distance = np.hypot(apart[..., 0], apart[..., 1])
    nearest = np.where(np.isfinite(distance), distance, np.inf).argmin(axis=2)
    least = np.min(np.where(np.isfinite(distance), distance, np.inf), axis=2)
    return np.where(least < 6 * NOISE[0], nearest, -1)


def unmarked_swaps(recording, world: World) -> tuple[int, int]:
    """Return how often a column went from one true body to another, and how often unmarked.

    A change is marked when all is, from the last sample of the one to the first of the other.
    """
    owner = owners(poses_of(recording), world)
    score = recording["ambiguous"].values
    changes = unmarked = 0
    for column in range(owner.shape[1]):
        present = np.flatnonzero(owner[:, column] >= 0)
        for one, other in itertools.pairwise(present):
            if owner[one, column] != owner[other, column]:
                changes += 1
                unmarked += not (score[one : other + 1, column] > 0).all()
    return changes, unmarked


def poses_of(recording) -> Floats:
    return np.stack([recording[name].values for name in ("x", "y", "theta")], axis=-1)


def of_nothing(recording, world: World) -> npt.NDArray[np.bool_]:
    """Return where an unmarked sample shows no body, (time, body)."""
    there = np.isfinite(recording["x"].values) & ~(recording["ambiguous"].values > 0)
    return there & (owners(poses_of(recording), world) < 0)


def with_gaps(seed: int) -> tuple[World, npt.NDArray[np.bool_]]:
    """Return blocks that cannot come nearer than a side, 60 s, and when each is hidden.

    2 % of the frames are missed, and there are gaps of up to 0.8 s.
    """
    world = wander(seed, bodies=4, frames=600, apart=0.03, jitter=0.3)
    random = np.random.default_rng(1000 + seed)
    lost = random.random((600, 4)) < 0.02
    for begin in random.integers(20, 580, 8):
        lost[begin : begin + random.integers(2, 8), random.integers(4)] = True
    return world, lost


def crossing(seed: int) -> tuple[World, npt.NDArray[np.bool_]]:
    """Return points that cross, and when each is hidden: while it does."""
    world = wander(seed, bodies=5, frames=900, apart=0.0, speed=0.08)
    gap = world.pose[:, :, None, :2] - world.pose[:, None, :, :2]
    near = np.hypot(gap[..., 0], gap[..., 1]) + np.eye(5)
    return world, (near < 0.012).any(axis=2)


def follow(world: World, settings: TrackerSettings, seed: int, *, lost=None, false=0.0, angle=True):
    """Track a world with clutter; `lost` (time, body) says what is hidden."""
    random = np.random.default_rng(seed)
    tracker = Tracker(settings)
    for frame, time in enumerate(world.time):
        found = [
            seen(pose, random, angle=angle)
            for body, pose in enumerate(world.pose[frame])
            if lost is None or not lost[frame, body]
        ]
        found += clutter(random, false)
        random.shuffle(found)
        tracker.step(float(time), found)
    return tracker.finish()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_four_blocks_with_clutter_and_gaps_never_swap(seed: int) -> None:
    world, lost = with_gaps(seed)
    recording = follow(world, TrackerSettings(max_speed=0.3, bodies=4), seed, lost=lost, false=0.5)
    assert recording.sizes["body"] == 4
    assert unmarked_swaps(recording, world) == (0, 0)
    # Every true pose that was seen stands in the recording, but for what clutter displaced.
    assert (owners(poses_of(recording), world) >= 0).sum() >= 0.995 * (~lost).sum()
    assert (recording["ambiguous"].values > 0).mean() < 0.1
    assert not of_nothing(recording, world).any()


@pytest.mark.false_alarm(4e-4)
@pytest.mark.study
def test_worlds_that_no_setting_was_chosen_on(fresh_seed: Callable[[int], int]) -> None:
    """What the tests around it demand in every run, in ten worlds of seeds used for nothing else.

    There is no swap. Of some 3000 detections of nothing, those that lie within a few millimetres of
    where a hidden body is expected cannot be told from it: 10 in 80 worlds of other seeds were
    taken without a mark. 7 in 10 worlds come once in 3100 times from that rate.
    """
    nothing = 0
    for seed in map(fresh_seed, range(600, 610)):
        world, lost = with_gaps(seed)
        settings = TrackerSettings(max_speed=0.3, bodies=4)
        recording = follow(world, settings, seed, lost=lost, false=0.5)
        assert unmarked_swaps(recording, world) == (0, 0)
        assert (owners(poses_of(recording), world) >= 0).sum() >= 0.995 * (~lost).sum()
        assert (recording["ambiguous"].values > 0).mean() < 0.1
        nothing += int(of_nothing(recording, world).sum())
        world, lost = crossing(seed)
        settings = TrackerSettings(max_speed=0.4, bodies=5)
        recording = follow(world, settings, seed, lost=lost, angle=False)
        assert unmarked_swaps(recording, world)[1] == 0
    assert nothing < 7


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_bodies_that_cross_unseen_are_marked(seed: int) -> None:
    """Points without angle that cross and are hidden while they do: swaps, none of them unmarked.

    Hidden for up to two seconds, so tracks end and come back as well.
    """
    world, lost = crossing(seed)
    recording = follow(
        world, TrackerSettings(max_speed=0.4, bodies=5), seed, lost=lost, angle=False
    )
    assert lost.sum() > 50
    _, unmarked = unmarked_swaps(recording, world)
    assert unmarked == 0


@pytest.mark.slow
def test_marking_is_not_everything() -> None:
    """The test above could pass by marking all: crossings are marked, the rest is not."""
    world = wander(3, bodies=5, frames=900, apart=0.0, speed=0.08)
    recording = follow(world, TrackerSettings(max_speed=0.4, bodies=5), 3, angle=False)
    assert (recording["ambiguous"].values > 0).mean() < 0.3
    assert unmarked_swaps(recording, world)[1] == 0


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_blocks_that_are_joined_are_not_marked_all_the_time(seed: int) -> None:
    """Four blocks side by side move as one, each missed in 5 % of the frames."""
    random = np.random.default_rng(seed)
    time = 0.1 * np.arange(400)
    middle = 0.05 * np.stack([np.sin(0.3 * time), np.cos(0.23 * time)], axis=1)
    theta = 0.3 * np.sin(0.2 * time)
    cos, sin = np.cos(theta), np.sin(theta)
    pose = np.empty((400, 4, 3))
    for body, (across, up) in enumerate([(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)]):
        pose[:, body, 0] = middle[:, 0] + 0.03 * (cos * across - sin * up)
        pose[:, body, 1] = middle[:, 1] + 0.03 * (sin * across + cos * up)
        pose[:, body, 2] = theta
    world = World(time, pose)
    lost = random.random((400, 4)) < 0.05
    recording = follow(world, TrackerSettings(max_speed=0.3, bodies=4), seed, lost=lost)
    assert unmarked_swaps(recording, world) == (0, 0)
    assert (recording["ambiguous"].values > 0).mean() < 0.1


def test_measurements_are_written_as_they_were() -> None:
    world = wander(1, bodies=1, frames=50, apart=0.03)
    random = np.random.default_rng(0)
    tracker = Tracker(TrackerSettings(max_speed=0.3))
    given = [seen(world.pose[frame, 0], random) for frame in range(50)]
    for time, detection in zip(world.time, given, strict=True):
        tracker.step(float(time), [detection])
    recording = tracker.finish(attrs={"source": "test"}, counts={"dropped": 2})
    assert recording["x"].values[:, 0].tolist() == [d.x for d in given]
    assert recording["y"].values[:, 0].tolist() == [d.y for d in given]
    assert recording["time"].values.tolist() == world.time.tolist()
    variance = recording["covariance"].sel(part="thetatheta").values[:, 0]
    np.testing.assert_allclose(variance, NOISE[2] ** 2, rtol=1e-6)
    assert json.loads(recording.attrs["counts"]) == {"frames": 50, "dropped": 2}
    assert recording.attrs["source"] == "test"


def test_a_tag_keeps_its_body() -> None:
    """Two tags change places while hidden for longer than any track lasts."""
    tracker = Tracker(TrackerSettings(max_speed=0.3, lost_after=0.5))
    places = {"7": -0.05, "9": 0.05}
    for frame in range(60):
        if frame == 30:
            places = {"7": 0.05, "9": -0.05}
        shown = [] if 20 <= frame < 30 else places.items()
        tracker.step(
            0.1 * frame,
            [Detection(x, 0.0, 0.0, 0.0, 0.0, np.diag(NOISE**2), 1.0, key) for key, x in shown],
        )
    recording = tracker.finish()
    assert recording["body"].values.tolist() == ["7", "9"]
    assert recording["x"].sel(body="7").values[[19, 30]].tolist() == [-0.05, 0.05]
    assert not recording["ambiguous"].values.any()


def test_the_same_tag_twice_is_counted() -> None:
    tracker = Tracker(TrackerSettings(max_speed=0.3))
    for frame in range(5):
        far = Detection(0.1, 0.0, 0.0, 0.0, 0.0, np.diag(NOISE**2), 1.0, "7", score=0.2)
        near = Detection(0.0, 0.0, 0.0, 0.0, 0.0, np.diag(NOISE**2), 1.0, "7")
        tracker.step(0.1 * frame, [far, near])
    recording = tracker.finish()
    assert recording["x"].values[:, 0].tolist() == [0.0] * 5
    assert json.loads(recording.attrs["counts"])["same_tag_twice"] == 5


def one_at(x: float) -> Detection:
    return Detection(x, 0.0, 0.0, 0.0, math.nan, np.diag(NOISE**2), 1.0)


def test_a_single_body_comes_back_as_itself() -> None:
    """Nothing else was lost: after 3 s out of sight it is body 0 again, and not ambiguous."""
    tracker = Tracker(TrackerSettings(max_speed=0.3))
    for frame in range(100):
        hidden = 30 <= frame < 60
        tracker.step(0.1 * frame, [] if hidden else [one_at(0.0 if frame < 30 else 0.1)])
    recording = tracker.finish()
    assert recording["body"].values.tolist() == ["0"]
    assert np.isfinite(recording["x"].values).sum() == 70
    assert not recording["ambiguous"].values.any()


@pytest.mark.parametrize(("bodies", "columns"), [(2, 2), (None, 4)])
def test_two_that_were_lost_come_back_with_a_mark_or_as_others(
    bodies: int | None, columns: int
) -> None:
    tracker = Tracker(TrackerSettings(max_speed=0.3, bodies=bodies))
    for frame in range(100):
        if not 30 <= frame < 60:
            tracker.step(0.1 * frame, [one_at(-0.05), one_at(0.05)])
        else:
            tracker.step(0.1 * frame, [])
    recording = tracker.finish()
    assert recording.sizes["body"] == columns
    marked = recording["ambiguous"].values
    if bodies is not None:
        assert (marked[30:60] > 0.05).all()
    assert not marked[5:28].any()


def test_nothing_faster_than_allowed_is_taken() -> None:
    tracker = Tracker(TrackerSettings(max_speed=0.1, bodies=1))
    for frame in range(40):
        tracker.step(0.1 * frame, [one_at(0.0 if frame < 20 else 0.12)])
    x = tracker.finish()["x"].values[:, 0]
    # 0.12 m take 1.2 s: until then the body is not there.
    assert np.isnan(x[20:31]).all()
    assert (x[-5:] == 0.12).all()


def test_bad_input() -> None:
    tracker = Tracker(TrackerSettings(max_speed=0.1))
    with pytest.raises(InputError, match="nothing was tracked in 0 frames"):
        tracker.finish()
    tracker.step(1.0, [])
    with pytest.raises(InputError, match="time does not increase"):
        tracker.step(1.0, [])
    with pytest.raises(InputError, match="not a finite number"):
        tracker.step(math.nan, [])
    nowhere = Detection(None, None, 1.0, 1.0, 0.0, np.eye(3), 1.0)
    with pytest.raises(InputError, match="no position in metres"):
        tracker.step(2.0, [nowhere])
    with pytest.raises(ConfigurationError, match="max_speed is out of range: -1"):
        TrackerSettings(max_speed=-1)


def test_a_collision_does_not_end_a_track() -> None:
    """A body that turns back at once, with its marker read the wrong way round for a frame."""
    tracker = Tracker(TrackerSettings(max_speed=0.3, bodies=1))
    x = 0.0
    for frame in range(60):
        x += 0.1 * (0.1 if frame < 30 else -0.1)
        theta = 3.0 if frame == 45 else 0.0
        tracker.step(0.1 * frame, [Detection(x, 0.0, 0.0, 0.0, theta, np.diag(NOISE**2), 100.0)])
    recording = tracker.finish()
    assert np.isfinite(recording["x"].values).all()
    assert not recording["ambiguous"].values.any()


def test_what_turns_up_beside_a_hidden_body_is_taken_back() -> None:
    """A body at rest is missed once; something else is seen 3 cm away in that frame only."""
    tracker = Tracker(TrackerSettings(max_speed=0.3, bodies=1))
    live = []
    for frame in range(40):
        states = tracker.step(0.1 * frame, [one_at(0.03 if frame == 20 else 0.0)])
        live.append(states[0].ambiguous if states else 0.0)
    recording = tracker.finish()
    x = recording["x"].values[:, 0]
    assert np.isnan(x[20])
    assert (np.delete(x, 20) == 0.0).all()
    assert not (recording["ambiguous"].values[25:] > 0).any()
    # While it was not settled, it was said.
    assert live[20] > 0.001
    assert json.loads(recording.attrs["counts"])["taken_back"] == 1


def test_a_body_that_is_pushed_is_not_taken_back() -> None:
    """The same jump, but it stays there: then it was the body, and nothing is in doubt."""
    tracker = Tracker(TrackerSettings(max_speed=0.4, bodies=1))
    for frame in range(40):
        tracker.step(0.1 * frame, [one_at(0.03 if frame >= 20 else 0.0)])
    recording = tracker.finish()
    assert np.isfinite(recording["x"].values).all()
    assert "taken_back" not in json.loads(recording.attrs["counts"])
    assert not (recording["ambiguous"].values > 0).any()


@pytest.mark.slow
def test_a_long_recording_takes_no_longer_for_each_frame() -> None:
    """Samples of one that never gets a name, and of all others, do not slow the next frame."""
    tracker = Tracker(TrackerSettings(max_speed=0.3, bodies=1))
    random = np.random.default_rng(5)
    began, spans = clock.process_time(), []
    for frame in range(4001):
        hidden = frame > 500 and frame % 50 == 0
        found = [] if hidden else [one_at(1e-4 * random.normal())]
        tracker.step(0.1 * frame, [*found, one_at(0.1)])
        if frame % 1000 == 0:
            spans.append(clock.process_time() - began)
            began = clock.process_time()
    assert spans[-1] < 2.0 * spans[1] + 0.1
    began = clock.process_time()
    tracker.finish()
    assert clock.process_time() - began < 0.05 * sum(spans)
