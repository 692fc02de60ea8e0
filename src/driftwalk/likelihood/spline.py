"""The water's velocity as a smooth surface: bicubic B-splines on an even grid of knots.

Coefficient (j, i) multiplies ``B((x - origin_x) / spacing - i) B((y - origin_y) / spacing - j)``
with the cubic B-spline B on [-3, 1]: at x the four columns from the cell of x on matter. The same
numbering is the native filter's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from driftwalk.core.arrays import Floats

if TYPE_CHECKING:
    from driftwalk.flow.arena import Outline


DEGREE = 3
"""Cubic: the flow's second derivatives, of which the roughness is made, are continuous."""


@dataclass(frozen=True)
class Spline:
    """Where the knots are."""

    origin_x: float
    """Left edge of the first cell of knots [m]."""
    origin_y: float
    """Lower edge of the first cell of knots [m]."""
    spacing: float
    """Side of a cell of knots [m]."""
    columns: int
    """Coefficients along x."""
    rows: int
    """Coefficients along y."""

    @property
    def size(self) -> int:
        """Coefficients of one velocity component."""
        return self.rows * self.columns

    def design(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Return the bases at the nodes of a grid: (x.size, columns) and (y.size, rows)."""
        return (
            basis_matrix((x - self.origin_x) / self.spacing, self.columns),
            basis_matrix((y - self.origin_y) / self.spacing, self.rows),
        )

    def values(self, coefficients: Floats, x: Floats, y: Floats) -> Floats:
        """Return the velocity [m/s] at the nodes of a grid, shape (2, y.size, x.size)."""
        along_x, along_y = self.design(x, y)
        return np.asarray(along_y @ coefficients @ along_x.T)

    def standard_errors(self, covariance: Floats, x: Floats, y: Floats) -> Floats:
        """Return the standard errors [m/s] at the nodes of a grid, shape (2, y.size, x.size)."""
        along_x, along_y = self.design(x, y)
        errors = np.empty((2, y.size, x.size))
        for component in range(2):
            part = slice(component * self.size, (component + 1) * self.size)
            block = covariance[part, part].reshape(self.rows, self.columns, self.rows, self.columns)
            # One axis after the other: the bases are products.
            over_x = np.einsum("xi,jikl,xl->xjk", along_x, block, along_x, optimize=True)
            variance = np.einsum("yj,xjk,yk->yx", along_y, over_x, along_y, optimize=True)
            errors[component] = np.sqrt(np.maximum(variance, 0.0))
        return errors


def lay_spline(outline: Outline, *, side: float, spacing: float) -> Spline:
    """Lay knots over a tank, centred on its bounding box.

    Examples
    --------
    >>> from driftwalk.flow.arena import Circle
    >>> lay_spline(Circle(0.15), side=0.03, spacing=0.02).columns
    19
    """
    # Knots go beyond the tank by a tenth of a side: a corner of a tracked block may seem to be
    # outside.
    x_min, y_min, x_max, y_max = outline.bounds
    cells_x, cells_y = (
        math.ceil((high - low + 2.0 * 0.1 * side) / spacing - 1e-9)
        for low, high in ((x_min, x_max), (y_min, y_max))
    )
    return Spline(
        origin_x=(x_min + x_max - cells_x * spacing) / 2.0,
        origin_y=(y_min + y_max - cells_y * spacing) / 2.0,
        spacing=spacing,
        columns=cells_x + DEGREE,
        rows=cells_y + DEGREE,
    )


def basis(share: Floats) -> Floats:
    """Return the four cubic B-splines of a cell at shares of it in [0, 1], shape (n, 4)."""
    t = share
    inner = 4.0 - 6.0 * t**2 + 3.0 * t**3, 1.0 + 3.0 * t + 3.0 * t**2 - 3.0 * t**3
    return np.stack([(1.0 - t) ** 3, *inner, t**3], axis=-1) / 6.0


def basis_matrix(position: Floats, count: int) -> Floats:
    """Return all basis functions at positions in knots, shape (n, count)."""
    cell = np.clip(np.floor(position).astype(np.intp), 0, count - DEGREE - 1)
    matrix = np.zeros((position.size, count))
    columns = cell[:, None] + np.arange(DEGREE + 1)
    np.put_along_axis(matrix, columns, basis(position - cell), axis=1)
    return matrix


def products(weight: Floats, along_x: Floats, along_y: Floats) -> Floats:
    """Return the weighted sum over the nodes of a grid of products of two basis functions."""
    pairs_x = np.einsum("xi,xk->xik", along_x, along_x)
    pairs_y = np.einsum("yj,yl->yjl", along_y, along_y)
    found = np.einsum("yx,yjl,xik->jilk", weight, pairs_y, pairs_x, optimize=True)
    size = along_x.shape[1] * along_y.shape[1]
    return np.asarray(found.reshape(size, size))


def penalties(spline: Spline) -> tuple[Floats, Floats]:
    """Return the matrices R, S of the two penalties on one velocity component f.

    ``c' R c`` is the integral of ``f_xx^2 + 2 f_xy^2 + f_yy^2`` over the knots' box, ``c' S c`` the
    integral of ``f^2``.

    Examples
    --------
    >>> roughness, size = penalties(Spline(0.0, 0.0, 0.5, 5, 5))
    >>> constant = np.ones(25)
    >>> form = [float(constant @ matrix @ constant) for matrix in (roughness, size)]
    >>> np.round(form, 9) + 0.0
    array([0., 1.])
    """
    x = [_gram(spline.columns, spline.spacing, order) for order in range(3)]
    y = [_gram(spline.rows, spline.spacing, order) for order in range(3)]
    roughness = np.kron(y[0], x[2]) + 2.0 * np.kron(y[1], x[1]) + np.kron(y[2], x[0])
    return np.asarray(roughness, np.float64), np.asarray(np.kron(y[0], x[0]), np.float64)


def _gram(count: int, spacing: float, order: int) -> Floats:
    """Return the integrals of products of two basis functions' derivatives along an axis."""
    nodes, weights = np.polynomial.legendre.leggauss(4)  # exact for products of two cubics
    values = _derivative(0.5 * (nodes + 1.0), order) / spacing**order
    cell = values.T @ (values * (0.5 * spacing * weights)[:, None])
    gram = np.zeros((count, count))
    for first in range(count - DEGREE):
        here = slice(first, first + DEGREE + 1)
        gram[here, here] += cell
    return gram


def _derivative(t: Floats, order: int) -> Floats:
    if order == 0:
        return basis(t)
    if order == 1:
        rows = [-((1.0 - t) ** 2), -4.0 * t + 3.0 * t**2, 1.0 + 2.0 * t - 3.0 * t**2, t**2]
        return np.stack(rows, axis=-1) / 2.0
    return np.stack([1.0 - t, -2.0 + 3.0 * t, 1.0 - 3.0 * t, t], axis=-1)
