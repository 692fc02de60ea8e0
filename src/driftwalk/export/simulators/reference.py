"""Paths of driftwalk that an export is held to: from rest, clear of the wall."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Bools, Floats, Integers
from driftwalk.core.errors import InputError
from driftwalk.core.random_streams import world_keys
from driftwalk.export.simulators.block import Block

if TYPE_CHECKING:
    from driftwalk.model import Study

TRIED: Final = 64
"""Replicates among which those that stay clear of the wall are looked for; chosen by hand."""
KEPT: Final = 4
"""Most paths of each set, without the stochastic force and with it; chosen by hand."""
LENGTHS_S: Final = (10.0, 5.0, 2.0, 1.0)
"""Lengths of the paths, the longest first: in a narrow tank none is clear of the wall for long;
chosen by hand."""
NO_PATH: Final = "no path stays clear of the wall of this tank for a second: nothing was compared"


class PathSet(NamedTuple):
    """Some paths: which replicates they are, and x, y and theta, shape (paths, samples, 3)."""

    replicate: Integers
    pose: Floats


@dataclass(frozen=True)
class Reference:
    """The paths that driftwalk computes for an export.

    Attributes
    ----------
    time : ndarray
        Times of the samples [s].
    steps_per_sample : int
        Time steps of driftwalk between two samples.
    still, noisy : PathSet
        Without the stochastic force, and with it.
    """

    time: Floats
    steps_per_sample: int
    still: PathSet
    noisy: PathSet

    def arrays(self) -> dict[str, Any]:
        """Return everything as arrays, units in the names."""
        found: dict[str, Any] = {"time_s": self.time}
        for name, paths in (("still", self.still), ("noisy", self.noisy)):
            found[f"{name}_replicate"] = paths.replicate
            for place, key in enumerate(("x_m", "y_m", "theta_rad")):
                found[f"{name}_{key}"] = paths.pose[..., place]
        return found


def reference_of(block: Block) -> Reference:
    """Simulate paths of a block in double precision, and keep those clear of the wall.

    A path is a replicate of `driftwalk simulate` with the export's seed and a random start. None is
    kept in a tank where no path is clear of the wall for a second.
    """
    from driftwalk.model import apply_overrides

    seen = {
        "observation.position_noise_m": 0.0,
        "observation.orientation_noise_rad": 0.0,
        "observation.position_quantum_m": 0.0,
        "observation.field_of_view": None,
    }
    study = apply_overrides(block.study, seen)
    interval = study.forces.force_interval_s
    # A sample about every 0.1 s.
    intervals = max(1, round(0.1 / interval))
    period, steps = intervals * interval, intervals * round(interval / study.time_step_s)
    for length in LENGTHS_S:
        samples = math.ceil(length / period - 1e-9) + 1
        time = np.arange(samples, dtype=np.float64) * period
        still = _clear_paths(apply_overrides(study, {"forces.force_std_N": 0.0}), block, time)
        noisy = _clear_paths(study, block, time)
        if min(still.replicate.size, noisy.replicate.size) > 0:
            break
    return Reference(time, steps, still, noisy)


def _clear_paths(study: Study, block: Block, time: Floats) -> PathSet:
    from driftwalk.simulation import simulate
    from driftwalk.simulation.initial import random_start

    keys = world_keys(block.seed, trial=0, replicate=np.arange(TRIED))
    try:
        start = random_start(study, keys)
    except InputError:  # the block hardly fits into the tank
        return PathSet(np.zeros(0, dtype=np.int64), np.zeros((0, time.size, 3)))
    run = simulate(
        study,
        block.flow,
        sample_time=time,
        start=start,
        replicates=TRIED,
        seed=block.seed,
        backend="reference",
    )
    pose = np.stack([run[name].values[:, :, 0] for name in ("x", "y", "theta")], axis=2)
    pose = pose.astype(np.float64)
    kept = np.flatnonzero(_is_clear(study, pose[..., 0], pose[..., 1]))[:KEPT]
    return PathSet(kept, pose[kept])


def _is_clear(study: Study, x: Floats, y: Floats) -> Bools:
    """Return which paths have no corner near the wall, at any angle of the block."""
    from driftwalk.model.tank import edges

    # Between two samples the block moves on.
    moved = np.hypot(np.diff(x, axis=1), np.diff(y, axis=1)).max(axis=1, initial=0.0)
    reach = study.block.side_m / np.sqrt(2.0) + 1e-3 + moved
    if study.tank.radius_m is not None:
        return np.asarray(np.hypot(x, y).max(axis=1) + reach < study.tank.radius_m)
    clear = np.ones(x.shape[0], dtype=bool)
    for (x0, y0), (x1, y1) in edges(study.tank.corners_m):
        inward = ((x1 - x0) * (y - y0) - (y1 - y0) * (x - x0)) / np.hypot(x1 - x0, y1 - y0)
        clear &= inward.min(axis=1) > reach
    return clear


def forces_of(block: Block) -> Floats:
    """Return states of a block and driftwalk's drag on it, a row each.

    x, y [m], theta [rad], vx, vy [m/s], omega [rad/s], then force x, y [N] and torque [N m].
    """
    from driftwalk import _core
    from driftwalk.simulation.backend import Camera, native_model

    model = native_model(block.study, block.flow, np.zeros(1), Camera())
    rng = np.random.default_rng(block.seed)
    width, height = block.study.tank.extent_m
    # A circle has no corners; its centre is the origin.
    corners = np.array(block.study.tank.corners_m or [(-width / 2, -height / 2)])
    low = np.array([*corners.min(axis=0), -np.pi, -0.1, -0.1, -2.0])
    size = np.array([width, height, 2 * np.pi, 0.2, 0.2, 4.0])
    states = low + rng.uniform(size=(200, 6)) * size
    names = ("x", "y", "theta", "vx", "vy", "omega")
    pushes = [
        _core.drag(
            model,
            drag_coefficient=block.study.forces.drag_coefficient,
            **dict(zip(names, state.tolist(), strict=True)),
        )
        for state in states
    ]
    return np.column_stack([states, np.array(pushes)])
