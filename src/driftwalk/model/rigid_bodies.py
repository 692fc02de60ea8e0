"""Outlines of rigid bodies: drag panels, corners, area and moments of every shape."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import ConfigurationError
from driftwalk.schema.shapes import STEPS, Cells, cells_of_shape


class Measures(NamedTuple):
    """Size of a body, and how finely its sides are cut."""

    side_m: float
    """Side of a square or of a cell, diameter of a disc, length of a rectangle [m]."""
    width_m: float | None = None
    """Second side of a rectangle [m]."""
    strips: int = 8
    """Strips along a side."""
    hidden_share: float = 0.0
    """Share of the drag of a free face that a face between two cells feels, 0 to 1."""


QUADRANTS: Final = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
"""Signs of the corners of a rectangle about its middle, counter-clockwise."""


@dataclass(frozen=True, eq=False)
class RigidBody:
    """An outline about its centre of mass, seen from above, in the body's own frame.

    Examples
    --------
    >>> body = rigid_body("rectangle", Measures(side_m=0.04, width_m=0.02))
    >>> round(body.area_m2, 6), round(body.moment_m2, 8), body.symmetry
    (0.0008, 0.00016667, 2)
    """

    area_m2: float
    panels: Floats
    """Strips of the drag, shape (n, 5): middle x, y [m], outward normal x, y, width [m]."""
    corners: Floats
    """Corners that may touch a wall, shape (n, 2) [m]; none of a disc."""
    moment_points: Floats
    """Points for means over the area, shape (n, 3): x, y [m], share of the area [1]."""
    symmetry: int
    """Turns by 2 pi / symmetry leave it as it is; 0 for a disc, which has no heading."""
    disc_radius_m: float = 0.0
    cells: Floats = field(default_factory=lambda: np.zeros((1, 2)))
    """Centres of its cells, shape (n, 2) [m]."""
    is_square: bool = False
    """Whether it is the block for which the native core has a special kernel."""

    @property
    def moment_m2(self) -> float:
        """Moment of inertia over mass, I / m, of a body of even density [m²]."""
        return float((self.moment_points[:, :2] ** 2).sum(axis=1) @ self.moment_points[:, 2])

    @property
    def reach_m(self) -> float:
        """Distance of the farthest point from the centre of mass [m]."""
        corners = np.hypot(*self.corners.T).max() if self.corners.size else 0.0
        return float(max(corners, self.disc_radius_m))

    def correlation(self, stirring_length: float) -> Floats:
        """Return the correlation of the forces on its cells, exp(-r²/2L²), shape (n, n)."""
        if stirring_length == 0.0:
            return np.eye(len(self.cells))
        apart = self.cells[:, None] - self.cells[None]
        return np.asarray(np.exp(-(apart**2).sum(axis=2) / (2.0 * stirring_length**2)))

    def force_share(self, stirring_length: float = 0.0) -> float:
        """Return the force on the body over that on one cell: √n where they are independent."""
        return float(np.sqrt(self.correlation(stirring_length).sum()))

    def force_lever_m(self, stirring_length: float = 0.0) -> float:
        """Return the torque over the force of the forces on its cells, rms [m]; 0 of one cell.

        With rho_ij their correlation and r_i their places, lever² is sum rho_ij r_i·r_j over
        sum rho_ij.
        """
        torque = (self.correlation(stirring_length) * (self.cells @ self.cells.T)).sum()
        return float(np.sqrt(max(torque, 0.0))) / self.force_share(stirring_length)

    def arrays(self) -> dict[str, Any]:
        """Return what the native core takes of a body that is no single square."""
        if self.is_square:
            return {}
        names = ("panels", "corners", "moment_points")
        return {name: np.ascontiguousarray(getattr(self, name)) for name in names}


def gauss_points(length: float, width: float, middles: npt.ArrayLike = ((0.0, 0.0),)) -> Floats:
    """Return 3 x 3 Gauss points of rectangles of one size, shape (9 n, 3): x, y, share.

    Of fewer the moment of the water's acceleration is 5 to 40 % off in eddies as small as a block
    (docs/explanation/likelihood.md).
    """
    place, weight = np.polynomial.legendre.leggauss(3)
    x, y = np.meshgrid(0.5 * length * place, 0.5 * width * place)
    share = np.outer(weight, weight) / 4.0
    one = np.stack([x, y, share], axis=-1).reshape(-1, 3)
    centres = np.asarray(middles, dtype=np.float64)
    shifts = np.concatenate([centres, np.zeros((len(centres), 1))], axis=1)
    every = (one + shifts[:, np.newaxis]).reshape(-1, 3)
    return np.asarray(every * [1.0, 1.0, 1.0 / len(centres)])


def face(middle: tuple[float, float], normal: tuple[float, float], length: float, strips: int,
         share: float = 1.0) -> Floats:  # fmt: skip
    """Return the panels of a straight face, of which the water reaches a share."""
    offsets = ((np.arange(strips) + 0.5) / strips - 0.5) * length
    (x, y), (nx, ny) = middle, normal
    columns = (x - ny * offsets, y + nx * offsets, nx, ny, share * length / strips)
    return np.stack(np.broadcast_arrays(*columns), axis=1)


def rectangle(measures: Measures) -> RigidBody:
    """Return a rectangle of two sides, the first along its own x.

    Raises
    ------
    ConfigurationError
        When it has no second side.
    """
    if measures.width_m is None:
        raise ConfigurationError(
            "a rectangle has two sides: rectangle:4x2cm, or side_m and width_m in [block]"
        )
    return _rectangle(measures.side_m, measures.width_m, measures.strips)


def square(measures: Measures) -> RigidBody:
    """Return the square block."""
    side = measures.side_m
    return replace(_rectangle(side, side, measures.strips), is_square=True)


def _rectangle(length: float, width: float, strips: int) -> RigidBody:
    normals = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)]
    faces = [
        face((nx * length / 2, ny * width / 2), (nx, ny), width if nx else length, strips)
        for nx, ny in normals
    ]
    return RigidBody(
        area_m2=length * width,
        panels=np.concatenate(faces),
        corners=QUADRANTS * (np.array([length, width]) / 2),
        moment_points=gauss_points(length, width),
        symmetry=4 if length == width else 2,
    )


def disc(measures: Measures) -> RigidBody:
    """Return a disc of a diameter.

    In a uniform flow past it at w, its panels sum to F = 1/2 rho C_d D d |w| w, the drag of a
    cylinder of diameter D and wetted depth d: the mean over all directions is exact, and one
    direction differs by less than pi² / (12 n²) of it, n the number of panels (0.1 % with 31). The
    number is odd: opposite panels would make it pi² / (3 n²).

    Examples
    --------
    >>> body = disc(Measures(side_m=0.04))
    >>> windward = np.maximum(body.panels[:, 2], 0.0) * body.panels[:, 4]
    >>> bool(abs(windward.sum() / 0.04 - 1.0) < 0.001)
    True
    """
    radius, count = measures.side_m / 2.0, 4 * measures.strips - 1
    angle = (np.arange(count) + 0.5) * (2.0 * math.pi / count)
    nx, ny = np.cos(angle), np.sin(angle)
    width = np.full(count, 2.0 * math.pi * radius / count)
    return RigidBody(
        area_m2=math.pi * radius**2,
        panels=np.stack([radius * nx, radius * ny, nx, ny, width], axis=1),
        corners=np.zeros((0, 2)),
        moment_points=_seven_points(radius),
        symmetry=0,
        disc_radius_m=radius,
    )


def _seven_points(radius: float) -> Floats:
    """Return the centre and a hexagon: means are exact for the fifth degree (Radon 1948)."""
    angle = np.arange(6) * (math.pi / 3.0)
    rim = math.sqrt(2.0 / 3.0) * radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    places = np.concatenate([np.zeros((1, 2)), rim])
    return np.column_stack([places, [0.25, *[0.125] * 6]])


MOST_CELLS = 64
"""A body may have this many: in every step 32 panels of each are read."""


def _glued(cells: Cells, measures: Measures) -> RigidBody:
    side = measures.side_m
    if len(cells) > MOST_CELLS:
        raise ConfigurationError(f"a body has {MOST_CELLS} cells at most, got {len(cells)}")
    if not _connected(cells):
        raise ConfigurationError("the cells of a body hang together face to face: 'xx', 'x./xx'")
    places = np.asarray(cells, dtype=np.float64) * side
    centres = places - places.mean(axis=0)
    faces = []
    for cell, (x, y) in zip(cells, centres, strict=True):
        for nx, ny in STEPS:
            hidden = (cell[0] + nx, cell[1] + ny) in cells
            share = measures.hidden_share if hidden else 1.0
            middle = (x + nx * side / 2, y + ny * side / 2)
            if share:
                faces.append(face(middle, (float(nx), float(ny)), side, measures.strips, share))
    return RigidBody(
        area_m2=len(cells) * side**2,
        panels=np.concatenate(faces),
        corners=_hull(centres, side),
        moment_points=gauss_points(side, side, centres),
        symmetry=_symmetry(centres),
        cells=centres,
    )


def _connected(cells: Cells) -> bool:
    found = {cells[0]}
    for _ in cells:
        found |= {(x + dx, y + dy) for x, y in found for dx, dy in STEPS} & set(cells)
    return len(found) == len(cells)


def _hull(centres: Floats, side: float) -> Floats:
    """Return the corners of the convex hull: no others touch a wall of a convex tank."""
    from scipy.spatial import ConvexHull

    reached = centres[:, None] + QUADRANTS * side / 2
    corners = np.unique(np.round(reached.reshape(-1, 2), 12), axis=0)
    return np.asarray(corners[ConvexHull(corners).vertices])


def _symmetry(centres: Floats) -> int:
    """Return 4, 2 or 1: how many turns within a full one leave the cells as they are."""

    def same(turned: Floats) -> bool:
        distance = np.hypot(*(turned[:, None] - centres[None]).transpose(2, 0, 1))
        return bool((distance.min(axis=1) < 1e-9).all())

    x, y = centres.T
    if same(np.stack([-y, x], axis=1)):
        return 4
    return 2 if same(-centres) else 1


BODIES: Final[dict[str, Callable[[Measures], RigidBody]]] = {
    "square": square,
    "disc": disc,
    "rectangle": rectangle,
}
"""Shapes by name; any other name is a polyomino's, or its rows."""


def rigid_body(shape: str, measures: Measures) -> RigidBody:
    """Return the body of a shape.

    Parameters
    ----------
    shape : str
        ``"square"``, ``"disc"``, ``"rectangle"``, or a polyomino by its name (``"L3"``) or its rows
        (``"xx"``, ``"x./xx"``).
    measures : Measures
        Its size.

    Raises
    ------
    ConfigurationError
        When there is no such shape, or its measures do not fit it.

    Examples
    --------
    >>> rigid_body("disc", Measures(side_m=0.04)).symmetry
    0
    >>> dimer = rigid_body("xx", Measures(side_m=0.03, hidden_share=0.5))
    >>> round(float(dimer.panels[:, 4].sum()), 6)  # six free faces, two that half count
    0.21
    """
    cells = cells_of_shape(shape)
    if shape not in BODIES and len(cells) < 2:
        raise ConfigurationError(
            f"no body shape {shape!r}: {', '.join(BODIES)}, or the rows of a polyomino such as "
            "'xx' or 'x./xx'"
        )
    if measures.width_m is not None and shape != "rectangle":
        raise ConfigurationError(f"width_m belongs to a rectangle, the shape is {shape!r}")
    return BODIES[shape](measures) if shape in BODIES else _glued(cells, measures)
