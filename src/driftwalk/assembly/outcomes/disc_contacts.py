"""Which discs of an assembly touch, and the outcome class of a world of discs.

Discs latch as they lie, so the shape of an assembly is its contact graph: which of its discs touch,
however they are numbered. Assemblies are rigid: the places at the end say what touched all along.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.outcomes.class_names import class_name
from driftwalk.core.arrays import Bools, Floats
from driftwalk.schema.contact_graphs import graph_name
from driftwalk.schema.shapes import MOST_NAMED, counted_class


class ContactPolicy(NamedTuple):
    """When discs of one assembly touch."""

    gap: float = 0.01
    """Gap up to which two discs of an assembly are a contact, in diameters; chosen by hand: two
    discs close it within a time step. The native core has the same for what a removed disc
    leaves."""


CONTACT_POLICY: Final = ContactPolicy()


def touching(places: Floats, *, diameter: float) -> Bools:
    """Return which discs touch, if they are of one assembly, shape (n, n); each touches itself.

    Parameters
    ----------
    places : ndarray, shape (n, 2 or more)
        Columns x and y of the centres [m].
    diameter : float
        Of a disc [m].
    """
    x, y = places[:, 0], places[:, 1]
    apart = np.hypot(x[:, None] - x, y[:, None] - y)
    return np.asarray(apart <= diameter * (1.0 + CONTACT_POLICY.gap))


def disc_shape(touch: Bools) -> str:
    """Return the name of an assembly of discs from which of them touch, shape (n, n)."""
    return graph_name(len(touch), [(a, b) for a, b in np.argwhere(np.triu(touch, 1)).tolist()])


def disc_class(
    places: Floats, assembly: Sequence[int] | npt.NDArray[np.int32], *, diameter: float
) -> str:
    """Name the outcome class of a world of discs.

    Parameters
    ----------
    places : ndarray, shape (discs, 2 or more)
        Columns x and y of the centres [m].
    assembly : sequence of int, shape (discs,)
        Which assembly each disc belongs to: any label.
    diameter : float
        Of a disc [m].

    Returns
    -------
    str
        Names of the contact graphs (`driftwalk.schema.contact_graphs`), joined by ``+``.

    Examples
    --------
    >>> row = np.array([[0.0, 0.0], [0.04, 0.0], [0.08, 0.0], [0.2, 0.0]])
    >>> disc_class(row, [0, 0, 0, 3], diameter=0.04)
    'chain3+1'
    """
    labels = np.asarray(assembly)
    if labels.size > MOST_NAMED:
        return counted_class(np.unique(labels).size)
    touch = touching(places, diameter=diameter)
    members = [np.flatnonzero(labels == label) for label in np.unique(labels)]
    return class_name(disc_shape(touch[np.ix_(own, own)]) for own in members)
