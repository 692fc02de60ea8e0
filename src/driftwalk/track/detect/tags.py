"""Fiducial tags with identities: ArUco and AprilTag, through OpenCV."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.core.extras import require_opencv
from driftwalk.track.types import Detection, Image, PixelToWorld, Rejected


def dictionary_of(cv2: Any, name: str) -> Any:
    """Return OpenCV's dictionary of a name: ``DICT_4X4_50`` or, in short, ``4X4_50``.

    Raises
    ------
    InputError
        When there is none of that name.
    """
    full = name.upper() if name.upper().startswith("DICT_") else f"DICT_{name.upper()}"
    if not hasattr(cv2.aruco, full):
        known = sorted({item.upper()[5:] for item in dir(cv2.aruco) if item.startswith("DICT_")})
        raise InputError(f"no dictionary '{name}' of tags; there is {', '.join(known)}")
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, full))


class TagDetector:
    """Finds coded tags.

    Position is where the tag's diagonals cross; orientation is that of its upper edge, from its
    left to its right corner.

    Parameters
    ----------
    dictionary : str
        As OpenCV names it: ``4X4_50``.
    camera : PixelToWorld, optional
        The scale; without it detections are in pixels.
    angle_offset : float
        Direction of the tag's upper edge, counter-clockwise from the block's +x face [rad].

    Raises
    ------
    InputError
        When there is no such dictionary.

    Examples
    --------
    >>> import cv2
    >>> tags = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    >>> image = cv2.copyMakeBorder(tags.generateImageMarker(7, 60), *[30] * 4, 0, value=255)
    >>> found, _ = TagDetector("4X4_50").detect(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR))
    >>> found[0].key, round(found[0].column), abs(round(found[0].theta, 2))
    ('7', 60, 0.0)
    """

    def __init__(
        self, dictionary: str, camera: PixelToWorld | None = None, *, angle_offset: float = 0.0
    ) -> None:
        cv2 = require_opencv()
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        self._cv2: Any = cv2
        self._detector = cv2.aruco.ArucoDetector(dictionary_of(cv2, dictionary), parameters)
        self.camera, self._offset = camera, angle_offset

    def detect(self, image: Image) -> tuple[list[Detection], list[Rejected]]:
        """Find the tags in one image.

        Parameters
        ----------
        image : array, shape (rows, columns, 3)
            Blue, green, red, uint8.

        Returns
        -------
        tuple
            Detections with their ``key``, and rejected candidates with the reason.
        """
        grey = self._cv2.cvtColor(image, self._cv2.COLOR_BGR2GRAY)
        corners, numbers, candidates = self._detector.detectMarkers(grey)
        names = [] if numbers is None else [str(int(n)) for n in np.asarray(numbers).ravel()]
        found: list[Detection] = []
        rejected = [
            _rejected(np.asarray(quad).reshape(4, 2), "no code of the dictionary", "no code")
            for quad in candidates
        ]
        for name, quad in zip(names, corners, strict=True):
            places = np.asarray(quad, dtype=np.float64).reshape(4, 2)
            if names.count(name) > 1:
                reason = f"tag {name} is seen {names.count(name)} times"
                rejected.append(_rejected(places, reason, "seen twice"))
            else:
                found.append(self._place(name, places))
        return found, rejected

    def _place(self, name: str, corners: Floats) -> Detection:
        pixel = _crossing(corners)
        # In the image, y up replaces the world if there is no camera.
        up = np.array([1.0, -1.0])
        world = corners * up if self.camera is None else self.camera.to_world(corners)
        slopes = np.diag(up) if self.camera is None else self.camera.jacobian(pixel[None])[0]
        along = ((world[1] - world[0]) + (world[2] - world[3])) / 2
        turn = np.array([-along[1], along[0]]) / float(along @ along)
        covariance = np.zeros((3, 3))
        # A corner of a tag is known to 0.15 px; chosen by hand.
        one = slopes @ slopes.T * 0.15**2
        covariance[:2, :2] = one / 4
        # Four corners, each with half of the turn of its edge.
        covariance[2, 2] = float(turn @ one @ turn)
        x, y = (None, None) if self.camera is None else _crossing(world).tolist()
        column, row = pixel.tolist()
        theta = math.remainder(math.atan2(along[1], along[0]) - self._offset, 2 * math.pi)
        return Detection(x, y, column, row, theta, covariance, _area(corners), key=name)


def _crossing(corners: Floats) -> Floats:
    """Return where the diagonals of a quadrilateral cross: its middle, seen from anywhere."""
    first, second = corners[2] - corners[0], corners[3] - corners[1]
    matrix = np.column_stack([first, -second])
    if abs(np.linalg.det(matrix)) < 1e-12 * max(float(np.abs(matrix).max()) ** 2, 1e-300):
        return np.asarray(corners.mean(axis=0))
    share = np.linalg.solve(matrix, corners[1] - corners[0])[0]
    return np.asarray(corners[0] + share * first)


def _area(corners: Floats) -> float:
    x, y = corners.T
    return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2)


def _rejected(corners: Floats, reason: str, kind: str) -> Rejected:
    column, row = corners.mean(axis=0)
    return Rejected(float(column), float(row), _area(corners), reason, kind)
