"""Sort rows x, y, u, v onto a regular grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import FormatError
from driftwalk.flow.grid import round_nodes

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]


@dataclass(frozen=True)
class FieldRows:
    """A velocity field as a table, a row per node."""

    line: Indices
    """Line of the file, from 1, shape (n,)."""
    x: Array
    """Position x, shape (n,)."""
    y: Array
    """Position y, shape (n,)."""
    u: Array
    """Velocity along x, shape (n,)."""
    v: Array
    """Velocity along y, shape (n,)."""


@dataclass(frozen=True)
class GriddedField:
    """A velocity field on a regular grid."""

    x: Array
    """Nodes along x, shape (nx,)."""
    y: Array
    """Nodes along y, shape (ny,)."""
    velocity: Array
    """Velocities, shape (ny, nx, 2)."""


def grid_rows(rows: FieldRows) -> GriddedField:
    """Put the rows of a file on their grid.

    Raises
    ------
    FormatError
        When a node stands in two rows, is missing, or the nodes are not evenly spaced.
    """
    x, column = _axis("x", rows.x, rows.line)
    y, row = _axis("y", rows.y, rows.line)
    node = row * x.size + column
    _refuse_duplicates(node, rows)
    order = np.argsort(node)
    # No list of all nodes: scattered rows may span a grid of a billion of them.
    absent = x.size * y.size - node.size
    if absent:
        moved = np.flatnonzero(node[order] != np.arange(node.size))
        j, i = divmod(int(moved[0]) if moved.size else node.size, x.size)
        raise FormatError(
            f"the grid of {x.size} x {y.size} nodes lacks {absent} of them, the first at "
            f"x = {x[i]:.6g}, y = {y[j]:.6g}: write a row for every node"
        )
    velocity = np.column_stack([rows.u, rows.v])[order].reshape(y.size, x.size, 2)
    return GriddedField(x, y, velocity)


def _axis(name: str, values: Array, line: Indices) -> tuple[Array, Indices]:
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


def _refuse_duplicates(node: Indices, rows: FieldRows) -> None:
    order = np.argsort(node, kind="stable")
    again = np.flatnonzero(np.diff(node[order]) == 0)
    if again.size:
        first, second = order[again[0]], order[again[0] + 1]
        raise FormatError(
            f"the node x = {rows.x[second]:.6g}, y = {rows.y[second]:.6g} stands in line "
            f"{rows.line[first]} already",
            line=int(rows.line[second]),
        )
