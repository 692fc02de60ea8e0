"""The figures of self-assembly."""

from __future__ import annotations

from typing import TYPE_CHECKING

from driftwalk.figures.write import Figures
from driftwalk.plot.assembly_courses import (
    plot_assembly_sizes,
    plot_class_times,
    plot_growth,
    plot_survival,
)
from driftwalk.plot.outcome_bars import plot_outcomes
from driftwalk.plot.parts.polyomino_sketch import figure_of
from driftwalk.plot.parts.style import DOUBLE_COLUMN_MM, letter_panels, new_figure
from driftwalk.plot.tank import plot_film_strip

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
        their place; with `path` also ``film_strip``.

    Examples
    --------
    ``write_figures(assembly_figures(outcomes, class_times=times), "run/figures")``
    """
    names = ("", "") if distribution_drawn is None else labels
    figures: Figures = {
        "outcomes": lambda: outcomes_figure(
            distribution, beside=distribution_drawn, labels=names, realisations=realisations
        )
    }
    if class_times is not None:
        figures["class_times"] = lambda: class_times_figure(class_times)
    if sizes is not None:
        figures = {
            "assembly_sizes": lambda: assembly_sizes_figure(
                sizes, beside=sizes_drawn, labels=names, times=class_times
            )
        }
    if path is not None:
        figures["film_strip"] = lambda: figure_of(plot_film_strip(path, run=run)[0])
    return figures


def outcomes_figure(
    distribution: xr.Dataset,
    *,
    beside: xr.Dataset | None = None,
    labels: tuple[str, str] = ("", ""),
    realisations: xr.Dataset | None = None,
) -> Figure:
    """Return Fig. 9: one column wide for few classes, else two."""
    return figure_of(
        plot_outcomes(distribution, beside=beside, labels=labels, realisations=realisations)
    )


def class_times_figure(times: xr.Dataset) -> Figure:
    """Return the classes over time next to the survival curves."""
    figure = new_figure(width_mm=DOUBLE_COLUMN_MM, height_mm=75.0)
    row = list(figure.subplots(1, 2, width_ratios=[1.25, 1.0]))
    plot_class_times(times, row[0])
    plot_survival(times, row[1])
    titles = [ax.get_title(loc="left") for ax in row]
    letter_panels(row, titles)
    return figure


def assembly_sizes_figure(
    sizes: xr.Dataset,
    *,
    beside: xr.Dataset | None = None,
    labels: tuple[str, str] = ("", ""),
    times: xr.Dataset | None = None,
) -> Figure:
    """Return the sizes at the end, their mean and shares over time, and the survival curves."""
    figure = new_figure(width_mm=DOUBLE_COLUMN_MM, height_mm=130.0)
    panels = list(figure.subplots(2, 2).ravel())
    plot_assembly_sizes(sizes, panels[0], beside=beside, labels=labels)
    plot_growth(sizes, panels[1], beside=beside, labels=labels)
    plot_growth(sizes, panels[2], beside=beside, labels=labels, what="shares")
    if times is None:
        panels.pop().remove()
    else:
        plot_survival(times, panels[3])
    letter_panels(panels, [ax.get_title(loc="left") for ax in panels])
    return figure
