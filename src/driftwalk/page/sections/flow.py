"""The part of a page on the flow: velocities at the nodes, with measured and filled ones marked."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.core.units import percent
from driftwalk.page.arrays import encode_array, plain_list
from driftwalk.page.parts import Section, arena_part, attempt, quantity, require, section
from driftwalk.schema import FLAGS

if TYPE_CHECKING:
    import xarray as xr

KINDS: Final = {"measured": 0, "filled": 1, "outside": 2}
"""How a page calls the origin of a node's value."""
MOST_FRAMES: Final = 8
"""Frames of a flow that a page shows, each a map of its own; chosen by eye."""


def flow_sections(flow: xr.Dataset) -> list[Section]:
    """Return the sections on a flow: one, or one for each flow or frame, at most 8.

    Parameters
    ----------
    flow : xarray.Dataset
        A `flow_field`, or the `fit` that it comes from.
    """
    dimension = next((name for name in ("flow", "time") if name in flow.dims), None)
    if dimension is None:
        return attempt("flow", "The flow", lambda: flow_section(flow))
    made: list[Section] = []
    frames = flow.sizes[dimension]
    for index in range(min(frames, MOST_FRAMES)):
        part = flow.isel({dimension: index})
        where = str(flow[dimension].values[index]) if dimension in flow.coords else str(index + 1)
        title = f"The flow {where}" if dimension == "flow" else f"The flow at {where} s"
        id = f"flow-{index + 1}"
        made += attempt(id, title, partial(flow_section, part, id=id, title=title))
    if frames > MOST_FRAMES:
        made[-1]["note"] = f"{made[-1]['note'] or ''} {frames - MOST_FRAMES} more are in the file."
    return made


def flow_section(flow: xr.Dataset, *, id: str = "flow", title: str = "The flow") -> Section:
    """Return the section on one flow field that does not change in time.

    Parameters
    ----------
    flow : xarray.Dataset
        A `flow_field`, or a `fit` with one flow.
    id, title : str
        Name of the section in its page, and its heading.

    Returns
    -------
    dict
        A section of kind "flow". `standard_error` is the root mean square over both components,
        NaN where the flow was not measured.

    Raises
    ------
    InputError
        When it has no velocities on (y, x).

    Examples
    --------
    >>> from driftwalk.schema import build_flow_field
    >>> still = build_flow_field([0, 1], [0, 1], u=[[0, 0]] * 2, v=[[0, 0]] * 2, flag=[[1, 2]] * 2)
    >>> flow_section(still)["kind"]
    'flow'
    """
    require(flow, "u", "v", "x", "y")
    if flow["u"].dims != ("y", "x"):
        raise InputError(f"the flow has the dimensions {', '.join(map(str, flow['u'].dims))}")
    kind = _kind(flow)
    errors = [f"{name}_standard_error" for name in "uv"]
    error = None
    if all(name in flow for name in errors):
        both = np.sqrt(sum(flow[name].values ** 2 for name in errors) / 2.0)
        error = encode_array(np.where(kind == KINDS["measured"], both, np.nan))
    return section(
        id, "flow", title, _note(flow, kind),
        arena=arena_part(flow),
        x=plain_list(flow["x"].values),
        y=plain_list(flow["y"].values),
        u=encode_array(flow["u"].values),
        v=encode_array(flow["v"].values),
        # In a file as in a page, "kind" of a section is its own: this one is of the nodes.
        origin=encode_array(kind),
        count=encode_array(flow["count"].values) if "count" in flow else None,
        standard_error=error,
    )  # fmt: skip


def _kind(flow: xr.Dataset) -> Any:
    if "flag" not in flow:
        return np.full(flow["u"].shape, KINDS["measured"])
    kind = np.full(flow["u"].shape, KINDS["outside"])
    for word, flag in FLAGS.items():
        kind[flow["flag"].values == flag] = KINDS[word]
    return kind


def _note(flow: xr.Dataset, kind: Any) -> str:
    inside = kind != KINDS["outside"]
    speed = np.hypot(flow["u"].values, flow["v"].values)[inside]
    if not speed.size:
        return "No node lies in the tank."
    measured = float((kind[inside] == KINDS["measured"]).mean())
    words = f"{percent(measured)} of the nodes in the tank are measured, the others filled."
    if "flag" not in flow:
        words = "The field does not say which nodes were measured."
    fastest = quantity(float(speed.max()), "m/s", digits=3)
    average = quantity(float(speed.mean()), "m/s", digits=3)
    method = flow.attrs.get("method")
    return f"{words} Speed up to {fastest}, {average} on average." + (
        f" Method: {method}." if method else ""
    )
