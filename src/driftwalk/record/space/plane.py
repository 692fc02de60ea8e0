"""Plane of the water in the axes of a file, seen from above."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.record.raw import Array

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
        return np.array([_vector(name) for name in (self.x, self.y, self.up)])

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


def _vector(name: str) -> Array:
    # Added to zeros, so that no axis gets a minus zero.
    vector = np.zeros(3)
    vector["xyz".index(name[-1])] = -1.0 if name.startswith("-") else 1.0
    return vector
