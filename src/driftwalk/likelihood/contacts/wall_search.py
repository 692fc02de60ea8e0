"""Grid search for the wall, and the parabola through its log likelihood."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import product
from typing import Any, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.likelihood.newton import Tell


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


class ParabolaPolicy(NamedTuple):
    """Which of the walls form the parabola."""

    near: float = 80.0
    """Walls whose log likelihood is this near the largest ones form the parabola. Chosen by
    hand."""
    fewest_walls: int = 14
    """Least number of walls that form the parabola: it has six numbers. Chosen by hand."""
    half_weight: float = 15.0
    """A wall with a log likelihood this far below the largest one counts half. Chosen by hand: far
    from its top the likelihood is no parabola."""
    least_curvature: float = 0.5
    """A direction along which the likelihood falls less is not determined. Chosen by hand."""


PARABOLA: Final = ParabolaPolicy()


def answer(walls: Sequence[Wall], confidence: float) -> dict[str, Any]:
    """Return the estimates with their intervals, from a parabola through the likely walls.

    The likelihoods scatter, since the particles are few. Their distances from the parabola say by
    how much, and the intervals hold the uncertainty of its top that follows.
    """
    from scipy.special import ndtri

    table = np.array(walls)
    order = np.argsort(-table[:, 2])
    top = table[order[:3], 2].mean()
    near = table[table[:, 2] > top - PARABOLA.near]
    if len(near) < PARABOLA.fewest_walls:
        near = table[order[: PARABOLA.fewest_walls]]
    e, hold, height = near.T
    terms = np.column_stack([np.ones_like(e), e, hold, e**2, e * hold, hold**2])
    weight = 1.0 / (1.0 + np.maximum(top - height, 0.0) / PARABOLA.half_weight)
    root = np.sqrt(weight)
    fitted, *_ = np.linalg.lstsq(terms * root[:, None], (height - top) * root, rcond=None)
    scatter = (height - top) - terms @ fitted
    variance = float((weight * scatter**2).sum() / (weight.sum() - 0.5 * terms.shape[1]))
    curvature = -np.array([[2 * fitted[3], fitted[4]], [fitted[4], 2 * fitted[5]]])
    values, vectors = np.linalg.eigh(curvature)
    # A direction along which the likelihood does not fall is not determined.
    inverse = vectors @ np.diag(1.0 / np.maximum(values, PARABOLA.least_curvature)) @ vectors.T
    best = inverse @ fitted[1:3]
    slopes = np.column_stack(
        [np.zeros(2), inverse, *(-inverse @ part @ best for part in _CURVATURES)]
    )
    own = variance * np.linalg.pinv(terms.T @ (weight[:, None] * terms))
    covariance = inverse + slopes @ own @ slopes.T
    reach = float(ndtri(0.5 + 0.5 * confidence)) * np.sqrt(np.diag(covariance))
    restitution, hold = np.clip([best, best - reach, best + reach], 0.0, 1.0).T
    # From the largest hold on every contact sticks.
    with np.errstate(divide="ignore"):
        friction = np.where(hold < LATTICE.most_hold, hold / (1.0 - hold), np.inf)
    return {
        "wall_restitution": ((), restitution[0]),
        "wall_restitution_interval": ("bound", restitution[1:]),
        "wall_friction": ((), friction[0]),
        "wall_friction_interval": ("bound", friction[1:]),
    }


def is_undetermined(found: Mapping[str, Any]) -> bool:
    """Return whether the intervals of an answer hold every wall."""
    ends = [found[f"wall_{name}_interval"][1].tolist() for name in ("restitution", "friction")]
    return bool(ends == [[0.0, 1.0], [0.0, math.inf]])


_CURVATURES: Final = (
    np.array([[-2.0, 0.0], [0.0, 0.0]]),
    np.array([[0.0, -1.0], [-1.0, 0.0]]),
    np.array([[0.0, 0.0], [0.0, -2.0]]),
)
"""Derivatives of the curvature by the parabola's last three numbers."""
