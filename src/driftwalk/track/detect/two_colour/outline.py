"""Fit partly hidden discs by their outlines.

The outline of what is seen of a disc is partly the disc's own, a circle of known size, and partly
the edge of what hides it, which can only lie inside the circle. Both circles, at the marker's
spacing, are laid over the outlines: points inside a circle count up to a limit, those outside more.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Bools, Floats, Indices
from driftwalk.track.detect.markers import Weights
from driftwalk.track.detect.two_colour.pose import Measured


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
_SHIFTS: Final = np.arange(-0.3, 0.31, 0.1)
_SWINGS: Final = np.radians(np.arange(-60.0, 60.1, 0.5))


def outlined_centres(
    weights: list[Weights], start: Floats, *, diameter: float, spacing: float
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


def _outline(weight: Weights, at: Floats, diameter: float) -> Floats:
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


def _around(weight: Weights, at: Floats, reach: float) -> tuple[Weights, Bools, Floats]:
    """Return a part of a patch, which of its pixels are near a place, and where it begins."""
    left, top = (max(math.floor(place - reach), 0) for place in at.tolist())
    # One more than needed, for outlines between the last pixel that is near and the next.
    right, bottom = (max(math.ceil(place + reach) + 2, 0) for place in at.tolist())
    part = weight[top:bottom, left:right]
    rows, columns = part.shape
    across, down = np.arange(left, left + columns) - at[0], np.arange(top, top + rows) - at[1]
    return part, across**2 + (down**2)[:, None] < reach**2, np.array([left, top])


def _part(
    weight: Weights, level: float, row: Indices, column: Indices, step: tuple[int, int]
) -> Floats:
    """Return which part of the way from pixels to the next ones a level is reached."""
    low, high = weight[row, column], weight[row + step[0], column + step[1]]
    return np.asarray((level - low) / (high - low), dtype=np.float64)


def _search(points: Floats, side: Floats, first: Floats, diameter: float, spacing: float) -> Floats:
    """Return the best poses of a grid around the first one, shape (n, 3)."""
    shift = _SHIFTS * diameter
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


def _shares(weights: list[Weights], centres: Floats, diameter: float) -> Floats:
    """Return how much of each disc is seen."""
    seen = []
    for weight, centre in zip(weights, centres, strict=True):
        part, disc, _ = _around(weight, centre, diameter / 2 + 1.0)
        seen.append(float(np.count_nonzero(disc & (part > _OUTLINE.level))))
    return np.array(seen) / (math.pi * diameter**2 / 4.0)
