"""The regular grid over a tank: square cells, nodes at their centres, values between them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError
from driftwalk.schema import check_flow_field

if TYPE_CHECKING:
    import xarray as xr
import math
from dataclasses import dataclass

from driftwalk.flow.arena import Outline

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]

MAX_CELLS = 2000
"""Cells along an axis; four million cells are more than any recording can fill."""


@dataclass(frozen=True)
class Grid:
    """Square cells of side `cell_size`; node (j, i) is the centre of cell (row j, column i)."""

    x: Array
    """Node positions along x [m], shape (nx,)."""
    y: Array
    """Node positions along y [m], shape (ny,)."""
    cell_size: float
    """Side of a cell [m]."""

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns (ny, nx)."""
        return self.y.size, self.x.size

    @property
    def size(self) -> int:
        """Number of cells."""
        return self.y.size * self.x.size

    def nodes(self) -> tuple[Array, Array]:
        """Return the positions of all nodes [m], each of shape (ny, nx)."""
        x, y = np.meshgrid(self.x, self.y)
        return x, y

    def cell_of(self, x: Array, y: Array) -> Indices:
        """Return the flat index of each point's cell, -1 off the grid.

        A cell holds its lower and left edges; the topmost and rightmost edges belong to the last
        cells, so that every point of the bounding box has a cell.
        """
        (column, inside_x), (row, inside_y) = (self._along(x, self.x), self._along(y, self.y))
        return np.where(inside_x & inside_y, row * self.x.size + column, -1)

    def _along(self, position: Array, nodes: Array) -> tuple[Indices, npt.NDArray[np.bool_]]:
        cells = (position - nodes[0]) / self.cell_size + 0.5
        # An edge that rounding has moved by a hair still belongs to the grid.
        inside = (cells >= -1e-9) & (cells <= nodes.size + 1e-9)
        index = np.clip(np.floor(np.where(inside, cells, 0.0)), 0, nodes.size - 1)
        return index.astype(np.intp), inside


def make_grid(outline: Outline, *, cells: int = 50, cell_size: float | None = None) -> Grid:
    """Lay square cells over the bounding box of a tank.

    Parameters
    ----------
    outline : Outline
        The tank.
    cells : int, optional
        Cells across the longer side of the bounding box; the shorter side gets as many of the same
        size as it needs, centred.
    cell_size : float, optional
        Side of a cell [m], in place of `cells`; the cells are centred on the bounding box.

    Returns
    -------
    Grid
        At least two cells along each axis.

    Raises
    ------
    InputError
        When there would be fewer than 2 or more than `MAX_CELLS` cells across the longer side.

    Examples
    --------
    >>> from driftwalk.flow.arena import outline_of
    >>> make_grid(outline_of({"shape": "circle", "diameter_m": 0.3})).cell_size
    0.006
    """
    x_min, y_min, x_max, y_max = outline.bounds
    longer = max(x_max - x_min, y_max - y_min)
    if cell_size is None:
        if not 2 <= cells <= MAX_CELLS:
            raise InputError(f"`cells` must be from 2 to {MAX_CELLS}, got {cells}")
        size = longer / cells
    else:
        if not (math.isfinite(cell_size) and longer / MAX_CELLS <= cell_size <= longer / 2.0):
            raise InputError(
                f"`cell_size` must be from {longer / MAX_CELLS:g} to {longer / 2.0:g} m in a tank "
                f"of {longer:g} m, got {cell_size}"
            )
        size = cell_size
    return Grid(_centres(x_min, x_max, size), _centres(y_min, y_max, size), size)


def _centres(low: float, high: float, size: float) -> Array:
    # 1e-9: a side that is a whole number of cells does not get one more from rounding.
    count = max(2, math.ceil((high - low) / size - 1e-9))
    middle = (low + high) / 2.0
    steps = np.arange(count, dtype=np.float64) - (count - 1) / 2.0
    return round_nodes(middle + steps * size)


def round_nodes(nodes: Array) -> Array:
    """Return nodes without the last digits, which depend on how they were computed.

    xarray lines up two fields by comparing their nodes exactly, and -0.147 is to be -0.147 whether
    it was computed or read from a file.
    """
    decimals = 12 - math.floor(math.log10(nodes[-1] - nodes[0]))
    return np.asarray(np.round(nodes, decimals))


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
