"""Columns of a 3-D pose in a plain table: z and the four parts of a quaternion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.record.raw import Array, RawBody
from driftwalk.record.space.flat import SpaceTrack, lay_flat
from driftwalk.record.space.plane import Plane, plane_of
from driftwalk.record.space.turns import QUATERNION, Turns

PARTS: Final = ("qx", "qy", "qz", "qw")
_UP: Final = "z"


def plane_of_columns(places: Mapping[str, int], up: str | None) -> Plane | None:
    """Return the plane that the columns of a body have to be laid into, None when they lie in one.

    Parameters
    ----------
    places : mapping
        From a quantity of the body to its column.
    up : str, optional
        Axis that points up, if anybody says so.

    Raises
    ------
    InputError
        When an axis is said to be up and there is no column of z.
    """
    if up is None and not set(PARTS) <= set(places):
        return None
    plane = plane_of(up or _UP)
    if up is not None and "z" not in places:
        raise InputError(
            "`up` needs a third axis, and no column is known to hold z: name it with "
            '`columns={"z": "NAME"}`'
        )
    return plane


def body_in_plane(
    values: Mapping[int, Array], places: Mapping[str, int], clock: Array, plane: Plane
) -> tuple[RawBody, list[str]]:
    """Return the body of some columns in the plane, and what speaks against the plane.

    Parameters
    ----------
    values : mapping
        Columns of the table, each of shape (n,).
    places : mapping
        From a quantity of the body to its column.
    clock : array, shape (n,)
        Times or frame numbers.
    plane : Plane
        The plane of the water.

    Raises
    ------
    InputError
        When the quaternions have not the length 1.
    """
    axes = [values[places[axis]] for axis in ("x", "y", "z") if axis in places]
    if len(axes) == 2:
        axes.append(np.zeros(clock.size))
    turned = set(PARTS) <= set(places)
    parts = [values[places[part]] for part in PARTS] if turned else []
    turns = Turns(np.column_stack(parts), QUATERNION) if turned else None
    flat = lay_flat([SpaceTrack("0", clock, np.column_stack(axes), turns)], plane)
    return flat.bodies[0], flat.notes
