"""The parts of a page on the settings of a sensitivity study: axes, distances, shares, times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats
from driftwalk.page import parts
from driftwalk.page.arrays import encode_array, numbers
from driftwalk.page.parts import Section, quantity, require, value_of
from driftwalk.page.sections.outcomes import cells_of
from driftwalk.plot.parts.outcome_classes import (
    OTHER,
    are_discs,
    class_names,
    classes_to_show,
    with_rest,
)
from driftwalk.schema.kinds.sensitivity import axis_number, ranked_axes

if TYPE_CHECKING:
    import xarray as xr

MAP_AXES: Final = 2
"""Axes of a map; a study with more is shown in slices."""
NOT_REACHED: Final = "Blank if fewer than half of the runs reached it."
MOST_SLICES: Final = 12
"""Slices of a study that a page shows; chosen by eye."""
MOST_COUNTS: Final = 6_000_000
"""Numbers of runs that the maps of a page hold together: some 4 MB of it; chosen by hand."""


def require_axes(sensitivity: xr.Dataset) -> None:
    """Raise `InputError` unless the study has its distances and the values of its axes."""
    require(sensitivity, "l1_distance")
    require(sensitivity, *map(str, sensitivity["l1_distance"].dims))


def map_axes(part: xr.Dataset) -> tuple[str, str | None]:
    """Return which axis is x and which is y."""
    ranked = ranked_axes([str(dim) for dim in part["l1_distance"].dims])
    return ranked[0], ranked[1] if len(ranked) > 1 else None


def is_words(part: xr.Dataset, name: str) -> bool:
    """Return whether the values of an axis are words, which have no place on a scale."""
    return part[name].dtype.kind not in "iuf"


def axis_of(part: xr.Dataset, name: str) -> dict[str, Any]:
    """Return an axis as maps have it, with its label, unit and values."""
    number, words = axis_number(name), axis_number(name).words
    every = value_of(part, "force_interval_s")
    if name == "force_std" and every is not None:
        words += f", redrawn every {quantity(every, 's')}"
    return parts.axis(name, words, number.unit, part[name].values)


def value_words(name: str, value: Any) -> str:
    """Return an axis and a value of it with its unit, as they stand in a sentence."""
    number = axis_number(name)
    if isinstance(value, str):
        return f"{number.plain} {value.replace('_', ' ')}"
    return f"{number.plain} {quantity(float(value), number.unit)}"


def setting_names(part: xr.Dataset, dims: Sequence[str]) -> list[str]:
    """Return the values of every setting of a study along some axes, the last one fastest."""
    values = ([value_words(name, one) for one in part[name].values.tolist()] for name in dims)
    return [", ".join(words) for words in parts.settings_of(*values)]


def l1_sections(sensitivity: xr.Dataset) -> list[Section]:
    """Return the distance to the reference over the axes: maps, or lines where they are no map.

    A study of more than two axes has a map for each value of the others, at most 12. A map holds
    the classes of its settings over time; those of lines are in `times_sections`.

    Parameters
    ----------
    sensitivity : xarray.Dataset
        A `sensitivity`.

    Raises
    ------
    InputError
        When it holds no distance.
    """
    require_axes(sensitivity)
    made: list[Section] = []
    for number_of, (words, part) in enumerate(_slices(with_fewer_times(sensitivity))):
        if number_of == MOST_SLICES:
            made[-1]["note"] = f"{made[-1]['note'] or ''} More are in the file.".strip()
            break
        id = "l1" if number_of == 0 else f"l1-{number_of + 1}"
        x, y = map_axes(part)
        title = f"Distance to the reference{words}"
        if y is None or not _is_map(part):
            made.append(_lines(part, "l1_distance", id, title, "l1 distance"))
        else:
            made.append(_l1_map(part, x, y, id, title))
    return made


def times_sections(sensitivity: xr.Dataset) -> list[Section]:
    """Return the classes over time of the settings of a study that is no map, one to be chosen."""
    require_axes(sensitivity)
    pieces = _slices(with_fewer_times(sensitivity))[:MOST_SLICES]
    return [
        setting_times_section(part, "times" if place == 0 else f"times-{place + 1}", words)
        for place, (words, part) in enumerate(pieces)
        if not _is_map(part)
    ]


def setting_sections(sensitivity: xr.Dataset) -> list[Section]:
    """Return the shares of complete runs and the median times over the settings."""
    shown = {
        "complete": ("Share of runs that end as one assembly", "share of runs", "1"),
        "first_contact_median": ("Median time of the first contact", "time", "s"),
        "completion_median": ("Median time of completion", "time", "s"),
    }
    require_axes(sensitivity)
    made: list[Section] = []
    if sensitivity["l1_distance"].ndim > MAP_AXES:
        return made
    for name, (title, words, unit) in shown.items():
        if name not in sensitivity or not np.isfinite(sensitivity[name].values).any():
            continue
        x, y = map_axes(sensitivity)
        id = name.replace("_", "-")
        if y is None or not _is_map(sensitivity):
            made.append(_lines(sensitivity, name, id, title, words, unit=unit))
            continue
        made.append(
            parts.section(
                id, "image_grid", title, None if unit == "1" else NOT_REACHED,
                arena=None, x=axis_of(sensitivity, x), y=axis_of(sensitivity, y),
                value=encode_array(sensitivity[name].transpose(y, x).values),
                label=words, unit=unit, diverging=False, limits=[0.0, 1.0] if unit == "1" else None,
            )
        )  # fmt: skip
    return made


def _is_map(part: xr.Dataset) -> bool:
    """Return whether a part of a study lies over two axes of numbers."""
    x, y = map_axes(part)
    return y is not None and not is_words(part, x) and not is_words(part, y)


def _l1_map(part: xr.Dataset, x: str, y: str, id: str, title: str) -> Section:
    names = class_names(part) if "class" in part else []
    shares = None
    shown: list[str] = []
    if "proportion" in part and names:
        every = part["proportion"].transpose(y, x, "class").values
        kept = classes_to_show(names, every)
        shown, shares = [names[k] for k in kept], encode_array(every[:, :, kept])
    floor = value_of(part, "noise_floor_95")
    note = "0: the same outcomes as the reference; 2: none in common."
    if floor is not None:
        note += f" Chance alone gives up to {floor:.3g} (95 %)."
    at = [value_of(part, f"reference_{axis_number(name).key}") for name in (x, y)]
    return parts.section(
        id, "l1_map", title, note,
        x=axis_of(part, x), y=axis_of(part, y),
        value=encode_array(part["l1_distance"].transpose(y, x).values),
        reference=None if None in at else {"x": at[0], "y": at[1]},
        noise=floor,
        label="l1 distance",
        classes=shown,
        cells=[cells_of(name, discs=are_discs(*shown)) for name in shown],
        shares=shares,
        over_time=over_time_part(part, x, y),
    )  # fmt: skip


def _lines(
    part: xr.Dataset, variable: str, id: str, title: str, words: str, *, unit: str = "1"
) -> Section:
    """Return a variable along one axis, or along numbers for each word of another."""
    x, y = map_axes(part)
    if y is not None and is_words(part, x) and not is_words(part, y):
        x, y = y, x
    positions, note = _positions(part, x)
    drawn: list[dict[str, Any]] = []
    if y is None:
        drawn.append(parts.series(words, positions, part[variable].values, style="points"))
    else:
        for value in part[y].values:
            one = part[variable].sel({y: value}).values
            drawn.append(parts.series(value_words(y, value), positions, one, style="points"))
    marks = []
    floor = value_of(part, "noise_floor_95")
    if variable == "l1_distance" and floor is not None:
        marks.append(parts.mark("by chance, 95 %", y=floor))
    across = axis_number(x)
    return parts.chart(
        note or None,
        x=parts.label(across.words, across.unit), y=parts.label(words, unit),
        series=drawn, marks=marks, id=id, title=title,
    )  # fmt: skip


def _positions(part: xr.Dataset, name: str) -> tuple[Floats, str]:
    """Return places along an axis, and their words if it is an axis of words."""
    if not is_words(part, name):
        return np.asarray(part[name].values, dtype=np.float64), ""
    values = [str(value) for value in part[name].values]
    told = ", ".join(f"{k}: {value}" for k, value in enumerate(values, start=1))
    return np.arange(1.0, len(values) + 1.0), f"{axis_number(name).plain}: {told}.".capitalize()


def _slices(sensitivity: xr.Dataset) -> list[tuple[str, xr.Dataset]]:
    """Return the parts of a study that have at most two axes, and what they are."""
    dims = [str(dim) for dim in sensitivity["l1_distance"].dims]
    fixed = dims[: max(len(dims) - MAP_AXES, 0)]
    pieces = []
    for values in parts.settings_of(*(sensitivity[name].values.tolist() for name in fixed)):
        chosen = dict(zip(fixed, values, strict=True))
        words = "".join(f", {value_words(name, one)}" for name, one in chosen.items())
        pieces.append((words, sensitivity.sel(chosen)))
    return pieces


def over_time_part(part: xr.Dataset, x: str, y: str) -> dict[str, Any]:
    """Return the classes of every setting of a map over time, next to those of the reference.

    Parameters
    ----------
    part : xarray.Dataset
        A `sensitivity` over two axes.
    x, y : str
        Its axes.

    Returns
    -------
    dict
        ``over_time`` of an "l1_map", see ``docs/reference/page-data.md``.
    """
    names = [str(name) for name in part["class_over_time"].values]
    count = part["count_over_time"].transpose(y, x, "class_over_time", "time").values
    runs = part["runs"].transpose(y, x).values
    known = None
    if "reference_over_time" in part:
        known = part["reference_over_time"].transpose("class_over_time", "time").values
    shown = _chosen(names, _largest(count, runs, known))
    listed = [*(names[index] for index in shown), *([OTHER] if len(shown) < len(names) else [])]
    return {
        "time": numbers(part["time"].values),
        "classes": listed,
        "cells": [cells_of(name, discs=are_discs(*names)) for name in listed],
        "count": encode_array(with_rest(count, shown, axis=2)),
        "runs": numbers(runs),
        "reference": None if known is None else encode_array(with_rest(known, shown)),
    }


def setting_times_section(part: xr.Dataset, id: str, where: str) -> Section:
    """Return the classes over time of settings that are on no map, one to be chosen by its name.

    Parameters
    ----------
    part : xarray.Dataset
        A `sensitivity` over any axes.
    id : str
        Name of the section in its page.
    where : str
        Words in the title for the axes that the part does not have, or nothing.
    """
    title = f"Outcome classes over time{where}"
    dims = [str(dim) for dim in part["l1_distance"].dims]
    row = part.drop_vars(dims).stack(x=dims, create_index=False)
    row = row.assign({name: row[name].expand_dims("y") for name in ("count_over_time", "runs")})
    found = over_time_part(row, "x", "y")
    settings = setting_names(part, dims)
    return parts.section(id, "setting_times", title, None, settings=settings, over_time=found)


def with_fewer_times(sensitivity: xr.Dataset) -> xr.Dataset:
    """Return a study with every second time, every fourth, ... where a page would grow too large.

    The first and the last time stay.
    """
    size, last = sensitivity["count_over_time"].size, sensitivity.sizes["time"] - 1
    steps = [step for step in range(1, last + 1) if last % step == 0]
    every = next((step for step in steps if size <= step * MOST_COUNTS), max(last, 1))
    return sensitivity.isel(time=slice(None, None, every))


def _largest(count: npt.NDArray[Any], runs: npt.NDArray[Any], known: Floats | None) -> Floats:
    """Return the largest share that each class reaches somewhere at some time."""
    with np.errstate(invalid="ignore"):
        share = np.nan_to_num(count.max(axis=3) / runs[:, :, None])
    largest: Floats = share.reshape(-1, share.shape[2]).max(axis=0)
    return largest if known is None else np.maximum(largest, known.max(axis=1))


def _chosen(names: list[str], largest: Floats) -> list[int]:
    """Return the classes to show; what is summed already is summed with the others."""
    places = [index for index, name in enumerate(names) if name != OTHER]
    chosen = classes_to_show([names[index] for index in places], largest[places])
    return [places[index] for index in chosen]
