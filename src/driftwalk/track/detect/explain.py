"""Draw detections into a frame, and rejected candidates with their reasons."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from driftwalk.core.extras import require_opencv
from driftwalk.track.types import Detection, Image, PixelToWorld, Rejected

_ACCEPTED: Final = (80, 220, 80)
_REJECTED: Final = (60, 60, 240)


def explain_frame(
    image: Image,
    detections: Sequence[Detection],
    rejected: Sequence[Rejected] = (),
    *,
    camera: PixelToWorld | None = None,
    names: Sequence[str] | None = None,
) -> Image:
    """Draw detections in green and rejected candidates in red, with their reasons.

    Parameters
    ----------
    image : array, shape (rows, columns, 3)
        The frame.
    detections : sequence of Detection
        The accepted candidates.
    rejected : sequence of Rejected
        The rejected candidates.
    camera : PixelToWorld, optional
        How the world lies in the image, for the arrows of orientations.
    names : sequence of str, optional
        Label of each detection; its key or number when left out.

    Returns
    -------
    array, shape (rows, columns, 3)
        A picture of the same size.

    Examples
    --------
    >>> import numpy as np
    >>> image = np.zeros((60, 120, 3), np.uint8)
    >>> turned_down = Rejected(30.0, 30.0, 20.0, "too small: 20 px²", "too small")
    >>> bool((explain_frame(image, [], [turned_down])[..., 2] > 100).any())
    True
    """
    cv2 = require_opencv()
    picture = image.copy()
    for number, found in enumerate(detections):
        centre = (round(found.column), round(found.row))
        radius = max(1.3 * math.sqrt(found.area_px / math.pi), 5.0)
        cv2.circle(picture, centre, round(radius), _ACCEPTED, 1, cv2.LINE_AA)
        if math.isfinite(found.theta):
            end = _arrow_end(found, radius, camera)
            cv2.arrowedLine(picture, centre, end, _ACCEPTED, 1, cv2.LINE_AA, 0, 0.25)
        name = names[number] if names is not None else found.key or str(number)
        _write(picture, name, (centre[0] + round(radius), centre[1] - round(radius)), _ACCEPTED)
    for item in rejected:
        centre = (round(item.column), round(item.row))
        cv2.drawMarker(picture, centre, _REJECTED, cv2.MARKER_TILTED_CROSS, 9, 1, cv2.LINE_AA)
        _write(picture, item.reason, (centre[0] + 7, centre[1] + 4), _REJECTED)
    return picture


def _arrow_end(found: Detection, radius: float, camera: PixelToWorld | None) -> tuple[int, int]:
    """Return the pixel at which the arrow of an orientation ends."""
    direction = np.array([math.cos(found.theta), -math.sin(found.theta)])
    if camera is not None and found.x is not None and found.y is not None:
        pixel = np.array([[found.column, found.row]])
        along = np.array([math.cos(found.theta), math.sin(found.theta)])
        direction = np.linalg.solve(camera.jacobian(pixel)[0], along)
        direction = direction / np.hypot(*direction)
    end = np.array([found.column, found.row]) + 1.6 * radius * direction
    return round(float(end[0])), round(float(end[1]))


def _write(picture: Image, text: str, at: tuple[int, int], colour: tuple[int, int, int]) -> None:
    """Write a line so that it stays in the picture and can be read on any ground."""
    cv2 = require_opencv()
    # The fonts of OpenCV know ASCII only.
    plain = text.replace("²", "2").encode("ascii", "replace").decode()
    (width, height), _ = cv2.getTextSize(plain, cv2.FONT_HERSHEY_SIMPLEX, 0.35, 1)
    column = max(min(at[0], picture.shape[1] - width - 2), 0)
    row = max(min(at[1], picture.shape[0] - 3), height)
    for shade, thickness in (((0, 0, 0), 3), (colour, 1)):
        cv2.putText(
            picture,
            plain,
            (column, row),
            cv2.FONT_HERSHEY_SIMPLEX,
            0.35,
            shade,
            thickness,
            cv2.LINE_AA,
        )
