"""The `model_recovery` dataset: what came out of every recording, and its summary."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.calibration.recover.summary import relative_errors, summary_by_parameter
from driftwalk.calibration.recover.truth import ModelRecovery
from driftwalk.motion import MotionModel, ParticleModel
from driftwalk.schema.answers.facts import BOUNDS, texts
from driftwalk.schema.check import build_dataset

if TYPE_CHECKING:
    import xarray as xr


def build_model_recovery(known: ModelRecovery, found: Mapping[str, Any]) -> xr.Dataset:
    """Return the dataset of a recovery study."""
    parameters, study = known.model.parameters, known.study
    names = [one.name for one in parameters]
    truth = np.array([known.values[name] for name in names])
    scales = [one.scale for one in parameters]
    error, *ends = (
        relative_errors(values, truth, found["range"], scales)
        for values in (found["estimate"], *np.moveaxis(found["interval"], -1, 0))
    )
    confidence = study.calibration.confidence
    each = ("recording", "parameter")
    summary = summary_by_parameter(
        error, found["interval"], found["determined"], truth, confidence=confidence
    )
    data: dict[str, Any] = {
        "truth": ("parameter", truth),
        **{name: (each, found[name]) for name in ("estimate", "determined", "half_width")},
        **{name: ((*each, "bound"), found[name]) for name in ("interval", "range")},
        "error": (each, error),
        "error_interval": ((*each, "bound"), np.stack(ends, axis=-1)),
        "status": ("recording", found["status"].astype(np.int8)),
        "message": ("recording", texts([str(one) for one in found["message"]])),
        **{name: ("parameter", values) for name, values in summary.items()},
        "unit": ("parameter", texts([one.unit for one in parameters])),
        "scale": ("parameter", texts(scales)),
        "meaning": ("parameter", texts([one.meaning or one.label for one in parameters])),
    }
    coords = {
        "recording": ("recording", np.arange(len(error))),
        "parameter": ("parameter", texts(names)),
        "bound": ("bound", texts(BOUNDS)),
    }
    time = known.times
    attrs = {
        "model": known.model.name,
        "fixed": json.dumps(_fixed(known.model)),
        "duration_s": float(time[-1] - time[0]),
        "sample_rate_Hz": float(f"{1.0 / np.median(np.diff(time)):.6g}"),
        "missing_share": known.missing_share,
        "position_noise_m": known.position_noise,
        "noise": known.noise,
        "confidence": confidence,
        "seed": study.recover.seed,
        "arena": study.tank.to_arena_json(),
        "source": "" if known.like is None else str(known.like.attrs.get("source", "")),
        "study": study.to_toml(),
    }
    return build_dataset("model_recovery", data, coords, attrs)


def _fixed(model: MotionModel) -> dict[str, float]:
    """Return what the model knows; a clearance of 0 is none: calibrations look for theirs."""
    fixed: Mapping[str, float] = getattr(model, "fixed", {})
    clearance = model.clearance if isinstance(model, ParticleModel) else 0.0
    return {**fixed, **({"clearance": clearance} if clearance else {})}
