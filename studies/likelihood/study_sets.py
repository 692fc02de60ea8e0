"""The four sets of recordings: which worlds, how long, through what camera, with what losses."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from ode import PROGRAM, ode_poses
from tracks import INTERVAL_S, Camera, Poses, own_poses, samples, see, wall_share
from worlds import FAMILIES, World, draw_flow, draw_parameters

from driftwalk.core.files.atomic import write_atomic

if TYPE_CHECKING:
    import xarray as xr

CAMERA = Camera()
FIRST_SEED = {
    "synthetic": 0,
    "coverage": 10_000,
    "ode": 20_000,
    "lengths": 30_000,
    "right": 50_000,
}
"""Seed of the first world of a set; the others follow. The set "right" is one of studies/misfit,
whose other worlds begin at 40,000."""
WORLDS = {"synthetic": 48, "coverage": 200, "ode": 16, "lengths": 6}
TRIAL_S = 1800.0
TRIAL_STEP_S = 0.01
MOST_WALL_SHARE = 0.25
"""In a trial of half an hour: a little below the bar, as the recording itself is another one."""
LOST_SHARE = 0.2
HOLE_S = (800.0, 980.0)


@dataclass(frozen=True)
class Condition:
    """How a world is recorded."""

    name: str
    minutes: float = 30.0
    camera: Camera = CAMERA
    lost: str = "nothing"
    """Or "at random": 20 % of the samples; or "a piece": three minutes."""


PLAIN = Condition("30 min")
CONDITIONS = {
    "lengths": (
        Condition("10 min", minutes=10.0),
        PLAIN,
        Condition("120 min", minutes=120.0),
        Condition("0.1 mm, 0.2°", camera=Camera(0.1e-3, 0.2)),
        Condition("1 mm, 1.5°", camera=Camera(1.0e-3, 1.5)),
        Condition("20 % of the samples lost", lost="at random"),
        Condition("3 minutes lost", lost="a piece"),
    ),
}


@dataclass(frozen=True)
class Case:
    """One recording of a set."""

    set_name: str
    number: int
    condition: Condition

    @property
    def key(self) -> tuple[int, str]:
        """What tells it from the others of its set."""
        return self.number, self.condition.name

    @property
    def seed(self) -> int:
        """The seed of its world, motion and noise."""
        return FIRST_SEED[self.set_name] + self.number

    @property
    def family(self) -> str:
        """Its family of flows; they take turns."""
        return FAMILIES[self.number % len(FAMILIES)]

    @property
    def file(self) -> str:
        """Name of the file that keeps its world and motion."""
        return f"{self.set_name}-{self.number:03d}.npz"


def cases_of(set_name: str, count: int | None = None) -> list[Case]:
    """Return the recordings of a set, or those of its first worlds."""
    numbers = range(WORLDS[set_name] if count is None else count)
    conditions = CONDITIONS.get(set_name, (PLAIN,))
    return [Case(set_name, number, one) for number in numbers for one in conditions]


def world_of(case: Case) -> World:
    """Draw the world of a case: flows are drawn until a trial keeps away from the wall."""
    rng = np.random.default_rng([case.seed, FAMILIES.index(case.family)])
    drag, force = draw_parameters(rng)
    while True:
        world = World(drag, force, *draw_flow(rng, case.family))
        trial = int(rng.integers(2**31))
        poses = own_poses(world, duration=TRIAL_S, seed=trial, time_step=TRIAL_STEP_S)
        if wall_share(poses) < MOST_WALL_SHARE:
            return world


def keep_motion(case: Case, folder: Path) -> None:
    """Draw the world of a case and simulate its motion, unless the folder holds them."""
    if (folder / case.file).exists():
        return
    world = world_of(case)
    duration = 60.0 * max(one.minutes for one in CONDITIONS.get(case.set_name, (PLAIN,)))
    if case.set_name == "ode":
        poses = ode_poses(folder / PROGRAM, world, duration=duration, seed=case.seed)
    else:
        poses = own_poses(world, duration=duration, seed=case.seed)
    save_motion(folder / case.file, world, poses)


def save_motion(path: Path, world: World, poses: Poses) -> None:
    """Write a world and the motion in it, whole or not at all."""
    import io

    buffer = io.BytesIO()
    np.savez(buffer, **vars(world), **poses._asdict())
    write_atomic(path, buffer.getvalue())


def load_motion(path: Path) -> tuple[World, Poses]:
    """Read a world and the motion in it."""
    with np.load(path) as stored:
        world = World(
            float(stored["drag_coefficient"]),
            float(stored["force_std_N"]),
            stored["u"],
            stored["v"],
        )
        return world, Poses(*(stored[name] for name in Poses._fields))


def record(case: Case, poses: Poses) -> xr.Dataset:
    """Return the recording of a motion under the conditions of a case."""
    condition = case.condition
    count = samples(60.0 * condition.minutes)
    recording = see(Poses(*(part[:count] for part in poses)), condition.camera, seed=case.seed)
    time = np.arange(count) * INTERVAL_S
    lost = np.zeros(count, dtype=bool)
    if condition.lost == "at random":
        lost = np.random.default_rng(case.seed).uniform(size=count) < LOST_SHARE
    elif condition.lost == "a piece":
        lost = (time >= HOLE_S[0]) & (time < HOLE_S[1])
    return recording.isel(time=~lost)
