"""Energy of, and force between, two cuboid magnets: the charge model, and multipoles far away.

A cuboid of remanence B_r has the magnetic charge ± B_r / μ0 per area on its two pole faces. The
potential and the field of a uniformly charged rectangle are closed forms; they are integrated over
the pole faces of the other magnet by Gauss-Legendre quadrature. For parallel magnets this is the
integral that Akoun and Yonnet solve (IEEE Trans. Magn. 20, 1962, 1984).

Far apart they are dipoles, with the next multipoles of them.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats
from driftwalk.model.interaction import Magnet

MU_0: Final = 1.25663706127e-6
"""Permeability of the vacuum [N/A²], CODATA 2022."""
NODES: Final = 12
"""Points of the quadrature along an edge of a pole face, of magnets that are close; measured: 24
change no force by 1e-3 as close as half the thickness."""


def magnet_energy(
    magnet: Magnet,
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    angle: npt.ArrayLike,
    *,
    nodes: int = NODES,
) -> Floats:
    """Return the energy of two equal magnets [J], 0 when they are far apart.

    Parameters
    ----------
    magnet : Magnet
        Either of them.
    x, y : array_like
        Place of the second's centre [m]; the first is at the origin, its moment along x.
    angle : array_like
        Of the second's moment against the first's, about the upright axis [rad].
    nodes : int
        Points of the quadrature along an edge of a pole face.

    Examples
    --------
    >>> energy = magnet_energy(Magnet(5e-3, 5e-3, 2e-3, 1.2), 6e-3, 0.0, 0.0)
    >>> round(float(energy) * 1e6)
    -1331
    """
    x, y, angle = np.broadcast_arrays(*(np.asarray(one, dtype=np.float64) for one in (x, y, angle)))
    across, up, weight = _pole_points(magnet, nodes)
    cosine, sine = np.cos(angle)[..., None], np.sin(angle)[..., None]
    total = np.zeros(x.shape)
    for own, other in product((-1.0, 1.0), repeat=2):
        along = other * magnet.thickness_m / 2.0
        at_x = x[..., None] + cosine * along - sine * across
        at_y = y[..., None] + sine * along + cosine * across
        seen = _potential(magnet, at_x - own * magnet.thickness_m / 2.0, at_y, up)
        total += own * other * (seen * weight).sum(axis=-1)
    return np.asarray(total * magnet.remanence_T**2 / (4.0 * np.pi * MU_0))


def coaxial_force(magnet: Magnet, distance: npt.ArrayLike) -> Floats:
    """Return the attraction of two equal magnets on one axis [N], pole to opposite pole.

    Parameters
    ----------
    magnet : Magnet
        Either of them.
    distance : array_like
        Between their centres [m], above the thickness.

    Examples
    --------
    >>> force = coaxial_force(Magnet(5e-3, 5e-3, 2e-3, 1.2), [6e-3, 12e-3])
    >>> (force * 1e3).round().tolist()
    [501.0, 53.0]
    """
    distance = np.asarray(distance, dtype=np.float64)[..., None]
    across, up, weight = _pole_points(magnet, NODES)
    total = np.zeros(distance.shape[:-1])
    for own, other in product((-1.0, 1.0), repeat=2):
        apart = distance + (other - own) * magnet.thickness_m / 2.0
        # The field normal to a charged rectangle is the solid angle that it fills.
        total += -own * other * (_solid_angle(magnet, apart, across, up) * weight).sum(axis=-1)
    return np.asarray(total * magnet.remanence_T**2 / (4.0 * np.pi * MU_0))


def _pole_points(magnet: Magnet, nodes: int) -> tuple[Floats, Floats, Floats]:
    """Return points of a pole face, across and up [m], and their areas [m²]."""
    node, weight = np.polynomial.legendre.leggauss(nodes)
    across, up = np.meshgrid(node * magnet.width_m / 2.0, node * magnet.height_m / 2.0)
    area = np.outer(weight, weight) * magnet.width_m * magnet.height_m / 4.0
    return across.ravel(), up.ravel(), area.ravel()


def _corners(magnet: Magnet, across: Floats, up: Floats) -> list[tuple[float, Floats, Floats]]:
    return [
        (i * j, across + i * magnet.width_m / 2.0, up + j * magnet.height_m / 2.0)
        for i, j in product((-1.0, 1.0), repeat=2)
    ]


def _potential(magnet: Magnet, z: Floats, across: Floats, up: Floats) -> Floats:
    """Return the integral of 1/r over a pole face, from points z in front of it."""
    total = np.zeros(np.broadcast_shapes(z.shape, across.shape, up.shape))
    for sign, u, v in _corners(magnet, across, up):
        r = np.sqrt(u**2 + v**2 + z**2)
        # u asinh(v / ...) is u ln(v + r) but for terms that the corners cancel.
        total += sign * (
            u * np.arcsinh(v / np.maximum(np.hypot(u, z), 1e-30))
            + v * np.arcsinh(u / np.maximum(np.hypot(v, z), 1e-30))
            - np.abs(z) * np.arctan2(u * v, np.abs(z) * r)
        )
    return np.asarray(total)


def _solid_angle(magnet: Magnet, z: Floats, across: Floats, up: Floats) -> Floats:
    total = np.zeros(np.broadcast_shapes(z.shape, across.shape, up.shape))
    for sign, u, v in _corners(magnet, across, up):
        total += sign * np.arctan2(u * v, z * np.sqrt(u**2 + v**2 + z**2))
    return np.asarray(total)


Energy = Callable[[Floats, Floats, Floats], Floats]


class MultipolePolicy(NamedTuple):
    """Where the closed form holds; lengths in largest sides of the magnet."""

    nearest: float = 2.5
    """Least distance of the fit; measured: there the energy is within 1.2 % of the largest."""
    farthest: float = 16.0
    """Largest distance of the fit; beyond, the closed form is extrapolated."""
    softening: float = 0.1
    """Square of the length that bounds the closed form near by; chosen by hand."""
    table: float = 4.0
    """A table adds what the closed form lacks up to this distance, and less and less of it from
    80 % of the distance on. There, forces and torques of the closed form alone are within 1.1 % of
    the largest, and at this distance within 0.6 % (six shapes)."""
    distances: int = 14
    """Distances of the fit; chosen by hand."""
    angles: int = 24
    """Directions and angles of the fit; chosen by hand."""


MULTIPOLES: Final = MultipolePolicy()


class Multipoles(NamedTuple):
    """Energy of two magnets as `driftwalk::Multipoles` of the native core has it; SI units."""

    coefficient: Floats
    """Of the six terms."""
    softening: float
    """Added to the squared distance [m²]."""
    fading: float
    """Squared distance from which the energy is led to 0 [m²]."""
    end: float
    """Squared distance from which it is 0 [m²]."""

    def energy(self, x: Floats, y: Floats, angle: Floats) -> Floats:
        """Return the energy [J] at places [m] and angles [rad], as of `magnet_energy`."""
        terms = _terms(x, y, angle, self.softening)
        return np.asarray(self.fade(x, y) * (terms @ self.coefficient))

    def fade(self, x: Floats, y: Floats) -> Floats:
        """Return the share of the energy that is left at places [m]."""
        part = np.clip((x**2 + y**2 - self.fading) / (self.end - self.fading), 0.0, 1.0)
        return np.asarray(1.0 - part**2 * (3.0 - 2.0 * part))


def fit_multipoles(energy: Energy, size: float, fading: float, end: float) -> Multipoles:
    """Fit the energy of two magnets, beyond the near field.

    Parameters
    ----------
    energy : callable
        From places (x, y) of the second [m] and its angle [rad] to the energy [J].
    size : float
        Largest side of a magnet [m].
    fading, end : float
        Distances between which the energy is led to 0 [m].

    Examples
    --------
    >>> from driftwalk.assembly.pull.magnets import magnet_energy
    >>> from driftwalk.model.interaction import Magnet
    >>> magnet = Magnet(5e-3, 5e-3, 2e-3, 1.2)
    >>> found = fit_multipoles(lambda *at: magnet_energy(magnet, *at), 5e-3, 0.064, 0.08)
    >>> place = np.array([0.02]), np.array([0.005]), np.array([0.3])
    >>> bool(np.isclose(found.energy(*place), magnet_energy(magnet, *place), rtol=3e-3)[0])
    True
    """
    turn = 2.0 * np.pi * np.arange(MULTIPOLES.angles) / MULTIPOLES.angles
    softening = MULTIPOLES.softening * size**2
    reach = size * np.geomspace(MULTIPOLES.nearest, MULTIPOLES.farthest, MULTIPOLES.distances)
    terms, values = [], []
    for r in reach:
        # Magnets have the same energy in a mirror.
        direction, angle = (one.ravel() for one in np.meshgrid(turn[: len(turn) // 2 + 1], turn))
        at = r * np.cos(direction), r * np.sin(direction), angle
        value = energy(*at)
        values.append(value / np.abs(value).max())
        terms.append(_terms(*at, softening) / np.abs(value).max())
    rows = np.concatenate(terms)
    scale = np.abs(rows).max(axis=0)
    found = np.linalg.lstsq(rows / scale, np.concatenate(values), rcond=None)[0]
    return Multipoles(found / scale, softening, fading**2, end**2)


def _terms(x: Floats, y: Floats, angle: Floats, softening: float) -> Floats:
    """Return the six terms: cosine of the normals, product along them; each of three."""
    square = 1.0 / (x**2 + y**2 + softening)
    along, inward = x, x * np.cos(angle) + y * np.sin(angle)
    v = (along**2 + inward**2) * square
    shapes = np.cos(angle), along * inward * square
    orders = np.ones_like(square), square, square * v
    return np.stack([square**1.5 * one * other for one in shapes for other in orders], axis=-1)
