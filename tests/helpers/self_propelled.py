"""Recordings of self-propelled bodies: made by a member of the family (synthetic)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

import driftwalk as dw
from driftwalk.core.random_streams import world_keys
from driftwalk.motion import MotionModel
from driftwalk.schema import Track, build_trajectory

SPEED = 0.05
"""With which a body sets out [m/s]."""


def moving(
    model: MotionModel,
    values: Mapping[str, float],
    seconds: float,
    *,
    seed: int,
    noise: float | None = None,
) -> xr.Dataset:
    """Return a recording of a model in the paper's tank, at 10 Hz; it sets out along x.

    `noise` is that of the camera [m]; by default there is none.
    """
    time = np.arange(0.0, seconds, 0.1)
    study = dw.Study()
    if noise is not None:
        study = dw.apply_overrides(study, {"observation.position_noise_m": noise})
    track = Track(time, SPEED + 0.0 * time, 0.0 * time, np.full(time.size, np.nan))
    camera = dw.conditions.recorded_camera(track, study, position_quantum=0.0)
    like = dw.conditions.recorded_conditions(track, study, camera=camera)
    given = {one.name: np.array([values[one.name]]) for one in model.parameters}
    seen = model.simulate(given, like, world_keys(seed, trial=0, replicate=0))
    arena = {"arena": study.tank.to_arena_json()}
    return build_trajectory(time, seen.x[0], seen.y[0], attrs=arena)
