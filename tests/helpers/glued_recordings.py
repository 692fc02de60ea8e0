"""Simulated recordings of one block, and of two that are glued together, in the same water."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import xarray as xr
from euler_blocks import stirred

import driftwalk as dw
from driftwalk.flow.analytic import flow_from_function

SIDE, MASS, HIDDEN, RHO = 0.03, 0.0116, 0.5, 0.6
ARENA = dw.Study(tank={"diameter_m": 0.32}).tank.to_arena()
LENGTH = SIDE / math.sqrt(-2.0 * math.log(RHO))


def recorded(folder: Path, name: str, study: dw.Study, flow: xr.Dataset) -> Path:
    """Write a simulated recording as a tracker does."""
    motion = dw.simulate(study, flow).isel(replicate=0, body=0)
    path = folder / f"{name}.csv"
    columns = [motion[key].values for key in ("time", "x", "y", "theta")]
    np.savetxt(path, np.stack(columns, axis=1), delimiter=",", comments="",
               header="t_s,x_m,y_m,theta_rad", fmt="%.6f")  # fmt: skip
    return path


def recordings(folder: Path, minutes: float = 10.0) -> tuple[Path, Path]:
    """Write ``one.csv`` and ``dimer.csv``."""
    flow = flow_from_function(lambda x, y: stirred(x, y, 1.0), arena=ARENA)
    one = dw.Study(
        tank={"diameter_m": 0.32},
        simulation={"duration_s": 60.0 * minutes, "sample_rate_Hz": 10.0, "seed": 4},
        observation={"position_noise_m": 2e-4, "orientation_noise_rad": 0.006},
    )
    glued = dw.apply_overrides(
        one,
        {
            "block.shape": "xx",
            "block.mass_kg": 2 * MASS,
            "assembly.hidden_face_drag": HIDDEN,
            "forces.stirring_length_m": LENGTH,
            # Of the sum of two forces with the correlation rho.
            "forces.force_std_N": one.forces.force_std_N * math.sqrt(2.0 * (1.0 + RHO)),
            "simulation.seed": 5,
        },
    )
    return recorded(folder, "one", one, flow), recorded(folder, "dimer", glued, flow)
