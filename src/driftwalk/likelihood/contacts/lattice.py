"""Grid search for the wall: a coarse lattice, then finer ones around the best wall."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import Final, NamedTuple

import numpy as np

from driftwalk.likelihood.newton import Tell
from driftwalk.likelihood.spline import Floats


class LatticePolicy(NamedTuple):
    """The lattices of walls, in restitution and hold: mu / (1 + mu) for the friction mu."""

    restitutions: tuple[float, ...] = (0.0, 0.5, 1.0)
    """Restitutions of the coarse lattice. Chosen by hand, as what follows."""
    holds: tuple[float, ...] = (0.0, 0.1, 0.25, 0.45, 0.65)
    """Holds of the coarse lattice. From a friction of about 1 on every contact sticks, and more of
    it changes nothing."""
    most_hold: float = 0.8
    """Largest hold that is tried."""
    finer: tuple[tuple[float, float], ...] = ((0.25, 0.12), (0.15, 0.05))
    """Half the widths of the finer lattices, in restitution and hold."""
    fine: int = 5
    """Places of a finer lattice along each axis."""


LATTICE: Final = LatticePolicy()


class Wall(NamedTuple):
    """A wall that was tried."""

    restitution: float
    hold: float
    log_likelihood: float


def search_walls(log_likelihood: Callable[[float, float], float], tell: Tell) -> list[Wall]:
    """Try the walls of a coarse lattice, then of finer ones around the best of them."""
    count = len(LATTICE.restitutions) * len(LATTICE.holds) + LATTICE.fine**2 * len(LATTICE.finer)
    walls: dict[tuple[float, float], Wall] = {}
    done = 0

    def look(restitutions: Floats, holds: Floats) -> None:
        nonlocal done
        for restitution, hold in product(restitutions.tolist(), holds.tolist()):
            tell(done, count, "wall")
            # The same place of two lattices may differ in its last digits.
            place = (round(restitution, 9), round(hold, 9))
            if place not in walls:
                found = log_likelihood(restitution, hold / (1.0 - hold))
                walls[place] = Wall(restitution, hold, found)
            done += 1

    look(np.array(LATTICE.restitutions), np.array(LATTICE.holds))
    for wide, high in LATTICE.finer:
        best = max(walls.values(), key=lambda wall: wall.log_likelihood)
        look(
            _around(best.restitution, wide, most=1.0),
            _around(best.hold, high, most=LATTICE.most_hold),
        )
    tell(count, count, "wall")
    return list(walls.values())


def _around(best: float, reach: float, *, most: float) -> Floats:
    """Return the places of a finer lattice along one axis."""
    return np.linspace(max(best - reach, 0.0), min(best + reach, most), LATTICE.fine)
