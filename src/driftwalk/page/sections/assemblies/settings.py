"""The part of a page on what comes of each setting: the l1 distance, shares and times."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.page.arrays import encode_array
from driftwalk.page.axes import (
    AXES,
    MAP_AXES,
    axis_of,
    axis_words,
    is_words,
    map_axes,
    require_axes,
    value_words,
)
from driftwalk.page.chart import chart, label, mark, series
from driftwalk.page.parts import Section, section, settings_of, value_of
from driftwalk.page.sections.assemblies.classes import cells_of
from driftwalk.page.sections.assemblies.sensitivity_times import (
    over_time_part,
    setting_times_section,
    with_fewer_times,
)
from driftwalk.plot.parts.assembly_labels import class_names, classes_to_show

if TYPE_CHECKING:
    import xarray as xr

Floats = npt.NDArray[np.float64]

NOT_REACHED: Final = "Blank if fewer than half of the runs reached it."
MOST_SLICES: Final = 12


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
            made.append(_lines(part, "l1_distance", id, title, "l1 distance", noise=True))
        else:
            made.append(_l1_map(part, x, y, id, title))
    return made


def times_sections(sensitivity: xr.Dataset) -> list[Section]:
    """Return the classes over time of the settings of a study that is no map, one to be chosen."""
    require_axes(sensitivity)
    parts = _slices(with_fewer_times(sensitivity))[:MOST_SLICES]
    return [
        setting_times_section(part, "times" if place == 0 else f"times-{place + 1}", words)
        for place, (words, part) in enumerate(parts)
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
            section(
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
        largest = np.nan_to_num(every).reshape(-1, len(names)).max(axis=0)
        kept = classes_to_show(names, largest)
        shown, shares = [names[k] for k in kept], encode_array(every[:, :, kept])
    floor = value_of(part, "noise_floor_95")
    note = "0: the same outcomes as the reference; 2: none in common."
    if floor is not None:
        note += f" Chance alone gives up to {floor:.3g} (95 %)."
    at = [_reference(part, name) for name in (x, y)]
    return section(
        id, "l1_map", title, note,
        x=axis_of(part, x), y=axis_of(part, y),
        value=encode_array(part["l1_distance"].transpose(y, x).values),
        reference=None if None in at else {"x": at[0], "y": at[1]},
        noise=floor,
        label="l1 distance",
        classes=shown,
        cells=[cells_of(name) for name in shown],
        shares=shares,
        over_time=over_time_part(part, x, y),
    )  # fmt: skip


def _lines(
    part: xr.Dataset,
    variable: str,
    id: str,
    title: str,
    words: str,
    *,
    unit: str = "1",
    noise: bool = False,
) -> Section:
    """Return a variable along one axis, or along numbers for each word of another."""
    x, y = map_axes(part)
    if y is not None and is_words(part, x) and not is_words(part, y):
        x, y = y, x
    positions, note = _positions(part, x)
    drawn: list[dict[str, Any]] = []
    if y is None:
        drawn.append(series(words, positions, part[variable].values, style="points"))
    else:
        for value in part[y].values:
            one = part[variable].sel({y: value}).values
            drawn.append(
                series(f"{axis_words(y)} {value_words(y, value)}", positions, one, style="points")
            )
    marks = []
    floor = value_of(part, "noise_floor_95")
    if noise and floor is not None:
        marks.append(mark("by chance, 95 %", y=floor))
    words_x = AXES.get(x, (axis_words(x), "1", ""))
    return chart(
        id, title, note or None, x=label(words_x[0], words_x[1]), y=label(words, unit),
        series=drawn, marks=marks,
    )  # fmt: skip


def _positions(part: xr.Dataset, name: str) -> tuple[Floats, str]:
    """Return places along an axis, and their words if it is an axis of words."""
    if not is_words(part, name):
        return np.asarray(part[name].values, dtype=np.float64), ""
    values = [str(value) for value in part[name].values]
    told = ", ".join(f"{k}: {value}" for k, value in enumerate(values, start=1))
    return np.arange(1.0, len(values) + 1.0), f"{axis_words(name)}: {told}.".capitalize()


def _slices(sensitivity: xr.Dataset) -> list[tuple[str, xr.Dataset]]:
    """Return the parts of a study that have at most two axes, and what they are."""
    dims = [str(dim) for dim in sensitivity["l1_distance"].dims]
    fixed = dims[: max(len(dims) - MAP_AXES, 0)]
    parts = []
    for values in settings_of(*(sensitivity[name].values.tolist() for name in fixed)):
        chosen = dict(zip(fixed, values, strict=True))
        words = "".join(f", {axis_words(n)} {value_words(n, v)}" for n, v in chosen.items())
        parts.append((words, sensitivity.sel(chosen)))
    return parts


def _reference(part: xr.Dataset, name: str) -> float | None:
    return value_of(part, f"reference_{name}{AXES.get(name, ('', '', ''))[2]}")
