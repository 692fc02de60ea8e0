"""The optimum of a smooth surface through noisy distances, instead of the luckiest cell.

At every point of a fine lattice a quadratic in (C_d, sigma_F) is fitted to the distances of the
cells nearby, weighted by (1 - r^2/4)^3 for r < 2 bandwidths, and its value there is the surface.
The fit is linear in the data: one matrix serves the recording and every bootstrap sample. The
valley of D is narrow and sharp in C_d, so the bandwidth is two refined steps: wider ones shift the
minimum towards the flatter side.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

FINENESS = 4
"""Lattice points per cell of a grid along each axis."""
_RIDGE = 1e-9


class Optimum(NamedTuple):
    """The lowest point of a surface."""

    drag_coefficient: float
    force_std: float
    """[N]"""
    distance: float
    """Value of the smooth surface there (a KS distance)."""


@dataclass(frozen=True, eq=False)
class Smoother:
    """A smooth surface over a grid of settings, as a linear map of the cells' distances.

    Attributes
    ----------
    drag_coefficient, force_std : ndarray
        Axes of the lattice.
    matrix : ndarray, shape (lattice points, cells)
        Weights of the cells in the value at each lattice point.
    """

    drag_coefficient: Floats
    force_std: Floats
    matrix: Floats

    def surface(self, distance: Floats) -> Floats:
        """Return the surface on the lattice, from distances on the grid (..., cells)."""
        values = np.asarray(distance) @ self.matrix.T
        shape = (*values.shape[:-1], self.drag_coefficient.size, self.force_std.size)
        return np.asarray(values.reshape(shape))

    def optimum(self, distance: Floats) -> Optimum:
        """Return the minimum of the surface through distances on the grid, shape (cells,)."""
        surface = self.surface(np.ravel(distance))
        row, column = np.unravel_index(int(np.argmin(surface)), surface.shape)
        return Optimum(
            float(self.drag_coefficient[row]),
            float(self.force_std[column]),
            float(surface[row, column]),
        )


def make_smoother(
    drag_coefficient: Floats, force_std: Floats, *, bandwidth: tuple[float, float]
) -> Smoother:
    """Prepare the surface for a grid.

    Parameters
    ----------
    drag_coefficient, force_std : ndarray
        Axes of the grid, increasing, evenly spaced.
    bandwidth : tuple of float
        Bandwidth of the fit along each axis, in the axis's unit; at least one grid step is used.

    Returns
    -------
    Smoother
        Its lattice spans the grid, `FINENESS` points per cell.

    Examples
    --------
    >>> axis = np.linspace(-1.0, 1.0, 9)
    >>> bowl = (axis[:, None] - 0.3) ** 2 + axis[None, :] ** 2
    >>> make_smoother(axis, axis, bandwidth=(0.5, 0.5)).optimum(bowl).drag_coefficient
    0.3125
    """
    lattice = [_lattice(axis) for axis in (drag_coefficient, force_std)]
    widths = [
        max(width, 1.01 * _spacing(axis))
        for axis, width in zip((drag_coefficient, force_std), bandwidth, strict=True)
    ]
    cell_x, cell_y = (
        grid.ravel() / width
        for grid, width in zip(
            np.meshgrid(drag_coefficient, force_std, indexing="ij"), widths, strict=True
        )
    )
    rows = [_fit_row(x / widths[0], lattice[1] / widths[1], cell_x, cell_y) for x in lattice[0]]
    return Smoother(lattice[0], lattice[1], np.concatenate(rows))


def _fit_row(x: float, y: Floats, cell_x: Floats, cell_y: Floats) -> Floats:
    """Return the weights of the cells at the lattice points (x, y[0]), (x, y[1]), ..."""
    dx = np.broadcast_to(cell_x - x, (y.size, cell_x.size))
    dy = cell_y - y[:, None]
    weight = np.clip(1.0 - (dx**2 + dy**2) / 4.0, 0.0, None) ** 3
    terms = np.stack([np.ones_like(dx), dx, dy, dx**2, dx * dy, dy**2], axis=-1)
    weighted = terms * weight[..., None]
    normal = np.einsum("lca,lcb->lab", weighted, terms)
    # Where a narrow grid cannot tell two terms apart the ridge decides, and the value stays sound.
    normal += _RIDGE * np.eye(6) * weight.sum(axis=1)[:, None, None]
    value = np.zeros((y.size, 6, 1))
    value[:, 0] = 1.0
    solution = np.linalg.solve(normal, value)[..., 0]
    fitted: Floats = np.einsum("la,lca->lc", solution, weighted)
    return fitted


def _spacing(axis: Floats) -> float:
    return float((axis[-1] - axis[0]) / (axis.size - 1)) if axis.size > 1 else 1.0


def _lattice(axis: Floats) -> Floats:
    return np.linspace(axis[0], axis[-1], (axis.size - 1) * FINENESS + 1)
