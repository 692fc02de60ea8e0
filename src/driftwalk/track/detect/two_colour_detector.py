"""Detector of two-colour markers: two discs of different hue give position and orientation."""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np

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
from driftwalk.track.detect.two_colour_discs import (
    Disc,
    Pair,
    find_regions,
    join_pieces,
    pair_discs,
    sort_out,
)
from driftwalk.track.types import Detection, Image, PixelToWorld, Rejected


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
        pairs, alone = pair_discs(
            discs[0], discs[1], spacing_per_diameter=self.marker.spacing_m / self.marker.size_m
        )
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

    def _discs(self, image: Image) -> tuple[tuple[list[Disc], list[Disc]], list[Rejected]]:
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
        return (both[0], both[1]), rejected

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
        """Return the detections in the world."""
        if not measured:
            return []
        centres = np.concatenate([result.centres for _, result in measured])
        world = self.camera.to_world(centres).reshape(-1, 2, 2)
        jacobians = self.camera.jacobian(centres).reshape(-1, 2, 2, 2)
        found = []
        for (pair, result), ends, slopes in zip(measured, world, jacobians, strict=True):
            along = ends[1] - ends[0]
            theta = math.atan2(along[1], along[0]) - self.marker.angle_offset_rad
            to_world = np.zeros((4, 4))
            to_world[:2, :2], to_world[2:, 2:] = slopes
            turn = np.array([-along[1], along[0]]) / float(along @ along)
            to_pose = np.zeros((3, 4))
            to_pose[:2, :2] = to_pose[:2, 2:] = np.eye(2) / 2
            to_pose[2, :2], to_pose[2, 2:] = -turn, turn
            lever = to_pose @ to_world
            x, y = ends.mean(axis=0)
            column, row = result.centres.mean(axis=0)
            found.append(
                Detection(
                    x=float(x),
                    y=float(y),
                    column=float(column),
                    row=float(row),
                    theta=math.remainder(theta, 2 * math.pi),
                    covariance=lever @ result.covariance @ lever.T,
                    area_px=pair.first.area + pair.second.area,
                    score=pair.score * result.visible,
                )
            )
        return found


def _reduced(cv2: Any, image: Image, factor: int) -> Image:
    """Return an image reduced by a whole factor, without the rows and columns that are left."""
    if factor == 1:
        return image
    columns, rows = image.shape[1] // factor, image.shape[0] // factor
    cut = image[: rows * factor, : columns * factor]
    return np.asarray(cv2.resize(cut, (columns, rows), interpolation=cv2.INTER_AREA))
