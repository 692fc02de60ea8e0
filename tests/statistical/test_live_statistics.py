"""The steps of a live tank against those of `simulate`."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import xarray as xr

import driftwalk as dw
from driftwalk.schema import build_trajectory

# Sampling rate [1/s] and duration [s]. Steps of 0.1 s are mostly camera noise; steps of 1 s are
# mostly motion, and an hour holds enough of it to tell a force from twice that force.
CAMERA, MOTION = (10, 900), (1, 3600)
PERMUTATIONS = 399
LEVEL = 1 / (1 + PERMUTATIONS)
"""The smallest p-value there is: no permutation is as far apart as the recordings are."""
SETTLED = 30.0
"""Time after which neither motion remembers its start [s]."""


def study() -> dw.Study:
    return dw.Study(
        forces={"drag_coefficient": 0.45, "force_std_N": 5.5e-4},
        observation={"position_noise_m": 4e-4, "position_quantum_m": 0.0},
    )


def live_recording(
    sampling: tuple[int, int],
    fresh_seed: Callable[[int], int],
    *,
    force_std: float | None = None,
    noise: bool = True,
) -> xr.Dataset:
    """Keep the poses of a live block, as a camera with the study's noise would see them."""
    rate, duration = sampling
    model = study()
    tank = dw.LiveTank(model, dw.tank30_flow(), blocks=1, seed=fresh_seed(11))
    tank.set(force_std=force_std)
    tank.advance(SETTLED)
    poses = []
    for _ in range(rate * duration):
        tank.advance(1 / rate)
        poses.append([tank.x[0], tank.y[0]])
    blur = float(model.observation.position_noise_m) * noise
    generator = np.random.default_rng(fresh_seed(5))
    seen = np.array(poses) + blur * generator.standard_normal((len(poses), 2))
    return build_trajectory(np.arange(len(seen)) / rate, seen[:, :1], seen[:, 1:])


def simulated_recording(sampling: tuple[int, int], fresh_seed: Callable[[int], int]) -> xr.Dataset:
    rate, duration = sampling
    time = SETTLED + np.arange(rate * duration) / rate
    run = dw.simulate(
        study(), dw.tank30_flow(), sample_time=time, replicates=1, seed=fresh_seed(12)
    )
    x, y = (run[name].values[0] for name in "xy")
    return build_trajectory(time - SETTLED, x, y)


def p_value(sampling: tuple[int, int], fresh_seed: Callable[[int], int], **changes: float) -> float:
    live = live_recording(sampling, fresh_seed, **changes)
    simulated = simulated_recording(sampling, fresh_seed)
    found = dw.compare(live, simulated, permutations=PERMUTATIONS, seed=fresh_seed(3))
    return float(found["p_value"])


@pytest.mark.slow
@pytest.mark.false_alarm(LEVEL)
@pytest.mark.parametrize("sampling", [CAMERA, MOTION], ids=["camera", "motion"])
def test_a_live_block_makes_the_steps_of_simulate(
    sampling: tuple[int, int], fresh_seed: Callable[[int], int]
) -> None:
    assert p_value(sampling, fresh_seed) > LEVEL


@pytest.mark.slow
@pytest.mark.false_alarm(0.01)
def test_the_comparison_sees_another_force_and_a_camera_without_noise(
    fresh_seed: Callable[[int], int],
) -> None:
    """The smallest p-value in all of 58 seeds (force) and 33 seeds (camera).

    In steps of 0.1 s, 36 % of seeds hid the doubled force.
    """
    assert p_value(MOTION, fresh_seed, force_std=1.1e-3) == LEVEL
    assert p_value(CAMERA, fresh_seed, noise=False) == LEVEL
