"""The `recovery` dataset: the fit of every recording, errors and coverage, the length to record."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.calibration.recover.study import ESTIMATED
from driftwalk.calibration.recover.summary import COVERAGE_CONFIDENCE, Summary, summarise
from driftwalk.core.arrays import Floats
from driftwalk.likelihood.recover.truth import FACTS, FLOW_PARTS, PARTS, FitRecovery
from driftwalk.likelihood.refuse import LIMIT
from driftwalk.model.recover import RANDOM
from driftwalk.schema.check import described
from driftwalk.schema.kinds import KINDS
from driftwalk.schema.kinds.recovery import RECOVERED

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study

_ERROR: Final = ("error", "z", "covered")
NEEDED_CONFIDENCE: Final = 0.9
"""Confidence of the interval of the time that one must record."""


def build_recovery(method: FitRecovery, found: Mapping[str, Any]) -> xr.Dataset:
    """Return the dataset of a recovery study, from arrays by (recording, duration, angle)."""
    import xarray as xr

    study = method.study
    dims = ("duration", "angle", "recording")
    tables = {key: np.moveaxis(values, 0, -1) for key, values in found.items()}
    fitted = tables["status"] == ESTIMATED
    used = fitted & (np.where(fitted, tables["wall_share"], 1.0) <= LIMIT.most_wall_share)
    data = {
        **{
            f"{name}{part}": tables[f"{one.key}{part}"]
            for name, one in RECOVERED.items()
            for part in PARTS
        },
        **{key: tables[key] for key in (*FLOW_PARTS, *FACTS, "status")},
        "message": tables["message"].astype(object),
        "used": used.astype(np.int8),
    }
    coords = {
        "duration": ("duration", np.array(study.recover.durations_s)),
        "angle": ("angle", np.array(method.angles, dtype=object)),
        "recording": ("recording", np.arange(study.recover.recordings)),
    }
    facts = {"kind": "recovery", "schema_version": KINDS["recovery"].version, **_attrs(method)}
    dataset = xr.Dataset({key: (dims, one) for key, one in data.items()}, coords, facts)
    return described(add_summary(dataset))


def _attrs(method: FitRecovery) -> dict[str, Any]:
    study = method.study
    settings, forces = study.recover, study.forces
    asked = settings.drag_coefficient_precision
    return {
        "drag_coefficient": forces.drag_coefficient,
        "force_std_N": forces.force_std_N,
        "force_interval_s": forces.force_interval_s,
        "tracking_noise_m": method.tracking_noise,
        "flow": _flow_name(study, method.flow),
        "sample_interval_s": settings.sample_interval_s,
        "recordings_per_fit": settings.recordings_per_fit,
        "missing_share": settings.missing_share,
        "seed": settings.seed,
        "confidence": study.fit.confidence,
        "coverage_confidence": COVERAGE_CONFIDENCE,
        "needed_confidence": NEEDED_CONFIDENCE,
        "most_wall_share": LIMIT.most_wall_share,
        "drag_coefficient_precision": np.nan if asked is None else asked,
        "study": study.to_toml(),
    }


def _flow_name(study: Study, flow: xr.Dataset | None) -> str:
    if flow is None:
        return f"random, {study.recover.flow_family}"
    named = study.recover.flow
    return str(flow.attrs.get("source", "given")) if named in (None, RANDOM) else str(named)


class Scale(NamedTuple):
    """How the error of C_d falls with the length T of a recording: scale / sqrt(T)."""

    value: float
    """Root mean square of ln(estimate / truth), times sqrt(T) [s^0.5]."""
    low: float
    high: float

    def needed(self, precision: float) -> tuple[float, float, float]:
        """Return the length [s] at which the error is `precision`, and its interval."""
        time, low, high = ((part / precision) ** 2 for part in self)
        return time, low, high


def error_scale(duration: Floats, rms_error: Floats, count: Floats) -> Scale:
    """Fit error = scale / sqrt(T) to the lengths of a study, in logarithms.

    Examples
    --------
    >>> round(error_scale(np.array([100.0]), np.array([0.2]), np.array([20])).value, 12)
    2.0
    """
    from scipy.special import chdtri

    enough = count >= 2  # one recording has no spread
    if not enough.any():
        return Scale(np.nan, np.nan, np.nan)
    logs = np.log(rms_error[enough]) + 0.5 * np.log(duration[enough])
    value = float(np.exp(np.average(logs, weights=count[enough])))
    tail, freedom = 0.5 * (1.0 - NEEDED_CONFIDENCE), float(count.max())
    # n rms^2 / sigma^2 is chi-squared with n degrees of freedom.
    low, high = (value * float(np.sqrt(freedom / chdtri(freedom, p))) for p in (tail, 1.0 - tail))
    return Scale(value, low, high)


def add_summary(recovery: xr.Dataset) -> xr.Dataset:
    """Return the dataset of a study with its summary by duration and use of the angle."""
    used = recovery["used"].values == 1
    cells = list(np.ndindex(used.shape[:2]))
    summaries = np.array(
        [
            [
                summarise(*(recovery[f"{name}_{part}"].values[cell][used[cell]] for part in _ERROR))
                for cell in cells
            ]
            for name in RECOVERED
        ]
    ).reshape(len(RECOVERED), *used.shape[:2], -1)
    flow = np.full((*used.shape[:2], 2), np.nan)
    for cell in cells:
        errors = recovery["flow_error"].values[cell][used[cell]]
        errors = errors[np.isfinite(errors)]
        if errors.size:
            flow[cell] = np.median(errors), np.quantile(errors, 0.9)
    rms, count = summaries[0, ..., Summary._fields.index("rms_error")], used.sum(axis=-1)
    scales = [
        error_scale(recovery["duration"].values, *one) for one in zip(rms.T, count.T, strict=True)
    ]
    # NaN where no precision is asked.
    needed = [scale.needed(recovery.attrs["drag_coefficient_precision"]) for scale in scales]
    by_angle = {"drag_coefficient_error_scale": np.array(scales), "needed_duration": needed}
    return recovery.assign(
        {
            name: (("parameter", "duration", "angle"), summaries[..., index])
            for index, name in enumerate(Summary._fields)
        }
        | {
            name: (("duration", "angle"), flow[..., index])
            for index, name in enumerate(("median_flow_error", "flow_error_90"))
        }
        | {
            f"{name}{end}": (("angle",), np.array(values)[:, column])
            for name, values in by_angle.items()
            for column, end in enumerate(("", "_low", "_high"))
        }
    ).assign_coords(parameter=np.array(list(RECOVERED), dtype=object))
