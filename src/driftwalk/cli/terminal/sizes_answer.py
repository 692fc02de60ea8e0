"""Answer of `driftwalk assemble` for many blocks: sizes of assemblies instead of classes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.cli.terminal.output import print_table

if TYPE_CHECKING:
    import xarray as xr

COURSES: Final = {
    "mean_size": "mean_size_blocks",
    "largest_share": "largest_share",
    "free_share": "free_share",
}
"""Variables over time, and their keys in JSON."""
SHOWN_TIMES: Final = 4
"""Times in the printed table, equally far apart, the last one the end of the runs."""


def sizes_facts(sizes: xr.Dataset) -> dict[str, Any]:
    """Return what ``--json`` says of the sizes; all are means over runs.

    Parameters
    ----------
    sizes : xarray.Dataset
        An `assembly_sizes`.
    """
    rows = [
        {
            "from_blocks": int(row["size"]),
            "to_blocks": int(row["size_to"]),
            **_with_interval(row, "number", "assemblies_per_run"),
            **_with_interval(row, "block_share", "block_share"),
        }
        for row in (sizes.isel(size=at) for at in range(sizes.sizes["size"]))
    ]
    facts = sizes.attrs
    return {
        "at_end": rows,
        "over_time": {
            "time_s": sizes["time"].values,
            **{
                name: values
                for course, key in COURSES.items()
                for name, values in _with_interval(sizes, course, key).items()
            },
        },
        "compactness": facts["compactness"],
        "compactness_interval": [facts[f"compactness_{end}"] for end in ("low", "high")],
        "method": facts["method"],
    }


def print_sizes(sizes: xr.Dataset, what: str = "") -> None:
    """Print the sizes at the end of the runs, and how they grew.

    Parameters
    ----------
    sizes : xarray.Dataset
        An `assembly_sizes`.
    what : str
        What sets these runs apart, where there are others.
    """
    facts = sizes.attrs
    interval = f"{facts['confidence']:.0%} interval"
    rows = []
    for at in np.flatnonzero(sizes["number"].values > 0):
        row = sizes.isel(size=int(at))
        first, last = int(row["size"]), int(row["size_to"])
        name = str(first) if first == last else f"{first} to {last}"
        rows.append([name, *_cells(row, "number"), *_cells(row, "block_share")])
    heads = ["blocks in it", "assemblies per run", interval, "share of blocks", interval]
    print_table(rows, columns=heads, title=what or None)
    times = sizes.sizes["time"] - 1
    chosen = [round(times * (at + 1) / SHOWN_TIMES) for at in range(SHOWN_TIMES)]
    rows = [
        [f"{float(one['time']):.4g}", *(cell for name in COURSES for cell in _cells(one, name))]
        for one in (sizes.isel(time=at) for at in chosen)
    ]
    heads = [cell for name in ("mean size", "in largest", "free") for cell in (name, interval)]
    print_table(rows, columns=["time [s]", *heads])
    if facts["compactness_runs"]:
        ends = _range(facts["compactness_low"], facts["compactness_high"])
        print(
            f"compactness: {facts['compactness']:.3g}{f' ({interval} {ends})' if ends else ''}, "
            "least perimeter over perimeter, 1 at most"
        )


def _with_interval(found: xr.Dataset, name: str, key: str) -> dict[str, Any]:
    mean, low, high = (found[f"{name}{end}"].values.tolist() for end in ("", "_low", "_high"))
    interval = [low, high] if found[name].ndim == 0 else np.stack([low, high], axis=1).tolist()
    return {key: mean, f"{key}_interval": interval}


def _cells(found: xr.Dataset, name: str) -> tuple[str, str]:
    value, low, high = (float(found[f"{name}{end}"]) for end in ("", "_low", "_high"))
    return f"{value:.3g}", _range(low, high)


def _range(low: float, high: float) -> str:
    """Return an interval, nothing of a single run."""
    return f"{low:.3g} to {high:.3g}" if low == low else ""
