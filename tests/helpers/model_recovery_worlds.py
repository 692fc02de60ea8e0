"""Recovery studies of a motion model with made-up calibrations (synthetic)."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

import driftwalk as dw
from driftwalk.calibration import ModelRecovery

VALUES = {"speed": 0.03, "rotational_diffusion": 0.5, "turn_rate": 0.3}


def made_up(recordings: int = 12, seed: int = 1, **changes: Any) -> dict[str, Any]:
    """Return estimates that scatter about the truth, with intervals of chance widths."""
    random = np.random.default_rng(seed)
    shape = (recordings, len(VALUES))
    truth = np.array(list(VALUES.values()))
    estimate = truth * np.exp(random.normal(0.0, [0.02, 0.2, 0.5], shape))
    width = random.uniform(0.5, 2.0, shape) * truth * [0.02, 0.2, 0.5]
    ranges = np.array([[0.001, 1.0], [0.01, 10.0], [-3.0, 3.0]])
    return {
        "estimate": estimate,
        "interval": np.stack([estimate - width, estimate + width], axis=-1),
        "range": np.broadcast_to(ranges, (*shape, 2)).copy(),
        "half_width": width / truth,
        "determined": width / truth < 0.25,
        "status": np.zeros(recordings, dtype=np.int64),
        "message": np.array([""] * recordings),
    } | changes


def made_up_recovery(found: dict[str, Any] | None = None) -> xr.Dataset:
    """Return the `model_recovery` of made-up calibrations."""
    chosen = made_up() if found is None else found
    count = {"recover.recordings": len(chosen["status"]), "recover.durations_s": [600.0]}
    study = dw.apply_overrides(dw.Study(), {**count, "observation.position_noise_m": 3e-4})
    model = dw.motion_model("active")
    return ModelRecovery(study, model, VALUES).result(chosen)


def lost(found: dict[str, Any], which: int, status: int, message: str) -> dict[str, Any]:
    """Return made-up calibrations of which one is missing."""
    for name in ("estimate", "interval", "half_width", "range"):
        found[name][which] = np.nan
    found["determined"][which] = False
    found["status"][which] = status
    found["message"] = found["message"].astype("U80")
    found["message"][which] = message
    return found
