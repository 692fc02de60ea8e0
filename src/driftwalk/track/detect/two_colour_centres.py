"""Subpixel centres of the two discs of a marker, with their covariance.

Each pixel's place counts by how much of the colour it shows. Discs that are partly hidden are
measured by their outlines: the outline of what is seen is partly the disc's own, a circle of known
size, and partly the edge of what hides it, which can only lie inside the circle. Both circles, at
the marker's spacing, are laid over the outlines: points inside a circle count up to a limit, those
outside more.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Bools, Floats, Indices, Singles


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
"""Gaussian of three pixels; it is normalised where it is used."""


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
    cv2: Any, weights: list[Singles], start: Floats, *, diameter: float
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
        variances[2 * which : 2 * which + 2], uneven[which] = _variance(cv2, weight, centre, reach)
    return Measured(centres, np.diag(variances), shares, float(uneven.max()) / diameter)


def _centre(weight: Singles, start: Floats, reach: float) -> tuple[Floats, float]:
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


def _variance(cv2: Any, weight: Singles, centre: Floats, reach: float) -> tuple[Floats, float]:
    """Return the variance of a disc's centre along columns and rows [px²], and how uneven it is.

    A disc looks the same when it is turned by half a turn about its centre: what differs is noise,
    whatever its source, and has twice a pixel's variance. Each pixel moves the mean by its distance
    times its noise over the mass.
    """
    inside, square, harmonics = _window(int(reach))
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
def _window(half: int) -> tuple[Singles, Floats, npt.NDArray[np.complex64]]:
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


class OutlinePolicy(NamedTuple):
    """How two circles are fitted to the outlines of partly hidden discs."""

    level: float = 0.5
    """Weight at the outline, as a share of the weight within; chosen by hand."""
    scale_px: float = 0.6
    """Distance at which an outline inside a circle counts a half of its limit [px]; chosen by
    hand."""
    outside: float = 6.0
    """How many times more an outline outside a circle may count than one inside; chosen by
    hand."""
    rounds: int = 12
    """Steps of the fit; chosen by hand."""
    starts: int = 4
    """Best starts from which it is done; chosen by hand."""
    least_points: int = 6
    """Points without which an outline says nothing; chosen by hand."""
    least_std_px: float = 0.12
    """Least standard deviation of a point of the outline [px]; chosen by hand."""
    correlated: float = 12.0
    """Neighbouring points of an outline share their pixels, so fewer are independent; measured on
    rendered frames with hidden discs."""
    sliver: float = 0.35
    """Share of a disc below which what is seen of it may fit the marker in more than one
    direction; chosen by hand."""


_OUTLINE: Final = OutlinePolicy()

_TURNS: Final = np.radians(np.arange(-40.0, 41.0, 8.0))
"""Turns from which the fit of outlines begins [rad]; chosen by hand."""
_SWINGS: Final = np.radians(np.arange(-60.0, 60.1, 0.5))
"""Directions about the held disc whose fit is looked at [rad]; chosen by hand."""


def outlined_centres(
    weights: list[Singles], start: Floats, *, diameter: float, spacing: float
) -> Measured | None:
    """Return the centres of two discs of which parts may be hidden.

    Parameters
    ----------
    weights : list of array, shape (rows, columns)
        Weight of each colour in a patch.
    start : array, shape (2, 2)
        (column, row) of both in the patch, roughly.
    diameter, spacing : float
        Of the marker [px].

    Returns
    -------
    Measured or None
        None when too little of an outline is seen.
    """
    parts = [_outline(w, at, diameter) for w, at in zip(weights, start, strict=True)]
    if min(map(len, parts)) < _OUTLINE.least_points:
        return None
    points = np.concatenate(parts)
    side = np.repeat([-0.5, 0.5], [len(part) for part in parts])
    along = start[1] - start[0]
    first = np.array([*start.mean(axis=0), math.atan2(along[1], along[0])])
    tried = _search(points, side, first, diameter, spacing)
    pose, normal, rms = _refine(points, side, tried, diameter, spacing)
    half = np.array([math.cos(pose[2]), math.sin(pose[2])]) * spacing / 2
    centres = np.stack([pose[:2] - half, pose[:2] + half])
    noise = _OUTLINE.correlated * max(rms, _OUTLINE.least_std_px) ** 2
    variance = noise * np.linalg.inv(normal)
    turned = np.array([-half[1], half[0]])
    lever = np.zeros((4, 3))
    lever[:2, :2] = lever[2:, :2] = np.eye(2)
    lever[:2, 2], lever[2:, 2] = -turned, turned
    covariance = lever @ variance @ lever.T
    shares = _shares(weights, centres, diameter)
    least = int(np.argmin(shares))
    if shares[least] < _OUTLINE.sliver:
        swung = _swing_variance(parts[least], centres[1 - least], centres[least], diameter, noise)
        sway = 4.0 * np.outer(turned, turned)
        block = np.s_[2 * least : 2 * least + 2]
        covariance[block, block] += max(swung - variance[2, 2], 0.0) * sway
    return Measured(centres, covariance, shares)


def _outline(weight: Singles, at: Floats, diameter: float) -> Floats:
    """Return where a colour's weight crosses half of its height, shape (n, 2)."""
    weight, near, corner = _around(weight, at, 1.2 * diameter)
    inside = weight[near & (weight > _OUTLINE.level)]
    level = _OUTLINE.level * (float(np.median(inside)) if inside.size else 1.0)
    over = weight > level
    down_row, down_column = np.nonzero((over[:-1] != over[1:]) & near[:-1])
    along_row, along_column = np.nonzero((over[:, :-1] != over[:, 1:]) & near[:, :-1])
    below = _part(weight, level, down_row, down_column, (1, 0))
    beside = _part(weight, level, along_row, along_column, (0, 1))
    found = np.empty((len(below) + len(beside), 2))
    found[:, 0] = np.concatenate([down_column, along_column + beside])
    found[:, 1] = np.concatenate([down_row + below, along_row])
    return np.asarray(found + corner)


def _around(weight: Singles, at: Floats, reach: float) -> tuple[Singles, Bools, Floats]:
    """Return a part of a patch, which of its pixels are near a place, and where it begins."""
    left, top = (max(math.floor(place - reach), 0) for place in at.tolist())
    # One more than needed, for outlines between the last pixel that is near and the next.
    right, bottom = (max(math.ceil(place + reach) + 2, 0) for place in at.tolist())
    part = weight[top:bottom, left:right]
    rows, columns = part.shape
    across, down = np.arange(left, left + columns) - at[0], np.arange(top, top + rows) - at[1]
    return part, across**2 + (down**2)[:, None] < reach**2, np.array([left, top])


def _part(
    weight: Singles, level: float, row: Indices, column: Indices, step: tuple[int, int]
) -> Floats:
    """Return which part of the way from pixels to the next ones a level is reached."""
    low, high = weight[row, column], weight[row + step[0], column + step[1]]
    return np.asarray((level - low) / (high - low), dtype=np.float64)


def _search(points: Floats, side: Floats, first: Floats, diameter: float, spacing: float) -> Floats:
    """Return the best poses of a grid around the first one, shape (n, 3)."""
    shift = np.arange(-0.3, 0.31, 0.1) * diameter
    turned = first[2] + _TURNS[:, None]
    # Shifts along columns and along rows apart: a distance takes one sum a pose and point. Single
    # precision is plenty to find where to begin.
    column = (points[:, 0] - first[0] - side * spacing * np.cos(turned)).astype(np.float32)
    row = (points[:, 1] - first[1] - side * spacing * np.sin(turned)).astype(np.float32)
    moved = shift.astype(np.float32)[:, None, None]
    across, down = (column - moved) ** 2, (row - moved) ** 2
    # A coarse grid is searched with a coarse scale.
    scale = 2.0 * _OUTLINE.scale_px
    beyond = across[:, None] + down
    np.sqrt(beyond, out=beyond)
    beyond -= np.float32(diameter / 2)
    beyond *= np.float32(1.0 / scale)
    limit = np.where(beyond > 0.0, np.float32(_OUTLINE.outside), np.float32(1.0))
    beyond *= beyond
    cost = limit * beyond
    beyond += limit
    cost /= beyond
    best = np.argsort(cost.sum(axis=-1), axis=None)[: _OUTLINE.starts]
    i, j, k = np.unravel_index(best, cost.shape[:-1])
    return np.asarray(first + np.stack([shift[i], shift[j], _TURNS[k]], axis=-1))


def _cost(beyond: Floats, scale: float) -> tuple[Floats, Floats]:
    """Return cost and weight of points at a distance beyond their circle [px]."""
    square = (beyond / scale) ** 2
    limit = np.where(beyond > 0.0, _OUTLINE.outside, 1.0)
    held = limit / (limit + square)
    return held * square, held**2


def _refine(
    points: Floats, side: Floats, poses: Floats, diameter: float, spacing: float
) -> tuple[Floats, Floats, float]:
    """Return the pose of least cost near some, its normal matrix and its residual [px].

    All are moved together, each until it stands still.
    """
    poses = poses.copy()
    costs = np.empty(len(poses))
    normals, residuals = np.empty((len(poses), 3, 3)), np.empty(len(poses))
    steadied = np.diag([1e-3, 1e-3, 1e-3 * spacing**2])
    moving = np.arange(len(poses))
    lever = side * spacing
    for step in range(_OUTLINE.rounds):
        scale = _OUTLINE.scale_px * max(2.0 - step / 3.0, 1.0)
        pose = poses[moving]
        cos, sin = np.cos(pose[:, 2:]), np.sin(pose[:, 2:])
        out = np.empty((len(moving), 3, len(points)))
        out[:, 0] = points[:, 0] - pose[:, :1] - lever * cos
        out[:, 1] = points[:, 1] - pose[:, 1:2] - lever * sin
        radius = np.maximum(np.sqrt(out[:, 0] ** 2 + out[:, 1] ** 2), 1e-6)
        beyond = radius - diameter / 2
        out[:, :2] /= radius[:, None]
        out[:, 2] = lever * (cos * out[:, 1] - sin * out[:, 0])
        cost, weight = _cost(beyond, scale)
        pulled = out * weight[:, None]
        normal = pulled @ out.transpose(0, 2, 1) + steadied
        change = np.linalg.solve(normal, pulled @ beyond[..., None])[..., 0]
        furthest = np.maximum(np.abs(change[:, :2]).max(axis=1), 1e-9)
        change *= np.minimum(1.0, 0.1 * diameter / furthest)[:, None]
        change[:, 2] = np.clip(change[:, 2], -0.15, 0.15)
        poses[moving] = pose + change
        costs[moving], normals[moving] = cost.sum(axis=1), normal
        residuals[moving] = (weight * beyond**2).sum(axis=1) / np.maximum(weight.sum(axis=1), 1e-9)
        if scale == _OUTLINE.scale_px:
            moving = moving[np.abs(change).max(axis=1) >= 1e-3]
            if not len(moving):
                break
    best = int(np.argmin(costs))
    return poses[best], normals[best], math.sqrt(float(residuals[best]))


def _swing_variance(
    points: Floats, held: Floats, centre: Floats, diameter: float, noise: float
) -> float:
    """Return the variance of a marker's direction when little is seen of one of its discs [rad²].

    The other disc is held, and this one swung around it: each direction counts as its outline fits
    there. Between a bar and a patch of glare a sliver may fit as well on another side, of which the
    slopes at the best direction know nothing.
    """
    column, row = centre - held
    cos, sin = np.cos(_SWINGS)[:, None], np.sin(_SWINGS)[:, None]
    across = points[:, 0] - held[0] - (cos * column - sin * row)
    down = points[:, 1] - held[1] - (sin * column + cos * row)
    beyond = np.sqrt(across**2 + down**2) - diameter / 2
    cost = _cost(beyond, _OUTLINE.scale_px)[0].sum(axis=1) * _OUTLINE.scale_px**2 / noise
    likely = np.exp(-0.5 * (cost - cost.min()))
    return float(likely @ _SWINGS**2 / likely.sum())


def _shares(weights: list[Singles], centres: Floats, diameter: float) -> Floats:
    """Return how much of each disc is seen."""
    seen = []
    for weight, centre in zip(weights, centres, strict=True):
        part, disc, _ = _around(weight, centre, diameter / 2 + 1.0)
        seen.append(float(np.count_nonzero(disc & (part > _OUTLINE.level))))
    return np.array(seen) / (math.pi * diameter**2 / 4.0)
