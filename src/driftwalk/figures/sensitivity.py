"""The figures of a sensitivity study."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Any, Literal

from driftwalk.figures.assembly import outcomes_figure
from driftwalk.figures.write import Figures
from driftwalk.plot.components import plot_biplot
from driftwalk.plot.parts.polyomino_sketch import figure_of
from driftwalk.plot.parts.style import SINGLE_COLUMN_MM, new_figure
from driftwalk.plot.sensitivity_maps import (
    KEY_ROW_MM,
    key_rows,
    plot_class_key,
    plot_class_panels,
    plot_l1_map,
    shown_classes,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

# Width of the map, and so of the key below it, as a share of the figure's.
MAP_SHARE = 0.75


def sensitivity_figures(
    sensitivity: xr.Dataset,
    reference: xr.Dataset | None,
    components: xr.Dataset | None = None,
) -> Figures:
    """Return the figures of a sensitivity study: the paper's 9 to 11, and a panel per class.

    A study of more than two axes has a subfolder for each value of the first ones.

    Parameters
    ----------
    sensitivity : xarray.Dataset
        A `sensitivity`.
    reference : xarray.Dataset or None
        Its reference, an `outcome_distribution` with ``realisation_proportion``.
    components : xarray.Dataset, optional
        Its `components`.

    Returns
    -------
    dict of str to callable
        ``l1_map`` and ``class_panels``; with `reference` also ``outcomes``, with two or more
        `components` also ``biplot`` and ``biplot_l1``.

    Examples
    --------
    ``write_figures(sensitivity_figures(study, reference, components), "run/figures")``
    """
    figures: Figures = {}
    if reference is not None:
        realised = reference[["realisation_proportion"]].rename(realisation_proportion="proportion")
        figures["outcomes"] = lambda: outcomes_figure(reference, realisations=realised)
    if components is not None and components.sizes["component"] < 2:
        components = None
    for folder, chosen in _planes(sensitivity):
        plane = sensitivity.sel(chosen)
        figures[f"{folder}l1_map"] = partial(l1_map_figure, plane)
        figures[f"{folder}class_panels"] = partial(class_panels_figure, plane)
        if components is not None:
            across = components.sel(chosen)
            figures[f"{folder}biplot"] = partial(biplot_figure, across, plane, "complete")
            figures[f"{folder}biplot_l1"] = partial(biplot_figure, across, plane, "l1_distance")
    return figures


def _planes(sensitivity: xr.Dataset) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the parts of a study that have two axes or fewer: their folder, and what to select."""
    axes = [str(name) for name in sensitivity["l1_distance"].dims]
    fixed = axes[:-2]
    for values in product(*(sensitivity[name].values.tolist() for name in fixed)):
        chosen = dict(zip(fixed, values, strict=True))
        name = "_".join(f"{name}_{value}" for name, value in chosen.items())
        yield re.sub(r"[^A-Za-z0-9._-]+", "-", name) + ("/" if fixed else ""), chosen


def l1_map_figure(sensitivity: xr.Dataset) -> Figure:
    """Return Fig. 11: the distance to the reference, and the sketches of the classes below."""
    names = shown_classes(sensitivity)
    rows = key_rows(names, MAP_SHARE * SINGLE_COLUMN_MM)
    figure = new_figure(width_mm=SINGLE_COLUMN_MM, height_mm=80.0 + KEY_ROW_MM * rows)
    ax, key = figure.subplots(2, 1, height_ratios=[80.0, KEY_ROW_MM * rows])
    plot_l1_map(sensitivity, ax)
    plot_class_key(names, key, rows=rows)
    return figure


def class_panels_figure(sensitivity: xr.Dataset) -> Figure:
    """Return the proportion of every class over the axes of the study."""
    return figure_of(plot_class_panels(sensitivity)[0])


def biplot_figure(
    components: xr.Dataset, sensitivity: xr.Dataset, color: Literal["complete", "l1_distance"]
) -> Figure:
    """Return Fig. 10, coloured by completion or by the distance to the reference."""
    figure = new_figure(width_mm=SINGLE_COLUMN_MM, height_mm=80.0)
    plot_biplot(components, figure.add_subplot(), sensitivity=sensitivity, color=color)
    return figure
