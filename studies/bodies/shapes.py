"""A disc, and blocks glued together, as bodies of the generator of the study of verdicts."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import numpy.typing as npt

sys.path.append(str(Path(__file__).resolve().parents[1] / "verdict"))

from blocks import CORNERS, INNER, NORMALS, POINTS, SHARES, WIDTHS, Body
from ranges import MASS_KG, SIDE_M

RIM_POINTS = 41
"""Of a disc: the sum is within (pi / 82)^2 / 3, 0.05 %, of the integral over the rim. An even
number would need twice as many."""


def disc(diameter: float = SIDE_M, mass: float = MASS_KG) -> Body:
    """Return a disc of even density."""
    radius = 0.5 * diameter
    rim = np.exp(2j * np.pi * (np.arange(RIM_POINTS) + 0.5) / RIM_POINTS)
    widths = np.full(RIM_POINTS, 2.0 * np.pi * radius / RIM_POINTS)
    # Centre and hexagon: means over the disc to the fifth degree.
    hexagon = np.exp(1j * np.pi / 3.0 * np.arange(6))
    inner = radius * np.sqrt(2.0 / 3.0) * np.concatenate([[0.0], hexagon])
    none = np.zeros(0, dtype=np.complex128)
    return Body(
        radius * rim, rim, widths, none, inner, radius, radius**2, 2.0, mass, radius,
        shares=np.array([0.25, *[0.125] * 6]),
    )  # fmt: skip


def dimer(hidden_share: npt.ArrayLike) -> Body:
    """Return two blocks glued side by side; hidden faces feel a share of the drag of free ones.

    Of several tanks the share may be one for each.
    """
    centres = 0.5 * SIDE_M * np.array([-1.0, 1.0])
    points = np.concatenate([centre + POINTS for centre in centres])
    normals = np.tile(NORMALS, 2)
    hidden = (np.abs(points.real) < 1e-12) & (np.abs(normals.imag) < 1e-12)
    widths = np.tile(WIDTHS, 2) * np.where(hidden, np.asarray(hidden_share)[..., np.newaxis], 1.0)
    corners = np.array([z + z.real / abs(z.real) * 0.5 * SIDE_M for z in CORNERS])
    # The Gauss points of each block: nine for both are 1 to 9 % off in eddies of their size.
    inner = np.concatenate([centre + INNER for centre in centres])
    return Body(
        points, normals, widths, corners, inner, float(np.abs(corners).max()), 5.0 * SIDE_M**2,
        12.0, 2.0 * MASS_KG, members=centres + 0j, shares=np.tile(SHARES, 2) / 2.0,
    )  # fmt: skip
