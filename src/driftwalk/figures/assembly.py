"""The figures of self-assembly, of its sensitivity analysis, and of a policy of control."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import partial
from itertools import combinations, product
from typing import TYPE_CHECKING, Any, Literal

from driftwalk.figures.write import Figures, plotted
from driftwalk.plot.assembly_courses import (
    drawn_classes,
    plot_assembly_sizes,
    plot_attraction,
    plot_class_times,
    plot_growth,
    plot_survival,
)
from driftwalk.plot.components import plot_biplot
from driftwalk.plot.control import plot_control_run, plot_control_shares, plot_policy
from driftwalk.plot.kinetics import plot_class_graph, plot_predicted_shares
from driftwalk.plot.outcome_bars import plot_outcomes
from driftwalk.plot.outcome_posterior import plot_data_widths, plot_outcome_posterior
from driftwalk.plot.parts import style
from driftwalk.plot.sensitivity_maps import (
    KEY_ROW_MM,
    key_rows,
    plot_class_key,
    plot_class_panels,
    plot_l1_map,
    shown_classes,
)
from driftwalk.plot.tank import plot_film_strip
from driftwalk.plot.yields import plot_yield_front, plot_yield_settings

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


LABELS = ("parameters found", "parameters drawn")
"""Names of the two sets of runs of a run directory."""


def assembly_figures(
    distribution: xr.Dataset,
    distribution_drawn: xr.Dataset | None = None,
    class_times: xr.Dataset | None = None,
    path: xr.Dataset | None = None,
    sizes: xr.Dataset | None = None,
    sizes_drawn: xr.Dataset | None = None,
    attraction: xr.Dataset | None = None,
    *,
    labels: tuple[str, str] = LABELS,
    realisations: xr.Dataset | None = None,
    run: int = 0,
) -> Figures:
    """Return the figures of one self-assembly experiment: the paper's 9, times, and a film strip.

    A film is written by `write_animation`.

    Parameters
    ----------
    distribution : xarray.Dataset
        An `outcome_distribution`.
    distribution_drawn : xarray.Dataset, optional
        A second `outcome_distribution` to compare with.
    class_times : xarray.Dataset, optional
        A `class_times`.
    path : xarray.Dataset, optional
        An `assembly_path`.
    sizes, sizes_drawn : xarray.Dataset, optional
        The `assembly_sizes` of both. Where there are many blocks and so too many classes to draw,
        they take the place of the classes.
    attraction : xarray.Dataset, optional
        An `attraction`.
    labels : tuple of str
        Names of the first distribution and the second, where there are two.
    realisations : xarray.Dataset, optional
        Repetitions of the first: ``proportion`` on (realisation, class).
    run : int
        Which run of `path` the strip shows, counted from 0.

    Returns
    -------
    dict of str to callable
        ``outcomes``, with `class_times` also ``class_times``, or with `sizes` ``assembly_sizes`` in
        their place; with `path` also ``film_strip``, with `attraction` ``attraction``.

    Examples
    --------
    ``write_figures(assembly_figures(outcomes, class_times=times), "run/figures")``
    """
    names = ("", "") if distribution_drawn is None else labels
    outcomes = partial(
        plot_outcomes, beside=distribution_drawn, labels=names, realisations=realisations
    )
    figures = plotted(distribution, outcomes=outcomes)
    if class_times is not None:
        figures["class_times"] = lambda: class_times_figure(class_times)
    if sizes is not None:
        figures = {
            "assembly_sizes": lambda: assembly_sizes_figure(
                sizes, beside=sizes_drawn, labels=names, times=class_times
            )
        }
    if path is not None:
        figures["film_strip"] = lambda: style.figure_of(plot_film_strip(path, run=run)[0])
    if attraction is not None:
        figures |= plotted(attraction, attraction=plot_attraction)
    return figures


def class_times_figure(times: xr.Dataset) -> Figure:
    """Return the classes over time next to the survival curves."""
    # 4.4 mm for the label of a class, 21 mm for title, axis and legend.
    height = max(75.0, 4.4 * len(drawn_classes(times)) + 21.0)
    figure, row = style.new_panels(1, 2, height_mm=height, width_ratios=[1.25, 1.0])
    plot_survival(times, row[1])
    plot_class_times(times, row[0])
    style.letter_panels(row)
    return figure


def assembly_sizes_figure(
    sizes: xr.Dataset,
    *,
    beside: xr.Dataset | None = None,
    labels: tuple[str, str] = ("", ""),
    times: xr.Dataset | None = None,
) -> Figure:
    """Return the sizes at the end, their mean and shares over time, and the survival curves."""
    figure, panels = style.new_panels(2, 2, height_mm=145.0)
    plot_assembly_sizes(sizes, panels[0], beside=beside, labels=labels)
    plot_growth(sizes, panels[1], beside=beside, labels=labels)
    plot_growth(sizes, panels[2], beside=beside, labels=labels, what="shares")
    if times is None:
        panels.pop().remove()
    else:
        plot_survival(times, panels[3])
    # All panels have the same title: of how many runs they are.
    figure.suptitle(panels[0].get_title(loc="left"))
    titles = ["at the end", "mean size", "shares", "waiting times"]
    style.letter_panels(panels, titles[: len(panels)])
    return figure


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
        figures = plotted(reference, outcomes=partial(plot_outcomes, realisations=realised))
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
    fixed = [str(name) for name in sensitivity["l1_distance"].dims[:-2]]
    for values in product(*(sensitivity[name].values.tolist() for name in fixed)):
        chosen = dict(zip(fixed, values, strict=True))
        name = "_".join(f"{name}_{value}" for name, value in chosen.items())
        yield re.sub(r"[^A-Za-z0-9._-]+", "-", name) + ("/" if fixed else ""), chosen


def l1_map_figure(sensitivity: xr.Dataset) -> Figure:
    """Return Fig. 11: the distance to the reference, and the sketches of the classes below."""
    names = shown_classes(sensitivity)
    # The map, and so the key below it, is three quarters as wide as the figure.
    rows = key_rows(names, 0.75 * style.SINGLE_COLUMN_MM)
    heights = [80.0, KEY_ROW_MM * rows]
    figure, (ax, key) = style.new_panels(
        2, 1, width_mm=style.SINGLE_COLUMN_MM, height_mm=sum(heights), height_ratios=heights
    )
    plot_l1_map(sensitivity, ax)
    plot_class_key(names, key, rows=rows)
    return figure


def class_panels_figure(sensitivity: xr.Dataset) -> Figure:
    """Return the share of runs in every class over the axes of the study."""
    return style.figure_of(plot_class_panels(sensitivity)[0])


def biplot_figure(
    components: xr.Dataset, sensitivity: xr.Dataset, color: Literal["complete", "l1_distance"]
) -> Figure:
    """Return Fig. 10, coloured by completion or by the distance to the reference."""
    return style.figure_of(plot_biplot(components, sensitivity=sensitivity, color=color))


def kinetics_figures(kinetics: xr.Dataset) -> Figures:
    """Return the figures of kinetics: the graph of classes, and the shares over time.

    Parameters
    ----------
    kinetics : xarray.Dataset
        A `kinetics`.

    Returns
    -------
    dict of str to callable
        ``class_graph`` and ``shares``.

    Examples
    --------
    ``write_figures(kinetics_figures(found), "kinetics/figures")``
    """
    return plotted(kinetics, class_graph=plot_class_graph, shares=plot_predicted_shares)


def outcome_posterior_figures(posterior: xr.Dataset) -> Figures:
    """Return the figures of a posterior from outcomes: the joint posterior, what data tell.

    Parameters
    ----------
    posterior : xarray.Dataset
        An `outcome_posterior`.

    Returns
    -------
    dict of str to callable
        ``posterior``, one more for each further pair of parameters, and ``data``.

    Examples
    --------
    ``write_figures(outcome_posterior_figures(found), "posterior/figures")``
    """
    pairs = list(combinations(range(posterior.sizes["parameter"]), 2))
    names = ["posterior", *(f"posterior_{a + 1}_{b + 1}" for a, b in pairs[1:])]
    plots = [partial(plot_outcome_posterior, pair=pair) for pair in pairs]
    return plotted(posterior, **dict(zip(names, plots, strict=True)), data=plot_data_widths)


def yield_figures(yields: xr.Dataset) -> Figures:
    """Return the figures of a maximised yield: the front of yield and time, and the settings.

    Parameters
    ----------
    yields : xarray.Dataset
        A `yield`.

    Returns
    -------
    dict of str to callable
        ``front`` and ``settings``.

    Examples
    --------
    ``write_figures(yield_figures(found), "yield/figures")``
    """
    return plotted(yields, front=plot_yield_front, settings=plot_yield_settings)


def policy_figures(policy: xr.Dataset) -> Figures:
    """Return the figure of a policy.

    Parameters
    ----------
    policy : xarray.Dataset
        A `control_policy`.

    Returns
    -------
    dict of str to callable
        ``policy``.

    Examples
    --------
    ``write_figures(policy_figures(policy), "policy/figures")``
    """
    return plotted(policy, policy=plot_policy)


def trial_figures(control_test: xr.Dataset, path: xr.Dataset | None = None) -> Figures:
    """Return the figures of a test: the target over time, and the decisions of one run.

    Parameters
    ----------
    control_test : xarray.Dataset
        A `control_test`.
    path : xarray.Dataset, optional
        The `assembly_path` of the run that it shows.

    Returns
    -------
    dict of str to callable
        ``shares`` and ``run``, with `path` also ``film_strip``.

    Examples
    --------
    ``write_figures(trial_figures(found), "test/figures")``
    """
    figures = plotted(control_test, shares=plot_control_shares, run=plot_control_run)
    if path is not None:
        figures["film_strip"] = lambda: style.figure_of(plot_film_strip(path)[0])
    return figures
