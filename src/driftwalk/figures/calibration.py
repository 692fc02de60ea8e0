"""The figures of a calibration."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from driftwalk.figures.write import Figures, marked_simulated
from driftwalk.plot.distances import LEGEND_ORDER, plot_ks_map, plot_refined_map
from driftwalk.plot.flow_field import COMPONENTS, add_speed_bar, plot_flow, top_speed
from driftwalk.plot.parts import style
from driftwalk.plot.parts.labels import PlotParameter, plot_parameters
from driftwalk.plot.step_densities import plot_density_panels, plot_steps, shared_setting_text
from driftwalk.plot.tank import plot_trajectory
from driftwalk.plot.uncertainty import plot_distance_profile, plot_validation, through_optimum
from driftwalk.schema import body_track

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Length of the sample of the path that is drawn [s]; chosen by hand.
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
    if any(name not in flow for name in COMPONENTS["block"]):
        ax = plot_flow(flow, style.axes_or_new(None, height_mm=78.0, layout="compressed"))
        if _is_filled(ax):
            ax.set_title("hatched: filled, not measured", loc="left")
        return style.figure_of(ax)
    top = max(top_speed(flow, field) for field in COMPONENTS)
    figure, row = style.new_panels(
        1, 2, height_mm=92.0, layout="compressed", sharex=True, sharey=True
    )
    plot_flow(flow, row[0], field="block", speed_limit=top, colorbar="none")
    plot_flow(flow, row[1], field="water", speed_limit=top, colorbar="none")
    row[1].set_ylabel("")
    hatched = " (hatched: filled, not measured)" if _is_filled(row[1]) else ""
    style.letter_panels(row, ["block velocity", f"corrected flow{hatched}"])
    add_speed_bar(row[1].collections[0], row)
    return figure


def _is_filled(ax: Axes) -> bool:
    """Return whether a part of the flow was filled, and so is hatched."""
    return any(str(patch.get_label()).startswith("filled") for patch in ax.patches)


def trajectory_figure(trajectory: xr.Dataset, *, body: str | None = None) -> Figure:
    """Return Fig. 5a: the first minute of the path."""
    ax = style.axes_or_new(None, height_mm=80.0, layout="compressed")
    time = body_track(trajectory, body).time
    if time.size and time[-1] - time[0] > EXCERPT_S:
        start = float(time[0])
        plot_trajectory(trajectory, ax, body=body, start=start, stop=start + EXCERPT_S)
        ax.set_title(f"first {EXCERPT_S:g} s of {time[-1] - start:.4g} s", loc="left")
    else:
        plot_trajectory(trajectory, ax, body=body)
    handles = [line for line in ax.lines if line.get_label() == "start"]
    ax.legend(handles=handles, loc="lower right", bbox_to_anchor=(1.02, 0.99), borderaxespad=0.0)
    return style.figure_of(ax)


def steps_figure(calibration: xr.Dataset) -> Figure:
    """Return Fig. 5b: the recording's steps with their marginals."""
    length = calibration["recording_step_length"].values
    angle = calibration["recording_turning_angle"].values
    return style.figure_of(plot_steps(length, angle, style.axes_or_new(None, height_mm=76.0)))


def ks_map_figure(calibration: xr.Dataset) -> Figure:
    """Return Fig. 6: the whole map next to the refined one, or the whole map alone.

    With one parameter the distance along it is the map.
    """
    if len(plot_parameters(calibration)) == 1:
        return _profiles_figure(calibration)
    if "refined_ks_distance" not in calibration:
        ax = plot_ks_map(calibration, style.axes_or_new(None, height_mm=80.0))
        ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, borderaxespad=0.2)
        return style.figure_of(ax)
    figure, row = style.new_panels(1, 2, height_mm=80.0)
    plot_ks_map(calibration, row[0])
    plot_refined_map(calibration, row[1])
    style.letter_panels(row, ["whole box", "near the optimum (lines: fitted surface)"])
    entries = zip(*row[0].get_legend_handles_labels(), strict=True)
    ordered = sorted(entries, key=lambda entry: LEGEND_ORDER.index(entry[1]))
    figure.legend(*zip(*ordered, strict=True), loc="outside upper center", ncols=6)
    return figure


def panels_figure(calibration: xr.Dataset, parameter: str) -> Figure:
    """Return the densities along a parameter: Fig. 7 (drag coefficient), Fig. 8 (force)."""
    figure = style.figure_of(plot_density_panels(calibration, parameter=parameter)[0])
    if shared := shared_setting_text(calibration, parameter=parameter):
        figure.suptitle(f"simulated with {shared}")
    return figure


def validation_figure(calibration: xr.Dataset) -> Figure:
    """Return the distance around the optimum and, where there are any, the bootstrap estimates."""
    parameters = plot_parameters(calibration)
    if any(f"bootstrap_{one.name}" not in calibration for one in parameters):
        return _profiles_figure(calibration)
    figure, row = style.new_panels(1, len(parameters) + 1, height_mm=80.0)
    plot_validation(calibration, row)
    style.letter_panels(row, [*(_along(calibration, one) for one in parameters), "estimates"])
    style.legend_above(figure, row[0], 7)
    # What only the last panel shows is named there.
    named = row[0].get_legend_handles_labels()[1]
    own = {
        label: handle
        for handle, label in zip(*row[-1].get_legend_handles_labels(), strict=True)
        if label not in named and not label.startswith("optimum")
    }
    style.legend_below(row[-1], 2, handles=own.values(), labels=own.keys())
    return figure


def _along(calibration: xr.Dataset, parameter: PlotParameter) -> str:
    """Return along which line a profile runs: other parameters have their value on the grid."""
    line = through_optimum(calibration, parameter)
    others = [one for one in plot_parameters(calibration) if one.name != parameter.name]
    at = ", ".join(one.words(float(line[one.name])) for one in others)
    return f"along {parameter.symbol}" + (f"\nat {at}" if at else "")


def _profiles_figure(calibration: xr.Dataset) -> Figure:
    parameters = plot_parameters(calibration)
    figure, row = style.new_panels(1, len(parameters), height_mm=68.0)
    for parameter, ax in zip(parameters, row, strict=True):
        plot_distance_profile(calibration, ax, parameter=parameter.name)
    style.letter_panels(row, [_along(calibration, one) for one in parameters])
    style.legend_above(figure, row[0], 7)
    return figure
