"""Outcome classes on a page: the cells of their shapes, shares with intervals, shares over time."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.page.arrays import number, numbers
from driftwalk.page.number_words import count, percent
from driftwalk.page.parts import Section, require, section, value_of
from driftwalk.plot.parts.assembly_labels import OTHER, class_names, classes_to_show
from driftwalk.plot.parts.polyomino_sketch import class_cells, is_class

if TYPE_CHECKING:
    import xarray as xr

Floats = npt.NDArray[np.float64]

MOST_TIMES: Final = 401
"""Times at which a page has the shares."""


@functools.cache
def cells_of(name: str) -> list[list[float]]:
    """Return the squares in the sketch of a class, see `class_cells`; none of anything else.

    Examples
    --------
    >>> cells_of("2+1"), cells_of("other")
    ([[0.0, 1.6], [1.0, 1.6], [0.0, 0.0]], [])
    """
    found: list[list[float]] = class_cells(name).tolist() if is_class(name) else []
    return found


def classes_section(series: dict[str, xr.Dataset], *, id: str = "classes") -> Section:
    """Return the shares of the outcome classes, one series next to the other.

    Parameters
    ----------
    series : dict of str to xarray.Dataset
        Each an `outcome_distribution`, by what it is of.
    id : str
        Name of the section in its page.

    Raises
    ------
    InputError
        When one of them has no shares.
    """
    for found in series.values():
        require(found, "class", "count", "proportion")
    names = list(dict.fromkeys(name for found in series.values() for name in class_names(found)))
    largest = np.max([_by_name(found, "proportion", names) for found in series.values()], axis=0)
    shown = [names[index] for index in classes_to_show(names, np.nan_to_num(largest))]
    first = next(iter(series.values()))
    confidence = value_of(first, "confidence")
    note = None
    if confidence is not None:
        note = f"{percent(confidence)} simultaneous intervals."
    return section(
        id, "classes", "Structures built", note,
        confidence=confidence,
        runs=int(first.attrs.get("runs", 0)),
        series=[
            {"name": name, "items": _items(found, names, shown)} for name, found in series.items()
        ],
    )  # fmt: skip


def class_times_section(times: xr.Dataset) -> Section:
    """Return the shares of the outcome classes over time.

    Parameters
    ----------
    times : xarray.Dataset
        A `class_times`.

    Raises
    ------
    InputError
        When it has no shares.
    """
    require(times, "time", "class", "proportion")
    every = -(-times.sizes["time"] // MOST_TIMES)
    thin = times.isel(time=slice(None, None, every))
    names = class_names(thin)
    share = thin["proportion"].transpose("class", "time").values
    shown = classes_to_show(names, np.nan_to_num(share).max(axis=1, initial=0.0))
    ends = [f"proportion_{end}" for end in ("low", "high")]
    bands = [thin[end].transpose("class", "time").values if end in thin else None for end in ends]
    classes = [
        _over_time(names[i], share[i], *(None if band is None else band[i] for band in bands))
        for i in shown
    ]
    rest = sorted(set(range(len(names))) - set(shown))
    if rest:
        classes.append(_over_time(OTHER, share[rest].sum(axis=0), None, None))
    return section(
        "class-times", "class_times", "Outcome classes over time", None,
        time=numbers(thin["time"].values), classes=classes,
    )  # fmt: skip


def _over_time(name: str, share: Floats, low: Floats | None, high: Floats | None) -> dict[str, Any]:
    return {
        "class": name,
        "cells": cells_of(name),
        "share": numbers(share),
        "low": None if low is None else numbers(low),
        "high": None if high is None else numbers(high),
    }


def _by_name(found: xr.Dataset, variable: str, names: list[str]) -> Floats:
    """Return a variable of the classes in another order, NaN where a class does not occur."""
    place = {name: index for index, name in enumerate(class_names(found))}
    values = np.asarray(found[variable].values, dtype=np.float64)
    return np.array([values[place[name]] if name in place else np.nan for name in names])


def _items(found: xr.Dataset, names: list[str], shown: list[str]) -> list[dict[str, Any]]:
    keys = ("count", "proportion", "interval_low", "interval_high")
    columns = {
        key: dict(zip(names, _by_name(found, key, names), strict=True)) for key in keys
        if key in found
    }  # fmt: skip

    def column(key: str, name: str) -> float | None:
        return number(columns[key][name]) if key in columns else None

    items = [
        {
            "class": name, "cells": cells_of(name),
            "count": None if (n := column("count", name)) is None else int(n),
            "share": column("proportion", name),
            "low": column("interval_low", name), "high": column("interval_high", name),
        }
        for name in shown
    ]  # fmt: skip
    rest = [name for name in names if name not in shown]
    if rest:
        total = [sum(column(key, name) or 0.0 for name in rest) for key in keys[:2]]
        items.append(
            {
                "class": OTHER, "cells": [], "count": int(total[0]), "share": total[1],
                "low": None, "high": None, "note": count(len(rest), "class") + " that are rare",
            }
        )  # fmt: skip
    return items
