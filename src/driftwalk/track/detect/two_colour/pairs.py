"""Pair discs of the two colours by the marker's spacing (assignment problem)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from driftwalk.track.detect.two_colour.discs import Disc
from driftwalk.track.types import Array, Rejected


class PairPolicy(NamedTuple):
    """Which two discs may belong together."""

    tolerance: float = 0.10
    """Tolerance of the spacing of two whole discs, as a share of it; chosen by hand."""
    per_missing: float = 0.9
    """How much further off, in diameters of a disc, for each missing share of a disc's area;
    chosen by hand."""


_PAIRS: Final = PairPolicy()


@dataclass(frozen=True)
class Pair:
    """Two discs that may be one marker.

    Parameters
    ----------
    first, second : Disc
        The discs.
    distance : float
        Between their centres, as a share of the marker's spacing.
    score : float
        In [0, 1]: how well distance and areas fit.
    """

    first: Disc
    second: Disc
    distance: float
    score: float


def pair_discs(
    first: list[Disc], second: list[Disc], *, spacing_per_diameter: float
) -> tuple[list[Pair], list[Rejected]]:
    """Pair the discs of two colours.

    Parameters
    ----------
    first, second : list of Disc
        Discs of each colour.
    spacing_per_diameter : float
        The marker's spacing as a share of its discs' diameter.

    Returns
    -------
    tuple
        The pairs, and the discs that are left over with the reason.
    """
    from scipy.optimize import linear_sum_assignment

    if not first or not second:
        other = 2 if first else 1
        return [], [_alone(disc, f"no disc of colour {other} was seen") for disc in first + second]
    distance, misfit = _misfit(first, second, spacing_per_diameter)
    # A cost above one is no pair; the offset makes more pairs better than closer ones.
    # A sum of misfits is far below 1e6: as many allowed pairs as possible are taken.
    cost = np.where(misfit <= 1.0, misfit - 1e6, 0.0)
    pairs, used = [], set()
    for i, j in zip(*linear_sum_assignment(cost), strict=True):
        if misfit[i, j] <= 1.0:
            used |= {(1, int(i)), (2, int(j))}
            score = float(1.0 - 0.5 * misfit[i, j] ** 2)
            pairs.append(Pair(first[i], second[j], float(distance[i, j]), score))
    rejected = [
        _alone(disc, _nearest(distance[i], 2)) for i, disc in enumerate(first) if (1, i) not in used
    ]
    rejected += [
        _alone(disc, _nearest(distance[:, j], 1))
        for j, disc in enumerate(second)
        if (2, j) not in used
    ]
    return pairs, rejected


def _misfit(first: list[Disc], second: list[Disc], ratio: float) -> tuple[Array, Array]:
    """Return distances over the spacing, and their misfit over what is allowed."""
    a, b = (
        np.array([[d.column, d.row, d.diameter, d.share] for d in discs])
        for discs in (first, second)
    )
    spacing = ratio * (a[:, None, 2] + b[None, :, 2]) / 2
    apart = np.hypot(a[:, None, 0] - b[None, :, 0], a[:, None, 1] - b[None, :, 1]) / spacing
    missing = np.maximum(1.0 - a[:, None, 3], 0.0) + np.maximum(1.0 - b[None, :, 3], 0.0)
    allowed = _PAIRS.tolerance + _PAIRS.per_missing * missing / ratio
    return apart, np.abs(apart - 1.0) / allowed


def _nearest(distances: Array, colour: int) -> str:
    return (
        f"no partner: the nearest disc of colour {colour} is at {distances.min():.2f} of the "
        "marker's spacing, or belongs to another"
    )


def _alone(disc: Disc, reason: str) -> Rejected:
    return Rejected(disc.column, disc.row, disc.area, reason, "no partner")
