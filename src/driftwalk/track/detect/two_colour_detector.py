"""Detector of two-colour markers: two discs of different hue give position and orientation.

Discs are connected regions of one colour; an assignment pairs them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats
from driftwalk.core.extras import require_opencv
from driftwalk.core.units import in_percent
from driftwalk.track.detect.markers import ChromaTables, TwoColourMarker
from driftwalk.track.detect.two_colour_centres import (
    CENTRES,
    Measured,
    outlined_centres,
    weighted_centres,
)
from driftwalk.track.types import Detection, Image, PixelToWorld, Rejected


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

    column: float
    row: float
    area: float
    box: tuple[float, ...]
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
        Disc(column, row, area, tuple(box), share, diameter)
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
        a * first.column + b * second.column,
        a * first.row + b * second.row,
        area,
        (*map(min, first.box[:2], second.box[:2]), *map(max, first.box[2:], second.box[2:])),
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


class TwoColourPolicy(NamedTuple):
    """When a pair of discs is measured at which resolution, and when by its outlines."""

    coarse_diameter_px: float = 6.0
    """Diameter of a disc in the reduced image in which discs are looked for [px]; chosen by
    hand."""
    fine_diameter_px: float = 12.0
    """Diameter of a disc in the reduced image in which it is measured [px]; chosen by hand."""
    most_factor: int = 4
    """Largest factor by which an image is reduced; chosen by hand."""
    whole: float = 0.93
    """Share of a disc's area from which on it is whole; chosen by hand."""
    least_visible: float = 0.35
    """Share of both discs that must be seen; chosen by hand."""
    most_off: float = 0.06
    """Largest error of the spacing of two whole discs, as a share of it; chosen by hand."""
    most_uneven: float = 0.015
    """Largest unevenness of a whole disc beyond chance, in diameters; chosen by hand."""


_TWO_COLOUR: Final = TwoColourPolicy()


class TwoColourDetector:
    """Finds two-colour markers.

    The image is first searched at reduced size for regions of either colour. Regions of the right
    area are paired by the marker's spacing, and each pair is measured at full size.

    Parameters
    ----------
    marker : TwoColourMarker
        Colours, size and spacing.
    camera : PixelToWorld
        The scale; there is no default one.

    Examples
    --------
    >>> import driftwalk as dw
    >>> marker = TwoColourMarker(
    ...     spacing_m=0.014, size_m=0.010,
    ...     colour_1={"a_star": 60, "b_star": 14}, colour_2={"a_star": -44, "b_star": 24},
    ... )
    >>> camera = dw.track.Camera.from_scale(640, 480, px_per_m=1500.0)
    >>> track = dw.tank30_recording("without_noise").isel(time=slice(0, 1))
    >>> _, image = next(dw.render_video(track))
    >>> found, _ = TwoColourDetector(marker, camera).detect(image)
    >>> bool(abs(found[0].x - track["x"].values[0, 0]) < 1e-4)
    True
    """

    def __init__(self, marker: TwoColourMarker, camera: PixelToWorld) -> None:
        self._cv2: Any = require_opencv()
        self.marker = marker
        self.camera = camera
        self._tables = ChromaTables(marker)
        self._factor = 0

    def detect(self, image: Image) -> tuple[list[Detection], list[Rejected]]:
        """Find the markers in one image.

        Parameters
        ----------
        image : array, shape (rows, columns, 3)
            Blue, green, red, uint8.

        Returns
        -------
        tuple
            Detections, and rejected candidates with the reason.
        """
        discs, rejected = self._discs(image)
        ratio = self.marker.spacing_m / self.marker.size_m
        pairs, alone = pair_discs(*discs, spacing_per_diameter=ratio)
        rejected += alone
        measured: list[tuple[Pair, Measured]] = []
        for pair in pairs:
            result = self._measure(image, pair)
            if result.visible >= _TWO_COLOUR.least_visible:
                measured.append((pair, result))
            else:
                column, row = result.centres.mean(axis=0)
                area = pair.first.area + pair.second.area
                reason = f"only {in_percent(result.visible)} of the marker can be seen"
                rejected.append(Rejected(float(column), float(row), area, reason, "hidden"))
        return self._place(measured), rejected

    def _discs(self, image: Image) -> tuple[list[list[Disc]], list[Rejected]]:
        """Return the candidates of both colours, and the regions that are none."""
        if not self._factor:
            # As small as it can be with the discs still found.
            middle = (np.array([image.shape[1::-1]]) - 1) / 2
            diameter = self._diameter(middle)[0] / _TWO_COLOUR.coarse_diameter_px
            self._factor = int(np.clip(diameter, 1, _TWO_COLOUR.most_factor))
        cv2, factor = self._cv2, self._factor
        label = self._tables.label.take(self._tables.codes(cv2, _reduced(cv2, image, factor)))
        both, rejected = [], []
        for colour in (1, 2):
            regions = find_regions(cv2, label, colour, factor, diameter_at=self._diameter)
            kept, wrong = sort_out(join_pieces(regions), colour=colour)
            both.append(kept)
            rejected += wrong
        return both, rejected

    def _diameter(self, points: Floats) -> Floats:
        """Return the diameter of a whole disc at points of the image [px]."""
        px_per_m = 1.0 / np.sqrt(np.abs(np.linalg.det(self.camera.jacobian(points))))
        return np.asarray(self.marker.size_m * px_per_m)

    def _measure(self, image: Image, pair: Pair) -> Measured:
        """Return the centres of a pair of discs in the image at full size."""
        first, second = pair.first, pair.second
        diameter = (first.diameter + second.diameter) / 2
        spacing = diameter * self.marker.spacing_m / self.marker.size_m
        centre = np.array([first.column + second.column, first.row + second.row]) / 2
        partly = (
            min(first.share, second.share) < _TWO_COLOUR.whole
            or abs(pair.distance - 1.0) > _TWO_COLOUR.most_off
        )
        reach = (spacing + diameter) / 2 * (1.6 if partly else 1.25) + 3.0
        rows, columns = image.shape[:2]
        left, top = (max(int(value - reach), 0) for value in centre)
        right = min(int(centre[0] + reach) + 2, columns)
        bottom = min(int(centre[1] + reach) + 2, rows)
        # Reduced where its discs are large, and with less noise.
        factor = int(np.clip(diameter / _TWO_COLOUR.fine_diameter_px, 1, _TWO_COLOUR.most_factor))
        patch = _reduced(self._cv2, image[top:bottom, left:right], factor)
        patch = self._cv2.GaussianBlur(patch, (3, 3), CENTRES.smoothing_px)
        codes = self._tables.codes(self._cv2, patch)
        weights = [table.take(codes) for table in self._tables.soft]
        corner = np.array([left, top]) + (factor - 1) / 2
        start = np.array([[first.column, first.row], [second.column, second.row]]) - corner
        start, diameter, spacing = start / factor, diameter / factor, spacing / factor
        result = weighted_centres(self._cv2, weights, start, diameter=diameter)
        apart = float(np.hypot(*(result.centres[1] - result.centres[0]))) / spacing
        whole = result.shares.min() >= _TWO_COLOUR.whole and result.uneven < _TWO_COLOUR.most_uneven
        if not whole or abs(apart - 1.0) > _TWO_COLOUR.most_off:
            outlined = outlined_centres(weights, result.centres, diameter=diameter, spacing=spacing)
            result = outlined if outlined is not None else result
        return Measured(
            result.centres * factor + corner, result.covariance * factor**2, result.shares
        )

    def _place(self, measured: list[tuple[Pair, Measured]]) -> list[Detection]:
        if not measured:
            return []
        centres = np.concatenate([result.centres for _, result in measured])
        world = self.camera.to_world(centres).reshape(-1, 2, 2)
        jacobians = self.camera.jacobian(centres).reshape(-1, 2, 2, 2)
        found = []
        for (pair, result), ends, slopes in zip(measured, world, jacobians, strict=True):
            along = ends[1] - ends[0]
            angle = math.atan2(along[1], along[0]) - self.marker.angle_offset_rad
            to_world = np.zeros((4, 4))
            to_world[:2, :2], to_world[2:, 2:] = slopes
            turn = np.array([-along[1], along[0]]) / float(along @ along)
            to_pose = np.zeros((3, 4))
            to_pose[:2, :2] = to_pose[:2, 2:] = np.eye(2) / 2
            to_pose[2, :2], to_pose[2, 2:] = -turn, turn
            lever = to_pose @ to_world
            x, y = ends.mean(axis=0).tolist()
            column, row = result.centres.mean(axis=0).tolist()
            theta = math.remainder(angle, 2 * math.pi)
            covariance = lever @ result.covariance @ lever.T
            area, score = pair.first.area + pair.second.area, pair.score * result.visible
            found.append(Detection(x, y, column, row, theta, covariance, area, score=score))
        return found


def _reduced(cv2: Any, image: Image, factor: int) -> Image:
    """Return an image reduced by a whole factor, without the rows and columns that are left."""
    if factor == 1:
        return image
    columns, rows = image.shape[1] // factor, image.shape[0] // factor
    cut = image[: rows * factor, : columns * factor]
    return np.asarray(cv2.resize(cut, (columns, rows), interpolation=cv2.INTER_AREA))
