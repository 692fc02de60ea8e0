"""The tank (a circle, a rectangle or a convex polygon), its wall, and the water."""

from __future__ import annotations

import json
import math
from typing import Annotated, Any, ClassVar, Final, Literal, Self

from pydantic import ModelWrapValidatorHandler, field_validator, model_validator

from driftwalk.core.errors import ConfigurationError, FormatError
from driftwalk.core.text_files import parse_json
from driftwalk.model.section import Quantity, Section, not_set

Vertices = tuple[tuple[float, float], ...]

KEYS_OF_SHAPE: Final[dict[str, tuple[str, ...]]] = {
    "circle": ("diameter_m",),
    "rectangle": ("width_m", "height_m"),
    "polygon": ("vertices_m",),
}


class Outline(Section):
    """A convex outline; a circle or rectangle is centred on the origin.

    Examples
    --------
    >>> Outline(shape="rectangle", width_m=0.4, height_m=0.2).extent_m
    (0.4, 0.2)
    """

    shape: Literal["circle", "rectangle", "polygon"] = "circle"
    """Shape; each shape has its own keys."""
    diameter_m: Annotated[float | None, Quantity("m", gt=0, le=1e3)] = None
    """Diameter of a circular tank.

    Diameter of a circle (0.3 m when it is not given).
    """
    width_m: Annotated[float | None, Quantity("m", gt=0, le=1e3)] = not_set(0.4)
    """Width of a rectangle, along x."""
    height_m: Annotated[float | None, Quantity("m", gt=0, le=1e3)] = not_set(0.3)
    """Height of a rectangle, along y."""
    vertices_m: Vertices | None = not_set("[[-0.1, -0.1], [0.2, -0.1], [0.0, 0.2]]")
    """Corners [x, y] of a convex polygon in m, in order; stored counter-clockwise."""

    @model_validator(mode="wrap")
    @classmethod
    def _default_circle(cls, data: Any, build: ModelWrapValidatorHandler[Self]) -> Self:
        if not isinstance(data, dict) or data.get("shape", "circle") != "circle":
            return build(data)
        if data.get("diameter_m") is not None:
            return build(data)
        outline = build({**data, "diameter_m": 0.30})
        # A default is not stated: it gives way to the tank of a recording.
        outline.model_fields_set.discard("diameter_m")
        return outline

    @field_validator("vertices_m")
    @classmethod
    def _convex(cls, vertices: Vertices | None) -> Vertices | None:
        return None if vertices is None else counter_clockwise(vertices)

    @model_validator(mode="after")
    def _keys_of_shape(self) -> Self:
        for shape, keys in KEYS_OF_SHAPE.items():
            for key in keys:
                given = getattr(self, key) is not None
                if given and shape != self.shape:
                    raise ConfigurationError(
                        f'{key} belongs to shape = "{shape}", but shape is "{self.shape}"'
                    )
                if not given and shape == self.shape:
                    raise ConfigurationError(f'shape = "{shape}" needs {key}')
        return self

    @classmethod
    def replaced_by(cls, keys: set[str]) -> set[str]:
        """Return the dimensions that a new shape drops; a diameter alone makes a circle."""
        dimensions = {key for group in KEYS_OF_SHAPE.values() for key in group}
        if "shape" in keys:
            return dimensions - keys
        if "diameter_m" in keys:
            return {"shape", *dimensions} - keys
        return set()

    @property
    def radius_m(self) -> float | None:
        """Radius of a circle [m], None for the other shapes."""
        return None if self.diameter_m is None else self.diameter_m / 2.0

    @property
    def corners_m(self) -> Vertices:
        """Corners of a rectangle or polygon [m], counter-clockwise; empty for a circle."""
        if self.vertices_m is not None:
            return self.vertices_m
        if self.width_m is None or self.height_m is None:
            return ()
        x, y = self.width_m / 2.0, self.height_m / 2.0
        return ((-x, -y), (x, -y), (x, y), (-x, y))

    @property
    def extent_m(self) -> tuple[float, float]:
        """Width and height of the bounding box [m]."""
        if self.diameter_m is not None:
            return self.diameter_m, self.diameter_m
        xs, ys = zip(*self.corners_m, strict=True)
        return max(xs) - min(xs), max(ys) - min(ys)

    @property
    def narrowest_m(self) -> float:
        """Smallest distance between two parallel lines that hold the outline [m]."""
        if self.diameter_m is not None:
            return self.diameter_m
        corners = self.corners_m
        return min(
            max(inward_distance(corner, edge) for corner in corners) for edge in edges(corners)
        )

    def contains(self, x_m: float, y_m: float) -> bool:
        """Return whether a point [m] lies inside or on the outline."""
        if self.radius_m is not None:
            return math.hypot(x_m, y_m) <= self.radius_m
        return all(inward_distance((x_m, y_m), edge) >= 0.0 for edge in edges(self.corners_m))

    def describe(self) -> str:
        """Return the shape and its size in words, for messages."""
        if self.diameter_m is not None:
            return f"circle of diameter {self.diameter_m:g} m"
        if self.width_m is not None:
            return f"rectangle of {self.width_m:g} m by {self.height_m:g} m"
        width, height = self.extent_m
        return f"polygon of {len(self.corners_m)} corners, {width:g} m by {height:g} m"

    def to_arena(self) -> dict[str, Any]:
        """Return the outline as the value of a trajectory's `arena` attribute."""
        if self.shape == "polygon":
            return {"shape": "polygon", "vertices_m": [list(corner) for corner in self.corners_m]}
        keys = KEYS_OF_SHAPE[self.shape]
        return {
            "shape": self.shape,
            **{key: getattr(self, key) for key in keys},
            "center_m": [0.0, 0.0],
        }

    def to_arena_json(self) -> str:
        """Return the outline as JSON text, as a trajectory keeps it in ``attrs["arena"]``."""
        return json.dumps(self.to_arena())


class FieldOfView(Outline):
    """Field of view of the camera, if smaller than the tank."""

    section_name: ClassVar[str] = "observation.field_of_view"

    center_m: tuple[float, float] = (0.0, 0.0)
    """Centre [x, y] of a circle or rectangle in m."""

    def contains(self, x_m: float, y_m: float) -> bool:
        """Return whether the camera sees a point [m]."""
        return super().contains(x_m - self.center_m[0], y_m - self.center_m[1])

    def to_arena(self) -> dict[str, Any]:
        """Return the outline with its centre, in the form of an `arena` attribute."""
        x, y = self.center_m
        arena = super().to_arena()
        if self.shape == "polygon":
            arena["vertices_m"] = [[a + x, b + y] for a, b in self.corners_m]
        else:
            arena["center_m"] = [x, y]
        return arena


class Tank(Outline):
    """The tank and its wall.

    Examples
    --------
    >>> Tank(diameter_m=0.5).to_arena()
    {'shape': 'circle', 'diameter_m': 0.5, 'center_m': [0.0, 0.0]}
    """

    section_name: ClassVar[str] = "tank"

    wall_restitution: Annotated[float, Quantity("1", ge=0, le=1)] = 0.5
    """Restitution of the wall, 0 to 1.

    Restitution e of an impact on the wall.
    """
    wall_friction: Annotated[float, Quantity("1", ge=0, le=100)] = 0.0
    """Coulomb friction of the wall; 0 for a wet wall."""
    bounce_speed_m_s: Annotated[float, Quantity("m/s", ge=0, le=1e3)] = 0.01
    """Approach speed below which there is no bounce."""

    @classmethod
    def from_arena(cls, arena: str | dict[str, Any], **wall: Any) -> Self:
        """Return the tank that a trajectory's `arena` attribute describes.

        Parameters
        ----------
        arena : str or dict
            JSON text of the attribute, or the same as a dictionary. Positions of the trajectory
            are relative to the arena's centre, so `center_m` of a circle or rectangle is dropped.
        **wall
            `wall_restitution`, `wall_friction`, `bounce_speed_m_s`.

        Raises
        ------
        ConfigurationError
            When it is not an arena.
        """
        try:
            facts = parse_json(arena) if isinstance(arena, str) else dict(arena)
        except FormatError as error:
            raise ConfigurationError(f"the arena is not JSON text: {error}") from error
        if not isinstance(facts, dict):
            raise ConfigurationError(f"the arena must be an object of keys, got {facts!r}")
        return cls(**{key: facts[key] for key in facts if key != "center_m"}, **wall)


Edge = tuple[tuple[float, float], tuple[float, float]]


def edges(corners: Vertices) -> list[Edge]:
    """Return the edges of a closed polygon, each from a corner to the next."""
    return [(corners[i], corners[(i + 1) % len(corners)]) for i in range(len(corners))]


def inward_distance(point: tuple[float, float], edge: Edge) -> float:
    """Return how far a point is to the left of an edge, inside for a counter-clockwise polygon."""
    (x0, y0), (x1, y1) = edge
    cross = (x1 - x0) * (point[1] - y0) - (y1 - y0) * (point[0] - x0)
    return cross / math.hypot(x1 - x0, y1 - y0)


def counter_clockwise(vertices: Vertices) -> Vertices:
    """Return the corners of a convex polygon in counter-clockwise order.

    Raises
    ------
    ConfigurationError
        With fewer than three corners, a repeated corner, a corner that is not finite, no area, or
        a polygon that is not convex (a star that winds twice is not).
    """
    if len(vertices) < 3:
        raise ConfigurationError(f"a polygon needs at least 3 corners, got {len(vertices)}")
    if not all(math.isfinite(value) for corner in vertices for value in corner):
        raise ConfigurationError("a corner of the polygon is not finite")
    if len(set(vertices)) < len(vertices):
        raise ConfigurationError(
            "the polygon repeats a corner; name each once, not the first again"
        )
    scale = max(max(abs(x), abs(y)) for x, y in vertices) ** 2
    doubled_area = sum(x0 * y1 - x1 * y0 for (x0, y0), (x1, y1) in edges(vertices))
    if abs(doubled_area) <= 1e-12 * scale:
        raise ConfigurationError("the corners of the polygon lie on one line")
    ordered = vertices if doubled_area > 0 else vertices[::-1]
    # Every corner to the left of every edge: convex, and wound once.
    for edge in edges(ordered):
        for corner in ordered:
            if inward_distance(corner, edge) < -1e-9 * math.sqrt(scale):
                raise ConfigurationError(
                    f"the polygon is not convex: corner {list(corner)} lies outside the edge from "
                    f"{list(edge[0])} to {list(edge[1])}"
                )
    return ordered


class Water(Section):
    """The liquid in the tank; the defaults are water at 25 °C."""

    section_name: ClassVar[str] = "water"

    density_kg_m3: Annotated[float, Quantity("kg/m3", gt=0, le=2e4)] = 1000.0
    """Density."""
    viscosity_Pa_s: Annotated[float, Quantity("Pa s", gt=0, le=1e3)] = 8.9e-4
    """Dynamic viscosity; used only for the reported Reynolds number."""
