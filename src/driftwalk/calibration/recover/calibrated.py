"""Estimate and interval of each parameter of a calibration, and whether it is determined."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.calibration.estimation.identifiability import DETERMINED
from driftwalk.core.arrays import Floats
from driftwalk.schema import Parameter

if TYPE_CHECKING:
    import xarray as xr


def calibrated_parameters(found: xr.Dataset, parameters: Sequence[Parameter]) -> dict[str, Any]:
    """Return what a calibration says of its parameters."""
    names = [one.name for one in parameters]
    found = found.sel(parameter=names)
    estimate = found["estimate"].values.astype(np.float64)
    interval = np.full((len(names), 2), np.nan)
    if "interval" in found:
        interval = found["interval"].transpose("parameter", "bound").values.astype(np.float64)
    # The ranges of the family go with the recording.
    searched = np.array([(one.low, one.high) for one in parameters])
    if "half_width" in found:
        searched = found["range"].transpose("parameter", "bound").values.astype(np.float64)
        half_width = found["half_width"].values.astype(np.float64)
        determined = found["determined"].values.astype(bool)
    else:
        confidence = (
            float(found["confidence"]) if np.isfinite(interval).any() else DETERMINED.confidence
        )
        half_width = np.array(
            [
                interval_half_width(ends, value, one, confidence=confidence)
                for ends, value, one in zip(interval, estimate, parameters, strict=True)
            ]
        )
        determined = half_width <= DETERMINED.most_half_width
    return {
        "estimate": estimate,
        "interval": interval,
        "range": searched,
        "determined": determined,
        "half_width": half_width,
    }


def interval_half_width(
    ends: Floats, value: float, parameter: Parameter, *, confidence: float
) -> float:
    """Return half the 90 % interval over the value, from an interval of another confidence.

    Examples
    --------
    >>> speed = Parameter("speed", "m/s", 0.0, 0.1)
    >>> round(interval_half_width(np.array([0.04, 0.06]), 0.05, speed, confidence=0.9), 3)
    0.2
    """
    from scipy.special import ndtri

    if not np.isfinite(ends).all():
        return float("nan")
    low, high = (float(parameter.to_coordinate(end)) for end in (parameter.low, parameter.high))
    room = DETERMINED.range_end * (high - low)
    start, end = (float(one) for one in parameter.to_coordinate(ends))
    if start < low + room or end > high - room:
        return float("inf")
    factor = float(ndtri(0.5 + 0.5 * DETERMINED.confidence) / ndtri(0.5 + 0.5 * confidence))
    if parameter.scale == "log":
        return 0.5 * factor * float(np.log(ends[1] / ends[0]))
    size = max(abs(value), DETERMINED.small_part * (parameter.high - parameter.low))
    return 0.5 * factor * float(ends[1] - ends[0]) / size
