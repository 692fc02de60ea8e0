"""The figures of a calibration."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from driftwalk.figures.write import Figures, marked_simulated
from driftwalk.plot.distances import LEGEND_ORDER, plot_ks_map, plot_refined_map
from driftwalk.plot.flow_field import COMPONENTS, SPEED_LABEL, plot_flow, velocity_of
from driftwalk.plot.parts import style
from driftwalk.plot.parts.labels import plot_parameters
from driftwalk.plot.step_densities import plot_density_panels, plot_steps, shared_setting_text
from driftwalk.plot.tank import plot_trajectory
from driftwalk.plot.uncertainty import plot_distance_profile, plot_validation
from driftwalk.schema import body_track

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

# Length of the sample of the path that is drawn [s].
EXCERPT_S = 60.0


def calibration_figures(
    calibration: xr.Dataset,
    recording: xr.Dataset,
    flow: xr.Dataset | None = None,
    body: str | None = None,
) -> Figures:
    """Return every figure of a calibration: the paper's 2, 5, 6, 7 and 8, and one on validation.

    Parameters
    ----------
    calibration : xarray.Dataset
        What `driftwalk.calibration.calibrate` returns.
    recording : xarray.Dataset
        The `trajectory`.
    flow : xarray.Dataset, optional
        The `flow_field` that was used, where the model uses one.
    body : str, optional
        Body of the recording; may be left out when there is only one.

    Returns
    -------
    dict of str to callable
        ``flow``, ``trajectory``, ``steps``, ``ks_map``, ``<parameter>_panels`` (for the block
        ``drag_coefficient_panels`` and ``force_std_panels``) and ``validation``.

    Examples
    --------
    ``write_figures(calibration_figures(calibration, recording, flow=flow), "run/figures")``
    """
    figures: Figures = {
        **({} if flow is None else {"flow": lambda: flow_figure(flow)}),
        "trajectory": lambda: trajectory_figure(recording, body=body),
        "steps": lambda: steps_figure(calibration),
        "ks_map": lambda: ks_map_figure(calibration),
        **{
            f"{one.name}_panels": partial(panels_figure, calibration, one.name)
            for one in plot_parameters(calibration)
        },
        "validation": lambda: validation_figure(calibration),
    }
    return marked_simulated(figures, calibration)


def flow_figure(flow: xr.Dataset) -> Figure:
    """Return Fig. 2: the block's velocity next to the water's, or the water's alone."""
    has_block = all(name in flow for name in COMPONENTS["block"])
    if not has_block:
        figure = style.new_figure(
            width_mm=style.SINGLE_COLUMN_MM, height_mm=76.0, layout="compressed"
        )
        plot_flow(flow, figure.add_subplot())
        return figure
    import numpy as np

    top = max(
        float(np.nanmax(np.hypot(*velocity_of(flow, field)[:2]), initial=0.0)) / 100.0
        for field in ("block", "water")
    )
    figure = style.new_figure(width_mm=style.DOUBLE_COLUMN_MM, height_mm=92.0, layout="compressed")
    row = list(figure.subplots(1, 2, sharex=True, sharey=True))
    plot_flow(flow, row[0], field="block", speed_limit=top, colorbar="none")
    plot_flow(flow, row[1], field="water", speed_limit=top, colorbar="none")
    row[1].set_ylabel("")
    filled = any(str(patch.get_label()).startswith("filled") for patch in row[1].patches)
    style.letter_panels(
        row,
        [
            "block velocity",
            "corrected flow" + (" (hatched: filled, not measured)" if filled else ""),
        ],
    )
    style.add_colorbar(row[1].collections[0], row, SPEED_LABEL)
    return figure


def trajectory_figure(trajectory: xr.Dataset, *, body: str | None = None) -> Figure:
    """Return Fig. 5a: the first minute of the path."""
    figure = style.new_figure(width_mm=style.SINGLE_COLUMN_MM, height_mm=80.0, layout="compressed")
    ax = figure.add_subplot()
    time = body_track(trajectory, body).time
    if time.size and time[-1] - time[0] > EXCERPT_S:
        start = float(time[0])
        plot_trajectory(trajectory, ax, body=body, start=start, stop=start + EXCERPT_S)
        ax.set_title(f"first {EXCERPT_S:g} s of {time[-1] - start:.4g} s", loc="left")
    else:
        plot_trajectory(trajectory, ax, body=body)
    handles = [line for line in ax.lines if line.get_label() == "start"]
    ax.legend(handles=handles, loc="lower right", bbox_to_anchor=(1.02, 0.99), borderaxespad=0.0)
    return figure


def steps_figure(calibration: xr.Dataset) -> Figure:
    """Return Fig. 5b: the recording's steps with their marginals."""
    figure = style.new_figure(width_mm=style.SINGLE_COLUMN_MM, height_mm=76.0)
    plot_steps(
        calibration["recording_step_length"].values,
        calibration["recording_turning_angle"].values,
        figure.add_subplot(),
    )
    return figure


def ks_map_figure(calibration: xr.Dataset) -> Figure:
    """Return Fig. 6: the whole map next to the refined one, or the whole map alone.

    With one parameter the distance along it is the map.
    """
    if len(plot_parameters(calibration)) == 1:
        return _profiles_figure(calibration)
    if "refined_ks_distance" not in calibration:
        figure = style.new_figure(width_mm=style.SINGLE_COLUMN_MM, height_mm=80.0)
        _legend_above(plot_ks_map(calibration, figure.add_subplot()))
        return figure
    figure = style.new_figure(width_mm=style.DOUBLE_COLUMN_MM, height_mm=80.0)
    row = list(figure.subplots(1, 2))
    plot_ks_map(calibration, row[0])
    plot_refined_map(calibration, row[1])
    style.letter_panels(row, ["whole box", "near the optimum (lines: fitted surface)"])
    handles, labels = row[0].get_legend_handles_labels()
    order = sorted(range(len(labels)), key=lambda index: LEGEND_ORDER.index(labels[index]))
    figure.legend(
        [handles[index] for index in order],
        [labels[index] for index in order],
        loc="outside upper center",
        ncols=6,
    )
    return figure


def panels_figure(calibration: xr.Dataset, parameter: str) -> Figure:
    """Return the densities along a parameter: Fig. 7 (drag coefficient), Fig. 8 (force)."""
    figure = style.new_figure(width_mm=style.DOUBLE_COLUMN_MM, height_mm=62.0)
    row = list(figure.subplots(1, 4, sharex=True, sharey=True))
    plot_density_panels(calibration, row, parameter=parameter)
    shared = shared_setting_text(calibration, parameter=parameter)
    if shared:
        figure.suptitle(f"simulated with {shared}")
    return figure


def validation_figure(calibration: xr.Dataset) -> Figure:
    """Return the distance around the optimum and, where there are any, the bootstrap estimates."""
    parameters = plot_parameters(calibration)
    if any(f"bootstrap_{one.name}" not in calibration for one in parameters):
        return _profiles_figure(calibration)
    figure = style.new_figure(width_mm=style.DOUBLE_COLUMN_MM, height_mm=68.0)
    row = plot_validation(calibration, list(figure.subplots(1, len(parameters) + 1)))
    style.letter_panels(row, [*(f"along {one.symbol}" for one in parameters), "estimates"])
    handles, labels = row[0].get_legend_handles_labels()
    more = zip(*row[-1].get_legend_handles_labels(), strict=True)
    for handle, label in more:
        if label not in labels and not label.startswith("optimum"):
            handles.append(handle)
            labels.append(label)
    figure.legend(handles, labels, loc="outside upper center", ncols=7)
    return figure


def _profiles_figure(calibration: xr.Dataset) -> Figure:
    parameters = plot_parameters(calibration)
    figure = style.new_figure(width_mm=style.DOUBLE_COLUMN_MM, height_mm=68.0)
    row = list(figure.subplots(1, len(parameters), squeeze=False)[0])
    for parameter, ax in zip(parameters, row, strict=True):
        plot_distance_profile(calibration, ax, parameter=parameter.name)
    style.letter_panels(row, [f"along {one.symbol}" for one in parameters])
    figure.legend(*row[0].get_legend_handles_labels(), loc="outside upper center", ncols=7)
    return figure


def _legend_above(ax: Any) -> None:
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, borderaxespad=0.2)
