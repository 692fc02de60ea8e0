"""Small fits in which the recording, the water or the body is other than in the plainest case."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import xarray as xr
from euler_blocks import (
    DEPTH_M,
    FORCE_INTERVAL_S,
    MASS_KG,
    SIDE_M,
    Velocity,
    euler_recordings,
    stirred,
)
from fit_worlds import coarse_study, driven

import driftwalk as dw
from driftwalk.flow.analytic import flow_from_function
from driftwalk.likelihood import EarlierFit, estimate_wall
from driftwalk.model import Study, apply_overrides
from driftwalk.schema import build_flow_field, build_trajectory

AXIS = np.arange(-16, 17) * 0.01
ERROR = 2e-3


def stirred_study(**more: Any) -> Study:
    """Return the study of blocks in the stirred flow, with knots 4 cm apart."""
    stated = {
        "tank.diameter_m": 0.32,
        "block.side_m": SIDE_M,
        "block.mass_kg": MASS_KG,
        "block.depth_m": DEPTH_M,
        "forces.force_interval_s": FORCE_INTERVAL_S,
        "fit.spline_spacing_m": 0.04,
        "fit.law": "paper",
        "fit.camera": "exact",
        "fit.flow_strength": "constant",
        "fit.force_memory_s": "white",
    }
    return apply_overrides(Study(), {**stated, **more})


def alternating(share: float, amplitude: Callable[[float], Any]) -> Velocity:
    """Return a stirred flow, and its mirror image as a mode."""

    def velocity(x: np.ndarray, y: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        u, v = stirred(x, y)
        mirrored_u, mirrored_v = stirred(-x, y)
        strength = share * amplitude(time)
        return u + strength * mirrored_u, v - strength * mirrored_v

    return velocity


def in_and_out(time: float) -> float:
    """Return an amplitude with a period of 12 s."""
    return float(np.sin(2.0 * np.pi * time / 12.0))


def frames_of(velocity: Velocity, time: np.ndarray, *, error: float = ERROR) -> xr.Dataset:
    """Return measured frames of a flow; a vector in twenty is missing."""
    generator = np.random.default_rng(4)
    x, y = np.meshgrid(AXIS, AXIS)
    values = np.stack([velocity(x, y, one) for one in time], axis=1)
    flag = np.where(np.hypot(x, y) < 0.158, 1, 0) * np.ones((time.size, 1, 1), dtype=np.int8)
    flag[(generator.random(flag.shape) < 0.05) & (flag == 1)] = 2
    u, v = values + error * generator.normal(size=values.shape)
    attrs = {"method": "file", "source": "piv.nc", "cell_size_m": 0.01}
    return build_flow_field(AXIS, AXIS, u=u, v=v, flag=flag, time=time, attrs=attrs)


def steady(x: np.ndarray, y: np.ndarray, _: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the stirred flow, at any time."""
    return stirred(x, y)


@cache
def in_the_stirred_flow() -> xr.Dataset:
    """Return a recording of 80 s."""
    return euler_recordings(steady, worlds=1, seconds=80.0, seed=3)[0]


@cache
def in_the_alternating_flow() -> xr.Dataset:
    """Return a recording of 80 s."""
    return euler_recordings(alternating(0.6, in_and_out), worlds=1, seconds=80.0, seed=3)[0]


def fit_with_a_measured_flow() -> xr.Dataset:
    field = frames_of(steady, np.zeros(1)).isel(time=0, drop=True)
    return dw.fit_motion(in_the_stirred_flow(), stirred_study(), flow=field)


def fit_with_a_measured_series() -> xr.Dataset:
    series = frames_of(alternating(0.6, in_and_out), np.arange(0.0, 82.0))
    return dw.fit_motion(in_the_alternating_flow(), stirred_study(), flow=series)


def fit_with_modes() -> xr.Dataset:
    return dw.fit_motion(in_the_alternating_flow(), stirred_study(**{"fit.flow_modes": "1"}))


def fit_of_free_bodies() -> xr.Dataset:
    """Return the fit of two blocks in one recording."""
    (two,) = euler_recordings(steady, worlds=1, seconds=80.0, seed=12, stirring_length=0.1)
    return dw.fit_motion(two, stirred_study(**{"fit.interaction": True}))


def fit_of_glued_blocks() -> xr.Dataset:
    """Return the fit of two glued blocks after one of a single block."""
    arena = dw.Study(tank={"diameter_m": 0.32}).tank.to_arena()
    flow = flow_from_function(stirred, arena=arena)
    noise = {"observation.position_noise_m": 2e-4, "observation.orientation_noise_rad": 0.006}
    times = {"simulation.duration_s": 80.0, "simulation.sample_rate_Hz": 10.0}
    single = stirred_study(**noise, **times)
    pair = apply_overrides(
        single,
        {
            "block.shape": "xx",
            "block.mass_kg": 2.0 * MASS_KG,
            "assembly.hidden_face_drag": 0.5,
            "forces.stirring_length_m": 0.03,
        },
    )
    alone, glued = (dw.simulate(one, flow).isel(replicate=0, body=0) for one in (single, pair))
    alone, glued = (
        build_trajectory(*(one[name].values for name in ("time", "x", "y", "theta")))
        for one in (alone, glued)
    )
    fit = dw.fit_motion(alone, single)
    return dw.fit_motion(glued, pair, earlier=EarlierFit(fit, [alone]))


def fit_that_estimates_the_wall() -> xr.Dataset:
    track = driven(3, 60.0, {"tank.wall_restitution": 0.8, "tank.wall_friction": 0.3})
    return estimate_wall(dw.fit_motion(track, coarse_study()), [track])


@cache
def flawed(seconds: float = 150.0) -> xr.Dataset:
    """Return a block that meets the wall, with frames dropped unseen and poses far off."""
    track = driven(7, seconds, {"simulation.seed": 7})
    generator = np.random.default_rng(2)
    kept = generator.random(track.sizes["time"]) > 0.03
    kept[:2] = True
    columns = [track[name].values[:, 0][kept] for name in ("x", "y", "theta")]
    wrong = generator.random(kept.sum()) < 0.01
    columns[0] = np.where(wrong, columns[0] + 0.03, columns[0])
    return build_trajectory(0.1 * np.arange(kept.sum()), *columns)


def fit_of_a_flawed_recording() -> xr.Dataset:
    return dw.fit_motion(flawed(), coarse_study("auto"))
