"""A disc: no heading, and a drag that is the same in all directions."""

from __future__ import annotations

import math

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.model.bodies.rigid_body import Measures, RigidBody


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
