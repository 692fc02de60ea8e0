"""Limits of a recording's size: bodies, times and positions.

A `trajectory` has a place for each body at each time.

A column that counts its rows, taken for the names of the bodies, makes a body of every row: a file
of one megabyte then asks for a hundred gigabytes of NaN.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from driftwalk.core.errors import FormatError, InputError
from driftwalk.record.raw import Array, RawBody


class ExtentPolicy(NamedTuple):
    """How large a recording may be."""

    most_bodies: int = 5000
    """Bodies of a recording at most; chosen by hand."""
    empty_places: int = 20_000_000
    """Places, times by bodies, that a recording of any size may have: 0.5 GB; chosen by hand."""
    places_per_sample: int = 50
    """Places beyond that for each sample: bodies come and go, as fragments of tracks do; chosen
    by hand."""
    farthest_m: float = 1e12
    """Farthest position, beyond the planets [m]: float64 must hold its powers."""
    nearest_m: float = 1e-25
    """If all positions are nearer to the origin, their powers are 0 in float64 [m]."""
    largest_angle: float = 1e12
    """In the file's unit; of larger angles float64 does not know the fraction of a turn."""


EXTENT: Final = ExtentPolicy()


def refuse_many_bodies(names: Sequence[str]) -> None:
    """Refuse more bodies than any recording has.

    Raises
    ------
    FormatError
        Names the first ones.
    """
    if len(names) > EXTENT.most_bodies:
        first = ", ".join(f"'{name:.20}'" for name in names[:3])
        raise FormatError(
            f"has {len(names)} bodies ({first}, …), more than the {EXTENT.most_bodies} that are "
            "read: does the column that names the body count rows?"
        )


def refuse_sparse(time: Array, bodies: list[RawBody]) -> None:
    """Refuse bodies that have almost none of their times in common.

    Parameters
    ----------
    time : array, shape (n,)
        The times of all bodies.
    bodies : list of RawBody
        The bodies.

    Raises
    ------
    FormatError
        Says how many places there would be, and for how many samples.
    """
    samples = sum(body.clock.size for body in bodies)
    places = time.size * len(bodies)
    if places > EXTENT.empty_places + EXTENT.places_per_sample * samples:
        raise FormatError(
            f"has {len(bodies)} bodies at {time.size} different times, which is a table of "
            f"{3 * 8 * places / 1e9:.3g} GB for {samples} samples: choose bodies (`body`) or a "
            "part of the time (`start`, `stop`)"
        )


def refuse_far(bodies: Sequence[RawBody], scale: float) -> None:
    """Refuse numbers that are no position and no angle: a damaged file, or a mark of what is lost.

    Positions that all are practically zero are refused too.

    Parameters
    ----------
    bodies : sequence of RawBody
        In the units of the file.
    scale : float
        Metres per unit.

    Raises
    ------
    InputError
        Names the body and the number.
    """
    for body in bodies:
        for name, values in (("x", body.x), ("y", body.y)):
            _refuse_beyond(body, name, values, EXTENT.farthest_m / scale)
        _refuse_within(body, EXTENT.nearest_m / scale)
        if body.theta is not None:
            _refuse_beyond(body, "angle", body.theta, EXTENT.largest_angle)


def _refuse_within(body: RawBody, least: float) -> None:
    farthest = max(
        float(np.abs(values).max(where=np.isfinite(values), initial=0.0))
        for values in (body.x, body.y)
    )
    if 0.0 < farthest < least:
        raise InputError(
            f"body '{body.name}' has no position that is further than {farthest:.3g} from the "
            "origin, in the file's unit: no camera sees that; are these the right columns, and is "
            "the unit right (`length_unit`)?"
        )


def _refuse_beyond(body: RawBody, name: str, values: Array, most: float) -> None:
    known = np.isfinite(values)
    largest = float(values.max(where=known, initial=0.0))
    smallest = float(values.min(where=known, initial=0.0))
    if max(largest, -smallest) > most:
        number = largest if largest > -smallest else smallest
        raise InputError(
            f"body '{body.name}' has {number:.3g} as {name}, which cannot be one: is the file "
            "damaged? Leave the field empty, or write nan, where nothing was measured"
        )
