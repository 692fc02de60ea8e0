"""Walls that are tried: a coarse lattice, then finer ones around the best wall."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import Final, NamedTuple

import numpy as np

from driftwalk.likelihood.newton import Tell
from driftwalk.likelihood.spline import Floats

RESTITUTIONS: Final = (0.0, 0.5, 1.0)
HOLDS: Final = (0.0, 0.1, 0.25, 0.45, 0.65)
"""The friction mu of the walls that are tried, as mu / (1 + mu): from about 1 on every contact
sticks, and more friction changes nothing."""
MOST_HOLD: Final = 0.8
FINER: Final = ((0.25, 0.12), (0.15, 0.05))
"""Half the widths of the finer lattices, in restitution and hold."""
FINE: Final = 5
"""Places of a finer lattice along each axis."""
DIGITS: Final = 9
"""Walls that agree in so many digits after the point are one."""


class Wall(NamedTuple):
    """A wall that was tried."""

    restitution: float
    hold: float
    log_likelihood: float


def tried_walls(log_likelihood: Callable[[float, float], float], tell: Tell) -> list[Wall]:
    """Try the walls of a coarse lattice, then of finer ones around the best of them.

    Parameters
    ----------
    log_likelihood : callable
        Gives the log likelihood of a restitution and a friction.
    tell : callable
        Called with the number of places of the lattices that are done, their number, and the task.

    Returns
    -------
    list of Wall
        Each wall once: a place that two lattices share is tried once and counts once.
    """
    count = len(RESTITUTIONS) * len(HOLDS) + FINE**2 * len(FINER)
    walls: dict[tuple[float, float], Wall] = {}
    done = 0

    def look(restitutions: Floats, holds: Floats) -> None:
        nonlocal done
        for restitution, hold in product(restitutions.tolist(), holds.tolist()):
            tell(done, count, "wall")
            # The same place of two lattices may differ in its last digits.
            place = (round(restitution, DIGITS), round(hold, DIGITS))
            if place not in walls:
                found = log_likelihood(restitution, hold / (1.0 - hold))
                walls[place] = Wall(restitution, hold, found)
            done += 1

    look(np.array(RESTITUTIONS), np.array(HOLDS))
    for wide, high in FINER:
        best = max(walls.values(), key=lambda wall: wall.log_likelihood)
        look(
            _around(best.restitution, wide, most=1.0),
            _around(best.hold, high, most=MOST_HOLD),
        )
    tell(count, count, "wall")
    return list(walls.values())


def _around(best: float, reach: float, *, most: float) -> Floats:
    """Return the places of a finer lattice along one axis."""
    return np.linspace(max(best - reach, 0.0), min(best + reach, most), FINE)
