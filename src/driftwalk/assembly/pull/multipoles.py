"""Energy of two magnets that are far apart: dipoles, and the next multipoles of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats

Energy = Callable[[Floats, Floats, Floats], Floats]


class MultipolePolicy(NamedTuple):
    """Where the closed form holds; lengths in largest sides of the magnet."""

    nearest: float = 2.5
    """Least distance of the fit; there the energy is within 1.2 % of the largest."""
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
