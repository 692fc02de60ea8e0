"""What the scripts of this folder simulate: four blocks with connectors in the bundled flow."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

import driftwalk as dw

CALIBRATED = (0.45, 0.55e-3)
"""C_d and sigma_F [N] of the paper."""
SMALL_DRAG = (0.05, 0.0)
OVERRIDES = {
    "forces.force_interval_s": 0.016,
    "tank.wall_friction": 1.0,
    "tank.wall_restitution": 0.5,
    "assembly.blocks": 4,
    "assembly.duration_s": 300.0,
    "assembly.latching": "connector",
}


def study_of(hidden_face_drag: str, changes: Mapping[str, Any] | None = None) -> dw.Study:
    """Return the study, with some of its values changed."""
    chosen = {**OVERRIDES, "assembly.hidden_face_drag": hidden_face_drag, **(changes or {})}
    return dw.apply_overrides(dw.Study(), chosen)


def simulate(
    hidden_face_drag: str,
    *,
    runs: int,
    parameters: tuple[float, float] = CALIBRATED,
    changes: Mapping[str, Any] | None = None,
    start: npt.ArrayLike | None = None,
    flow_factor: float = 1.0,
) -> xr.Dataset:
    """Return the distribution of outcomes, with some of the study's values changed."""
    flow = dw.tank30_flow()
    assembly = dw.assembly.assemble(
        study_of(hidden_face_drag, changes),
        flow.assign({name: flow_factor * flow[name] for name in "uv"}),
        runs=runs,
        start=start,
        drag_coefficient=parameters[0],
        force_std=parameters[1],
    )
    return dw.outcome_distribution(assembly)


def starts_within(diameter: float, *, runs: int) -> npt.NDArray[np.float64]:
    """Return start poses of whole blocks in a circle [m] in the middle of the tank."""
    small = study_of("none", {"tank.diameter_m": diameter})
    path = dw.assembly_path(small, dw.tank30_flow(), runs=range(runs), duration=small.time_step_s)
    first = path.isel(time=0)
    return np.stack([first[name].values for name in ("x", "y", "theta")], axis=-1).astype(float)
