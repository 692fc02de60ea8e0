"""A rectangle, and the square block."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from driftwalk.core.errors import ConfigurationError
from driftwalk.model.bodies.rigid_body import Measures, RigidBody, face, gauss_points


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
    signs = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    half = np.array([length, width]) / 2
    return RigidBody(
        area_m2=length * width,
        panels=np.concatenate(faces),
        corners=signs * half,
        moment_points=gauss_points(length, width),
        symmetry=4 if length == width else 2,
    )
