"""The figures of a model check: whiteness, residuals in the tank and over time, predicted steps."""

from __future__ import annotations

from typing import TYPE_CHECKING

from driftwalk.figures.write import Figures, marked_simulated
from driftwalk.plot.model_check import (
    legend_of,
    plot_innovations,
    plot_predicted_steps,
    plot_residual_map,
    plot_residual_time,
)
from driftwalk.plot.parts.style import DOUBLE_COLUMN_MM, letter_panels, new_figure

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


def check_figures(check: xr.Dataset) -> Figures:
    """Return the figures of a model check.

    Parameters
    ----------
    check : xarray.Dataset
        A `model_check`.

    Returns
    -------
    dict of str to callable
        ``check_innovations``, ``check_map``, ``check_time`` and, where recordings could be
        simulated, ``check_steps``.

    Examples
    --------
    ``write_figures(check_figures(check), "fit/figures")``
    """
    figures: Figures = {
        "check_innovations": lambda: _innovations_figure(check),
        "check_map": lambda: _map_figure(check),
        "check_time": lambda: _time_figure(check),
    }
    if "step_length_edge" in check:
        figures["check_steps"] = lambda: _steps_figure(check)
    return marked_simulated(figures, check)


def _innovations_figure(check: xr.Dataset) -> Figure:
    figure = new_figure(width_mm=DOUBLE_COLUMN_MM, height_mm=62.0)
    ax = plot_innovations(check, figure.add_subplot())
    figure.legend(**legend_of(ax), loc="outside upper center", ncols=2 + check.sizes["component"])
    return figure


def _map_figure(check: xr.Dataset) -> Figure:
    figure = new_figure(width_mm=DOUBLE_COLUMN_MM, height_mm=80.0, layout="compressed")
    row = list(figure.subplots(1, 2, sharex=True, sharey=True))
    plot_residual_map(check, row[0])
    plot_residual_map(check, row[1], show="noise")
    row[1].set_ylabel("")
    letter_panels(row, ["mean error of prediction", "its noise"])
    return figure


def _time_figure(check: xr.Dataset) -> Figure:
    figure = new_figure(width_mm=DOUBLE_COLUMN_MM, height_mm=58.0)
    row = list(figure.subplots(1, 2, sharex=True))
    plot_residual_time(check, row[0])
    plot_residual_time(check, row[1], show="noise")
    letter_panels(row, ["flow (bars: 95 %)", "noise (bars: 95 %)"])
    return figure


def _steps_figure(check: xr.Dataset) -> Figure:
    figure = new_figure(width_mm=DOUBLE_COLUMN_MM, height_mm=66.0)
    row = list(figure.subplots(1, 2))
    plot_predicted_steps(check, row[0])
    plot_predicted_steps(check, row[1], show="turning_angle")
    letter_panels(row, ["step length", "turning angle"])
    figure.legend(**legend_of(row[0]), loc="outside upper center", ncols=3)
    return figure
