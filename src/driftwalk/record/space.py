"""3-D poses of motion capture and robots, projected onto the plane of the water."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.record.raw import Array, RawBody, RawRecording, TableLayout
from driftwalk.record.text import read_table

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation


# The plane's axes for each axis that is up. Right-handed, so that angles stay counter-clockwise
# seen from above, and with the file's x kept wherever it lies in the plane.
_PLANES: Final = {
    "x": ("y", "z"),
    "y": ("x", "-z"),
    "z": ("x", "y"),
    "-x": ("y", "-z"),
    "-y": ("x", "z"),
    "-z": ("x", "-y"),
}


@dataclass(frozen=True)
class Plane:
    """A plane by its names in the file, and their unit vectors."""

    up: str
    """Axis that points up, such as ``"-y"``."""
    x: str
    """Axis that becomes x."""
    y: str
    """Axis that becomes y."""

    @property
    def vectors(self) -> Array:
        """Unit vectors of x, y and up in the axes of the file, shape (3, 3)."""
        vectors = np.zeros((3, 3))  # so that no axis gets a minus zero
        for vector, name in zip(vectors, (self.x, self.y, self.up), strict=True):
            vector["xyz".index(name[-1])] = -1.0 if name.startswith("-") else 1.0
        return vectors

    def describe(self) -> str:
        """Return the plane in words.

        Examples
        --------
        >>> plane_of("y").describe()
        "the file's y points up, and x, y are its x, -z"
        """
        return f"the file's {self.up} points up, and x, y are its {self.x}, {self.y}"


def plane_of(up: str) -> Plane:
    """Return the plane that the axis `up` stands on.

    Parameters
    ----------
    up : str
        ``"x"``, ``"y"``, ``"z"``, or one of them with a minus in front.

    Raises
    ------
    InputError
        When there is no such axis.

    Examples
    --------
    >>> plane_of("y").vectors.tolist()
    [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]
    """
    name = up.strip().lower().removeprefix("+")
    if name not in _PLANES:
        raise InputError(f"`up` is one of {', '.join(_PLANES)}; got '{up}'")
    return Plane(name, *_PLANES[name])


QUATERNION: Final = "quaternion"
VECTOR: Final = "vector"
MATRIX: Final = "matrix"


@dataclass(frozen=True)
class SpaceTrack:
    """The samples of one body in space, in the units and axes of the file."""

    name: str
    clock: Array
    """Time stamps or frame numbers, shape (n,)."""
    position: Array
    """Positions, shape (n, 3), NaN where the body was not seen."""
    turns: Array | None = None
    """Orientations, from the body's own axes to the file's, shape (n, 4), (n, 3) or (n, 9), NaN
    where there is none; None when the file has none."""
    form: str = QUATERNION
    """Form of the orientations: `QUATERNION` (x, y, z, w), `VECTOR` (axis times angle), `MATRIX`
    (down its columns), or the order of Euler angles about the axes of the body, such as
    ``"XYZ"``."""
    degrees: bool = False
    """Whether their angles are in degrees."""

    def in_plane(self, plane: Plane) -> tuple[Array | None, Array | None]:
        """Return the angle in the plane and the tilt out of it, None without orientations.

        The angle [rad] is the direction of that axis of the body that lies along the plane's x
        where the body is not turned: the yaw of a body that stands upright, and of one that rolls
        and pitches as well, counter-clockwise seen from above. The tilt [rad] is how far the body's
        own upward axis leans.

        Raises
        ------
        InputError
            When quaternions have not the length 1.
        """
        if self.turns is None:
            return None, None
        angle, tilt = np.full(len(self.turns), np.nan), np.full(len(self.turns), np.nan)
        known = np.isfinite(self.turns).all(axis=1)
        if self.form in (QUATERNION, MATRIX):
            # Zeros alone are how some programs write that there is none.
            # float64 does not hold the squares of much smaller numbers.
            known = known & (np.abs(self.turns) > 1e-12).any(axis=1)
        if not known.any():
            return angle, tilt
        rotation = self._rotation(self.turns[known])
        x, y, up = plane.vectors
        forward = rotation.apply(x)
        angle[known] = np.arctan2(forward @ y, forward @ x)
        tilt[known] = np.arccos(np.clip(rotation.apply(up) @ up, -1.0, 1.0))
        return angle, tilt

    def _rotation(self, values: Array) -> Rotation:
        from scipy.spatial.transform import Rotation

        if self.form == QUATERNION:
            with np.errstate(over="ignore"):
                length = float(np.median(np.linalg.norm(values, axis=1)))
            # Printed with three digits, a unit quaternion keeps its length to within 2 %.
            if not abs(length - 1.0) <= 0.02:
                raise InputError(
                    f"the quaternions have a length of {length:.4g} instead of 1: are their "
                    "columns x, y, z, w the right ones?"
                )
            return Rotation.from_quat(values)
        if self.form == MATRIX:
            return Rotation.from_matrix(values.reshape(-1, 3, 3).transpose(0, 2, 1))
        if self.form == VECTOR:
            return Rotation.from_rotvec(values, degrees=self.degrees)
        return Rotation.from_euler(self.form, values, degrees=self.degrees)


MOST_TILT: Final = math.radians(30.0)
"""A body that leans further as a rule does not float in that plane."""


def lay_flat(tracks: Sequence[SpaceTrack], plane: Plane) -> RawRecording:
    """Return the bodies in the plane, with notes on what speaks against the plane.

    The loader says the rest: clock, units and rows.

    Parameters
    ----------
    tracks : sequence of SpaceTrack
        Bodies in space.
    plane : Plane
        The plane of the water.

    Raises
    ------
    InputError
        When the orientations of a body are none.
    """
    bodies, notes = [], []
    for track in tracks:
        with np.errstate(invalid="ignore"):  # an infinite position is a gap
            x, y, height = (track.position @ vector for vector in plane.vectors)
        angle, tilt = track.in_plane(plane)
        bodies.append(RawBody(track.name, track.clock, x, y, angle))
        notes += _against(track.name, plane, _span(height), max(_span(x), _span(y)), tilt)
    return RawRecording(bodies, y_axis="up", plane=plane.describe(), notes=notes)


def _span(values: Array) -> float:
    """Return how far a coordinate reaches, without the farthest hundredths, 0 when unknown."""
    known = values[np.isfinite(values)]
    return float(np.ptp(np.percentile(known, [1.0, 99.0]))) if known.size else 0.0


def _against(name: str, plane: Plane, height: float, width: float, tilt: Array | None) -> list[str]:
    notes = []
    if height > width:
        notes.append(
            f"body '{name}' moves farther along {plane.up}, which is taken to point up, than in "
            "the plane of the water: is `up` right?"
        )
    known = np.zeros(0) if tilt is None else tilt[np.isfinite(tilt)]
    leaning = float(np.median(known)) if known.size else 0.0
    if leaning > MOST_TILT:
        notes.append(
            f"body '{name}' leans by {math.degrees(leaning):.0f}° as a rule: is `up` right? Its "
            "angle is the angle of the body's axis that lies in the plane while the body is upright"
        )
    return notes


@dataclass(frozen=True)
class SpaceColumns:
    """Columns of one body in a table, from 0."""

    position: Sequence[int]
    """Those of x, y, z."""
    turns: Sequence[int] = ()
    """Those of its orientation; empty: it has none."""
    form: str = QUATERNION
    """As in `SpaceTrack`."""
    degrees: bool = False


def read_in_space(
    path: Path,
    layout: TableLayout,
    bodies: Mapping[str, SpaceColumns],
    up: str,
    *,
    zero_is_missing: bool = False,
    **facts: Any,
) -> RawRecording:
    """Read bodies in space from a table and lay them into the plane.

    Parameters
    ----------
    path : Path
        Text file.
    layout : TableLayout
        Where its rows begin; its clock, without which the rows are counted.
    bodies : mapping
        From a name to its columns.
    up : str
        Axis that points up.
    zero_is_missing : bool
        Whether a position of three zeros was not seen.
    **facts
        What the `RawRecording` says besides.

    Raises
    ------
    FormatError, InputError
        When a row cannot be read, or an orientation is none.
    """
    used = {at for one in bodies.values() for at in (*one.position, *one.turns)}
    used |= set() if layout.clock is None else {layout.clock}
    table = read_table(path, replace(layout, numbers=tuple(sorted(used))))
    rows = np.arange(table.rows, dtype=np.float64)
    clock = rows if layout.clock is None else table.numbers[layout.clock]
    tracks = []
    for name, one in bodies.items():
        position = table.stack(one.position)
        if zero_is_missing:
            position[(position == 0.0).all(axis=1)] = np.nan
        turns = table.stack(one.turns) if one.turns else None
        tracks.append(SpaceTrack(name, clock, position, turns, one.form, one.degrees))
    return replace(lay_flat(tracks, plane_of(up)), clock_origin=table.clock_origin, **facts)


PARTS: Final = ("qx", "qy", "qz", "qw")


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
    plane = plane_of(up or "z")
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
    axes = [values[places[axis]] if axis in places else np.zeros(clock.size) for axis in "xyz"]
    parts = [values[places[part]] for part in PARTS if set(PARTS) <= set(places)]
    turns = np.column_stack(parts) if parts else None
    flat = lay_flat([SpaceTrack("0", clock, np.column_stack(axes), turns)], plane)
    return flat.bodies[0], flat.notes


_RADIUS_M: Final = 6_378_137.0
"""Equatorial radius of the ellipsoid WGS 84."""
_ECCENTRICITY: Final = 6.694379990141e-3
"""Square of its first eccentricity."""


def on_the_ground(bodies: list[RawBody]) -> str:
    """Turn longitude and latitude [deg] of all bodies into x, y [m], in place; return the note.

    The plane touches the ellipsoid at the first position: east is x, north is y. A kilometre away
    its error is a few centimetres.

    Raises
    ------
    InputError
        When a latitude is none.
    """
    places = np.concatenate([[body.x, body.y] for body in bodies], axis=1)
    places = places[:, np.isfinite(places).all(axis=0)]
    if (np.abs(places) > [[360.0], [90.0]]).any():
        raise InputError(
            "a latitude is beyond 90, or a longitude beyond 360 degrees: are the columns right, "
            "and are they in degrees?"
        )
    if not places.size:
        return "longitude and latitude are missing in every row"
    lon, lat = places[:, 0].tolist()
    bend = 1.0 - _ECCENTRICITY * np.sin(np.radians(lat)) ** 2
    east = _RADIUS_M / np.sqrt(bend) * np.cos(np.radians(lat))
    north = _RADIUS_M * (1.0 - _ECCENTRICITY) / bend**1.5
    for body in bodies:
        away = (body.x - lon + 180.0) % 360.0 - 180.0
        body.x, body.y = east * np.radians(away), north * np.radians(body.y - lat)
    return (
        f"longitude and latitude are projected: x to the east and y to the north of the first "
        f"position, {lat:.7g}, {lon:.7g}"
    )
