"""Densities of steps of the recording and of three settings of one parameter (Figs. 7 and 8)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.plot.distances import CAUSES
from driftwalk.plot.parts.labels import (
    ANGLE_LABEL,
    FACTORS,
    LENGTH_LABEL,
    require_variables,
    required_fact,
)
from driftwalk.plot.parts.parameters import (
    FORCE,
    PlotParameter,
    drawn_anew,
    parameter_named,
    plot_parameters,
)
from driftwalk.plot.parts.style import MUTED, add_colorbar, axes_row_or_new, letter_panels
from driftwalk.plot.step_densities import DENSITY_LABEL, density_mesh, density_of, filled_range

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

Array = npt.NDArray[np.float64]
# Where "low" and "high" lie, as multiples of the optimum, unless the caller says.
LOW_FACTOR, HIGH_FACTOR = 0.25, 1.8


class Setting(NamedTuple):
    """One setting of the coarse map that a panel shows."""

    values: dict[str, float]
    """Its parameters by name, in the dataset's units."""
    density: Array
    status: int


def plot_density_panels(
    calibration: xr.Dataset,
    axes: Any = None,
    *,
    parameter: str | None = None,
    low: float | None = None,
    high: float | None = None,
    colorbar: Literal["beside", "none"] = "beside",
) -> list[Axes]:
    """Draw four densities: recording, low, best and high value of one parameter.

    Other parameters stay at their optimum. Simulated panels show the settings of the coarse map
    nearest to the values asked for, and their titles name the values shown. All four share their
    axes and their colour scale.

    Parameters
    ----------
    calibration : xarray.Dataset
        Result of `driftwalk.calibration.calibrate`.
    axes : sequence of 4 matplotlib.axes.Axes, optional
        Where to draw, in one row or two; a new figure with one row when left out.
    parameter : str, optional
        Name of the parameter that differs between the panels; default: the first.
    low, high : float, optional
        Its low and high value, in its SI unit; default: 0.25 and 1.8 times the optimum.
    colorbar : {"beside", "none"}
        Whether to add the common colour bar.

    Returns
    -------
    list of matplotlib.axes.Axes
        The four axes.

    Raises
    ------
    InputError
        When the calibration has no such parameter, or lacks the densities.

    Examples
    --------
    ``plot_density_panels(calibration, parameter="force_std", low=0.0, high=0.001)``
    """
    from matplotlib.ticker import MaxNLocator

    along = parameter_named(calibration, parameter)
    settings = choose_settings(calibration, parameter=along.name, low=low, high=high)
    recorded = np.nan_to_num(calibration["recording_step_density"].values.astype(np.float64))
    length_mm = FACTORS["m", "mm"] * calibration["step_length_edge"].values
    angle_deg = FACTORS["rad", "°"] * calibration["turning_angle_edge"].values
    densities = [recorded, *(setting.density for setting in settings)]
    top = max(
        float(density_of(density, length_mm, angle_deg).max(initial=0.0)) for density in densities
    )
    row = axes_row_or_new(axes, count=4, sharex=True, sharey=True)
    limits = _common_limits(densities, length_mm, angle_deg)
    for ax, density in zip(row, densities, strict=True):
        mesh = density_mesh(ax, density, length_mm, angle_deg, top=top)
        ax.set_xlim(*limits[0])
        ax.set_ylim(*limits[1])
        ax.xaxis.set_major_locator(MaxNLocator(nbins=4, steps=[1, 2, 5, 10]))
        ax.set_xlabel(LENGTH_LABEL)
        ax.set_ylabel(ANGLE_LABEL)
        ax.label_outer()
    for ax, setting in zip(row[1:], settings, strict=True):
        _mark_cause(ax, setting)
    letter_panels(
        row, ["recording", *(along.title(setting.values[along.name]) for setting in settings)]
    )
    if colorbar == "beside":
        add_colorbar(mesh, row, DENSITY_LABEL)
    return row


def choose_settings(
    calibration: xr.Dataset,
    *,
    parameter: str,
    low: float | None = None,
    high: float | None = None,
) -> list[Setting]:
    """Return the low, best and high setting of the coarse map nearest to the values wanted."""
    require_variables(
        calibration, "step_density", "recording_step_density", "step_length_edge",
        "turning_angle_edge", *(one.name for one in plot_parameters(calibration)),
    )  # fmt: skip
    along = parameter_named(calibration, parameter)
    best = {
        one.name: float(required_fact(calibration, one.key)) for one in plot_parameters(calibration)
    }
    wanted = (
        LOW_FACTOR * best[along.name] if low is None else low,
        best[along.name],
        HIGH_FACTOR * best[along.name] if high is None else high,
    )
    return [_nearest(calibration, {**best, along.name: value}) for value in wanted]


def _nearest(calibration: xr.Dataset, values: dict[str, float]) -> Setting:
    cell = calibration.sel(values, method="nearest")
    density = cell["step_density"].transpose("density_step_length", "density_turning_angle")
    return Setting(
        values={name: float(cell[name]) for name in values},
        density=np.nan_to_num(density.values.astype(np.float64)),
        status=int(cell["status"]) if "status" in cell else 0,
    )


def shared_setting_text(calibration: xr.Dataset, *, parameter: str) -> str:
    """Return what stays the same in the simulated panels: "σ_F = 0.55 mN, new every 16 ms".

    Empty for a model of one parameter.
    """
    along = parameter_named(calibration, parameter)
    setting = choose_settings(calibration, parameter=along.name)[1]
    others = [one for one in plot_parameters(calibration) if one.name != along.name]
    words = [_with_interval(one, calibration, setting.values[one.name]) for one in others]
    if along == FORCE:
        words.append(f"{FORCE.symbol} {drawn_anew(calibration)}")
    return "; ".join(words)


def _with_interval(one: PlotParameter, calibration: xr.Dataset, value: float) -> str:
    return f"{one.words(value)} ({drawn_anew(calibration)})" if one == FORCE else one.words(value)


def _common_limits(
    densities: list[Array], length_mm: Array, angle_deg: Array
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return limits that show the central part of every panel."""
    ranges = []
    for axis, edge in ((1, length_mm), (0, angle_deg)):
        filled = [
            filled_range(density.sum(axis=axis), edge) for density in densities if density.any()
        ]
        ends = filled or [(float(edge[0]), float(edge[-1]))]
        ranges.append((min(low for low, _ in ends), max(high for _, high in ends)))
    return ranges[0], ranges[1]


def _mark_cause(ax: Axes, setting: Setting) -> None:
    """Hatch a panel whose setting made no steps, and say why."""
    causes = [cause for bit, cause in CAUSES.items() if setting.status & bit]
    if not causes:
        return
    name, hatch = causes[0]
    ax.set_facecolor("white")
    ax.axhspan(
        *ax.get_ylim(), facecolor="none", edgecolor=MUTED, linewidth=0.0, hatch=hatch, gid=name
    )
    ax.text(
        0.5, 0.5, name, transform=ax.transAxes, ha="center", va="center",
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 3.0},
    )  # fmt: skip
