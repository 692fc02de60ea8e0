"""Modes of the flow in time in the dataset of a fit: coefficients, fields and amplitudes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.flow.grid import Grid
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.filter.series import Series, mode_amplitudes
from driftwalk.likelihood.spline import Spline

if TYPE_CHECKING:
    import xarray as xr

FRAMES_PER_PERIOD: Final = 32
"""Frames of a flow with modes; linear between them, an amplitude comes out 0.2 % too small."""


def mode_variables(
    point: Point, series: Series, spline: Spline, grid: Grid, count: Floats
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the variables of the modes and their coordinates; `count` as in the fit."""
    fields = np.stack([spline.values(one, grid.x, grid.y) for one in point.coefficients])
    seen = count >= 3
    speeds = np.sqrt((fields**2).sum(axis=1)[:, seen].mean(axis=-1))
    time = np.linspace(0.0, 1.0 / point.number("mode_frequency"), FRAMES_PER_PERIOD + 1)
    plane = ("flow_mode", "y", "x")
    data = {
        "mode_coefficient": (
            ("flow_mode", "component", "knot_y", "knot_x"),
            point.coefficients[1:],
        ),
        "u_mode": (plane, fields[1:, 0]),
        "v_mode": (plane, fields[1:, 1]),
        "mode_amplitude": (
            ("flow_mode", "mode_time"),
            mode_amplitudes(float(series.time[0]) + time, point),
        ),
        "mode_share": ("flow_mode", speeds[1:] / speeds[0]),
    }
    return data, {"mode_time": ("mode_time", time)}


def stored_coefficients(fit: xr.Dataset) -> Floats:
    """Return the coefficients of a stored fit as a `Point` takes them."""
    mean = np.asarray(fit["coefficient"].values, dtype=np.float64)
    if "flow_mode" not in fit.dims:
        return mean
    return np.concatenate([mean[np.newaxis], fit["mode_coefficient"].values])


def mode_frames(
    fit: xr.Dataset, mean: Mapping[str, np.ndarray]
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return times and frames over a period of a fit with modes, from the fields of its mean."""
    amplitudes = fit["mode_amplitude"].values
    frames = {
        name: np.broadcast_to(one, (amplitudes.shape[1], *one.shape)) for name, one in mean.items()
    }
    moving = {
        name: fit[name].values + np.tensordot(amplitudes.T, fit[f"{name}_mode"].values, 1)
        for name in ("u", "v")
    }
    return fit["mode_time"].values, frames | moving
