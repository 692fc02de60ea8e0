"""Sample images spread over a source, to find the rim, the background, the colours."""

from __future__ import annotations

import contextlib
from itertools import islice
from pathlib import Path

from driftwalk.core.errors import InputError
from driftwalk.core.extras import require_opencv
from driftwalk.track.frames import (
    FrameSource,
    ImageSequence,
    LiveCamera,
    VideoFile,
    images_in,
    open_capture,
)
from driftwalk.track.types import Image


def sample_images(
    source: str | Path, number: int = 25, *, rate: float | None = None
) -> list[Image]:
    """Return images spread evenly over a source.

    Parameters
    ----------
    source : str or path-like
        As `open_source` takes it. Of a camera, the images of the next seconds.
    number : int
        How many, at most.
    rate : float, optional
        Images per second of a folder without times [Hz].

    Returns
    -------
    list of array, shape (rows, columns, 3)
        The images, at least one.

    Raises
    ------
    InputError
        When the source cannot be read or holds no frame.

    Examples
    --------
    >>> sample_images("no/such/video.mp4")
    Traceback (most recent call last):
    driftwalk.core.errors.FormatError: no/such/video.mp4: no such video
    """
    total = frame_count(source) or 0
    # Of a camera every fifth frame: those in between show much the same.
    stride = 5 if str(source).startswith("camera:") else max(1, total // number)
    # Seeking is quicker than reading 50 frames between two samples.
    seekable = total > 50 * number and Path(source).is_file()
    if seekable and (found := _by_seeking(source, total, number)):
        return found
    opened = open_source(source, rate=rate)
    with contextlib.closing(opened):
        images = [frame.image for frame in islice(iter(opened), 0, stride * number, stride)]
    if not images:
        raise InputError(f"{source}: holds no frame")
    return images


def frame_count(source: str | Path) -> int | None:
    """Return the number of frames that a source states; None if it states none.

    Parameters
    ----------
    source : str or path-like
        As `open_source` takes it.

    Returns
    -------
    int or None
        The number; a video may be wrong about itself.

    Examples
    --------
    >>> frame_count("camera:0") is None
    True
    """
    path = Path(source)
    if path.is_dir():
        listed = path / "times.csv"
        if listed.exists():
            with listed.open("rb") as file:
                return sum(1 for _ in file) - 1
        return len(images_in(path))
    if not path.is_file():
        return None
    cv2 = require_opencv()
    open_source(source).close()
    capture = open_capture(str(path))
    count = int(capture.get(cv2.CAP_PROP_FRAME_COUNT))
    capture.release()
    return count if count > 0 else None


def _by_seeking(source: str | Path, total: int, number: int) -> list[Image]:
    cv2 = require_opencv()
    capture = open_capture(str(source))
    images = []
    for place in range(number):
        capture.set(cv2.CAP_PROP_POS_FRAMES, place * total // number)
        read, image = capture.read()
        if read:
            images.append(image)
    capture.release()
    return images


def open_source(
    source: str | Path, *, rate: float | None = None, keep_stale: bool = False
) -> FrameSource:
    """Open a video, a folder of images, or a camera.

    Parameters
    ----------
    source : str or path-like
        A video file; a folder of images; ``camera:0`` for the first camera.
    rate : float, optional
        Images per second of a folder without a ``times.csv`` [Hz].
    keep_stale : bool
        Whether frames with exactly the image before are handed on.

    Returns
    -------
    FrameSource
        Iterate over it for `Frame` objects; then its ``counts`` and ``interrupted`` (None, or why
        it ended early) are final.

    Raises
    ------
    InputError
        When it cannot be opened.

    Examples
    --------
    >>> open_source("no/such/video.mp4")
    Traceback (most recent call last):
    driftwalk.core.errors.FormatError: no/such/video.mp4: no such video
    """
    text = str(source)
    if text.startswith("camera:"):
        return LiveCamera.open(text)
    if Path(source).is_dir():
        return ImageSequence(source, rate=rate, keep_stale=keep_stale)
    return VideoFile(source, keep_stale=keep_stale)
