"""The outline of a rigid body: its drag panels, corners, area and moments."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats


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


@dataclass(frozen=True, eq=False)
class RigidBody:
    """An outline about its centre of mass, seen from above, in the body's own frame.

    Examples
    --------
    >>> from driftwalk.model.bodies import rigid_body
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
    """Whether it is the block for which the native core has a kernel of its own."""

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
