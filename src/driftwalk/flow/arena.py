"""Geometry of the tank: inside test, wall normals, intersection of a ray with the wall."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.schema.trajectory import read_arena

SHAPES = ("circle", "rectangle", "polygon")


@dataclass(frozen=True)
class Circle:
    """A circular tank."""

    radius: float
    center: tuple[float, float] = (0.0, 0.0)

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Bounding box (x_min, y_min, x_max, y_max) [m]."""
        (x, y), r = self.center, self.radius
        return x - r, y - r, x + r, y + r

    def depth(self, x: Floats, y: Floats) -> Floats:
        """Return the distance to the wall [m], negative outside."""
        return self.radius - np.hypot(x - self.center[0], y - self.center[1])

    def normal(self, x: Floats, y: Floats) -> Floats:
        """Return the unit normal into the tank of the wall nearest to each point, shape (n, 2).

        At the very centre, where all of the wall is as near, it is +x.
        """
        towards = np.column_stack([self.center[0] - x, self.center[1] - y])
        length = np.hypot(towards[:, 0], towards[:, 1])
        towards[length == 0.0] = (1.0, 0.0)
        return np.asarray(towards / np.where(length == 0.0, 1.0, length)[:, None])

    def leave(self, x: Floats, y: Floats, dx: Floats, dy: Floats) -> tuple[Floats, Floats]:
        """Return where the way from an inside point to an outside point crosses the wall.

        Returns
        -------
        part : ndarray, shape (n,)
            Part of the way (dx, dy) that lies inside, in [0, 1].
        normal : ndarray, shape (n, 2)
            Unit normal into the tank at the crossing.
        """
        px, py = x - self.center[0], y - self.center[1]
        a, b = dx**2 + dy**2, px * dx + py * dy
        c = px**2 + py**2 - self.radius**2
        part = np.clip((np.sqrt(np.maximum(b**2 - a * c, 0.0)) - b) / a, 0.0, 1.0)
        return part, self.normal(x + part * dx, y + part * dy)


@dataclass(frozen=True)
class ConvexPolygon:
    """A convex tank with straight walls, corners counter-clockwise."""

    corners: tuple[tuple[float, float], ...]

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Bounding box (x_min, y_min, x_max, y_max) [m]."""
        (x0, y0), (x1, y1) = np.min(self.corners, axis=0), np.max(self.corners, axis=0)
        return float(x0), float(y0), float(x1), float(y1)

    def depth(self, x: Floats, y: Floats) -> Floats:
        """Return the distance to the nearest wall's line [m], negative outside."""
        return np.asarray(self._distances(x, y).min(axis=0))

    def normal(self, x: Floats, y: Floats) -> Floats:
        """Return the unit normal into the tank of the nearest wall's line."""
        return np.asarray(self._normals()[self._distances(x, y).argmin(axis=0)])

    def leave(self, x: Floats, y: Floats, dx: Floats, dy: Floats) -> tuple[Floats, Floats]:
        """Return where the way from an inside point to an outside point crosses the wall.

        Parameters and values are as in `Circle.leave`.
        """
        inside, normals = self._distances(x, y), self._normals()
        closing = -(normals @ np.stack([dx, dy]))
        with np.errstate(divide="ignore", invalid="ignore"):
            part = np.where(closing > 0.0, inside / closing, np.inf)
        return np.clip(part.min(axis=0), 0.0, 1.0), normals[part.argmin(axis=0)]

    def _normals(self) -> Floats:
        corners = np.asarray(self.corners)
        along = np.roll(corners, -1, axis=0) - corners
        left = np.column_stack([-along[:, 1], along[:, 0]])
        return np.asarray(left / np.hypot(along[:, 0], along[:, 1])[:, None])

    def _distances(self, x: Floats, y: Floats) -> Floats:
        """Return how far each point is inside each edge's line, shape (edges, n)."""
        corners, normals = np.asarray(self.corners), self._normals()
        offsets = np.sum(normals * corners, axis=1)
        return np.asarray(normals @ np.stack([x, y]) - offsets[:, None])


Outline = Circle | ConvexPolygon
"""A convex region of the plane."""


def outline_of(arena: Mapping[str, Any] | str) -> Outline:
    """Return the outline that an `arena` describes.

    Parameters
    ----------
    arena : mapping or str
        ``{"shape": "circle", "diameter_m": 0.3, "center_m": [0, 0]}``, ``{"shape": "rectangle",
        "width_m": ..., "height_m": ..., "center_m": [0, 0]}`` or ``{"shape": "polygon",
        "vertices_m": [[x, y], ...]}`` (convex), or the same as JSON text. The centre may be left
        out and is then the origin.

    Raises
    ------
    InputError
        When it is not JSON, the shape is unknown, a key is missing or has no usable value, or the
        polygon is not convex.

    Examples
    --------
    >>> outline_of({"shape": "circle", "diameter_m": 0.3}).bounds
    (-0.15, -0.15, 0.15, 0.15)
    """
    facts = read_arena(arena)
    shape = facts.get("shape")
    if shape == "circle":
        return Circle(_length(facts, "diameter_m") / 2.0, _center(facts))
    if shape == "rectangle":
        half_x, half_y = _length(facts, "width_m") / 2.0, _length(facts, "height_m") / 2.0
        x, y = _center(facts)
        signs = ((-1, -1), (1, -1), (1, 1), (-1, 1))
        return ConvexPolygon(tuple((x + a * half_x, y + b * half_y) for a, b in signs))
    if shape == "polygon":
        return ConvexPolygon(_convex_corners(facts))
    raise InputError(f"the arena has shape {shape!r}, expected one of {', '.join(SHAPES)}")


def _length(facts: Mapping[str, Any], key: str) -> float:
    value = facts.get(key)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(f"the arena needs {key}, a number in m, got {value!r} in {dict(facts)}")
    if not (math.isfinite(value) and value > 0.0):
        raise InputError(f"the arena's {key} must be positive, got {value!r}")
    return float(value)


def _center(facts: Mapping[str, Any]) -> tuple[float, float]:
    ((x, y),) = _points([facts.get("center_m", (0.0, 0.0))], "center_m")
    return x, y


def _points(values: Any, key: str) -> list[tuple[float, float]]:
    try:
        points = [(float(x), float(y)) for x, y in values]
    except (TypeError, ValueError) as error:
        raise InputError(f"the arena's {key} must be [x, y] in m, got {values!r}") from error
    if not all(math.isfinite(value) for point in points for value in point):
        raise InputError(f"the arena's {key} has a value that is not finite: {values!r}")
    return points


def _convex_corners(facts: Mapping[str, Any]) -> tuple[tuple[float, float], ...]:
    """Return the corners counter-clockwise, or raise when they are not a convex polygon."""
    corners = _points(facts.get("vertices_m"), "vertices_m")
    if len(corners) < 3:
        raise InputError(f"the arena's polygon needs at least 3 corners, got {len(corners)}")
    points = np.asarray(corners)
    x, y = (points - points.mean(axis=0)).T
    area = float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) / 2.0
    size = float(np.hypot(x, y).max())
    if abs(area) <= 1e-9 * size**2 or len(set(corners)) < len(corners):
        raise InputError("the arena's polygon repeats a corner or has no area")
    polygon = ConvexPolygon(tuple(corners if area > 0.0 else corners[::-1]))
    if float(polygon.depth(points[:, 0], points[:, 1]).min()) < -1e-9 * size:
        raise InputError("the arena's polygon is not convex; give the convex outline of the tank")
    return polygon.corners
