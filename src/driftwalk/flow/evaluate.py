"""The velocity between the nodes of a flow field."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError
from driftwalk.schema import check_flow_field

if TYPE_CHECKING:
    import xarray as xr

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]


def bilinear(
    flow: xr.Dataset, x: npt.ArrayLike, y: npt.ArrayLike, *, time: float | None = None
) -> tuple[Array, Array]:
    """Return the velocity of the water at given positions.

    Bilinear between the four nodes around a place; beyond the outermost nodes the nearest value on
    their rectangle. In time, linear between frames and constant before the first and after the
    last.

    Parameters
    ----------
    flow : xarray.Dataset
        A `flow_field`.
    x, y : array_like
        Places [m], of shapes that broadcast; finite.
    time : float, optional
        Time [s]; needed for a field with frames, and not used for one without.

    Returns
    -------
    u, v : ndarray
        Velocities [m/s], in the broadcast shape.

    Raises
    ------
    InputError
        When the field has frames and no time is given, or a place is not finite.

    Examples
    --------
    >>> from driftwalk.flow import shear_flow
    >>> u, v = bilinear(shear_flow(0.5), [0.01, 0.0], [0.1, -0.02])
    >>> u.round(12).tolist()
    [0.05, -0.01]
    """
    check_flow_field(flow)
    at_x, at_y = np.broadcast_arrays(
        np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    )
    if not (np.isfinite(at_x).all() and np.isfinite(at_y).all()):
        raise InputError("a point at which the flow is requested is not finite")
    column, right = _bracket(flow["x"].values, at_x)
    row, up = _bracket(flow["y"].values, at_y)
    u, v = (
        (1.0 - up) * ((1.0 - right) * nodes[row, column] + right * nodes[row, column + 1])
        + up * ((1.0 - right) * nodes[row + 1, column] + right * nodes[row + 1, column + 1])
        for nodes in (_frame(flow, "u", time), _frame(flow, "v", time))
    )
    return u, v


def _bracket(nodes: Array, at: Array) -> tuple[Indices, Array]:
    """Return the node to the left of each place and how far on it is, clamped to the nodes."""
    # Uniform spacing, so division instead of a search.
    spacing = (nodes[-1] - nodes[0]) / (nodes.size - 1)
    position = np.clip((at - nodes[0]) / spacing, 0.0, nodes.size - 1)
    left = np.minimum(position.astype(np.intp), nodes.size - 2)
    return left, position - left


def _frame(flow: xr.Dataset, name: str, time: float | None) -> Array:
    """Return a component at a time, shape (ny, nx)."""
    values = np.asarray(flow[name].values, dtype=np.float64)
    if "time" not in flow[name].dims:
        return values
    if time is None:
        raise InputError("this flow field changes in time: give a time")
    frames = flow["time"].values
    if frames.size == 1:
        return np.asarray(values[0])
    at = float(np.clip(time, frames[0], frames[-1]))
    after = int(np.clip(np.searchsorted(frames, at, side="right"), 1, frames.size - 1))
    part = (at - frames[after - 1]) / (frames[after] - frames[after - 1])
    return np.asarray((1.0 - part) * values[after - 1] + part * values[after])
