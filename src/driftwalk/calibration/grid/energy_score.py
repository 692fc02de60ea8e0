"""The energy score of a recording at each setting of a grid, and the minimum of its smooth surface.

The distance D of a recording from a simulated one is partly chance: two recordings of one setting
are apart, too, by the floor of that setting. The mean of D alone favours settings whose simulations
scatter little, such as a small random force: they are nearer to every recording than the truth is,
on average. Half of the floor is therefore taken off,

    S(setting) = mean D(recording, simulation) - 1/2 mean D(simulation, simulation),

the energy score of Gneiting and Raftery (J. Am. Stat. Assoc. 102, 359, 2007) with D for the
distance: no setting has a smaller expectation than the truth. Chance in S grows with the floor, so
its height above the minimum is counted in floors.

Distances are noisy, so the optimum is taken on a smooth surface, instead of the luckiest cell. At
every point of a fine lattice a quadratic in the n parameters, (n + 1)(n + 2) / 2 terms, is fitted
to the distances of the cells nearby, weighted by (1 - r^2/4)^3 for r < 2 bandwidths, and its value
there is the surface. The fit is linear in the data: one matrix serves the recording and every
bootstrap sample. The valley of D of the block is narrow and sharp in C_d, so the bandwidth is two
refined steps: wider ones shift the minimum towards the flatter side.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import NamedTuple

import numpy as np

from driftwalk.calibration.grid.grid_map import Map
from driftwalk.core.arrays import Floats

FINENESS = 4
"""Lattice points per cell of a grid along each axis; chosen by hand."""
REACH = 2.0
"""How far the cells are that count, in bandwidths; chosen by hand."""


class Optimum(NamedTuple):
    """The lowest point of a surface."""

    point: tuple[float, ...]
    """Its coordinates, one per parameter."""
    distance: float
    """Value of the smooth surface there (a KS distance)."""


@dataclass(frozen=True, eq=False)
class Smoother:
    """A smooth surface over a grid of settings, as a linear map of the cells' distances.

    Attributes
    ----------
    axes : tuple of ndarray
        Axes of the lattice, one per parameter.
    matrix : ndarray, shape (lattice points, cells)
        Weights of the cells in the value at each lattice point.
    """

    axes: tuple[Floats, ...]
    matrix: Floats

    def surface(self, distance: Floats) -> Floats:
        """Return the surface on the lattice, from distances on the grid (..., cells)."""
        values = np.asarray(distance) @ self.matrix.T
        return np.asarray(values.reshape(*values.shape[:-1], *(axis.size for axis in self.axes)))


def nearest_point(axes: Sequence[Floats], point: Sequence[float]) -> tuple[int, ...]:
    """Return the indices of the point of a lattice next to a point."""
    return tuple(
        int(np.argmin(np.abs(axis - value))) for axis, value in zip(axes, point, strict=True)
    )


def lowest_point(axes: Sequence[Floats], surface: Floats) -> tuple[float, ...]:
    """Return the point of a lattice at which a surface is lowest."""
    lowest = np.unravel_index(int(np.argmin(surface)), surface.shape)
    return tuple(float(axis[at]) for axis, at in zip(axes, lowest, strict=True))


def lowest_between(axes: Sequence[Floats], surface: Floats) -> tuple[float, ...]:
    """Return where a surface is lowest, between points of its lattice: a parabola along each axis.

    At the end of an axis, and where a neighbour is infinite, the point of the lattice stands.

    Examples
    --------
    >>> axis = np.linspace(0.0, 1.0, 5)
    >>> bowl = (axis[:, None] - 0.3) ** 2 + (axis[None, :] - 1.0) ** 2
    >>> tuple(round(value, 6) for value in lowest_between([axis, axis], bowl))
    (0.3, 1.0)
    """
    lowest = tuple(map(int, np.unravel_index(int(np.argmin(surface)), surface.shape)))
    found = []
    for along, axis in enumerate(axes):
        at, value = lowest[along], float(axis[lowest[along]])
        line = np.moveaxis(surface, along, -1)[lowest[:along] + lowest[along + 1 :]]
        if 0 < at < axis.size - 1 and np.isfinite(line[at - 1 : at + 2]).all():
            before, here, after = map(float, line[at - 1 : at + 2])
            bend = before - 2.0 * here + after
            if bend > 0.0:
                value += 0.25 * (before - after) / bend * float(axis[at + 1] - axis[at - 1])
        found.append(value)
    return tuple(found)


def at_settings(surface: Floats) -> Floats:
    """Return a surface at the settings of its grid: every `FINENESS`-th point of the lattice."""
    return np.asarray(surface[(slice(None, None, FINENESS),) * surface.ndim])


def make_smoother(
    axes: Sequence[Floats], *, bandwidth: Sequence[float], weights: Floats | None = None
) -> Smoother:
    """Prepare the surface for a grid.

    Examples
    --------
    >>> axis = np.linspace(-1.0, 1.0, 9)
    >>> bowl = (axis[:, None] - 0.3) ** 2 + axis[None, :] ** 2
    >>> smoother = make_smoother([axis, axis], bandwidth=(0.5, 0.5))
    >>> lowest_point(smoother.axes, smoother.surface(bowl.ravel()))
    (0.3125, 0.0)
    """
    lattice = lattice_of(axes)
    widths = [
        max(width, 1.01 * _spacing(axis)) for axis, width in zip(axes, bandwidth, strict=True)
    ]
    cells = [
        grid.ravel() / width
        for grid, width in zip(np.meshgrid(*axes, indexing="ij"), widths, strict=True)
    ]
    scaled = [axis / width for axis, width in zip(lattice, widths, strict=True)]
    # One row of the lattice at a time: all its points but those of the first axis.
    rest = [grid.ravel() for grid in np.meshgrid(*scaled[1:], indexing="ij")]
    each = np.ones(cells[0].size) if weights is None else np.ravel(weights)
    rows = [_fit_row(x, rest, cells, each) for x in scaled[0]]
    return Smoother(lattice, np.concatenate(rows))


def _fit_row(x: float, rest: Sequence[Floats], cells: Sequence[Floats], weights: Floats) -> Floats:
    """Return the weights of the cells at the lattice points (x, rest[0]), (x, rest[1]), ..."""
    near = np.abs(cells[0] - x) < REACH
    first, *others = (one[near] for one in cells)
    points = rest[0].size if rest else 1
    away = [np.broadcast_to(first - x, (points, first.size))]
    away += [cell - at[:, None] for cell, at in zip(others, rest, strict=True)]
    squares = sum((one**2 for one in away[1:]), start=away[0] ** 2)
    weight = weights[near] * np.clip(1.0 - squares / REACH**2, 0.0, None) ** 3
    products = [a * b for a, b in combinations_with_replacement(away, 2)]
    terms = np.stack([np.ones_like(away[0]), *away, *products], axis=-1)
    weighted = terms * weight[..., None]
    normal = np.einsum("lca,lcb->lab", weighted, terms)
    # Where a narrow grid cannot tell two terms apart the ridge decides, and the value stays sound.
    count = terms.shape[-1]
    # The second number keeps the surface at 0, not undefined, far from any cell.
    normal += np.eye(count) * (1e-9 * weight.sum(axis=1) + 1e-12)[:, None, None]
    value = np.zeros((points, count, 1))
    value[:, 0] = 1.0
    solution = np.linalg.solve(normal, value)[..., 0]
    fitted = np.zeros((points, near.size))
    fitted[:, near] = np.einsum("la,lca->lc", solution, weighted)
    return fitted


def _spacing(axis: Floats) -> float:
    return float((axis[-1] - axis[0]) / (axis.size - 1)) if axis.size > 1 else 1.0


def lattice_of(axes: Sequence[Floats]) -> tuple[Floats, ...]:
    """Return the axes of the lattice of a grid, `FINENESS` points per cell."""
    return tuple(np.linspace(axis[0], axis[-1], (axis.size - 1) * FINENESS + 1) for axis in axes)


class EnergyScore(NamedTuple):
    """The smooth surface of a map, on a lattice finer than its grid."""

    smoother: Smoother
    optimum: Optimum
    """The lowest point, with the mean distance there."""
    floor: Floats
    """Distance between two simulations of the same setting, on the lattice."""
    surface: Floats
    """The distance that a recording as far above its minimum in floors would have at the optimum:
    D at the optimum + (S - min S) / floor x the floor at the optimum; on the lattice."""

    @property
    def floor_at_optimum(self) -> float:
        """Floor of the optimum."""
        return float(self.floor[nearest_point(self.smoother.axes, self.optimum.point)])

    @property
    def mean(self) -> Floats:
        """Mean distance of the recording from simulations of each setting, on the lattice."""
        floor, distance = self.floor_at_optimum, self.optimum.distance
        # S is the mean less half the floor, and the surface its rise in floors of the setting.
        rise = self.floor * (self.surface - self.surface.min()) / floor
        return np.asarray(distance - 0.5 * floor + rise + 0.5 * self.floor)

    @property
    def height(self) -> Floats:
        """Height of the surface above its minimum in floors of the optimum, on the lattice."""
        return np.asarray((self.surface - self.surface.min()) / self.floor_at_optimum)


def smooth_energy_score(found: Map, bandwidth: Sequence[float]) -> EnergyScore:
    """Return the smooth surface of a map."""
    smoother = make_smoother(
        found.axes, bandwidth=bandwidth, weights=found.replicates.astype(float)
    )
    apart = found.apart
    # Kept away from 0, so that heights in floors stay finite.
    least = 0.2 * float(np.median(apart)) or np.finfo(np.float64).tiny
    floor = np.clip(smoother.surface(apart.ravel()), least, None)
    score = smoother.surface((found.mean - 0.5 * apart).ravel())
    surface = np.asarray((score - score.min()) / floor)
    lowest = np.unravel_index(int(np.argmin(surface)), surface.shape)
    point = lowest_point(smoother.axes, surface)
    distance = float(smoother.surface(found.mean.ravel())[lowest])
    return EnergyScore(
        smoother, Optimum(point, distance), floor, distance + float(floor[lowest]) * surface
    )
