"""Types that pass between the parts of the tracker: frames, detections, and rejected candidates.

Pixels are (column, row), with pixel centres at whole numbers and rows counted downwards. The world
is in metres, y up, angles counter-clockwise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats

Image = npt.NDArray[np.uint8]
"""An image, shape (rows, columns, 3), blue, green, red."""


@dataclass(frozen=True, eq=False)
class Frame:
    """One image of a video, and when it was taken.

    Parameters
    ----------
    index : int
        Number of the frame in its source, from 0.
    time : float
        Presentation time [s].
    image : array, shape (rows, columns, 3)
        Blue, green, red, uint8.
    """

    index: int
    time: float
    image: Image


@dataclass(frozen=True, eq=False)
class Detection:
    """One object found in a frame.

    Parameters
    ----------
    x, y : float or None
        Position [m]; None when the camera is not calibrated.
    column, row : float
        Position in the image [px].
    theta : float
        Orientation [rad], counter-clockwise; NaN when the object has none. In the world when the
        camera is calibrated, else in the image seen with y up.
    covariance : array, shape (3, 3)
        Of x, y, theta [m, m, rad]; of the position in pixels when the camera is not calibrated.
        NaN in the row and column of an angle that is not known.
    area_px : float
        Area of what was found [px²].
    key : str or None
        Key of a coded tag; None for objects that look alike.
    score : float
        In [0, 1]: how well it fits what was looked for.
    """

    x: float | None
    y: float | None
    column: float
    row: float
    theta: float
    covariance: Floats
    area_px: float
    key: str | None = None
    score: float = 1.0


@dataclass(frozen=True)
class Rejected:
    """A rejected candidate.

    Parameters
    ----------
    column, row : float
        Where it was [px].
    area_px : float
        Its area [px²].
    reason : str
        Why, in words.
    kind : str
        The reason as one word, by which rejected candidates are counted.
    """

    column: float
    row: float
    area_px: float
    reason: str
    kind: str = "other"


class PixelToWorld(Protocol):
    """A calibrated camera."""

    def to_world(self, points: Floats) -> Floats:
        """Return pixels, shape (n, 2), as metres."""

    def to_pixel(self, points: Floats) -> Floats:
        """Return metres, shape (n, 2), as pixels."""

    def jacobian(self, points: Floats) -> Floats:
        """Return d(x, y)/d(column, row) [m/px] at pixels, shape (n, 2, 2)."""


class Detector(Protocol):
    """Finds objects in one image."""

    def detect(self, image: Image) -> tuple[list[Detection], list[Rejected]]:
        """Return the detections, and the rejected candidates with their reasons."""
