"""Subpixel centres of the two discs of a marker, with their covariance.

Each pixel's place counts by how much of the colour it shows; discs that are partly hidden are
measured by their outlines (`driftwalk.track.detect.two_colour.outline`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats
from driftwalk.track.detect.markers import Weights


class CentrePolicy(NamedTuple):
    """How the centre of a disc is measured."""

    smoothing_px: float = 0.6
    """Standard deviation of the smoothing of a patch before it is measured [px]; chosen by hand."""
    window: float = 1.4
    """Size of the window around a disc, in diameters; chosen by hand."""
    edge_px: float = 1.2
    """Width of the disc's blurred edge [px]; chosen by hand."""
    floor_px: float = 0.005
    """Standard deviation that no centre is better than: colours have 8 bits [px]; chosen by
    hand."""
    chance: float = 2.5
    """Standard deviations that chance explains; chosen by hand."""


CENTRES: Final = CentrePolicy()

_KERNEL: Final = np.exp(-0.5 * (np.arange(-1.0, 2.0) / CENTRES.smoothing_px) ** 2)


@dataclass(frozen=True)
class Measured:
    """The two centres of a marker in a patch.

    Parameters
    ----------
    centres : array, shape (2, 2)
        (column, row) of both discs [px].
    covariance : array, shape (4, 4)
        Of (column, row) of the first and of the second [px²].
    shares : array, shape (2,)
        Share of each disc that is seen.
    uneven : float
        How uneven the more uneven of the two discs is beyond chance, in diameters: about how far
        its centre is off when a part of its edge is hidden.
    """

    centres: Floats
    covariance: Floats
    shares: Floats
    uneven: float = 0.0

    @property
    def visible(self) -> float:
        """Share of the two discs that is seen, 0 to 1."""
        return float(np.minimum(self.shares, 1.0).mean())


def weighted_centres(
    cv2: Any, weights: list[Weights], start: Floats, *, diameter: float
) -> Measured:
    """Return the centres of two whole discs.

    Parameters
    ----------
    cv2 : module
        OpenCV.
    weights : list of array, shape (rows, columns)
        Weight of each colour in a patch that was smoothed by `CENTRES.smoothing_px`.
    start : array, shape (2, 2)
        (column, row) of both in the patch, to about a pixel.
    diameter : float
        Of a disc [px].
    """
    centres, variances = start.copy(), np.zeros(4)
    shares, uneven = np.zeros(2), np.zeros(2)
    reach = CENTRES.window * diameter / 2 + CENTRES.edge_px
    for which, weight in enumerate(weights):
        centre, share = _centre(weight, start[which], reach)
        centres[which], shares[which] = centre, share / (math.pi * diameter**2 / 4.0)
        both = _variance(cv2, weight, centre, reach)
        variances[2 * which : 2 * which + 2], uneven[which] = both
    return Measured(centres, np.diag(variances), shares, float(uneven.max()) / diameter)


def _centre(weight: Weights, start: Floats, reach: float) -> tuple[Floats, float]:
    """Return the centre of a disc, and the area over half of its height [px²]."""
    rows, columns = weight.shape
    column, row = start.tolist()
    area = 0.0
    for _ in range(2):
        left, right = max(int(column - reach), 0), min(int(column + reach) + 2, columns)
        top, bottom = max(int(row - reach), 0), min(int(row + reach) + 2, rows)
        across, down = np.arange(left, right) - column, np.arange(top, bottom) - row
        near = across**2 + (down**2)[:, None] <= reach * reach
        inside = weight[top:bottom, left:right] * near
        mass = float(inside.sum())
        if mass <= 0.0:
            break
        # The mean weight where there is weight: the disc's height, whatever its brightness.
        height = float(np.vdot(inside, inside)) / mass
        area = float(np.count_nonzero(inside > 0.5 * height))
        column += float(inside.sum(axis=0) @ across) / mass
        row += float(inside.sum(axis=1) @ down) / mass
    return np.array([column, row]), area


def _variance(cv2: Any, weight: Weights, centre: Floats, reach: float) -> tuple[Floats, float]:
    """Return the variance of a disc's centre along columns and rows [px²], and how uneven it is.

    A disc looks the same when it is turned by half a turn about its centre: what differs is noise,
    whatever its source, and has twice a pixel's variance. Each pixel moves the mean by its distance
    times its noise over the mass.
    """
    half = int(reach)
    inside, square, harmonics = _window(half)
    column, row = centre.tolist()
    around = cv2.getRectSubPix(weight, inside.shape, (column, row)) * inside
    noise = (around - around[::-1, ::-1]) ** 2
    mass = max(float(around.sum()), 1.0)
    moment = np.array([noise.sum(axis=0) @ square, noise.sum(axis=1) @ square]) / 2.0
    hidden = _smoothed_by(column % 1.0) * _smoothed_by(row % 1.0)
    variance = moment * hidden / mass**2 + CENTRES.floor_px**2
    uneven = float(np.sqrt((np.abs(harmonics @ around.ravel()) ** 2).mean())) / mass
    by_chance = CENTRES.chance * math.sqrt(float(variance.mean()))
    return np.asarray(variance), uneven if uneven > by_chance else 0.0


@lru_cache(maxsize=64)
def _window(half: int) -> tuple[Weights, Floats, npt.NDArray[np.complex64]]:
    """Return a round window, squares of distances along one side, and two harmonics, flat.

    The harmonics are the second and the third; both are of the form of a distance, so that they
    vary as the centre does by chance. A disc of which a part is missing has all harmonics; one that
    is elsewhere has the first one only.
    """
    line = np.arange(-half, half + 1.0)
    place = line + 1j * line[:, None]
    distance = np.abs(place)
    inside = (distance <= half).astype(np.float32)
    unit = place / np.maximum(distance, 1.0)
    both = np.stack([(distance * unit**order * inside).ravel() for order in (2, 3)])
    return inside, line**2, both.astype(np.complex64)


def _smoothed_by(part: float) -> float:
    """Return by how much one direction of a smoothed patch lessens the variance of its noise.

    It was smoothed once as a whole, and once more by reading it between its pixels; a sum over
    many pixels varies as it did before.
    """
    kernel = np.convolve(_KERNEL / _KERNEL.sum(), [1.0 - part, part])
    return 1.0 / float(kernel @ kernel)
