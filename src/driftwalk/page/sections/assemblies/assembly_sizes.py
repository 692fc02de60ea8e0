"""Sizes of assemblies on a page: for many blocks, where nearly every run is a class of its own."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.page.arrays import number
from driftwalk.page.chart import chart, label, series
from driftwalk.page.number_words import percent
from driftwalk.page.parts import Section, attempt, figure, require, value_of

if TYPE_CHECKING:
    import xarray as xr

MEAN_TITLE: Final = "Mean size over time"
SHARES_TITLE: Final = "Largest assembly and free blocks"
SHARES: Final = {"largest_share": "in the largest assembly", "free_share": "alone"}


def size_sections(found: dict[str, xr.Dataset]) -> list[Section]:
    """Return the sizes at the end of the runs, and their growth over time.

    Parameters
    ----------
    found : dict of str to xarray.Dataset
        Each an `assembly_sizes`, by what it is of.
    """
    return [
        *attempt("sizes", "Sizes of the assemblies", lambda: sizes_section(found)),
        *attempt("mean-size", MEAN_TITLE, lambda: mean_size_section(found)),
        *attempt("size-shares", SHARES_TITLE, lambda: shares_section(found)),
    ]


def mean_size_section(found: dict[str, xr.Dataset]) -> Section:
    """Return the mean size of the assemblies over time."""
    return chart(
        "mean-size", MEAN_TITLE, _note(found), x=label("time", "s"), y=label("blocks per assembly"),
        series=_courses(found, {"mean_size": ""}),
    )  # fmt: skip


def shares_section(found: dict[str, xr.Dataset]) -> Section:
    """Return the shares of the blocks that are in the largest assembly, and alone, over time."""
    return chart(
        "size-shares", SHARES_TITLE, _note(found), x=label("time", "s"),
        y=label("share of the blocks"), series=_courses(found, SHARES),
    )  # fmt: skip


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
        drawn.append(_series(name, middle, one, "block_share", style="points"))
    grouped = "Sizes that share a point, at their geometric mean"
    note = f"{grouped}: {', '.join(groups)}. " if groups else ""
    return chart(
        "sizes", "Sizes of the assemblies", f"At the end of the runs. {note}{_note(found)}",
        x=label("blocks in the assembly", log=True), y=label("share of the blocks"), series=drawn,
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
        figure(text, float(end[name]))
        | {
            "low": number(end[f"{name}_low"]),
            "high": number(end[f"{name}_high"]),
            "confidence": confidence,
        }
        for name, text in words.items()
    ]
    compact = figure(
        "compactness", value_of(sizes, "compactness"), note="least perimeter over perimeter"
    )
    ends = {end: value_of(sizes, f"compactness_{end}") for end in ("low", "high")}
    return [*shown, compact | ends | {"confidence": confidence}]


def _courses(found: dict[str, xr.Dataset], names: dict[str, str]) -> list[dict[str, Any]]:
    drawn = []
    for kind, one in found.items():
        require(one, "time", *names)
        for name, words in names.items():
            both = (words, kind if len(found) > 1 or not words else "")
            text = ", ".join(part for part in both if part)
            drawn.append(_series(text, one["time"].values, one, name))
    return drawn


def _series(name: str, x: Any, found: xr.Dataset, of: str, **how: Any) -> dict[str, Any]:
    ends = (found[f"{of}_low"].values, found[f"{of}_high"].values)
    return series(name, x, found[of].values, ends=ends, **how)


def _note(found: dict[str, xr.Dataset]) -> str:
    confidence = value_of(next(iter(found.values())), "confidence")
    each = "" if confidence is None else f", with {percent(confidence)} intervals"
    return f"Means over the runs{each}."
