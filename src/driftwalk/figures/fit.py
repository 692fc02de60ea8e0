"""The figures of a likelihood fit: flow and path, the laws that it compared, and its check."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.core.units import percent
from driftwalk.figures.calibration import trajectory_figure
from driftwalk.figures.write import Figures, marked_simulated
from driftwalk.plot.flow_field import plot_flow, top_speed
from driftwalk.plot.model_check import (
    plot_innovations,
    plot_predicted_steps,
    plot_residual_map,
    plot_residual_time,
)
from driftwalk.plot.parts import style
from driftwalk.plot.parts.arena import arena_of, draw_arena, label_position
from driftwalk.plot.parts.labels import in_unit
from driftwalk.schema import FLAGS
from driftwalk.schema.answers.force_law import compared_laws, shared_lengths

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def plot_flow_error(flow: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the uncertainty of a flow: the larger standard error of its two components.

    Parameters
    ----------
    flow : xarray.Dataset
        A `flow_field` with standard errors. Nodes without one are blank.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When the flow field has no standard errors.

    Examples
    --------
    >>> from driftwalk.schema import build_flow_field
    >>> ones = np.ones((2, 2))
    >>> error = {"u_standard_error": 0.001 * ones, "v_standard_error": 0.002 * ones}
    >>> flow = build_flow_field([0.0, 0.1], [0.0, 0.1], u=ones, v=ones, flag=ones, **error)
    >>> float(plot_flow_error(flow).collections[0].get_array().max())
    2.0
    """
    names = ("u_standard_error", "v_standard_error")
    absent = [name for name in names if name not in flow]
    if absent:
        raise InputError(f"the flow field has no {' and '.join(absent)}")
    ax = style.axes_or_new(ax, layout="compressed")
    error = 10.0 * np.maximum(*(in_unit(flow[name], "cm/s", stored="m s-1") for name in names))
    shown = np.where(flow["flag"].values == FLAGS["measured"], error, np.nan)
    x, y = (in_unit(flow[axis], "cm", stored="m") for axis in ("x", "y"))
    # A few nodes at the rim, hardly visited, would make all others pale.
    top = float(np.nanquantile(shown, 0.98)) if np.isfinite(shown).any() else 1.0
    mesh = style.speed_mesh(ax, x, y, shown, top)
    if (outline := draw_arena(ax, arena_of(flow, None))) is not None:
        mesh.set_clip_path(outline)
    label_position(ax)
    beyond = bool(np.nanmax(shown, initial=0.0) > top)
    style.add_colorbar(mesh, ax, "standard error (mm/s)", extend="max" if beyond else "neither")
    return ax


def fit_figures(
    fit: xr.Dataset,
    recording: xr.Dataset,
    *,
    flows: Sequence[xr.Dataset],
    body: str | None = None,
    check: xr.Dataset | None = None,
) -> Figures:
    """Return the figures of a likelihood fit, of the laws that it compared, and of its check.

    Parameters
    ----------
    fit : xarray.Dataset
        A `fit`.
    recording : xarray.Dataset
        The `trajectory`.
    flows : sequence of xarray.Dataset
        The fitted `flow_field`; several where the pumps were switched, each with its name in the
        attribute ``flow_label`` and its times in ``intervals``.
    body : str, optional
        Body of the recording; may be left out when there is only one.
    check : xarray.Dataset, optional
        Its `model_check`.

    Returns
    -------
    dict of str to callable
        ``flow`` (``flow_A`` and so on by name of the flow where there are several) and
        ``trajectory``; with compared laws ``laws``; of free bodies in one recording ``stirring``;
        with a check those of `check_figures`.

    Examples
    --------
    ``write_figures(fit_figures(fit, recording, flows=[flow]), "fit/figures")``
    """
    # One scale for all flows of a recording whose pumps were switched.
    top = max((top_speed(one, "water") for one in flows), default=0.0)
    figures: Figures = {
        "_".join(["flow", *_label(one)]): partial(_flow_figure, one, top) for one in flows
    }
    figures["trajectory"] = lambda: trajectory_figure(recording, body=body)
    figures = marked_simulated(figures, fit)
    if "compared_law" in fit.dims:
        figures |= laws_figures(fit)
    if "force_correlation" in fit:
        figures["stirring"] = lambda: style.figure_of(plot_shared_stirring(fit))
    return figures if check is None else figures | check_figures(check)


def _label(flow: xr.Dataset) -> list[str]:
    """Return the name of a flow, nothing where it has none."""
    return [str(flow.attrs["flow_label"])] if "flow_label" in flow.attrs else []


def _flow_figure(flow: xr.Dataset, top: float) -> Figure:
    figure, row = style.new_panels(
        1, 2, height_mm=80.0, layout="compressed", sharex=True, sharey=True
    )
    plot_flow(flow, row[0], speed_limit=top)
    plot_flow_error(flow, row[1])
    row[1].set_ylabel("")
    filled = bool((flow["flag"].values == FLAGS["filled"]).any())
    title = " ".join(["fitted flow", *_label(flow), *(["(hatched: filled)"] if filled else [])])
    style.letter_panels(row, [title, "its standard error"])
    if "intervals" in flow.attrs:
        figure.suptitle(textwrap.fill(f"from {flow.attrs['intervals']}", 90))
    return figure


def laws_figures(fit: xr.Dataset) -> Figures:
    """Return the figure of the laws that a fit has compared.

    Parameters
    ----------
    fit : xarray.Dataset
        A `fit` whose laws were compared.

    Returns
    -------
    dict of str to callable
        ``laws``.

    Raises
    ------
    InputError
        When no laws were compared.

    Examples
    --------
    ``write_figures(laws_figures(fit), "fit/figures")``
    """
    if "compared_law" not in fit.dims:
        raise InputError("the fit has compared no force laws: `compare_laws` adds them")
    return {"laws": lambda: _laws_figure(fit)}


def _laws_figure(fit: xr.Dataset) -> Figure:
    figure, (ax,) = style.new_panels(1, 1, height_mm=55.0)
    plot_laws(fit, ax)
    return figure


def plot_laws(fit: xr.Dataset, ax: Axes) -> Axes:
    """Plot by how much each law predicts held out samples worse than the best.

    Parameters
    ----------
    fit : xarray.Dataset
        A `fit` whose laws were compared.
    ax : matplotlib.axes.Axes
        Where to plot.

    Returns
    -------
    matplotlib.axes.Axes
        The same axes.

    Examples
    --------
    ``plot_laws(fit, ax)``
    """
    from matplotlib.ticker import FixedLocator

    every = compared_laws(fit)
    known = [law for law in reversed(every) if law.solved]
    if not known:
        ax.set_title("no law has a solution")
        return ax
    names = [law.name for law in known]
    lost, std = (np.array(one) for one in zip(*((law.loss, law.std) for law in known), strict=True))
    place = np.arange(len(names))
    ax.errorbar(lost, place, xerr=std, fmt="o", ms=3.0, lw=0.9, capsize=2.0, color=style.BLUE)
    # A logarithmic axis is even around 0, as far as the errors of laws that may be the best reach,
    # and to 1e-5 nats at least.
    even = max(float(std[lost <= 2.0 * std].max(initial=0.0)), 1e-5)
    if float(lost.max()) > 20.0 * even:
        # From a power of ten on: no other label of the axis is then next to that of 0.
        first, last = (math.ceil(math.log10(one)) for one in (even, float(lost.max())))
        ax.set_xscale("symlog", linthresh=10.0**first)
        minor = np.arange(2, 10) * 10.0 ** np.arange(first - 1, last)[:, None]
        ax.xaxis.set_minor_locator(FixedLocator(minor.ravel().tolist()))
    else:
        ax.locator_params(axis="x", nbins=5)
    ax.axvline(0.0, color=style.MUTED, lw=0.6)
    ax.set_yticks(place, names)
    ax.set(ylim=(-0.6, len(names) - 0.4), xlabel="loss per sample, against the best law (nats)")
    ax.set_title("held out samples; bars: standard error", loc="left")
    if unsolved := len(every) - len(known):
        ax.set_title(f"not shown, without a solution: {unsolved}", loc="right")
    return ax


def plot_shared_stirring(fit: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Plot the correlation of the forces on two bodies against their distance, with its kernel.

    Parameters
    ----------
    fit : xarray.Dataset
        A `fit` of free bodies in one recording.
    ax : matplotlib.axes.Axes, optional
        Where to plot; by default the only axes of a new figure.

    Returns
    -------
    matplotlib.axes.Axes
        The axes.

    Examples
    --------
    ``plot_shared_stirring(fit)``
    """
    ax = style.axes_or_new(ax, height_mm=62.0)
    distance = in_unit(fit["body_distance"], "cm", stored="m")
    value, ends = fit["force_correlation"].values, fit["force_correlation_interval"].values.T
    confidence = percent(fit["confidence"])
    ax.errorbar(
        distance, value, yerr=np.abs(ends - value), fmt="o", ms=3.0, lw=0.9, capsize=2.0,
        color=style.BLUE, label=f"at each distance (bars: {confidence})",
    )  # fmt: skip
    r = np.linspace(0.0, 1.05 * float(distance.max()), 200)
    lengths = shared_lengths(fit)
    low, middle, high = (np.exp(-0.5 * (0.01 * r / max(one, 1e-9)) ** 2) for one in lengths)
    ax.fill_between(r, low, high, color=style.PALE, lw=0.0)
    law = rf"$\exp(-r^2/2L^2)$, $L$ = {1e3 * lengths[1]:.3g} mm"
    ax.plot(r, middle, color=style.INK, label=f"{law} (band: {confidence})")
    ax.axhline(0.0, color=style.MUTED, lw=0.6)
    ax.set(xlim=(0.0, float(r[-1])), xlabel="distance of the bodies $r$ (cm)")
    ax.set_ylabel("correlation of the forces")
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2)
    return ax


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
    maps = {"mean": "mean error of prediction", "noise": "its noise"}
    times = {"flow": "flow (bars: 95 %)", "noise": "noise (bars: 95 %)"}
    steps = {"step_length": "step length", "turning_angle": "turning angle"}
    tank: dict[str, Any] = {"layout": "compressed", "sharex": True, "sharey": True}
    figures: Figures = {
        "check_innovations": lambda: _innovations_figure(check),
        "check_map": lambda: _pair(plot_residual_map, check, maps, height_mm=80.0, **tank),
        "check_time": lambda: _pair(plot_residual_time, check, times, height_mm=58.0, sharex=True),
    }
    if "step_length_edge" in check:
        figures["check_steps"] = lambda: _pair(plot_predicted_steps, check, steps, height_mm=66.0)
    return marked_simulated(figures, check)


def _innovations_figure(check: xr.Dataset) -> Figure:
    figure, (ax,) = style.new_panels(1, 1, height_mm=62.0)
    plot_innovations(check, ax)
    style.legend_above(figure, ax, 2 + check.sizes["component"])
    return figure


def _pair(
    draw: Callable[..., Axes], check: xr.Dataset, titles: dict[str, str], **options: Any
) -> Figure:
    """Draw two aspects of a check next to each other; `titles` are by the word for `show`."""
    figure, row = style.new_panels(1, 2, **options)
    for ax, show in zip(row, titles, strict=True):
        draw(check, ax, show=show)
    if "sharey" in options:
        row[1].set_ylabel("")
    style.letter_panels(row, list(titles.values()))
    if row[0].get_legend_handles_labels()[1]:
        style.legend_above(figure, row[0], 3)
    return figure
