"""Where the two discs of a marker are, to a small part of a pixel.

Whole discs: the mean place of the colour, weighted by how much of it each pixel shows. Discs that
are partly hidden: a model of both discs with the marker's size and spacing is laid over the
colours. What hides a disc takes colour away but never adds any, so colour beyond the model counts
in full, and missing colour only up to a limit.
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
_FIT_ROUNDS: Final = 14
_LIMITS: Final = (0.8, 0.3)
"""Size of a missing weight that counts half, at the start and at the end of the fit."""
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


def noise_of(weights: list[Weights]) -> float:
    """Return the standard deviation of a pixel's weight, from neighbours inside the discs."""
    steps = []
    for weight in weights:
        inside = (weight[:, 1:] > 0.7) & (weight[:, :-1] > 0.7)
        steps.append((weight[:, 1:] - weight[:, :-1])[inside])
    together = np.concatenate(steps)
    if together.size < 8:
        return 0.1
    return float(np.median(np.abs(together)) / (0.6745 * math.sqrt(2.0)))


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


def fitted_centres(
    weights: list[Weights], start: Array, *, diameter: float, spacing: float, noise: float
) -> Measured:
    """Return the centres of two discs of which parts may be hidden.

    Parameters
    ----------
    weights : list of array, shape (rows, columns)
        Weight of each colour in a patch.
    start : array, shape (2, 2)
        (column, row) of both in the patch, roughly.
    diameter, spacing : float
        Of the marker [px].
    noise : float
        Standard deviation of a weight.
    """
    data = np.stack([np.minimum(weight, 1.0) for weight in weights]).astype(np.float64)
    rows, columns = np.meshgrid(*(np.arange(n) for n in data.shape[1:]), indexing="ij")
    place = np.stack([columns, rows]).astype(np.float64)
    along = start[1] - start[0]
    pose = np.array([*start.mean(axis=0), math.atan2(along[1], along[0])])
    normal = np.eye(3)
    damping = 1e-3
    cost, slopes, gradient, normal = _terms(data, place, pose, diameter, spacing, _LIMITS[0])
    for step in range(_FIT_ROUNDS):
        limit = _LIMITS[0] + (_LIMITS[1] - _LIMITS[0]) * min(step / (_FIT_ROUNDS / 2), 1.0)
        cost, _, gradient, normal = _terms(data, place, pose, diameter, spacing, limit)
        change = -np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-9), gradient)
        # A step of more than a fifth of a disc leaves the edge that the slopes describe.
        change *= min(1.0, 0.2 * diameter / max(float(np.hypot(change[0], change[1])), 1e-12))
        change[2] = np.clip(change[2], -0.3, 0.3)
        pose = pose + change
        if step >= _FIT_ROUNDS / 2 and np.abs(change).max() < 1e-3:
            break
    centres, model, _ = _model(place, pose, diameter, spacing)
    seen = np.minimum(data, model)
    variance = noise**2 * np.linalg.inv(normal + 1e-6 * np.eye(3))
    return Measured(
        centres,
        _of_centres(variance, pose[2], spacing),
        float(seen.sum() / model.sum()),
        float(seen.sum() / max(data.sum(), 1e-9)),
    )


def _terms(
    data: Array, place: Array, pose: Array, diameter: float, spacing: float, limit: float
) -> tuple[float, Array, Array, Array]:
    """Return cost, slopes, gradient and normal matrix of the one-sided fit."""
    _, model, slopes = _model(place, pose, diameter, spacing)
    residual = data - model
    missing = np.where(residual < 0.0, residual / limit, 0.0)
    weight = 1.0 / (1.0 + missing**2) ** 2
    flat = slopes.reshape(3, -1)
    weighted = flat * weight.ravel()
    gradient = -weighted @ residual.ravel()
    normal = weighted @ flat.T + 1e-9 * np.eye(3)
    cost = float((residual**2 / (1.0 + missing**2)).sum())
    return cost, slopes, gradient, normal


def _model(
    place: Array, pose: Array, diameter: float, spacing: float
) -> tuple[Array, Array, Array]:
    """Return centres, coverage of both discs, and its slopes along column, row and angle."""
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    half = np.array([cos, sin]) * spacing / 2
    turned = np.array([-sin, cos]) * spacing / 2
    centres = np.stack([pose[:2] - half, pose[:2] + half])
    coverage, slopes = [], []
    for centre, sign in zip(centres, (-1.0, 1.0), strict=True):
        dc, dr = place[0] - centre[0], place[1] - centre[1]
        radius = np.hypot(dc, dr)
        value = 1.0 / (1.0 + np.exp(np.clip((radius - diameter / 2) * (1.7 / _EDGE_PX), -40, 40)))
        steep = value * (1.0 - value) * (1.7 / _EDGE_PX) / np.maximum(radius, 1e-6)
        by_column, by_row = steep * dc, steep * dr
        coverage.append(value)
        slopes.append(
            np.stack([by_column, by_row, sign * (by_column * turned[0] + by_row * turned[1])])
        )
    return centres, np.stack(coverage), np.stack(slopes, axis=1)


def _of_centres(variance: Array, angle: float, spacing: float) -> Array:
    """Return the covariance of both centres from that of middle and angle."""
    turned = np.array([-math.sin(angle), math.cos(angle)]) * spacing / 2
    lever = np.zeros((4, 3))
    lever[:2, :2] = lever[2:, :2] = np.eye(2)
    lever[:2, 2], lever[2:, 2] = -turned, turned
    return np.asarray(lever @ variance @ lever.T + _FLOOR_PX**2 * np.eye(4))
