"""Candidates for the discs of two-colour markers: connected regions of one colour."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.track.types import Rejected

LEAST_SHARE: Final = 0.15
"""Least area of a region, of the whole disc's."""
MOST_SHARE: Final = 1.7
_SPECK_SHARE: Final = 0.03
_PIECES_EXTENT: Final = 1.3


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
    share: float = 0.0
    diameter: float = 0.0


def find_regions(cv2: Any, label: npt.NDArray[np.uint8], colour: int, factor: int) -> list[Disc]:
    """Return the connected regions of one label, in pixels of the image that was reduced.

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
    """
    mask = np.equal(label, colour).view(np.uint8)
    # No more regions than a quarter of the pixels: where short labels are enough, they are quicker.
    kind = cv2.CV_16U if mask.size < 4 * 65535 else cv2.CV_32S
    count, _, stats, centres = cv2.connectedComponentsWithStats(mask, connectivity=8, ltype=kind)
    shift = (factor - 1) / 2
    found = []
    for index in range(1, count):
        left, top, width, height, area = (float(value) for value in stats[index])
        found.append(
            Disc(
                colour,
                float(centres[index, 0]) * factor + shift,
                float(centres[index, 1]) * factor + shift,
                area * factor**2,
                (
                    left * factor,
                    top * factor,
                    (left + width) * factor - 1,
                    (top + height) * factor - 1,
                ),
            )
        )
    return found


def join_pieces(regions: list[Disc]) -> list[Disc]:
    """Join regions of one colour that together are no larger than a disc.

    A narrow bar or reflection cuts a disc into pieces.
    """
    joined: list[Disc] = []
    for region in sorted(regions, key=lambda item: -item.area):
        for index, other in enumerate(joined):
            both = _together(other, region)
            width, height = both.box[2] - both.box[0] + 1, both.box[3] - both.box[1] + 1
            near = max(width, height) <= _PIECES_EXTENT * other.diameter
            if near and other.share < 1.0 and both.share <= MOST_SHARE:
                joined[index] = both
                break
        else:
            joined.append(region)
    return joined


def sort_out(regions: list[Disc], *, colour: int) -> tuple[list[Disc], list[Rejected]]:
    """Return the regions whose area may be that of a disc, and the others with the reason.

    Specks that noise alone makes are left out of both.
    """
    kept, rejected = [], []
    for region in regions:
        whole = (
            f"{region.area:.0f} px² of colour {colour}; a disc has {region.area / region.share:.0f}"
        )
        if region.share < _SPECK_SHARE:
            continue
        if region.share < LEAST_SHARE:
            rejected.append(_reject(region, f"too small: {whole}", "too small"))
        elif region.share > MOST_SHARE:
            rejected.append(_reject(region, f"too large: {whole}", "too large"))
        else:
            kept.append(region)
    return kept, rejected


def _reject(region: Disc, reason: str, kind: str) -> Rejected:
    return Rejected(region.column, region.row, region.area, reason, kind)


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
