"""Discs of two-colour markers: connected regions of one colour, and their pairs by assignment."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats
from driftwalk.track.types import Rejected


class DiscPolicy(NamedTuple):
    """Which regions of one colour are discs."""

    least_share: float = 0.15
    """Least area of a region, of the whole disc's; chosen by hand."""
    most_share: float = 1.7
    """Largest area of a region, of the whole disc's; chosen by hand."""
    speck_share: float = 0.03
    """Area below which a region is not mentioned, of the whole disc's; chosen by hand."""
    pieces_extent: float = 1.3
    """Largest extent of the pieces of one disc, in diameters; chosen by hand."""


_DISCS: Final = DiscPolicy()


@dataclass
class Disc:
    """A region of one colour.

    Parameters
    ----------
    colour : int
        1 or 2.
    column, row : float
        Its centre [px].
    area : float
        Its area [px²].
    box : tuple of float
        Least column and row, largest column and row [px].
    share : float
        Its area, of a whole disc's.
    diameter : float
        Diameter of a whole disc here [px].
    """

    colour: int
    column: float
    row: float
    area: float
    box: tuple[float, float, float, float]
    share: float
    diameter: float


def find_regions(
    cv2: Any,
    label: npt.NDArray[np.uint8],
    colour: int,
    factor: int,
    *,
    diameter_at: Callable[[Floats], Floats],
) -> list[Disc]:
    """Return the connected regions of one label; specks that noise alone makes are left out.

    Parameters
    ----------
    cv2 : module
        OpenCV.
    label : array, shape (rows, columns)
        0, 1 or 2.
    colour : int
        Which label.
    factor : int
        By how much the image was reduced.
    diameter_at : callable
        Diameter of a whole disc [px] at points (column, row) of the image at full size, shape
        (n, 2).
    """
    mask = np.equal(label, colour).view(np.uint8)
    # No more regions than a quarter of the pixels: where short labels are enough, they are quicker.
    kind = cv2.CV_16U if mask.size < 4 * 65535 else cv2.CV_32S
    _, _, stats, centres = cv2.connectedComponentsWithStats(mask, connectivity=8, ltype=kind)
    places = centres[1:] * factor + (factor - 1) / 2
    if not len(places):
        return []
    diameters = diameter_at(places)
    areas = stats[1:, cv2.CC_STAT_AREA] * float(factor**2)
    shares = areas / (np.pi * diameters**2 / 4.0)
    # A noisy image has thousands of specks, so they go before there is an object for each.
    kept = np.flatnonzero(shares >= _DISCS.speck_share)
    corners = stats[1:, :2][kept]
    ends = corners + stats[1:, 2:4][kept]
    boxes = np.concatenate([corners * factor, ends * factor - 1], axis=1).astype(float)
    columns = (places[kept, 0], places[kept, 1], areas[kept], shares[kept], diameters[kept])
    return [
        Disc(colour, column, row, area, tuple(box), share, diameter)
        for box, column, row, area, share, diameter in zip(
            boxes.tolist(), *(column.tolist() for column in columns), strict=True
        )
    ]


def join_pieces(regions: list[Disc]) -> list[Disc]:
    """Join regions of one colour that together are no larger than a disc.

    A narrow bar or reflection cuts a disc into pieces.
    """
    if len(regions) < 2:
        return regions
    joined: list[Disc] = []
    # Pieces of one disc lie in the same or in adjoining cells.
    side = _DISCS.pieces_extent * max(region.diameter for region in regions)
    cells: dict[tuple[int, int], set[int]] = {}
    for region in sorted(regions, key=lambda item: -item.area):
        for index in sorted(_near(cells, region, side)):
            other = joined[index]
            if other.share >= 1.0 or other.share + region.share > _DISCS.most_share:
                continue
            both = _together(other, region)
            width, height = both.box[2] - both.box[0] + 1, both.box[3] - both.box[1] + 1
            if max(width, height) <= _DISCS.pieces_extent * other.diameter:
                cells[_cell(other, side)].discard(index)
                joined[index] = both
                break
        else:
            index = len(joined)
            joined.append(region)
        cells.setdefault(_cell(joined[index], side), set()).add(index)
    return joined


def _cell(region: Disc, side: float) -> tuple[int, int]:
    return int(region.column // side), int(region.row // side)


def _near(cells: dict[tuple[int, int], set[int]], region: Disc, side: float) -> set[int]:
    """Return what lies in the cell of a region and in the eight around it."""
    column, row = _cell(region, side)
    around = ((column + i, row + j) for i in (-1, 0, 1) for j in (-1, 0, 1))
    return set().union(*(cells.get(cell, ()) for cell in around))


def sort_out(regions: list[Disc], *, colour: int) -> tuple[list[Disc], list[Rejected]]:
    """Return the regions whose area may be that of a disc, and the others with the reason."""
    kept, rejected = [], []
    for region in regions:
        whole = (
            f"{region.area:.0f} px² of colour {colour}; a disc has {region.area / region.share:.0f}"
        )
        if region.share < _DISCS.least_share:
            rejected.append(_reject(region, f"too small: {whole}", "too small"))
        elif region.share > _DISCS.most_share:
            rejected.append(_reject(region, f"too large: {whole}", "too large"))
        else:
            kept.append(region)
    return kept, rejected


def _reject(disc: Disc, reason: str, kind: str = "no partner") -> Rejected:
    return Rejected(disc.column, disc.row, disc.area, reason, kind)


def _together(first: Disc, second: Disc) -> Disc:
    area = first.area + second.area
    a, b = first.area / area, second.area / area
    return Disc(
        first.colour,
        a * first.column + b * second.column,
        a * first.row + b * second.row,
        area,
        (
            min(first.box[0], second.box[0]),
            min(first.box[1], second.box[1]),
            max(first.box[2], second.box[2]),
            max(first.box[3], second.box[3]),
        ),
        first.share + second.share,
        first.diameter,
    )


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
        return [], [_reject(disc, f"no disc of colour {other} was seen") for disc in first + second]
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
    rejected = []
    for number, discs, apart in ((1, first, distance), (2, second, distance.T)):
        for place, disc in enumerate(discs):
            if (number, place) not in used:
                rejected.append(_reject(disc, _nearest(apart[place], 3 - number)))
    return pairs, rejected


def _misfit(first: list[Disc], second: list[Disc], ratio: float) -> tuple[Floats, Floats]:
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


def _nearest(distances: Floats, colour: int) -> str:
    return (
        f"no partner: the nearest disc of colour {colour} is at {distances.min():.2f} of the "
        "marker's spacing, or belongs to another"
    )
