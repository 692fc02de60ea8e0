"""A recording of known truth in two flows, one after the other, for tests of the likelihood fit."""

from __future__ import annotations

from functools import cache

import numpy as np
import xarray as xr

import driftwalk as dw
from driftwalk.flow import random_tank_flow
from driftwalk.model import Study, apply_overrides
from driftwalk.schema import build_flow_field, build_trajectory
from driftwalk.simulation import Start

DRAG = 0.4
FORCE_N = 6e-4
NOISE_M = 3e-4
SWITCH_S = 200.0
START_S = 50.0
"""First time stamp of the recording: its clock does not begin with it."""


def coarse_study(**fit: object) -> Study:
    """Return the truth's study, with knots 3 cm apart and the angle as an input, for speed."""
    study = Study(
        forces={"drag_coefficient": DRAG, "force_std_N": FORCE_N, "force_interval_s": 0.01},
        observation={"position_noise_m": NOISE_M, "orientation_noise_rad": "0.5deg"},
        fit={"spline_spacing_m": 0.03, "angle": "given"},
    )
    return apply_overrides(study, {f"fit.{key}": value for key, value in fit.items()})


@cache
def true_flows() -> tuple[xr.Dataset, xr.Dataset]:
    """Return two swirls that have nothing to do with each other."""
    first, second = (random_tank_flow(seed, speed=0.05) for seed in (1, 4))
    return first, second


@cache
def two_flows(duration: float = SWITCH_S) -> xr.Dataset:
    """Return a recording of so many seconds in the first flow, then as many in the second."""
    frames = true_flows()
    flow = build_flow_field(
        frames[0]["x"],
        frames[0]["y"],
        time=[duration - 1e-6, duration + 1e-6],
        **{name: np.stack([one[name].values for one in frames]) for name in ("u", "v", "flag")},
        attrs={"repeat": "hold"},
    )
    clock = 0.1 * np.arange(round(20.0 * duration) + 1)
    study = apply_overrides(coarse_study(), {"simulation.time_step_s": 0.0025})
    run = dw.simulate(study, flow, sample_time=clock, replicates=1, seed=3)
    assert not run["status"].values.any()
    pose = {name: run[name].values[0, :, 0].astype(float) for name in ("x", "y", "theta")}
    return build_trajectory(START_S + clock, **pose, attrs={"source": "switched.csv"})


FORCES_N = (4e-4, 9e-4)
"""σ_F of the two settings of the pumps."""


def two_settings(seed: int, *, duration: float = SWITCH_S) -> xr.Dataset:
    """Return a recording of so many seconds in each of two flows, with the σ_F of each.

    The block is held for a moment at the switch: the second part begins at rest where the first
    one ended.
    """
    clock = 0.1 * np.arange(round(10.0 * duration) + 1)
    parts: list[dict[str, np.ndarray]] = []
    start = None
    for number, (flow, force) in enumerate(zip(true_flows(), FORCES_N, strict=True)):
        wanted = {"simulation.time_step_s": 0.0025, "forces.force_std_N": force}
        study = apply_overrides(coarse_study(), wanted)
        run = dw.simulate(
            study, flow, sample_time=clock, replicates=1, seed=100 * seed + number, start=start
        )
        assert not run["status"].values.any()
        pose = {name: run[name].values[0, :, 0].astype(float) for name in ("x", "y", "theta")}
        start = Start(*(axis[-1] for axis in pose.values()))
        parts.append({name: axis[: -1 if number == 0 else None] for name, axis in pose.items()})
    pose = {name: np.concatenate([one[name] for one in parts]) for name in parts[0]}
    time = START_S + 0.1 * np.arange(pose["x"].size)
    return build_trajectory(time, **pose, attrs={"source": "pumps.csv"})
