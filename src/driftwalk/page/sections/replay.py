"""The replay of a page: blocks of sample runs over time, and what joined when."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.page.arrays import binary_step, encode_array
from driftwalk.page.parts import Section, arena_part, count, quantity, require, required, section
from driftwalk.page.sections.outcomes import cells_of
from driftwalk.plot.parts.outcome_classes import are_discs
from driftwalk.schema.shapes import all_single

if TYPE_CHECKING:
    import xarray as xr

MOST_POSES: Final = 400_000
"""Poses that a page holds; longer paths are shown more rarely, then fewer of them; chosen by
hand."""


def replay_section(path: xr.Dataset, assembly: xr.Dataset | None = None) -> Section:
    """Return the sample runs of an assembly, to be played.

    Parameters
    ----------
    path : xarray.Dataset
        An `assembly_path`.
    assembly : xarray.Dataset, optional
        The `assembly` that the runs belong to, for what joined when.

    Raises
    ------
    InputError
        When the path lacks poses or the side of the blocks.
    """
    require(path, "x", "y", "theta", "assembly", "time")
    runs, every = _shares(path)
    thin = path.isel(run=slice(0, runs), time=slice(None, None, every))
    # The tank is two thousand steps wide or more; times are known to 0.06 ms, angles to 0.1°.
    step = binary_step(2.0 * float(np.nanmax(np.abs(thin["x"].values))), 2000)
    note = f"{count(runs, 'run')}, a position every {_interval(thin)}, to {1e3 * step:.2g} mm."
    if runs < path.sizes["run"]:
        note += f" {count(path.sizes['run'] - runs, 'more run')} in the file."
    if path.attrs.get("block_shape") == "disc":
        thin = thin.assign(theta=thin["theta"] * np.nan)  # drawn as discs
    made = [_run(thin.isel(run=index), index, assembly, step) for index in range(runs)]
    names = {change["class"] for run in made for change in run["classes"]}
    return section(
        "replay", "replay", "Sample runs", note,
        arena=arena_part(path),
        side=float(required(path, "block_side_m")),
        width=path.attrs.get("block_width_m"),
        time=encode_array(thin["time"].values, step=2.0**-14),
        runs=made,
        cells={name: cells_of(name, discs=are_discs(*names)) for name in sorted(names)},
    )  # fmt: skip


def _shares(path: xr.Dataset) -> tuple[int, int]:
    """Return how many runs are shown, and every how manyth sample of them."""
    runs, times, blocks = (path.sizes[name] for name in ("run", "time", "block"))
    # A run keeps 300 of its times before another is left out.
    while runs > 1 and runs * min(times, 300) * blocks > MOST_POSES:
        runs -= 1
    return runs, max(1, -(-runs * times * blocks // MOST_POSES))


def _interval(path: xr.Dataset) -> str:
    time = path["time"].values
    return quantity(float(np.median(np.diff(time))), "s", digits=3) if time.size > 1 else "run"


def _run(path: xr.Dataset, index: int, assembly: xr.Dataset | None, step: float) -> dict[str, Any]:
    x, y, theta, joined = (
        path[name].transpose("block", "time").values for name in ("x", "y", "theta", "assembly")
    )
    # From the path's own numbering: its first run need not be the first of all.
    number_of = int(path["run"]) if "run" in path.coords else index
    events, classes = ([], []) if assembly is None else _changes(assembly, number_of)
    turned = np.angle(np.exp(1j * theta.astype(np.float64)))
    return {
        "name": f"run {number_of}",
        "x": encode_array(x, step=step),
        "y": encode_array(y, step=step),
        "theta": encode_array(turned, step=2.0**-9),
        "assembly": encode_array(joined),
        "events": events,
        "classes": classes,
    }


def _changes(assembly: xr.Dataset, run: int) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Return what joined and parted in a run over time, and the class from each change on."""
    require(assembly, "event_count", "event_time", "event_block", "event_class", "class")
    if run not in assembly["run"].values:
        return [], []
    found = assembly.sel(run=run)
    events = [
        {
            "time": float(found["event_time"].values[event]),
            "blocks": [int(block) for block in found["event_block"].values[event]],
            "class": _class(assembly, int(found["event_class"].values[event])),
        }
        for event in range(int(found["event_count"]))
        # Kinds 2 and 3: what happens to a bond of a loop changes no assembly.
        if "event_kind" not in found or int(found["event_kind"].values[event]) < 2
    ]
    start = {"time": 0.0, "class": all_single(assembly.sizes.get("block", 0))}
    return events, [start, *({key: one[key] for key in ("time", "class")} for one in events)]


def _class(assembly: xr.Dataset, index: int) -> str:
    names = assembly["class"].values
    if not 0 <= index < names.size:
        raise InputError(f"an event of the assembly has class {index}, of {names.size} there are")
    return str(names[index])
