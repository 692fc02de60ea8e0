"""The regular grid over a tank: square cells, nodes at their centres, values between them.

Rows x, y, u, v are sorted onto it, and the flow of a round tank is stretched to a larger one that
is stirred alike.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats, Indices
from driftwalk.core.errors import FormatError, InputError
from driftwalk.flow.arena import Outline
from driftwalk.schema import check_flow_field

if TYPE_CHECKING:
    import xarray as xr


MAX_CELLS = 2000
"""Cells along an axis; four million cells are more than any recording can fill; chosen by hand."""


@dataclass(frozen=True)
class Grid:
    """Square cells of side `cell_size`; node (j, i) is the centre of cell (row j, column i)."""

    x: Floats
    """Node positions along x [m], shape (nx,)."""
    y: Floats
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

    def nodes(self) -> tuple[Floats, Floats]:
        """Return the positions of all nodes [m], each of shape (ny, nx)."""
        x, y = np.meshgrid(self.x, self.y)
        return x, y

    def cell_of(self, x: Floats, y: Floats) -> Indices:
        """Return the flat index of each point's cell, -1 off the grid.

        A cell holds its lower and left edges; the topmost and rightmost edges belong to the last
        cells, so that every point of the bounding box has a cell.
        """
        (column, inside_x), (row, inside_y) = (self._along(x, self.x), self._along(y, self.y))
        return np.where(inside_x & inside_y, row * self.x.size + column, -1)

    def _along(self, position: Floats, nodes: Floats) -> tuple[Indices, npt.NDArray[np.bool_]]:
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


def _centres(low: float, high: float, size: float) -> Floats:
    # 1e-9: a side that is a whole number of cells does not get one more from rounding.
    count = max(2, math.ceil((high - low) / size - 1e-9))
    middle = (low + high) / 2.0
    steps = np.arange(count, dtype=np.float64) - (count - 1) / 2.0
    return round_nodes(middle + steps * size)


def round_nodes(nodes: Floats) -> Floats:
    """Return nodes without the last digits, which depend on how they were computed.

    xarray lines up two fields by comparing their nodes exactly, and -0.147 is to be -0.147 whether
    it was computed or read from a file.
    """
    decimals = 12 - math.floor(math.log10(nodes[-1] - nodes[0]))
    return np.asarray(np.round(nodes, decimals))


def bilinear(
    flow: xr.Dataset, x: npt.ArrayLike, y: npt.ArrayLike, *, time: float | None = None
) -> tuple[Floats, Floats]:
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
    at_x, at_y = positions(x, y)
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


def positions(x: npt.ArrayLike, y: npt.ArrayLike) -> tuple[Floats, Floats]:
    """Return coordinates as arrays of one shape."""
    at_x, at_y = np.broadcast_arrays(*(np.asarray(one, dtype=np.float64) for one in (x, y)))
    return at_x, at_y


def _bracket(nodes: Floats, at: Floats) -> tuple[Indices, Floats]:
    """Return the node to the left of each place and how far on it is, clamped to the nodes."""
    # Uniform spacing, so division instead of a search.
    spacing = (nodes[-1] - nodes[0]) / (nodes.size - 1)
    position = np.clip((at - nodes[0]) / spacing, 0.0, nodes.size - 1)
    left = np.minimum(position.astype(np.intp), nodes.size - 2)
    return left, position - left


def _frame(flow: xr.Dataset, name: str, time: float | None) -> Floats:
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


def stretch_flow(field: xr.Dataset, *, diameter: float) -> xr.Dataset:
    """Return the flow of a round tank stretched to a tank of another diameter.

    The water has the same velocity at the same share of the radius. That is an assumption: no
    recording of one tank tells how the water moves in another.

    Parameters
    ----------
    field : xarray.Dataset
        A `flow_field` that knows its tank, a circle.
    diameter : float
        Of the other tank [m].

    Returns
    -------
    xarray.Dataset
        A `flow_field`; ``attrs["stretched_by"]`` is the ratio of the diameters.

    Raises
    ------
    InputError
        When the field knows no tank, or a tank of another shape, or the diameter is not above 0.

    Examples
    --------
    >>> import driftwalk as dw
    >>> wide = dw.flow.stretch_flow(dw.tank30_flow(), diameter=3.0)
    >>> wide.attrs["stretched_by"], round(float(wide["x"].max()), 2)
    (10.0, 1.47)
    """
    arena = json.loads(field.attrs.get("arena", "{}"))
    if arena.get("shape") != "circle":
        raise InputError(
            "a flow is stretched from one round tank to another, and this field's is not"
        )
    if not diameter > 0.0:
        raise InputError(f"diameter must be above 0 m, got {diameter}")
    ratio = diameter / float(arena["diameter_m"])
    center = [ratio * float(place) for place in arena.get("center_m", (0.0, 0.0))]
    attrs = {
        **field.attrs,
        "arena": json.dumps({**arena, "diameter_m": diameter, "center_m": center}),
        "stretched_by": ratio * float(field.attrs.get("stretched_by", 1.0)),
    }
    if "cell_size_m" in attrs:
        attrs["cell_size_m"] = ratio * float(attrs["cell_size_m"])
    axes = {axis: (axis, ratio * field[axis].values, field[axis].attrs) for axis in ("x", "y")}
    return field.assign_coords(axes).assign_attrs(attrs)


@dataclass(frozen=True)
class FieldRows:
    """A velocity field as a table, a row per node."""

    line: Indices
    """Line of the file, from 1, shape (n,)."""
    x: Floats
    """Position x, shape (n,)."""
    y: Floats
    """Position y, shape (n,)."""
    u: Floats
    """Velocity along x, shape (n,)."""
    v: Floats
    """Velocity along y, shape (n,)."""


def grid_rows(rows: FieldRows) -> tuple[Floats, Floats, Floats]:
    """Return the nodes along x and along y, and the velocities at them, shape (ny, nx, 2).

    Raises
    ------
    FormatError
        When a node stands in two rows, is missing, or the nodes are not evenly spaced.
    """
    x, column = _axis("x", rows.x, rows.line)
    y, row = _axis("y", rows.y, rows.line)
    node = row * x.size + column
    order = np.argsort(node, kind="stable")
    again = np.flatnonzero(np.diff(node[order]) == 0)
    if again.size:
        first, second = order[again[0]], order[again[0] + 1]
        raise FormatError(
            f"the node x = {rows.x[second]:.6g}, y = {rows.y[second]:.6g} stands in line "
            f"{rows.line[first]} already",
            line=int(rows.line[second]),
        )
    # No list of all nodes: scattered rows may span a grid of a billion of them.
    if absent := x.size * y.size - node.size:
        moved = np.flatnonzero(node[order] != np.arange(node.size))
        j, i = divmod(int(moved[0]) if moved.size else node.size, x.size)
        raise FormatError(
            f"the grid of {x.size} x {y.size} nodes lacks {absent} of them, the first at "
            f"x = {x[i]:.6g}, y = {y[j]:.6g}: write a row for every node"
        )
    return x, y, np.column_stack([rows.u, rows.v])[order].reshape(y.size, x.size, 2)


def _axis(name: str, values: Floats, line: Indices) -> tuple[Floats, Indices]:
    """Return the nodes along an axis and the number of each row's node."""
    order = np.argsort(values, kind="stable")
    width = float(np.ptp(values))
    if width == 0.0:
        raise FormatError(f"all rows have the same {name}: a grid needs 2 at least")
    is_new = np.concatenate([[False], np.diff(values[order]) > 1e-6 * width])
    number = np.empty(values.size, dtype=np.intp)
    number[order] = np.cumsum(is_new)
    count = np.bincount(number)
    nodes = np.bincount(number, weights=values) / count
    even = np.linspace(nodes[0], nodes[-1], nodes.size)
    # Positions are printed with few digits.
    if abs(nodes - even).max() > 0.02 * (even[1] - even[0]):
        # Most likely one row has a wrong position, which makes a separate line of nodes.
        rarest = int(count.argmin())
        at = int(np.flatnonzero(number == rarest)[0])
        raise FormatError(
            f"the nodes along {name} are not evenly spaced; {name} = {values[at]:.6g} stands in "
            f"{count[rarest]} of {values.size} rows",
            line=int(line[at]),
        )
    return round_nodes(even), number
