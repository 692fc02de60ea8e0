"""Recordings for tests of the likelihood fit: parts of the bundled one, with coarse knots.

They were simulated by another engine; every parameter is known. `driven` makes others.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any, Literal

import numpy as np
import xarray as xr
from made_once import made_once

import driftwalk as dw
from driftwalk.model import Study, apply_overrides
from driftwalk.schema import build_flow_field, build_trajectory

TRUTH = dw.tank30_truth()
DRAG = TRUTH["drag_coefficient"]
FORCE_N = TRUTH["force_std_N"]
NOISE_M = TRUTH["tracking_noise_m"]


def coarse_study(law: Literal["auto", "paper"] = "paper") -> Study:
    """Return the study of the bundled recording with knots 3 cm apart, for speed.

    With the paper's law, which is that of the recording, nothing else is looked for.
    """
    closed = {
        "fit.law": "paper",
        "fit.camera": "exact",
        "fit.flow_strength": "constant",
        "fit.force_memory_s": "white",
    }
    return apply_overrides(
        Study(),
        {
            "tank.diameter_m": 2.0 * TRUTH["tank_radius_m"],
            "block.side_m": TRUTH["side_m"],
            "block.mass_kg": TRUTH["mass_kg"],
            "forces.force_interval_s": TRUTH["force_interval_s"],
            "fit.spline_spacing_m": 0.03,
            **(closed if law == "paper" else {}),
        },
    )


@cache
def _whole(realisation: Literal["first", "second"]) -> xr.Dataset:
    return dw.tank30_recording(realisation)


def recording(seconds: float, realisation: Literal["first", "second"] = "first") -> xr.Dataset:
    """Return the first part of a bundled recording."""
    return _whole(realisation).sel(time=slice(0.0, seconds)).copy(deep=True)


@cache
def _fitted(seconds: float) -> xr.Dataset:
    name = f"fit of {seconds:g} s"
    return made_once(name, lambda: dw.fit_motion(recording(seconds), coarse_study()))


def fitted(seconds: float) -> xr.Dataset:
    """Return the fit of the first part of the bundled recording, made once in a session."""
    return _fitted(seconds).copy(deep=True)


def driven(
    seed: int, seconds: float, changes: Mapping[str, Any], *, interval: float = 0.1
) -> xr.Dataset:
    """Return a block on a swirl, with a jet that drives it to the wall; simulated by driftwalk.

    C_d is 0.45, σ_F 0.8 mN, the noise 0.3 mm and 9 mrad; `changes` are keys of the study.
    """
    study = apply_overrides(
        coarse_study(),
        {
            "forces.drag_coefficient": 0.45,
            "forces.force_std_N": 0.8e-3,
            "simulation.time_step_s": 0.002,
            "observation.position_noise_m": 3e-4,
            "observation.orientation_noise_rad": 0.009,
            **changes,
        },
    )
    axis = np.linspace(-0.15, 0.15, 41)
    x, y = np.meshgrid(axis, axis)
    swirl = 0.5 * np.exp(-((np.hypot(x, y) / 0.14) ** 4))
    jet = 0.05 * np.exp(-0.5 * (np.hypot(x - 0.09, y + 0.05) / 0.03) ** 2)
    inside = np.ones(x.shape, dtype=np.int8)
    flow = build_flow_field(axis, axis, u=-swirl * y - jet, v=swirl * x, flag=inside)
    time = np.arange(0.0, seconds + 20.0, interval)
    run = dw.simulate(study, flow, sample_time=time, replicates=1, seed=seed)
    seen = run.isel(replicate=0, body=0, time=slice(round(20.0 / interval), None))
    return build_trajectory(
        seen["time"].values - 20.0, *(seen[name].values for name in ("x", "y", "theta"))
    )
