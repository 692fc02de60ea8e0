"""Means over the cells of a grid with their errors, and values for the empty cells.

Empty cells are filled by a smooth interpolation of the measured ones that respects the wall.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Bools, Floats, Indices
from driftwalk.core.errors import InputError
from driftwalk.flow.arena import Outline
from driftwalk.flow.grid import Grid
from driftwalk.schema import FLAGS, build_flow_field

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Samples:
    """Smoothed samples of one or more bodies, each in a cell."""

    cell: Indices
    """Flat index of the cell, shape (n,), none negative."""
    body: Indices
    """Number of the body, shape (n,)."""
    time: Floats
    """Time [s], shape (n,)."""
    velocity: Floats
    """Velocity [m/s], shape (n, 2)."""
    acceleration: Floats
    """Acceleration [m/s²], shape (n, 2)."""

    def select(self, chosen: Bools) -> Samples:
        """Return some of the samples."""
        return Samples(*(column[chosen] for column in vars(self).values()))


@dataclass(frozen=True)
class CellMeans:
    """Results for every cell; rows of NaN where there are too few samples."""

    count: Indices
    """Samples, shape (cells,)."""
    visits: Indices
    """Visits, shape (cells,)."""
    velocity: Floats
    """Mean velocity of the body [m/s], shape (cells, 2)."""
    flow: Floats
    """Velocity of the water [m/s], shape (cells, 2)."""
    standard_error: Floats
    """Standard error of `flow` [m/s], shape (cells, 2), NaN with fewer than two visits."""


def average_cells(
    samples: Samples, *, cells: int, pause: float, correction: Callable[[Floats], Floats]
) -> CellMeans:
    """Average the samples of every cell and carry the means over to the water.

    The water's velocity of a cell is its mean velocity plus ``correction(mean acceleration)``.
    Neighbouring samples share most of their smoothing window and are no independent observations,
    so the standard error comes from a jackknife over visits: leave out one visit at a time,
    compute the water's velocity from the rest, and take the spread. A visit is all samples of one
    body in one cell that follow each other within `pause`.

    Parameters
    ----------
    samples : Samples
        The samples, in any order.
    cells : int
        Number of cells.
    pause : float
        Absence from the cell [s] after which a return counts as a new visit: the smoothing window,
        beyond which two samples share no raw point.
    correction : callable
        From accelerations, shape (n, 2), to velocities, shape (n, 2).
    """
    order = np.lexsort((samples.time, samples.body, samples.cell))
    cell, body, time = samples.cell[order], samples.body[order], samples.time[order]
    arrives = np.ones(cell.size, dtype=bool)
    arrives[1:] = (np.diff(cell) != 0) | (np.diff(body) != 0) | (np.diff(time) > pause)
    visit = np.cumsum(arrives) - 1
    cell_of_visit = cell[arrives]
    rows = np.column_stack([np.ones(cell.size), samples.velocity, samples.acceleration])[order]
    own = _sum_by(visit, rows, cell_of_visit.size)
    total = _sum_by(cell_of_visit, own, cells)

    def water(sums: Floats) -> Floats:
        """Return the velocity of the water from count, velocities and accelerations."""
        return sums[:, 1:3] / sums[:, :1] + correction(sums[:, 3:] / sums[:, :1])

    with np.errstate(invalid="ignore", divide="ignore"):
        velocity, flow = total[:, 1:3] / total[:, :1], water(total)
        visits = np.bincount(cell_of_visit, minlength=cells).astype(np.intp)
        error = _jackknife(water(total[cell_of_visit] - own), cell_of_visit, visits)
    return CellMeans(total[:, 0].astype(np.intp), visits, velocity, flow, error)


def _sum_by(group: Indices, values: Floats, groups: int) -> Floats:
    """Return the sums of the rows of each group, shape (groups, k)."""
    return np.column_stack([np.bincount(group, part, minlength=groups) for part in values.T])


def _jackknife(without: Floats, group: Indices, size: Indices) -> Floats:
    """Return the jackknife standard error of each group, NaN for groups of fewer than two."""
    without = np.where((size[group] < 2)[:, None], 0.0, without)
    mean = _sum_by(group, without, size.size) / size[:, None]
    spread = _sum_by(group, (without - mean[group]) ** 2, size.size)
    error = np.sqrt(spread * ((size - 1) / size)[:, None])
    return np.where((size >= 2)[:, None], error, np.nan)


def flags_of(grid: Grid, outline: Outline | None, measured: Bools) -> npt.NDArray[np.int8]:
    """Return the flag of every cell.

    Parameters
    ----------
    grid : Grid
        The cells.
    outline : Outline or None
        The tank. A cell that its wall cuts belongs to it when its centre does or when it is
        measured; without a tank every cell does.
    measured : ndarray of bool, shape (ny, nx)
        Which cells have data.
    """
    in_tank = np.ones(grid.shape, dtype=bool)
    if outline is not None:
        x, y = (part.ravel() for part in grid.nodes())
        in_tank = measured | (outline.depth(x, y) >= 0.0).reshape(grid.shape)
    flag = np.where(in_tank, FLAGS["filled"], FLAGS["outside"])
    flag[measured] = FLAGS["measured"]
    return flag.astype(np.int8)


def measured_share(flag: npt.NDArray[np.int8]) -> float:
    """Return the share of measured cells among those of the tank."""
    in_tank = np.count_nonzero(flag != FLAGS["outside"])
    return float(np.count_nonzero(flag == FLAGS["measured"]) / in_tank)


class CoveragePolicy(NamedTuple):
    """When a measured field covers too little of the tank."""

    least_share: float = 0.25
    """Share of measured cells below which the field is mostly a guess; chosen by hand."""
    most_beyond: float = 0.01
    """Samples beyond the wall, in those within, above which scale or arena are in doubt; chosen by
    hand."""


COVERAGE: Final = CoveragePolicy()


def coverage_warnings(
    share: float, *, used: int, beyond: int, cells: str = "the tank's cells"
) -> list[str]:
    """Return what the user of a field has to know of its coverage, in sentences.

    Parameters
    ----------
    share : float
        Share of the cells that are measured.
    used, beyond : int
        Samples in the tank, and beyond its wall.
    cells : str, optional
        What the share is of.

    Examples
    --------
    >>> coverage_warnings(0.9, used=100, beyond=0)
    []
    """
    sentences = []
    if share < COVERAGE.least_share:
        sentences.append(
            f"Only {100.0 * share:.0f} % of {cells} are measured, the others are filled "
            "in: record for longer, or use larger cells."
        )
    if beyond > math.ceil(COVERAGE.most_beyond * used):
        sentences.append(
            f"{beyond} of {used + beyond} samples lie beyond the wall of the tank and were left "
            "out: check the scale, the origin and the arena."
        )
    return sentences


def field_of_cells(
    grid: Grid,
    outline: Outline | None,
    means: CellMeans,
    measured: Bools,
    settings: Mapping[str, Any],
    *,
    doubts: Sequence[str] = (),
    **more: npt.ArrayLike,
) -> xr.Dataset:
    """Return the flow field of the means over cells, with the empty ones filled.

    Parameters
    ----------
    grid, outline, means : Grid, Outline or None, CellMeans
        The cells, the tank, and the means.
    measured : ndarray of bool, shape (ny, nx)
        Which cells have data.
    settings : mapping
        Attributes, with ``samples_used`` and ``samples_outside_tank``.
    doubts : sequence of str
        Sentences for the warning, besides those on the coverage.
    **more : array-like, shape (ny, nx)
        Further variables.
    """
    flag = flags_of(grid, outline, measured)
    share = measured_share(flag)
    used, beyond = settings["samples_used"], settings["samples_outside_tank"]
    cells = "the cells" if outline is None else "the tank's cells"
    warning = " ".join([*coverage_warnings(share, used=used, beyond=beyond, cells=cells), *doubts])
    flow = fill_velocity(grid, means.flow.reshape(*grid.shape, 2), known=measured, outline=outline)
    error = np.where(measured[..., None], means.standard_error.reshape(*grid.shape, 2), np.nan)
    return build_flow_field(
        grid.x,
        grid.y,
        u=flow[..., 0],
        v=flow[..., 1],
        flag=flag,
        attrs={
            **settings,
            "measured_share": share,
            "filled_share": 1.0 - share,
            **({"warning": warning} if warning else {}),
        },
        **more,
        u_standard_error=error[..., 0],
        v_standard_error=error[..., 1],
    )


_MAX_ITERATIONS = 20_000
"""Measured: ten times what an 800 x 800 grid with one known cell in 2000 needs."""


def fill_velocity(
    grid: Grid, velocity: npt.ArrayLike, *, known: npt.ArrayLike, outline: Outline | None = None
) -> Floats:
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


def _continue(
    field: Floats, known: Bools, domain: Bools, grid: Grid, wall: Outline | None
) -> Floats:
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


def _wall_blocks(node: Indices, step: tuple[int, int], grid: Grid, wall: Outline) -> Floats:
    """Return n nᵀ / d of the links that the wall cuts, shape (k, 2, 2)."""
    row, column = np.divmod(node, grid.shape[1])
    dy = np.full(node.size, step[0] * (grid.y[1] - grid.y[0]))
    dx = np.full(node.size, step[1] * (grid.x[1] - grid.x[0]))
    part, normal = wall.leave(grid.x[column], grid.y[row], dx, dy)
    # A node on the wall stays finite.
    weight = 1.0 / np.maximum(part, 1e-3)
    return np.asarray(weight[:, None, None] * normal[:, :, None] * normal[:, None, :])


def _solve(pairs: npt.NDArray[np.intp], blocks: Floats, right: Floats) -> Floats:
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
