"""Fill empty cells by a smooth interpolation of the measured ones that respects the wall."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError
from driftwalk.flow.arena import Outline
from driftwalk.flow.grid import Grid

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.intp]

_MAX_ITERATIONS = 20_000
"""Ten times what an 800 x 800 grid with one known cell in 2000 needs."""


def fill_velocity(
    grid: Grid, velocity: npt.ArrayLike, *, known: npt.ArrayLike, outline: Outline | None = None
) -> Array:
    """Fill the nodes of a velocity field that are not known.

    Inside the tank both components solve Laplace's equation on the grid, held at the known nodes.
    At the wall the normal component is zero and the tangential one is free to slip. The matrix is
    that of the energy ``sum |u_i - u_j|² + sum (u_i · n)² / d`` over neighbouring nodes and over
    the links that the wall cuts at a distance of d cells, so no filled speed exceeds the largest
    known one. Nodes outside the tank continue the field in the same way without a wall, and keep
    the component along the nearest wall only: a bilinear lookup near the wall finds no flow into
    it.

    Parameters
    ----------
    grid : Grid
        The nodes.
    velocity : array_like, shape (ny, nx, 2)
        Velocities [m/s]; only those at known nodes are read.
    known : array_like of bool, shape (ny, nx)
        Which nodes hold data. They are returned as they are, even where they lie beyond the wall.
    outline : Outline, optional
        The tank; without one there is no wall and every node is inside.

    Returns
    -------
    ndarray, shape (ny, nx, 2)
        Velocities [m/s], finite at every node.

    Raises
    ------
    InputError
        When no node is known.

    Examples
    --------
    >>> import numpy as np
    >>> line = Grid(np.arange(3.0), np.arange(2.0), 1.0)
    >>> u = np.array([[[0.0, 0.0], [9.0, 9.0], [2.0, 0.0]]] * 2)
    >>> fill_velocity(line, u, known=[[True, False, True]] * 2)[0, :, 0].round(9).tolist()
    [0.0, 1.0, 2.0]
    """
    held = np.asarray(known, dtype=bool)
    field = np.where(held[..., None], np.asarray(velocity, dtype=np.float64), 0.0)
    if not held.any():
        raise InputError("the flow field has no known node to fill from")
    if outline is None:
        return _continue(field, held, np.ones_like(held), grid, None)
    x, y = (part.ravel() for part in grid.nodes())
    inside = held | (outline.depth(x, y) >= 0.0).reshape(grid.shape)
    field = _continue(field, held, inside, grid, outline)
    field = _continue(field, inside, np.ones_like(held), grid, None)
    outside = ~inside.ravel()
    normal = outline.normal(x[outside], y[outside])
    flat = field.reshape(-1, 2)
    flat[outside] -= np.sum(flat[outside] * normal, axis=1, keepdims=True) * normal
    return flat.reshape(*grid.shape, 2)


def _continue(field: Array, known: Mask, domain: Mask, grid: Grid, wall: Outline | None) -> Array:
    """Return the field with the unknown nodes of the domain solved for."""
    unknown = np.flatnonzero(domain & ~known)
    if unknown.size == 0:
        return field
    number = np.full(domain.size, -1)
    number[unknown] = np.arange(unknown.size)
    pairs, blocks = [], np.zeros((unknown.size, 2, 2))
    right = np.zeros((unknown.size, 2))
    for step in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        neighbour = _neighbour(unknown, step, grid.shape)
        linked = (neighbour >= 0) & domain.ravel()[neighbour]
        blocks[linked] += np.eye(2)
        held = linked & known.ravel()[neighbour]
        right[held] += field.reshape(-1, 2)[neighbour[held]]
        free = linked & ~held
        pairs.append(np.column_stack([np.flatnonzero(free), number[neighbour[free]]]))
        if wall is not None:
            cut = np.flatnonzero(~linked)
            blocks[cut] += _wall_blocks(unknown[cut], step, grid, wall)
    solution = _solve(np.concatenate(pairs), blocks, right)
    filled = field.reshape(-1, 2).copy()
    filled[unknown] = solution
    return filled.reshape(field.shape)


def _neighbour(node: Indices, step: tuple[int, int], shape: tuple[int, int]) -> Indices:
    """Return the flat index of each node's neighbour, -1 off the grid."""
    row, column = np.divmod(node, shape[1])
    row, column = row + step[0], column + step[1]
    inside = (row >= 0) & (row < shape[0]) & (column >= 0) & (column < shape[1])
    return np.where(inside, row * shape[1] + column, -1)


def _wall_blocks(node: Indices, step: tuple[int, int], grid: Grid, wall: Outline) -> Array:
    """Return n nᵀ / d of the links that the wall cuts, shape (k, 2, 2)."""
    row, column = np.divmod(node, grid.shape[1])
    dy = np.full(node.size, step[0] * (grid.y[1] - grid.y[0]))
    dx = np.full(node.size, step[1] * (grid.x[1] - grid.x[0]))
    part, normal = wall.leave(grid.x[column], grid.y[row], dx, dy)
    # A node on the wall stays finite.
    weight = 1.0 / np.maximum(part, 1e-3)
    return np.asarray(weight[:, None, None] * normal[:, :, None] * normal[:, None, :])


def _solve(pairs: npt.NDArray[np.intp], blocks: Array, right: Array) -> Array:
    """Solve for both components at every unknown node, coupled where the wall is oblique."""
    from scipy.sparse import csr_matrix, diags
    from scipy.sparse.linalg import cg

    size = len(blocks)
    rows, columns, values = [], [], []
    for i in range(2):
        rows.append(2 * pairs[:, 0] + i)
        columns.append(2 * pairs[:, 1] + i)
        values.append(np.full(len(pairs), -1.0))
        for j in range(2):
            rows.append(2 * np.arange(size) + i)
            columns.append(2 * np.arange(size) + j)
            values.append(blocks[:, i, j])
    entries: Any = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    matrix = csr_matrix(entries, shape=(2 * size, 2 * size))
    # Symmetric and positive definite: conjugate gradients need no fill-in and never fail to pivot.
    solution, unfinished = cg(
        matrix,
        right.ravel(),
        rtol=1e-10,
        maxiter=_MAX_ITERATIONS,
        M=diags(1.0 / matrix.diagonal()),
    )
    if unfinished:
        raise InputError(
            f"the empty cells could not be filled in {_MAX_ITERATIONS} iterations: the grid is too "
            "fine for the recording; use fewer cells (`cells`)"
        )
    return np.asarray(solution).reshape(size, 2)
