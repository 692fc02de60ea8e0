"""Means over the cells of a grid, and standard errors from visits, flags and warnings."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from driftwalk.flow.arena import Outline
from driftwalk.flow.grid import Grid
from driftwalk.schema import FLAGS

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]


@dataclass(frozen=True)
class Samples:
    """Smoothed samples of one or more bodies, each in a cell."""

    cell: Indices
    """Flat index of the cell, shape (n,), none negative."""
    body: Indices
    """Number of the body, shape (n,)."""
    time: Array
    """Time [s], shape (n,)."""
    velocity: Array
    """Velocity [m/s], shape (n, 2)."""
    acceleration: Array
    """Acceleration [m/s²], shape (n, 2)."""


@dataclass(frozen=True)
class CellMeans:
    """Results for every cell; rows of NaN where there are too few samples."""

    count: Indices
    """Samples, shape (cells,)."""
    visits: Indices
    """Visits, shape (cells,)."""
    velocity: Array
    """Mean velocity of the body [m/s], shape (cells, 2)."""
    flow: Array
    """Velocity of the water [m/s], shape (cells, 2)."""
    standard_error: Array
    """Standard error of `flow` [m/s], shape (cells, 2), NaN with fewer than two visits."""


def average_cells(
    samples: Samples, *, cells: int, pause: float, correction: Callable[[Array], Array]
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

    weight, velocity, acceleration = _visit_sums(visit, samples, order)
    total = _sum_by(cell_of_visit, weight, cells)
    total_velocity = _sum_by(cell_of_visit, velocity, cells)
    total_acceleration = _sum_by(cell_of_visit, acceleration, cells)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean_velocity = total_velocity / total
        flow = mean_velocity + correction(total_acceleration / total)
        rest = total[cell_of_visit] - weight
        without = (total_velocity[cell_of_visit] - velocity) / rest
        without += correction((total_acceleration[cell_of_visit] - acceleration) / rest)
        visits = np.bincount(cell_of_visit, minlength=cells)
        standard_error = _jackknife(without, cell_of_visit, visits)
    return CellMeans(
        total[:, 0].astype(np.intp), visits.astype(np.intp), mean_velocity, flow, standard_error
    )


def _visit_sums(visit: Indices, samples: Samples, order: Indices) -> tuple[Array, Array, Array]:
    number = int(visit[-1]) + 1 if visit.size else 0
    return (
        _sum_by(visit, np.ones((visit.size, 1)), number),
        _sum_by(visit, samples.velocity[order], number),
        _sum_by(visit, samples.acceleration[order], number),
    )


def _sum_by(group: Indices, values: Array, groups: int) -> Array:
    """Return the sums of the rows of each group, shape (groups, k)."""
    return np.column_stack([np.bincount(group, part, minlength=groups) for part in values.T])


def _jackknife(without: Array, group: Indices, size: Indices) -> Array:
    """Return the jackknife standard error of each group, NaN for groups of fewer than two."""
    lonely = size[group] < 2
    without = np.where(lonely[:, None], 0.0, without)
    mean = _sum_by(group, without, size.size) / size[:, None]
    spread = _sum_by(group, (without - mean[group]) ** 2, size.size)
    error = np.sqrt(spread * ((size - 1) / size)[:, None])
    return np.where((size >= 2)[:, None], error, np.nan)


Mask = npt.NDArray[np.bool_]


def flags_of(grid: Grid, outline: Outline | None, measured: Mask) -> npt.NDArray[np.int8]:
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
    # With fewer measured cells the field is mostly a guess; chosen by hand.
    if share < 0.25:
        sentences.append(
            f"Only {100.0 * share:.0f} % of {cells} are measured, the others are filled "
            "in: record for longer, or use larger cells."
        )
    if beyond > math.ceil(0.01 * used):
        sentences.append(
            f"{beyond} of {used + beyond} samples lie beyond the wall of the tank and were left "
            "out: check the scale, the origin and the arena."
        )
    return sentences
