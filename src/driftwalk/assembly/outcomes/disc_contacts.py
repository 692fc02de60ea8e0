"""Which discs, or rectangles, of an assembly touch, and the outcome class of a world of them.

They latch as they lie, so the shape of an assembly is its contact graph: which of its bodies touch,
however they are numbered. Assemblies are rigid: the poses at the end say what touched all along.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.outcomes.class_names import class_name
from driftwalk.core.arrays import Bools, Floats
from driftwalk.schema.contact_graphs import graph_name
from driftwalk.schema.shapes import MOST_NAMED, counted_class


class ContactPolicy(NamedTuple):
    """When discs, or rectangles, of one assembly touch."""

    gap: float = 0.01
    """Gap up to which two bodies of an assembly are a contact, in diameters or longer sides; chosen
    by hand: two discs close it within a time step. The native core has the same for what a removed
    one leaves."""


CONTACT_POLICY: Final = ContactPolicy()


def overlap_depth(
    first: Floats, second: Floats, *, side: float, width: float | None = None
) -> Floats:
    """Return how deep rectangles overlap [m], negative where they are apart, shape (n,).

    By the separating axes (Gottschalk, Lin and Manocha 1996): the smallest over the four face
    directions.

    Parameters
    ----------
    first, second : ndarray, shape (n, 3)
        Poses [m, m, rad].
    side : float
        Length along the own x [m].
    width : float, optional
        Along the own y [m]; default: squares.
    """
    turn = second[:, 2] - first[:, 2]
    half = np.array([side, side if width is None else width]) / 2.0
    same, turned = np.abs(np.cos(turn)), np.abs(np.sin(turn))
    reach = half[:, None] * (1.0 + same) + half[::-1, None] * turned
    along = np.stack([first[:, 2], first[:, 2], second[:, 2], second[:, 2]])
    along += np.array([0.0, 0.5, 0.0, 0.5])[:, None] * np.pi
    apart = second[:, :2] - first[:, :2]
    reached = np.abs(np.cos(along) * apart[:, 0] + np.sin(along) * apart[:, 1])
    return np.asarray((np.tile(reach, (2, 1)) - reached).min(axis=0))


def touching(places: Floats, *, diameter: float, width: float | None = None) -> Bools:
    """Return which bodies touch, if they are of one assembly, shape (n, n); each touches itself.

    Parameters
    ----------
    places : ndarray, shape (n, 2 or more)
        Columns x and y of the centres [m]; of rectangles the third is theta [rad].
    diameter : float
        Of a disc, or length of a rectangle along its own x [m].
    width : float, optional
        Of a rectangle, along its own y [m]; default: discs.
    """
    if width is None:
        x, y = places[:, 0], places[:, 1]
        apart = np.hypot(x[:, None] - x, y[:, None] - y)
        return np.asarray(apart <= diameter * (1.0 + CONTACT_POLICY.gap))
    first, second = (index.ravel() for index in np.indices((len(places), len(places))))
    depth = overlap_depth(places[first], places[second], side=diameter, width=width)
    gap = CONTACT_POLICY.gap * max(diameter, width)
    return np.asarray(depth >= -gap).reshape(len(places), -1)


def contact_pairs(
    places: Floats, *, diameter: float, width: float | None = None
) -> list[tuple[int, int]]:
    """Return the pairs that touch, of many bodies; parameters as in `touching`."""
    from scipy.spatial import cKDTree

    gap = CONTACT_POLICY.gap
    if width is None:
        return sorted(cKDTree(places[:, :2]).query_pairs(diameter * (1.0 + gap)))
    reach = math.hypot(diameter, width) + math.sqrt(2.0) * gap * max(diameter, width)
    pairs = cKDTree(places[:, :2]).query_pairs(reach, output_type="ndarray")
    depth = overlap_depth(places[pairs[:, 0]], places[pairs[:, 1]], side=diameter, width=width)
    return [(a, b) for a, b in pairs[depth >= -gap * max(diameter, width)].tolist()]


def disc_shape(touch: Bools, *, noun: str = "discs") -> str:
    """Return the name of an assembly from which of its bodies touch, shape (n, n)."""
    contacts = [(a, b) for a, b in np.argwhere(np.triu(touch, 1)).tolist()]
    return graph_name(len(touch), contacts, noun)


def disc_class(
    places: Floats,
    assembly: Sequence[int] | npt.NDArray[np.int32],
    *,
    diameter: float,
    width: float | None = None,
) -> str:
    """Name the outcome class of a world of discs, or of rectangles.

    Parameters
    ----------
    places, diameter, width
        As in `touching`.
    assembly : sequence of int, shape (n,)
        Which assembly each body belongs to: any label.

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
    touch = touching(places, diameter=diameter, width=width)
    members = [np.flatnonzero(labels == label) for label in np.unique(labels)]
    noun = "discs" if width is None else "rectangles"
    return class_name(disc_shape(touch[np.ix_(own, own)], noun=noun) for own in members)
