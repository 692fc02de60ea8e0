"""Where the two discs of a marker are, to a small part of a pixel.

Each pixel's place counts by how much of the colour it shows; discs that are partly hidden are
measured by their outlines (`driftwalk.track.two_colour_outline`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from driftwalk.track.chroma import Weights
from driftwalk.track.types import Array

_WINDOW: Final = 1.4
_ROUNDS: Final = 2
_EDGE_PX: Final = 1.2
_FLOOR_PX: Final = 0.02
"""Standard deviation that no centre is better than: squares of pixels, colours in 8 bits [px]."""


@dataclass(frozen=True)
class Measured:
    """The two centres of a marker in a patch.

    Parameters
    ----------
    centres : array, shape (2, 2)
        (column, row) of both discs [px].
    covariance : array, shape (4, 4)
        Of (column, row) of the first and of the second [px²].
    visible : float
        Share of the two discs that is seen.
    explained : float
        Share of the colour in the patch that lies in the discs.
    """

    centres: Array
    covariance: Array
    visible: float
    explained: float


_SMOOTHED: Final = 2.6
"""What the smoothing of a patch hides of its noise: neighbours differ by 1/1.3 of what they would
alone, and a sum over many pixels varies twice as much."""


def noise_of(weights: list[Weights]) -> float:
    """Return the standard deviation of a pixel's weight, from neighbours inside the discs.

    It is that of the pixels before the patch was smoothed.
    """
    steps = []
    for weight in weights:
        inside = (weight[:, 1:] > 0.7) & (weight[:, :-1] > 0.7)
        steps.append((weight[:, 1:] - weight[:, :-1])[inside])
    together = np.concatenate(steps)
    if together.size < 8:
        return 0.1
    return float(_SMOOTHED * np.median(np.abs(together)) / (0.6745 * math.sqrt(2.0)))


def weighted_centres(
    weights: list[Weights], start: Array, *, diameter: float, noise: float
) -> Measured:
    """Return the centres of two whole discs.

    Parameters
    ----------
    weights : list of array, shape (rows, columns)
        Weight of each colour in a patch.
    start : array, shape (2, 2)
        (column, row) of both in the patch, to about a pixel.
    diameter : float
        Of a disc [px].
    noise : float
        Standard deviation of a weight.
    """
    centres, variances, masses, totals = start.copy(), np.zeros(2), np.zeros(2), np.zeros(2)
    reach = _WINDOW * diameter / 2 + _EDGE_PX
    for which, weight in enumerate(weights):
        rows, columns = weight.shape
        for _ in range(_ROUNDS):
            c, r = centres[which]
            left, right = max(int(c - reach), 0), min(int(c + reach) + 2, columns)
            top, bottom = max(int(r - reach), 0), min(int(r + reach) + 2, rows)
            part = weight[top:bottom, left:right]
            dc, dr = np.arange(left, right) - c, np.arange(top, bottom) - r
            square = dc[None, :] ** 2 + dr[:, None] ** 2
            inside = part * (square <= reach * reach)
            mass = float(inside.sum())
            if mass <= 0.0:
                break
            by_column, by_row = inside.sum(axis=0), inside.sum(axis=1)
            centres[which] = c + by_column @ dc / mass, r + by_row @ dr / mass
        masses[which], totals[which] = mass, float(weight.sum())
        # Each pixel of the window moves the mean by its distance times its noise over the mass.
        spread = math.pi * (diameter / 2 + 1.0) ** 4 / 4.0
        variances[which] = (noise**2 * spread) / max(mass, 1.0) ** 2 + _FLOOR_PX**2
    whole = math.pi * diameter**2 / 4.0
    return Measured(
        centres,
        np.diag(np.repeat(variances, 2)),
        float(np.minimum(masses / whole, 1.0).mean()),
        float(masses.sum() / max(totals.sum(), 1e-9)),
    )
