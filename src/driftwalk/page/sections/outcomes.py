"""The parts of a page on what blocks built: outcome classes, their sketches, and sizes."""

from __future__ import annotations

from functools import cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.core.units import percent
from driftwalk.page import parts
from driftwalk.page.arrays import number, numbers
from driftwalk.page.parts import Section, count, require, value_of
from driftwalk.plot.parts.outcome_classes import (
    OTHER,
    are_discs,
    class_cells,
    class_names,
    classes_to_show,
    is_class,
    with_rest,
)

if TYPE_CHECKING:
    import xarray as xr


@cache
def cells_of(name: str, *, discs: bool = False) -> list[list[float]]:
    """Return the squares in the sketch of a class, see `class_cells`; none of anything else.

    A disc has a third number, 1. A class may be of discs without saying so in its name.

    Examples
    --------
    >>> cells_of("2+1"), cells_of("other"), cells_of("1", discs=True)
    ([[0.0, 1.6], [1.0, 1.6], [0.0, 0.0]], [], [[0.0, 0.0, 1.0]])
    """
    found: list[list[float]] = class_cells(name).round(3).tolist() if is_class(name) else []
    return [[*cell, 1.0] for cell in found] if discs or are_discs(name) else found


def classes_section(found: dict[str, xr.Dataset]) -> Section:
    """Return the shares of the outcome classes, one series next to the other.

    Parameters
    ----------
    found : dict of str to xarray.Dataset
        Each an `outcome_distribution`, by what it is of.

    Raises
    ------
    InputError
        When one of them has no shares.
    """
    for one in found.values():
        require(one, "class", "count", "proportion")
    names = list(dict.fromkeys(name for one in found.values() for name in class_names(one)))
    share = [one["proportion"].reindex({"class": names}).values for one in found.values()]
    shown = [names[index] for index in classes_to_show(names, np.array(share))]
    first = next(iter(found.values()))
    confidence = value_of(first, "confidence")
    items = {name: class_items(one, names, shown) for name, one in found.items()}
    return parts.section(
        "", "classes", "",
        None if confidence is None else f"{percent(confidence)} simultaneous intervals.",
        confidence=confidence,
        runs=int(first.attrs.get("runs", 0)),
        series=[{"name": name, "items": each} for name, each in items.items()],
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
    # A page has the shares at 401 times or fewer.
    every = -(-times.sizes["time"] // 401)
    thin = times.isel(time=slice(None, None, every))
    names = class_names(thin)
    share = thin["proportion"].transpose("class", "time").values
    shown = classes_to_show(names, share.T)
    known = {"share": share, "low": None, "high": None}
    for end in ("low", "high"):
        if f"proportion_{end}" in thin:
            known[end] = thin[f"proportion_{end}"].transpose("class", "time").values
    classes = [
        {"class": names[i], "cells": cells_of(names[i], discs=are_discs(*names))}
        | {key: None if one is None else numbers(one[i]) for key, one in known.items()}
        for i in shown
    ]
    if len(shown) < len(names):
        rest = numbers(with_rest(share, shown)[-1])
        classes.append({"class": OTHER, "cells": [], "share": rest, "low": None, "high": None})
    return parts.section(
        "class-times", "class_times", "Outcome classes over time",
        time=numbers(thin["time"].values), classes=classes,
    )  # fmt: skip


def class_items(found: xr.Dataset, names: list[str], shown: list[str]) -> list[dict[str, Any]]:
    """Return the classes to show of an `outcome_distribution`, and the rest of `names` summed."""
    keys = ("count", "proportion", "interval_low", "interval_high")
    columns = {
        key: dict(zip(class_names(found), found[key].values.tolist(), strict=True))
        for key in keys
        if key in found
    }

    def column(key: str, name: str) -> float | None:
        return number(columns.get(key, {}).get(name))

    items = [
        {
            "class": name, "cells": cells_of(name, discs=are_discs(*names)),
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


def size_sections(found: dict[str, xr.Dataset]) -> list[Section]:
    """Return the sizes at the end of the runs, and their growth over time.

    Parameters
    ----------
    found : dict of str to xarray.Dataset
        Each an `assembly_sizes`, by what it is of.
    """
    shares = {"largest_share": "in the largest assembly", "free_share": "alone"}
    drawn = {
        ("mean-size", "Mean size over time"): ("blocks per assembly", {"mean_size": ""}),
        ("size-shares", "Largest assembly and free blocks"): ("share of the blocks", shares),
    }
    # Older files have none.
    if all("compactness" in one for one in found.values()):
        ratio = ("least perimeter over perimeter", {"compactness": ""})
        drawn["compactness", "Compactness over time"] = ratio
    made = parts.attempt("sizes", "Sizes of the assemblies", lambda: sizes_section(found))
    for (id, title), (words, names) in drawn.items():
        made += parts.attempt(id, title, partial(_over_time, found, words, names))
    return made


def _over_time(found: dict[str, xr.Dataset], words: str, names: dict[str, str]) -> Section:
    drawn = []
    for kind, one in found.items():
        require(one, "time", *names)
        for name, of in names.items():
            both = (of, kind if len(found) > 1 or not of else "")
            text = ", ".join(part for part in both if part)
            drawn.append(parts.course(text, one["time"].values, one, name))
    time = parts.label("time", "s")
    return parts.chart(_note(found), x=time, y=parts.label(words), series=drawn)


def sizes_section(found: dict[str, xr.Dataset]) -> Section:
    """Return the share of the blocks that is in assemblies of each size at the end.

    Parameters
    ----------
    found : dict of str to xarray.Dataset
        Each an `assembly_sizes`, by what it is of.

    Raises
    ------
    InputError
        When one of them has no sizes.
    """
    drawn = []
    groups: dict[str, None] = {}
    for name, one in found.items():
        require(one, "size", "size_to", "block_share")
        ends = zip(one["size"].values, one["size_to"].values, strict=True)
        groups |= dict.fromkeys(f"{low} to {high}" for low, high in ends if high > low)
        middle = np.sqrt(one["size"].values * one["size_to"].values)
        drawn.append(parts.course(name, middle, one, "block_share", style="points"))
    grouped = "Sizes that share a point, at their geometric mean"
    note = f"{grouped}: {', '.join(groups)}. " if groups else ""
    return parts.chart(
        f"At the end of the runs. {note}{_note(found)}",
        x=parts.label("blocks in the assembly", log=True), y=parts.label("share of the blocks"),
        series=drawn,
    )  # fmt: skip


def size_numbers(sizes: xr.Dataset) -> list[dict[str, Any]]:
    """Return the numbers of a summary: the end of the runs, with intervals."""
    end = sizes.isel(time=-1)
    words = {
        "largest_share": "share of the blocks in the largest assembly",
        "free_share": "share of the blocks that are alone",
        "mean_size": "blocks per assembly, mean",
    }
    confidence = value_of(sizes, "confidence")
    shown = [
        parts.figure(
            text, end[name], ends=(end[f"{name}_low"], end[f"{name}_high"]), confidence=confidence
        )
        for name, text in words.items()
    ]
    note = "least perimeter over perimeter"
    return [*shown, parts.figure_with_ends(sizes, "compactness", "compactness", note=note)]


def _note(found: dict[str, xr.Dataset]) -> str:
    confidence = value_of(next(iter(found.values())), "confidence")
    each = "" if confidence is None else f", with {percent(confidence)} intervals"
    return f"Means over the runs{each}."
