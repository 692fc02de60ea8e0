"""Quadratic fit to the log likelihood of the walls: restitution and friction with intervals."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from driftwalk.likelihood.contacts.lattice import LATTICE, Wall
from driftwalk.likelihood.spline import Floats


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
    restitution = np.clip([best[0], best[0] - reach[0], best[0] + reach[0]], 0.0, 1.0)
    friction = _friction(np.clip([best[1], best[1] - reach[1], best[1] + reach[1]], 0.0, 1.0))
    return {
        "wall_restitution": ((), restitution[0]),
        "wall_restitution_interval": ("bound", restitution[1:]),
        "wall_friction": ((), friction[0]),
        "wall_friction_interval": ("bound", friction[1:]),
    }


def is_undetermined(found: Mapping[str, Any]) -> bool:
    """Return whether the intervals of an answer hold every wall."""
    restitution, friction = (
        found[f"wall_{name}_interval"][1].tolist() for name in ("restitution", "friction")
    )
    return bool(restitution == [0.0, 1.0] and friction == [0.0, math.inf])


_CURVATURES: Final = (
    np.array([[-2.0, 0.0], [0.0, 0.0]]),
    np.array([[0.0, -1.0], [-1.0, 0.0]]),
    np.array([[0.0, 0.0], [0.0, -2.0]]),
)
"""Derivatives of the curvature by the parabola's last three numbers."""


def _friction(hold: Floats) -> Floats:
    """Return the friction of a hold; from the largest hold on it only sticks."""
    with np.errstate(divide="ignore"):
        return np.where(hold < LATTICE.most_hold, hold / (1.0 - hold), np.inf)
