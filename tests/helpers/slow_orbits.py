"""A block on a slow, regular orbit: two recordings of the same parameters are far apart. Synthetic.

A swirl, a weak sink, and a jet that is too weak to throw the block off its orbit.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import driftwalk as dw
from driftwalk.schema import build_flow_field, build_trajectory

TRUTH = {"drag_coefficient": 0.74, "force_std_N": 0.16e-3}
AXIS = np.linspace(-0.165, 0.165, 67)
POSITION_NOISE_M = 0.3e-3
ORIENTATION_NOISE_RAD = 0.01


def slow_flow() -> Any:
    """Return the flow, 1 to 3 cm/s where the block is."""
    x, y = np.meshgrid(AXIS, AXIS)
    swirl = 0.2 * np.exp(-((np.hypot(x, y) / 0.14) ** 4))
    jet = 0.02 * np.exp(-0.5 * (np.hypot(x - 0.11, y - 0.05) / 0.03) ** 2)
    flag = np.ones(x.shape, dtype=np.int8)
    u, v = -swirl * y - 0.04 * x - 0.9 * jet, swirl * x - 0.04 * y - 0.4 * jet
    return build_flow_field(AXIS, AXIS, u=u, v=v, flag=flag)


def slow_recording(*, seed: int, duration: float = 900.0) -> Any:
    """Simulate a recording at the true parameters [s]."""
    study = dw.apply_overrides(
        dw.Study(),
        {
            **{f"forces.{name}": value for name, value in TRUTH.items()},
            "simulation.duration_s": duration,
            "observation.position_noise_m": POSITION_NOISE_M,
            "observation.orientation_noise_rad": ORIENTATION_NOISE_RAD,
        },
    )
    start = dw.simulation.Start(0.06, 0.0, 0.0)
    run = dw.simulate(study, slow_flow(), start=start, seed=seed).isel(replicate=0, body=0)
    return build_trajectory(run["time"], run["x"], run["y"], run["theta"])
