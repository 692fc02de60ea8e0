"""The regular grid over a tank: square cells, nodes at their centres."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError
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
