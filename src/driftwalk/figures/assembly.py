"""All figures of self-assembly, written into one folder."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from driftwalk.figures.write import write_each
from driftwalk.plot.assembly_growth import plot_assembly_sizes, plot_growth
from driftwalk.plot.class_courses import plot_class_times, plot_survival
from driftwalk.plot.components import plot_biplot
from driftwalk.plot.outcome_bars import plot_outcomes
from driftwalk.plot.parts.polyomino_sketch import figure_of
from driftwalk.plot.parts.style import DOUBLE_COLUMN_MM, SINGLE_COLUMN_MM, letter_panels, new_figure
from driftwalk.plot.sensitivity_maps import (
    KEY_ROW_MM,
    key_rows,
    plot_class_key,
    plot_class_panels,
    plot_l1_map,
    shown_classes,
)
from driftwalk.plot.tank import plot_film_strip

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

# Width of the map, and so of the key below it, as a share of the figure's.
MAP_SHARE = 0.75


def write_assembly_figures(
    folder: str | Path,
    *,
    distribution: xr.Dataset,
    beside: xr.Dataset | None = None,
    labels: tuple[str, str] = ("", ""),
    realisations: xr.Dataset | None = None,
    times: xr.Dataset | None = None,
    path: xr.Dataset | None = None,
    run: int = 0,
    sizes: xr.Dataset | None = None,
    sizes_drawn: xr.Dataset | None = None,
    formats: Sequence[str] = ("png", "svg"),
) -> list[Path]:
    """Write the figures of one self-assembly experiment: the paper's 9, times, and a film strip.

    The same datasets give the same files, byte for byte, with one version of matplotlib. A film
    is written by `write_animation`.

    Parameters
    ----------
    folder : path-like
        Where to write; made when absent.
    distribution : xarray.Dataset
        An `outcome_distribution`.
    beside : xarray.Dataset, optional
        A second `outcome_distribution` to compare with.
    labels : tuple of str
        Names of the first and the second.
    realisations : xarray.Dataset, optional
        Repetitions of the first: ``proportion`` on (realisation, class).
    times : xarray.Dataset, optional
        A `class_times`.
    path : xarray.Dataset, optional
        An `assembly_path`.
    run : int
        Which run of `path` the strip shows, counted from 0.
    sizes, sizes_drawn : xarray.Dataset, optional
        The `assembly_sizes` of both. Where there are many blocks and so too many classes to draw,
        they take the place of the classes.
    formats : sequence of {"png", "svg", "pdf"}
        File formats.

    Returns
    -------
    list of pathlib.Path
        The files: ``outcomes``, with `times` also ``class_times``, or with `sizes`
        ``assembly_sizes`` in their place; with `path` also ``film_strip``, each in every format.

    Raises
    ------
    InputError
        When a format is not known, or a dataset lacks what a figure draws.
    RunDirectoryError
        When a figure cannot be written.

    Examples
    --------
    ``write_assembly_figures("run/figures", distribution=outcomes, times=times)``
    """
    makers: dict[str, Callable[[], Figure]] = {
        "outcomes": lambda: outcomes_figure(
            distribution, beside=beside, labels=labels, realisations=realisations
        )
    }
    if times is not None:
        makers["class_times"] = lambda: class_times_figure(times)
    if sizes is not None:
        makers = {
            "assembly_sizes": lambda: assembly_sizes_figure(
                sizes, beside=sizes_drawn, labels=labels, times=times
            )
        }
    if path is not None:
        makers["film_strip"] = lambda: figure_of(plot_film_strip(path, run=run)[0])
    return write_each(makers, folder, formats)


def write_sensitivity_figures(
    folder: str | Path,
    *,
    sensitivity: xr.Dataset,
    components: xr.Dataset | None = None,
    formats: Sequence[str] = ("png", "svg"),
) -> list[Path]:
    """Write the figures of a sensitivity study: the paper's 11 and 10, and a panel per class.

    Parameters
    ----------
    folder : path-like
        Where to write; made when absent.
    sensitivity : xarray.Dataset
        A `sensitivity` of one or two axes.
    components : xarray.Dataset, optional
        Its `components`.
    formats : sequence of {"png", "svg", "pdf"}
        File formats.

    Returns
    -------
    list of pathlib.Path
        The files: ``l1_map`` and ``class_panels``, with `components` also ``biplot`` and
        ``biplot_l1``, each in every format.

    Raises
    ------
    InputError
        When a format is not known, or a dataset lacks what a figure draws.
    RunDirectoryError
        When a figure cannot be written.

    Examples
    --------
    ``write_sensitivity_figures("run/figures", sensitivity=study, components=components)``
    """
    makers: dict[str, Callable[[], Figure]] = {
        "l1_map": lambda: l1_map_figure(sensitivity),
        "class_panels": lambda: class_panels_figure(sensitivity),
    }
    if components is not None:
        makers["biplot"] = lambda: biplot_figure(components, sensitivity, "complete")
        makers["biplot_l1"] = lambda: biplot_figure(components, sensitivity, "l1_distance")
    return write_each(makers, folder, formats)


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
