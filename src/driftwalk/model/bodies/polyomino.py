"""A rigid polyomino: blocks glued face to face, such as a dimer."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import ConfigurationError
from driftwalk.model.bodies.rigid_body import Measures, RigidBody, face, gauss_points
from driftwalk.schema.shapes import Cells, cells_of_shape

MOST_CELLS = 64
"""A body may have this many: in every step 32 panels of each are read."""
STEPS = ((1, 0), (0, 1), (-1, 0), (0, -1))
"""From a cell to its neighbours."""


def polyomino(shape: str) -> Callable[[Measures], RigidBody] | None:
    """Return the maker of a polyomino, by its name or rows; None when it is no polyomino.

    Examples
    --------
    >>> dimer = polyomino("xx")(Measures(side_m=0.03, hidden_share=0.5))
    >>> round(float(dimer.panels[:, 4].sum()), 6)  # six free faces, two that half count
    0.21
    """
    cells = cells_of_shape(shape)
    return (lambda measures: _glued(cells, measures)) if len(cells) > 1 else None


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

    offsets = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * side / 2
    corners = np.unique(np.round((centres[:, None] + offsets).reshape(-1, 2), 12), axis=0)
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
