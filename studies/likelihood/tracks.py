"""The motion of the block of a world, and what a camera sees."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from worlds import RADIUS_M, Floats, World

import driftwalk as dw
from driftwalk.flow.arena import outline_of
from driftwalk.likelihood.filter.series import wall_intervals
from driftwalk.model import Tank
from driftwalk.schema import build_trajectory

if TYPE_CHECKING:
    import xarray as xr

INTERVAL_S = 0.1
SETTLING_S = 60.0
OWN_STEP_S = 2.5e-3


class Poses(NamedTuple):
    """Where the block was every 0.1 s, without noise, shapes (n,) [m], [m], [rad]."""

    x: Floats
    y: Floats
    theta: Floats


class Camera(NamedTuple):
    """Noise of positions and orientations."""

    position_m: float = 0.3e-3
    orientation_deg: float = 0.5


def own_poses(world: World, *, duration: float, seed: int, time_step: float = OWN_STEP_S) -> Poses:
    """Simulate with driftwalk; a minute to settle, then the duration [s]."""
    first, count = round(SETTLING_S / INTERVAL_S), samples(duration)
    run = dw.simulate(
        world.study(time_step=time_step),
        world.flow(),
        sample_time=np.arange(first, first + count) * INTERVAL_S,
        replicates=1,
        seed=seed,
        threads=1,
    )
    return Poses(*(run[name].values[0, :, 0].astype(np.float64) for name in Poses._fields))


def samples(duration: float) -> int:
    """Return how many samples a duration [s] has, both ends included."""
    return round(duration / INTERVAL_S) + 1


def wall_share(poses: Poses) -> float:
    """Return the share of intervals that the fit leaves out because of the wall."""
    near = wall_intervals(
        np.arange(poses.x.size) * INTERVAL_S,
        *poses,
        outline=outline_of(dw.Study().tank.to_arena()),
        block=dw.Study().block,
    )
    return float(near[1:].mean())


def see(poses: Poses, camera: Camera, *, seed: int) -> xr.Dataset:
    """Return the `trajectory` that a camera makes of the motion."""
    noise = np.random.default_rng(seed).normal(size=(3, poses.x.size))
    return build_trajectory(
        np.arange(poses.x.size) * INTERVAL_S,
        poses.x + camera.position_m * noise[0],
        poses.y + camera.position_m * noise[1],
        poses.theta + np.deg2rad(camera.orientation_deg) * noise[2],
        attrs={
            "arena": Tank(diameter_m=2.0 * RADIUS_M).to_arena_json(),
            "source": "simulated",
            "simulated": "yes",
        },
    )
