"""Open a source of frames: a video, a folder of images, a camera."""

from __future__ import annotations

from pathlib import Path

from driftwalk.track.source.frames import FrameSource, ImageSequence, VideoFile
from driftwalk.track.source.live_camera import LiveCamera


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
