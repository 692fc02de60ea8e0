"""The part of a page on how the outcome classes of every setting develop over time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.page.arrays import encode_array, numbers
from driftwalk.page.axes import axis_words, value_words
from driftwalk.page.parts import Section, section, settings_of
from driftwalk.page.sections.assemblies.classes import cells_of
from driftwalk.plot.parts.assembly_labels import OTHER, classes_to_show

if TYPE_CHECKING:
    import xarray as xr

Floats = npt.NDArray[np.float64]

MOST_COUNTS: Final = 6_000_000
"""Numbers of runs that the maps of a page hold together: some 2.2 MB of it."""


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
    shown, rest = _chosen(names, _largest(count, runs, known))
    listed = [*(names[index] for index in shown), *([OTHER] if rest else [])]
    return {
        "time": numbers(part["time"].values),
        "classes": listed,
        "cells": [cells_of(name) for name in listed],
        "count": encode_array(_summed(count, shown, rest, axis=2)),
        "runs": numbers(runs),
        "reference": None if known is None else encode_array(_summed(known, shown, rest, axis=0)),
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
    settings = [
        ", ".join(f"{axis_words(n)} {value_words(n, v)}" for n, v in zip(dims, place, strict=True))
        for place in settings_of(*(part[name].values.tolist() for name in dims))
    ]
    return section(id, "setting_times", title, None, settings=settings, over_time=found)


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


def _chosen(names: list[str], largest: Floats) -> tuple[list[int], list[int]]:
    """Return the classes to show, and those that are summed: what is summed already is the last."""
    places = [index for index, name in enumerate(names) if name != OTHER]
    chosen = classes_to_show([names[index] for index in places], largest[places])
    shown = [places[index] for index in chosen]
    return shown, [index for index in range(len(names)) if index not in shown]


def _summed(
    values: npt.NDArray[Any], shown: list[int], rest: list[int], *, axis: int
) -> npt.NDArray[Any]:
    """Return the classes to show along an axis, and behind them the sum of the rest."""
    kept = values.take(shown, axis=axis)
    if not rest:
        return kept
    return np.concatenate([kept, values.take(rest, axis=axis).sum(axis=axis, keepdims=True)], axis)
