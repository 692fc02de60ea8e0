"""The steps of a live tank against those of `simulate`, with fixed seeds.

Were the seeds redrawn, the comparison would fail falsely in about one of 200 runs.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

import driftwalk as dw
from driftwalk.schema import build_trajectory

RATE, DURATION = 10, 900
LEVEL = 0.005
SETTLED = 30.0
"""Time after which neither motion remembers its start [s]."""


def study() -> dw.Study:
    return dw.Study(
        forces={"drag_coefficient": 0.45, "force_std_N": 5.5e-4},
        observation={"position_noise_m": 4e-4, "position_quantum_m": 0.0},
    )


def live_recording(*, force_std: float | None = None, noise: bool = True) -> xr.Dataset:
    """Keep the poses of a live block, as a camera with the study's noise would see them."""
    model = study()
    tank = dw.LiveTank(model, dw.tank30_flow(), blocks=1, seed=11)
    tank.set(force_std=force_std)
    tank.advance(SETTLED)
    poses = []
    for _ in range(RATE * DURATION):
        tank.advance(1 / RATE)
        poses.append([tank.x[0], tank.y[0]])
    blur = float(model.observation.position_noise_m) * noise
    seen = np.array(poses) + blur * np.random.default_rng(5).standard_normal((len(poses), 2))
    return build_trajectory(np.arange(len(seen)) / RATE, seen[:, :1], seen[:, 1:])


def simulated_recording() -> xr.Dataset:
    time = SETTLED + np.arange(RATE * DURATION) / RATE
    run = dw.simulate(study(), dw.tank30_flow(), sample_time=time, replicates=1, seed=12)
    x, y = (run[name].values[0] for name in "xy")
    return build_trajectory(time - SETTLED, x, y)


def p_value(recording: xr.Dataset) -> float:
    return float(dw.compare(recording, simulated_recording(), permutations=399, seed=3)["p_value"])


def test_a_live_block_makes_the_steps_of_simulate() -> None:
    assert p_value(live_recording()) > LEVEL


def test_the_comparison_sees_another_force_and_a_camera_without_noise() -> None:
    assert p_value(live_recording(force_std=1.1e-3)) <= LEVEL
    assert p_value(live_recording(noise=False)) <= LEVEL
