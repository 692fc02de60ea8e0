"""Summary of a recovery study: errors, coverage, and the length to record."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import xarray as xr

Floats = npt.NDArray[np.float64]

COVERAGE_CONFIDENCE: Final = 0.95
"""Confidence of the Clopper-Pearson interval of a coverage."""
NEEDED_CONFIDENCE: Final = 0.9
"""Confidence of the interval of the time that one must record."""
PARAMETERS: Final = ("drag_coefficient", "force_std", "tracking_noise")


class Summary(NamedTuple):
    """Summary of one parameter over recordings that were made alike."""

    median_absolute_error: float
    """Median of the size of the relative error."""
    absolute_error_90: float
    """Size of the relative error that 90 % of the recordings stay within."""
    bias: float
    """Mean relative error."""
    rms_error: float
    """Root mean square of ln(estimate / truth): chance and bias together."""
    spread: float
    """Standard deviation of ln(estimate) over the recordings."""
    rms_z: float
    """Root mean square of the error in stated standard deviations; 1 if these are right."""
    coverage: float
    """Share of the intervals that hold the truth."""
    coverage_low: float
    """Lower end of the coverage's own interval."""
    coverage_high: float
    """Its upper end."""


def summarise(error: Floats, z: Floats, covered: Floats) -> Summary:
    """Return the summary of recordings.

    Examples
    --------
    >>> error = np.array([-0.1, 0.2])
    >>> found = summarise(error, error / 0.1, np.array([1.0, 0.0]))
    >>> round(found.bias, 3), found.coverage, round(found.rms_z, 3)
    (0.05, 0.5, 1.581)
    """
    if error.size == 0:
        return Summary(*[np.nan] * len(Summary._fields))
    low, high = coverage_interval(int(covered.sum()), covered.size)
    return Summary(
        median_absolute_error=float(np.median(np.abs(error))),
        absolute_error_90=float(np.quantile(np.abs(error), 0.9)),
        bias=float(error.mean()),
        rms_error=float(np.sqrt(np.mean(np.log1p(error) ** 2))),
        spread=float(np.log1p(error).std(ddof=1)) if error.size >= 2 else np.nan,
        rms_z=float(np.sqrt(np.mean(z**2))),
        coverage=float(covered.mean()),
        coverage_low=low,
        coverage_high=high,
    )


def coverage_interval(
    count: int, total: int, *, confidence: float = COVERAGE_CONFIDENCE
) -> tuple[float, float]:
    """Return the Clopper-Pearson interval of a share.

    Examples
    --------
    >>> low, high = coverage_interval(0, 10, confidence=0.9)
    >>> low, round(high, 4)
    (0.0, 0.2589)
    """
    from scipy.special import betaincinv

    tail = 0.5 * (1.0 - confidence)
    low = float(betaincinv(count, total - count + 1.0, tail)) if count > 0 else 0.0
    high = float(betaincinv(count + 1.0, total - count, 1.0 - tail)) if count < total else 1.0
    return low, high


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


def add_summary(recovery: xr.Dataset, *, precision: float | None) -> xr.Dataset:
    """Return the dataset of a study with its summary by duration and use of the angle."""
    shape = (len(PARAMETERS), recovery.sizes["duration"], recovery.sizes["angle"])
    tables = {name: np.full(shape, np.nan) for name in Summary._fields}
    flow = {name: np.full(shape[1:], np.nan) for name in ("median_flow_error", "flow_error_90")}
    used = recovery["used"].values == 1
    for place in np.ndindex(*shape):
        name, retained = PARAMETERS[place[0]], used[place[1:]]
        found = summarise(
            *(
                recovery[f"{name}_{part}"].values[place[1:]][retained]
                for part in ("error", "z", "covered")
            )
        )
        for key, value in found._asdict().items():
            tables[key][place] = value
    for place in np.ndindex(*shape[1:]):
        errors = recovery["flow_error"].values[place][used[place]]
        errors = errors[np.isfinite(errors)]
        if errors.size:
            flow["median_flow_error"][place] = np.median(errors)
            flow["flow_error_90"][place] = np.quantile(errors, 0.9)
    scales, needed = _needed(recovery, tables["rms_error"][0], precision)
    by_angle = {"drag_coefficient_error_scale": scales, "needed_duration": needed}
    return recovery.assign(
        {key: (("parameter", "duration", "angle"), table) for key, table in tables.items()}
        | {key: (("duration", "angle"), table) for key, table in flow.items()}
        | {
            f"{key}{end}": (("angle",), values[:, column])
            for key, values in by_angle.items()
            for column, end in enumerate(("", "_low", "_high"))
        }
    ).assign_coords(parameter=np.array(PARAMETERS, dtype=object))


def _needed(
    recovery: xr.Dataset, rms_error: Floats, precision: float | None
) -> tuple[Floats, Floats]:
    """Return the scale of C_d's error and the length needed, with their ends, by angle."""
    duration = recovery["duration"].values
    counts = (recovery["used"].values == 1).sum(axis=-1)
    scales = [
        error_scale(duration, rms_error[:, one], counts[:, one])
        for one in range(rms_error.shape[1])
    ]
    needed = [
        scale.needed(precision) if precision is not None else (np.nan,) * 3 for scale in scales
    ]
    return np.array(scales), np.array(needed)
