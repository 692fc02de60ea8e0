"""Where the two discs of a marker are when parts of them are hidden: from their outlines.

The outline of what is seen of a disc is partly the disc's own, a circle of known size, and partly
the edge of what hides it, which can only lie inside the circle. Both circles, at the marker's
spacing, are laid over the outlines: points inside a circle count up to a limit, those outside more.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from driftwalk.track.chroma import Weights
from driftwalk.track.two_colour_pose import Measured
from driftwalk.track.types import Array

_LEVEL: Final = 0.5
_SCALE_PX: Final = 0.6
"""Distance at which an outline inside a circle counts a half of its limit [px]."""
_OUTSIDE: Final = 6.0
"""How many times more an outline outside a circle may count than one inside."""
_TURNS: Final = np.radians(np.arange(-40.0, 41.0, 8.0))
_SHIFTS: Final = np.arange(-0.3, 0.31, 0.1)
_ROUNDS: Final = 12
_STARTS: Final = 4
_LEAST_POINTS: Final = 6
_LEAST_STD_PX: Final = 0.12
_CORRELATED: Final = 12.0
"""Neighbouring points of an outline share their pixels, so fewer are independent; measured on
rendered frames with hidden discs."""


def outlined_centres(
    weights: list[Weights], start: Array, *, diameter: float, spacing: float
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
    if min(map(len, parts)) < _LEAST_POINTS:
        return None
    points = np.concatenate(parts)
    side = np.repeat([-0.5, 0.5], [len(part) for part in parts])
    along = start[1] - start[0]
    first = np.array([*start.mean(axis=0), math.atan2(along[1], along[0])])
    tried = _search(points, side, first, diameter, spacing)
    fits = [_refine(points, side, pose, diameter, spacing) for pose in tried]
    pose, _, normal, rms = min(fits, key=lambda fit: fit[1])
    half = np.array([math.cos(pose[2]), math.sin(pose[2])]) * spacing / 2
    centres = np.stack([pose[:2] - half, pose[:2] + half])
    variance = _CORRELATED * max(rms, _LEAST_STD_PX) ** 2 * np.linalg.inv(normal)
    turned = np.array([-half[1], half[0]])
    lever = np.zeros((4, 3))
    lever[:2, :2] = lever[2:, :2] = np.eye(2)
    lever[:2, 2], lever[2:, 2] = -turned, turned
    return Measured(centres, lever @ variance @ lever.T, _shares(weights, centres, diameter))


def _outline(weight: Weights, at: Array, diameter: float) -> Array:
    """Return where a colour's weight crosses half of its height, shape (n, 2)."""
    rows, columns = np.ogrid[: weight.shape[0], : weight.shape[1]]
    near = (columns - at[0]) ** 2 + (rows - at[1]) ** 2 < (1.2 * diameter) ** 2
    inside = weight[near & (weight > _LEVEL)]
    level = _LEVEL * (float(np.median(inside)) if inside.size else 1.0)
    over = weight > level
    found = []
    for axis in (0, 1):
        low = weight[:-1] if axis == 0 else weight[:, :-1]
        high = weight[1:] if axis == 0 else weight[:, 1:]
        crossed = np.logical_xor(
            *((over[:-1], over[1:]) if axis == 0 else (over[:, :-1], over[:, 1:]))
        )
        crossed &= near[:-1] if axis == 0 else near[:, :-1]
        row, column = np.nonzero(crossed)
        part = (level - low[crossed]) / (high[crossed] - low[crossed])
        step = np.stack([column + part * axis, row + part * (1 - axis)], axis=-1)
        found.append(step)
    return np.concatenate(found)


def _search(
    points: Array, side: Array, first: Array, diameter: float, spacing: float
) -> list[Array]:
    """Return the best poses of a grid around the first one."""
    shift = _SHIFTS * diameter
    grid = np.stack(np.meshgrid(shift, shift, _TURNS, indexing="ij"), axis=-1).reshape(-1, 3)
    poses = first + grid
    reach = side[None, :] * spacing
    column = points[None, :, 0] - poses[:, None, 0] - reach * np.cos(poses[:, None, 2])
    row = points[None, :, 1] - poses[:, None, 1] - reach * np.sin(poses[:, None, 2])
    # A coarse grid is searched with a coarse scale.
    cost = _cost(np.hypot(column, row) - diameter / 2, 2.0 * _SCALE_PX)[0].sum(axis=1)
    return list(poses[np.argsort(cost)[:_STARTS]])


def _cost(beyond: Array, scale: float) -> tuple[Array, Array]:
    """Return cost and weight of points at a distance beyond their circle [px]."""
    square = (beyond / scale) ** 2
    limit = np.where(beyond > 0.0, _OUTSIDE, 1.0)
    return limit * square / (limit + square), (limit / (limit + square)) ** 2


def _refine(
    points: Array, side: Array, pose: Array, diameter: float, spacing: float
) -> tuple[Array, float, Array, float]:
    """Return the pose of least cost near one, its cost, normal matrix and residual [px]."""
    for step in range(_ROUNDS):
        scale = _SCALE_PX * max(2.0 - step / 3.0, 1.0)
        cos, sin = math.cos(pose[2]), math.sin(pose[2])
        away = points - pose[:2] - side[:, None] * spacing * np.array([cos, sin])
        radius = np.maximum(np.hypot(away[:, 0], away[:, 1]), 1e-6)
        beyond = radius - diameter / 2
        cost, weight = _cost(beyond, scale)
        out = away / radius[:, None]
        turn = side * spacing * (-sin * out[:, 0] + cos * out[:, 1])
        slopes = np.column_stack([out, turn])
        normal = slopes.T @ (slopes * weight[:, None]) + np.diag([1e-3, 1e-3, 1e-3 * spacing**2])
        change = np.linalg.solve(normal, slopes.T @ (weight * beyond))
        change *= min(1.0, 0.1 * diameter / max(float(np.abs(change[:2]).max()), 1e-9))
        change[2] = min(max(change[2], -0.15), 0.15)
        pose = pose + change
        if scale == _SCALE_PX and np.abs(change).max() < 1e-3:
            break
    rms = math.sqrt(float((weight * beyond**2).sum() / max(weight.sum(), 1e-9)))
    return pose, float(cost.sum()), normal, rms


def _shares(weights: list[Weights], centres: Array, diameter: float) -> Array:
    """Return how much of each disc is seen."""
    seen = []
    for weight, centre in zip(weights, centres, strict=True):
        rows, columns = np.ogrid[: weight.shape[0], : weight.shape[1]]
        disc = np.hypot(columns - centre[0], rows - centre[1]) < diameter / 2 + 1.0
        seen.append(float(np.count_nonzero(disc & (weight > _LEVEL))))
    return np.array(seen) / (math.pi * diameter**2 / 4.0)
