"""How far the outcomes of a sweep lie from those of the reference (Fig. 11), and class by class."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.plot.distances import cell_edges, hatch_cell
from driftwalk.plot.parts import style
from driftwalk.plot.parts.labels import number_fact
from driftwalk.plot.parts.outcome_classes import (
    LETTER_PT,
    MAX_CELL_PT,
    NAME_GAP_PT,
    NAME_SIZE_PT,
    SweepAxis,
    are_discs,
    check_kind,
    class_cells,
    class_names,
    classes_to_show,
    is_class,
    name_text,
    place_sketch,
    reference_value,
    sketch_size,
    sketch_sizes,
    sweep_axes,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh

# Bright is close to the reference, as bright is a good score in the map of the calibration.
DISTANCE_COLORMAP: Final = "viridis_r"
DISTANCE_LABEL: Final = r"$\ell_1$ distance to the reference"
SHARE_LABEL: Final = "share of runs"
FLOOR_LABEL: Final = "95 % noise floor"
REFERENCE_LABEL: Final = "reference"
KEY_ROW_MM: Final = 11.0
"""Height of a row of sketches with their names; chosen by eye."""
MM_PER_PT: Final = style.MM_PER_INCH / 72.0
"""A point is 1/72 inch."""
MARKERS: Final = "osD^v<>"


def plot_l1_map(
    sensitivity: xr.Dataset,
    ax: Axes | None = None,
    *,
    colorbar: Literal["beside", "none"] = "beside",
) -> Axes:
    """Draw the l1 distance to the reference over the axes of a sensitivity study.

    Two axes of numbers give a map: the star is the reference, the black line the distance that 95
    in 100 repetitions of the reference itself stay below (95 % noise floor), and hatched cells have
    no distance. One axis, or one of words, gives points over a band below the noise floor; words
    have a row each. A cross is a setting without a distance.

    Parameters
    ----------
    sensitivity : xarray.Dataset
        A `sensitivity` of one or two axes; select along the others first.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.
    colorbar : {"beside", "none"}
        Whether a map gets a colour bar.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When the dataset is of another kind, lacks the distance, or has more than two axes.

    Examples
    --------
    ``plot_l1_map(sensitivity).figure.savefig("l1_map.png")``
    """
    check_kind(sensitivity, "sensitivity", "l1_distance")
    sweep = _one_or_two(sensitivity, sensitivity["l1_distance"])
    distance = _values(sensitivity["l1_distance"], sweep)
    if len(sweep) == 1 or any(axis.words for axis in sweep):
        ax = style.axes_or_new(ax, height_mm=65.0)
        _draw_floor_band(ax, sensitivity, sweep)
        _draw_lines(ax, sweep, distance)
        _mark_missing(ax, sweep, distance)
        _mark_on_line(ax, sensitivity, sweep)
        _scale_values(ax, sweep, label=DISTANCE_LABEL)
        style.legend_on_axes(ax)
        return ax
    ax = style.axes_or_new(ax)
    mesh = _draw_map(ax, sweep, distance, colormap=DISTANCE_COLORMAP)
    mesh.set_clim(0.0, float(np.nanmax(distance)) if np.isfinite(distance).any() else 2.0)
    floor = number_fact(sensitivity, "noise_floor_95")
    drawn = _draw_floor_contour(ax, sweep, distance, floor)
    _mark_on_map(ax, sensitivity, sweep)
    if colorbar == "beside":
        bar = style.add_colorbar(mesh, ax, DISTANCE_LABEL)
        if np.isfinite(floor):
            bar.ax.axhline(floor, color=style.INK, lw=1.4)
            if not drawn:
                bar.set_label(rf"$\ell_1$ distance (line: {FLOOR_LABEL})")
    style.legend_on_axes(ax)
    return ax


def plot_class_panels(
    sensitivity: xr.Dataset,
    axes: Any = None,
    *,
    classes: Sequence[str] | None = None,
    columns: int = 5,
) -> list[Axes]:
    """Draw the share of runs in every outcome class over the axes of a sensitivity study.

    One panel per class, all with one scale. Two axes of numbers give maps, other axes points; words
    have a row each.

    Parameters
    ----------
    sensitivity : xarray.Dataset
        A `sensitivity` of one or two axes.
    axes : sequence of matplotlib.axes.Axes, optional
        Where to draw, one per class; a new figure when left out.
    classes : sequence of str, optional
        Names of the classes. Default: all up to 16, else those that reach 1 % in some setting, at
        most 20.
    columns : int
        Panels per row of a new figure.

    Returns
    -------
    list of matplotlib.axes.Axes
        The axes, one per class.

    Raises
    ------
    InputError
        When the dataset is of another kind, has more than two axes or no such class, or the
        number of axes is not that of the classes.

    Examples
    --------
    ``plot_class_panels(sensitivity, classes=["I", "T"])``
    """
    check_kind(sensitivity, "sensitivity", "proportion", "class")
    sweep = _one_or_two(sensitivity, sensitivity["proportion"])
    shown = shown_classes(sensitivity) if classes is None else list(classes)
    unknown = [name for name in shown if name not in class_names(sensitivity)]
    if unknown or not shown:
        raise InputError(f"the study has no class {', '.join(unknown) or '(none was asked for)'}")
    columns = min(columns, len(shown))
    words = sweep[0].words
    # A word has 6 mm, a panel of numbers 32 mm; 8 mm are for the title of a panel.
    row_mm = 8.0 + (6.0 * (len(words) + 1) if words else 32.0)
    panels = style.axes_grid_or_new(
        axes, count=len(shown), columns=columns,
        height_mm=20.0 + row_mm * -(-len(shown) // columns), sharex=True, sharey=True,
    )  # fmt: skip
    mapped = len(sweep) == 2 and not any(axis.words for axis in sweep)
    row = {name: index for index, name in enumerate(class_names(sensitivity))}
    every = [_values(sensitivity["proportion"].isel({"class": row[name]}), sweep) for name in shown]
    top = max((float(np.nanmax(p)) for p in every if np.isfinite(p).any()), default=1.0) or 1.0
    for ax, name, proportion in zip(panels, shown, every, strict=True):
        if mapped:
            mesh = _draw_map(ax, sweep, proportion, colormap="viridis")
            mesh.set_clim(0.0, top)
            _mark_on_map(ax, sensitivity, sweep, size=6.0)
        else:
            _draw_lines(ax, sweep, proportion)
            _mark_on_line(ax, sensitivity, sweep)
            _scale_values(ax, sweep, label=SHARE_LABEL, top=1.05 * top)
        _title_panel(ax, name, discs=are_discs(*class_names(sensitivity)))
    if axes is None:
        _label_outside(panels, columns)
        handles, labels = panels[0].get_legend_handles_labels()
        if labels:
            style.figure_of(panels[0]).legend(handles, labels, loc="outside upper center", ncols=4)
    if mapped:
        style.add_colorbar(panels[0].collections[0], panels, SHARE_LABEL)
    return panels


def plot_class_key(
    names: Sequence[str], ax: Axes | None = None, *, rows: int | None = None
) -> Axes:
    """Draw the sketches of classes with their names, in rows: the key below a map (Fig. 11).

    Parameters
    ----------
    names : sequence of str
        Names of the classes.
    ax : matplotlib.axes.Axes, optional
        Where to draw; its frame is taken away. A new figure when left out.
    rows : int, optional
        Number of rows; default: as the width of the axes asks.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Examples
    --------
    >>> len(plot_class_key(["2", "1+1"]).artists)
    2
    """
    if rows is None:
        width_mm = (
            style.SINGLE_COLUMN_MM if ax is None else float(style.axes_points(ax)[0]) * MM_PER_PT
        )
        rows = key_rows(names, width_mm)
    ax = style.axes_or_new(ax, height_mm=KEY_ROW_MM * rows)
    ax.set_axis_off()
    ax.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
    columns = -(-len(names) // rows)
    sizes = sketch_sizes(names)
    written = any(name_text(name) for name in names)
    free = style.axes_points(ax) / np.array([columns, rows])
    free -= np.array([0.0, NAME_SIZE_PT + 4.0 if written else 2.0])
    side = max(1.0, min(MAX_CELL_PT, *(0.85 * free / sizes.max(axis=0))))
    for index, name in enumerate(names):
        row, column = divmod(index, columns)
        x = (column + 0.5) / columns
        if is_class(name):
            place_sketch(
                ax, name, (x, 1.0 - row / rows), alignment=(0.5, 1.0), cell_pt=side,
                color=style.INK, discs=are_discs(*names),
            )  # fmt: skip
        ax.annotate(
            name_text(name), (x, 1.0 - row / rows), size=NAME_SIZE_PT, ha="center", va="top",
            xytext=(0.0, -side * float(sizes[:, 1].max()) - NAME_GAP_PT),
            textcoords="offset points",
        )  # fmt: skip
    return ax


def key_rows(names: Sequence[str], width_mm: float) -> int:
    """Return in how many rows `plot_class_key` draws the classes on axes of that width."""
    longest = max((len(name_text(name)) for name in names), default=0)
    # A sketch takes 32 pt across or more.
    slot = max(32.0, (longest + 1.0) * LETTER_PT)
    columns = max(1, int(width_mm / MM_PER_PT / slot))
    return max(1, -(-len(names) // columns))


def shown_classes(sensitivity: xr.Dataset) -> list[str]:
    """Return the classes of a study that figures show."""
    names = class_names(sensitivity)
    share = sensitivity["proportion"].transpose(..., "class").values
    return [names[index] for index in classes_to_show(names, share)]


def _one_or_two(sensitivity: xr.Dataset, variable: xr.DataArray) -> list[SweepAxis]:
    """Return the axes of a figure; points lie along the first, one of numbers if there is one."""
    sweep = sweep_axes(variable, sensitivity)
    if not 1 <= len(sweep) <= 2:
        raise InputError(
            f"the study has {len(sweep)} axes ({', '.join(axis.name for axis in sweep)}): select "
            "values along all but two, such as study.sel(latching='collision')"
        )
    return sorted(sweep, key=lambda axis: bool(axis.words))


def _values(variable: xr.DataArray, sweep: list[SweepAxis]) -> Floats:
    """Return the values with the first axis of the figure first."""
    return np.asarray(variable.transpose(*(axis.name for axis in sweep)).values, dtype=np.float64)


def _draw_map(ax: Axes, sweep: list[SweepAxis], values: Floats, *, colormap: str) -> QuadMesh:
    """Draw values (x, y) as a map, and hatch the cells that have none."""
    x_edge, y_edge = (cell_edges(axis.values) for axis in sweep)
    mesh = ax.pcolormesh(x_edge, y_edge, np.ma.masked_invalid(values.T), cmap=colormap)
    mesh.set_rasterized(True)
    named: set[str] = set()
    for cell in zip(*np.nonzero(~np.isfinite(values)), strict=True):
        hatch_cell(ax, (x_edge, y_edge), cell, cause=("not computed", "//////"), named=named)
    ax.set(xlim=x_edge[[0, -1]], ylim=y_edge[[0, -1]], xlabel=sweep[0].label, ylabel=sweep[1].label)
    return mesh


def _draw_floor_contour(ax: Axes, sweep: list[SweepAxis], values: Floats, floor: float) -> bool:
    """Draw the line of the noise floor; False when the map does not cross it."""
    known = values[np.isfinite(values)]
    crossed = known.size and known.min() < floor < known.max()
    if min(values.shape) < 2 or not crossed:
        return False
    lines = ax.contour(
        sweep[0].values, sweep[1].values, np.ma.masked_invalid(values.T), levels=[floor],
        colors=style.INK, linewidths=1.2,
    )  # fmt: skip
    lines.set_path_effects(style.outlined(2.6))
    ax.plot([], [], color=style.INK, lw=1.2, label=f"{FLOOR_LABEL} ({floor:.3g})")
    return True


def _mark_on_map(
    ax: Axes, sensitivity: xr.Dataset, sweep: list[SweepAxis], *, size: float = 10.0
) -> None:
    x, y = (reference_value(sensitivity, axis) for axis in sweep)
    if np.isfinite([x, y]).all():
        ax.plot(
            [x], [y], "*", ms=size, mfc=style.ORANGE, mec="white", mew=0.7, zorder=6, clip_on=False,
            ls="none", label=REFERENCE_LABEL,
        )  # fmt: skip


def _draw_floor_band(ax: Axes, sensitivity: xr.Dataset, sweep: list[SweepAxis]) -> None:
    span, line = (ax.axvspan, ax.axvline) if sweep[0].words else (ax.axhspan, ax.axhline)
    high = number_fact(sensitivity, "noise_floor_95")
    mean = number_fact(sensitivity, "noise_floor_mean")
    if np.isfinite(high):
        span(0.0, high, color=style.PALE, lw=0, label=f"below the {FLOOR_LABEL}")
    if np.isfinite(mean):
        line(mean, color=style.INK, lw=0.8, dashes=(4, 2.5), label="mean noise floor")


def _draw_lines(ax: Axes, sweep: list[SweepAxis], values: Floats) -> None:
    """Draw values over one axis, one line per value of the other.

    Words have a row each, where they have room, and are not joined.
    """
    along, *others = sweep
    look: dict[str, Any] = {"ms": 3.5, "ls": "none" if along.words else "-", "clip_on": False}

    def draw(at: Floats, value: Floats, **more: Any) -> None:
        ax.plot(*((value, at) if along.words else (at, value)), **look, **more)

    if not others:
        draw(along.values, values, marker="o", color=style.BLUE)
    else:
        other = others[0]
        texts = other.words or [f"{value:.4g}" for value in other.values]
        name = other.label.split(", ")[0]
        spread = 0.12 * (np.arange(len(texts)) - (len(texts) - 1) / 2.0)
        for index, text in enumerate(texts):
            draw(
                along.values + (spread[index] if along.words else 0.0), values[:, index],
                marker=MARKERS[index % len(MARKERS)],
                color=style.PALETTE[index % len(style.PALETTE)], label=f"{name}: {text}",
            )  # fmt: skip
    if along.words:
        ax.set_yticks(along.values, labels=along.words)
        ax.set(ylim=(len(along.words) - 0.5, -0.5), ylabel=along.label)
    else:
        ax.locator_params(axis="x", integer=bool((along.values % 1.0 == 0.0).all()))
        ax.set_xlabel(along.label)
    ax.spines[["top", "right"]].set_visible(False)


def _scale_values(
    ax: Axes, sweep: list[SweepAxis], *, label: str, top: float | None = None
) -> None:
    """Name the axis of the values of `_draw_lines`, and begin it at 0."""
    if sweep[0].words:
        ax.set(xlim=(0.0, top), xlabel=label)
    else:
        ax.set(ylim=(0.0, top), ylabel=label)


def _mark_missing(ax: Axes, sweep: list[SweepAxis], values: Floats) -> None:
    """Mark where no line has a value."""
    at = sweep[0].values[~np.isfinite(values).any(axis=tuple(range(1, values.ndim)))]
    if at.size:
        zero = np.zeros(at.size)
        ax.plot(
            *((zero, at) if sweep[0].words else (at, zero)), "x", ms=3.5, color=style.MUTED,
            clip_on=False, label="no distance",
        )  # fmt: skip


def _mark_on_line(ax: Axes, sensitivity: xr.Dataset, sweep: list[SweepAxis]) -> None:
    at = reference_value(sensitivity, sweep[0])
    if np.isfinite(at):
        line = ax.axhline if sweep[0].words else ax.axvline
        line(at, color=style.INK, lw=0.7, zorder=1, label=REFERENCE_LABEL)


def _label_outside(panels: list[Axes], columns: int) -> None:
    """Label the lowest panel of every column, and all rows at once."""
    style.figure_of(panels[0]).supylabel(panels[0].get_ylabel())
    for index, ax in enumerate(panels):
        lowest = index + columns >= len(panels)
        ax.tick_params(labelbottom=lowest)
        if not lowest:
            ax.set_xlabel("")
        # One label for all rows: a panel is lower than it is long.
        ax.set_ylabel("")


def _title_panel(ax: Axes, name: str, *, discs: bool) -> None:
    """Write the name of a class above the left edge and draw its sketch above the right one."""
    ax.set_title(name_text(name), loc="left", color=style.MUTED)
    if is_class(name):
        side = min(4.0, 10.0 / float(sketch_size(class_cells(name))[1]))
        place_sketch(
            ax, name, (1.0, 1.03), transform="axes fraction", alignment=(1.0, 0.0), cell_pt=side,
            color=style.INK, discs=discs,
        )  # fmt: skip
