"""Pictures of detections and rejected candidates, over the frames."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.core.extras import require_opencv
from driftwalk.track.follow.tracker import TrackState
from driftwalk.track.types import Detection, Image, PixelToWorld, Rejected

Pixel = tuple[int, int]

# Blue, green, red; of Okabe and Ito, distinguishable with any kind of colour vision.
_COLOURS: Final = (
    (178, 114, 0),
    (0, 94, 213),
    (115, 158, 0),
    (167, 121, 204),
    (0, 159, 230),
    (233, 180, 86),
    (66, 228, 240),
)
_DARK, _LIGHT, _WARNING = (0, 0, 0), (255, 255, 255), (0, 0, 255)
"""Colours of words: blue, green, red."""
_ACCEPTED, _REJECTED = (80, 220, 80), (60, 60, 240)
"""Colours of regions that count, and of those that do not."""
_CODECS: Final = {".mp4": "mp4v", ".avi": "MJPG", ".mkv": "FFV1"}


def draw_states(image: Image, states: Iterable[TrackState], camera: PixelToWorld) -> Image:
    """Return a frame with the bodies drawn over it.

    Parameters
    ----------
    image : array, shape (rows, columns, 3)
        The frame; it is not changed.
    states : iterable of TrackState
        The bodies: a line along their orientation, hollow where the body is not seen, a red ring
        where its identity is ambiguous.
    camera : PixelToWorld
        Where metres are in the image.

    Returns
    -------
    array, shape (rows, columns, 3)
        The picture.

    Examples
    --------
    >>> from driftwalk.track.camera import Camera
    >>> state = TrackState("0", 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, None, 0.0)
    >>> camera = Camera.from_scale(80, 60, px_per_m=100.0)
    >>> bool(draw_states(np.zeros((60, 80, 3), np.uint8), [state], camera).any())
    True
    """
    cv2 = require_opencv()
    picture = image.copy()
    for place, state in enumerate(states):
        colour = _COLOURS[place % len(_COLOURS)]
        middle = camera.to_pixel(np.array([[state.x, state.y]]))[0]
        if not np.isfinite(middle).all():
            continue
        at = _whole(middle)
        cv2.circle(picture, at, 4, colour, 1 if state.measured is None else -1, cv2.LINE_AA)
        if math.isfinite(state.theta):
            ahead = np.array([math.cos(state.theta), -math.sin(state.theta)])
            cv2.line(picture, at, _whole(middle + 18 * ahead), colour, 2, cv2.LINE_AA)
        if state.ambiguous > 0:
            cv2.circle(picture, at, 18, _WARNING, 2, cv2.LINE_AA)
        _write(picture, state.id, (at[0] + 6, at[1] - 6), _LIGHT, size=0.45)
    return picture


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


class OverlayWriter:
    """Writes pictures as a video that plays in real time.

    A video file has one rate; it is that of the first pictures. Where pictures are missing the one
    before stays, and pictures that come faster are left out.

    Parameters
    ----------
    path : path-like
        ``.mp4``, ``.avi`` or ``.mkv``.

    Raises
    ------
    InputError
        When the ending is another one, or the file cannot be written.

    Examples
    --------
    >>> OverlayWriter("overlay.gif")
    Traceback (most recent call last):
    driftwalk.core.errors.InputError: overlay.gif: an overlay is written as .mp4, .avi or .mkv
    """

    def __init__(self, path: str | Path) -> None:
        self._path = Path(path)
        if self._path.suffix.lower() not in _CODECS:
            raise InputError(f"{path}: an overlay is written as .mp4, .avi or .mkv")
        self._cv2 = require_opencv()
        self._writer: Any = None
        self._first: list[tuple[float, Image]] = []
        self._rate, self._began, self._written = 10.0, 0.0, 0
        self._last: Image | None = None

    def write(self, picture: Image, time: float) -> None:
        """Add a picture.

        Parameters
        ----------
        picture : array, shape (rows, columns, 3)
            Blue, green, red.
        time : float
            When it was taken [s].
        """
        if self._writer is not None:
            self._add(picture, time)
            return
        self._first.append((time, picture))
        # Twelve frames tell their rate.
        if len(self._first) == 12:
            self._open()

    def close(self) -> None:
        """Finish the file."""
        if self._writer is None and self._first:
            self._open()
        if self._writer is not None:
            self._writer.release()

    def _open(self) -> None:
        """Open the file with the rate of the first pictures, and write these."""
        times = [time for time, _ in self._first]
        if len(times) > 1:
            gap = float(np.median(np.diff(times)))
            self._rate = min(max(1.0 / gap, 0.5), 240.0)
        self._began = times[0]
        code = self._cv2.VideoWriter_fourcc(*_CODECS[self._path.suffix.lower()])
        rows, columns = self._first[0][1].shape[:2]
        self._writer = self._cv2.VideoWriter(str(self._path), code, self._rate, (columns, rows))
        if not self._writer.isOpened():
            raise InputError(f"{self._path}: cannot be written as a video")
        waiting, self._first = self._first, []
        for time, picture in waiting:
            self._add(picture, time)

    def _add(self, picture: Image, time: float) -> None:
        place = round((time - self._began) * self._rate)
        while self._last is not None and self._written < place:
            self._put(self._last)
        if self._written == place:
            self._put(picture)
        self._last = picture

    def _put(self, picture: Image) -> None:
        self._writer.write(picture)
        self._written += 1


def save_picture(path: str | Path, picture: Image) -> Path:
    """Write a picture as PNG.

    Parameters
    ----------
    path : path-like
        The file.
    picture : array, shape (rows, columns, 3)
        Blue, green, red.

    Returns
    -------
    pathlib.Path
        The file.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save_picture(f"{folder}/a.png", np.zeros((4, 4, 3), np.uint8)).name
    'a.png'
    """
    from driftwalk.core.files.atomic import write_atomic

    done, data = require_opencv().imencode(".png", picture)
    if not done:
        raise InputError(f"{path}: the picture cannot be written as PNG")
    write_atomic(path, data.tobytes())
    return Path(path)


def _arrow_end(found: Detection, radius: float, camera: PixelToWorld | None) -> Pixel:
    """Return the pixel at which the arrow of an orientation ends."""
    direction = np.array([math.cos(found.theta), -math.sin(found.theta)])
    if camera is not None and found.x is not None and found.y is not None:
        pixel = np.array([[found.column, found.row]])
        along = np.array([math.cos(found.theta), math.sin(found.theta)])
        direction = np.linalg.solve(camera.jacobian(pixel)[0], along)
        direction = direction / np.hypot(*direction)
    return _whole(np.array([found.column, found.row]) + 1.6 * radius * direction)


def _whole(point: Any) -> Pixel:
    return round(float(point[0])), round(float(point[1]))


def _write(
    picture: Image, text: str, at: Pixel, colour: tuple[int, int, int], *, size: float = 0.35
) -> None:
    """Write a line on a dark rim so that it stays in the picture and can be read on any ground."""
    cv2 = require_opencv()
    font = cv2.FONT_HERSHEY_SIMPLEX
    # The fonts of OpenCV know ASCII only.
    plain = text.replace("²", "2").encode("ascii", "replace").decode()
    (width, height), _ = cv2.getTextSize(plain, font, size, 1)
    column = max(min(at[0], picture.shape[1] - width - 2), 0)
    row = max(min(at[1], picture.shape[0] - 3), height)
    for shade, thickness in ((_DARK, 3), (colour, 1)):
        cv2.putText(picture, plain, (column, row), font, size, shade, thickness, cv2.LINE_AA)
