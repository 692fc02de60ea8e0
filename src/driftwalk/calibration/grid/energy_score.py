"""How far a recording is from each setting, with what chance does to a setting taken off.

The distance D of a recording from a simulated one is partly chance: two recordings of one setting
are apart, too, by the floor of that setting. The mean of D alone favours settings whose simulations
scatter little, such as a small random force: they are nearer to every recording than the truth is,
on average. Half of the floor is therefore taken off,

    S(setting) = mean D(recording, simulation) - 1/2 mean D(simulation, simulation),

the energy score of Gneiting and Raftery (J. Am. Stat. Assoc. 102, 359, 2007) with D for the
distance: no setting has a smaller expectation than the truth. Chance in S grows with the floor, so
its height above the minimum is counted in floors.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from driftwalk.calibration.grid.grid_map import Map
from driftwalk.calibration.grid.surface import (
    Optimum,
    Smoother,
    lowest_point,
    make_smoother,
    nearest_point,
)
from driftwalk.core.arrays import Floats


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
    def height(self) -> Floats:
        """Height of the surface above its minimum in floors of the optimum, on the lattice."""
        return np.asarray((self.surface - self.surface.min()) / self.floor_at_optimum)


def smooth_energy_score(found: Map, bandwidth: Sequence[float]) -> EnergyScore:
    """Return the smooth surface of a map."""
    smoother = make_smoother(
        found.axes, bandwidth=bandwidth, weights=found.replicates.astype(float)
    )
    floor = smooth_floor(smoother, found.apart)
    surface = height_in_floors(smoother, found.mean, found.apart, floor)
    lowest = np.unravel_index(int(np.argmin(surface)), surface.shape)
    point = lowest_point(smoother.axes, surface)
    distance = float(smoother.surface(found.mean.ravel())[lowest])
    return EnergyScore(
        smoother, Optimum(point, distance), floor, distance + float(floor[lowest]) * surface
    )


def smooth_floor(smoother: Smoother, apart: Floats) -> Floats:
    """Return the floor of every point of the lattice, from the floors of the settings."""
    # Kept away from 0, so that heights in floors stay finite.
    least = 0.2 * float(np.median(apart)) or np.finfo(np.float64).tiny
    return np.asarray(np.clip(smoother.surface(apart.ravel()), least, None))


def height_in_floors(smoother: Smoother, distance: Floats, apart: Floats, floor: Floats) -> Floats:
    """Return how far S lies above its minimum, in floors, on the lattice."""
    score = smoother.surface((distance - 0.5 * apart).ravel())
    return np.asarray((score - score.min()) / floor)
