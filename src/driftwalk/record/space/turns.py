"""3-D orientations (quaternions, Euler angles), and their angle in the plane."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError
from driftwalk.record.raw import Array
from driftwalk.record.space.plane import Plane

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

QUATERNION: Final = "quaternion"
VECTOR: Final = "vector"


@dataclass(frozen=True)
class Turns:
    """Orientations of a body in space, from its own axes to the file's."""

    values: Array
    """Shape (n, 4) or (n, 3), NaN where there is none."""
    form: str
    """`QUATERNION` (x, y, z, w), `VECTOR` (axis times angle), or the order of Euler angles about
    the axes of the body, such as ``"XYZ"``."""
    degrees: bool = False
    """Whether angles are in degrees."""

    def in_plane(self, plane: Plane) -> tuple[Array, Array]:
        """Return the angle in the plane and the tilt out of it.

        The angle [rad] is the direction of that axis of the body that lies along the plane's x
        where the body is not turned: the yaw of a body that stands upright, and of one that rolls
        and pitches as well, counter-clockwise seen from above. The tilt [rad] is how far the body's
        own upward axis leans.

        Raises
        ------
        InputError
            When quaternions have not the length 1.
        """
        angle, tilt = np.full(len(self.values), np.nan), np.full(len(self.values), np.nan)
        known = self._known()
        if not known.any():
            return angle, tilt
        rotation = self._rotation(self.values[known])
        x, y, up = plane.vectors
        forward = rotation.apply(x)
        angle[known] = np.arctan2(forward @ y, forward @ x)
        tilt[known] = np.arccos(np.clip(rotation.apply(up) @ up, -1.0, 1.0))
        return angle, tilt

    def _known(self) -> npt.NDArray[np.bool_]:
        known = np.isfinite(self.values).all(axis=1)
        if self.form == QUATERNION:
            # Four zeros are how some programs write that there is none.
            # float64 does not hold the squares of much smaller numbers.
            known = known & (np.abs(self.values) > 1e-12).any(axis=1)
        return np.asarray(known)

    def _rotation(self, values: Array) -> Rotation:
        from scipy.spatial.transform import Rotation

        if self.form == QUATERNION:
            _require_unit_length(values)
            return Rotation.from_quat(values)
        if self.form == VECTOR:
            return Rotation.from_rotvec(values, degrees=self.degrees)
        return Rotation.from_euler(self.form, values, degrees=self.degrees)


def _require_unit_length(quaternions: Array) -> None:
    with np.errstate(over="ignore"):
        length = float(np.median(np.linalg.norm(quaternions, axis=1)))
    # Printed with three digits, a unit quaternion keeps its length to within 2 %.
    if not abs(length - 1.0) <= 0.02:
        raise InputError(
            f"the quaternions have a length of {length:.4g} instead of 1: are their columns "
            "x, y, z, w the right ones?"
        )
