"""The `model_recovery` dataset: what came out of every recording, and its summary."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.calibration.estimation.identifiability import DETERMINED
from driftwalk.calibration.recover.truth import KnownTruth
from driftwalk.core.arrays import Bools, Floats
from driftwalk.motion import MotionModel, ParticleModel
from driftwalk.schema.answers.facts import BOUNDS, texts
from driftwalk.schema.check import build_dataset

if TYPE_CHECKING:
    import xarray as xr


def build_model_recovery(known: KnownTruth, found: Mapping[str, Any]) -> xr.Dataset:
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


def relative_errors(
    estimate: Floats, truth: Floats, ranges: Floats, scales: Sequence[str]
) -> Floats:
    """Return the errors of estimates, shape (recordings, parameters).

    Examples
    --------
    >>> ends = np.array([[[-5.0, 5.0]]])
    >>> relative_errors(np.array([[0.2]]), np.array([0.0]), ends, ["linear"]).tolist()
    [[0.4]]
    """
    error = np.empty_like(estimate)
    for index, scale in enumerate(scales):
        found, value = estimate[:, index], float(truth[index])
        if scale == "log":
            with np.errstate(divide="ignore"):
                error[:, index] = np.log(found / value)
        else:
            low, high = ranges[:, index].T
            error[:, index] = (found - value) / np.maximum(
                abs(value), DETERMINED.small_part * (high - low)
            )
    return error


def summary_by_parameter(
    error: Floats, interval: Floats, determined: Bools, truth: Floats, *, confidence: float
) -> dict[str, Floats]:
    """Return the summary of a study, an array by parameter each.

    Examples
    --------
    >>> ends = np.array([[[0.9, 1.2]], [[1.1, 1.3]]])
    >>> found = summary_by_parameter(
    ...     np.array([[0.05], [0.2]]), ends, np.array([[True], [False]]), np.array([1.0]),
    ...     confidence=0.9,
    ... )
    >>> found["coverage"].tolist(), found["determined_median_error"].tolist()
    ([0.5], [0.05])
    """
    size = np.abs(error)
    calibrated = np.isfinite(size)
    known = np.isfinite(interval).all(axis=2)
    held = known & (interval[..., 0] <= truth) & (truth <= interval[..., 1])
    counted = known.sum(axis=0).astype(np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        return {
            "median_error": _medians(size, calibrated),
            "determined_median_error": _medians(size, calibrated & determined),
            "determined_share": (calibrated & determined).sum(axis=0) / calibrated.sum(axis=0),
            "coverage": held.sum(axis=0) / counted,
            "coverage_standard_error": np.where(
                counted > 0.0, np.sqrt(confidence * (1.0 - confidence) / counted), np.nan
            ),
        }


def _medians(size: Floats, counts: Bools) -> Floats:
    """Return the median of what counts in each column, NaN where nothing does."""
    columns = zip(size.T, counts.T, strict=True)
    return np.array(
        [np.median(one[retained]) if retained.any() else np.nan for one, retained in columns]
    )
