"""Summary of a recovery study of fits: errors, coverage, and the length to record."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from driftwalk.calibration.recover.summary import Summary, summarise
from driftwalk.core.arrays import Floats
from driftwalk.schema.kinds.recovery import RECOVERED

if TYPE_CHECKING:
    import xarray as xr

NEEDED_CONFIDENCE: Final = 0.9
"""Confidence of the interval of the time that one must record."""


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
                summarise(
                    *(
                        recovery[f"{name}_{part}"].values[cell][used[cell]]
                        for part in ("error", "z", "covered")
                    )
                )
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
