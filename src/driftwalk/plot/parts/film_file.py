"""The file of a film: frames to GIF by Pillow, to MP4 by ffmpeg or by OpenCV."""

from __future__ import annotations

import contextlib
import itertools
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError

Frame = npt.NDArray[np.uint8]
"""Red, green, blue: shape (rows, columns, 3)."""
FRAMES_PER_S: Final = {".gif": 12.5, ".mp4": 25.0}
"""A GIF counts in hundredths of a second: 12.5 frames per second are exact."""
CODECS: Final = ("vp09", "mp4v")
"""Encoders of OpenCV, best first: VP9, which browsers play, and MPEG-4."""


def require_film_writer(ending: str) -> None:
    """Refuse a film that nothing on this machine can write.

    Parameters
    ----------
    ending : {".gif", ".mp4"}
        Its ending.

    Raises
    ------
    InputError
        Says what to install.

    Examples
    --------
    >>> require_film_writer(".gif")
    """
    if ending != ".mp4" or shutil.which("ffmpeg") is not None:
        return
    try:
        import cv2  # noqa: F401
    except ImportError as error:
        raise InputError(
            "an MP4 needs the program ffmpeg, or OpenCV: pip install 'driftwalk[track]'; or write "
            "a .gif"
        ) from error


def write_frames(path: Path, ending: str, frames: Iterator[Frame]) -> None:
    """Write frames as a film, one after another, so that they are never all in memory.

    Parameters
    ----------
    path : Path
        The file to make.
    ending : {".gif", ".mp4"}
        As what.
    frames : iterator of array, shape (rows, columns, 3)
        Frames of one size, at least one.

    Raises
    ------
    InputError
        When the encoder fails.

    Examples
    --------
    >>> write_frames(Path("a.gif"), ".gif", iter([frame]))  # doctest: +SKIP
    """
    if ending == ".gif":
        _write_gif(path, frames)
    elif shutil.which("ffmpeg") is not None:
        _write_by_ffmpeg(path, frames)
    else:
        _write_by_opencv(path, frames)


def _write_gif(path: Path, frames: Iterator[Frame]) -> None:
    from PIL import Image

    pictures = (Image.fromarray(np.ascontiguousarray(frame)) for frame in frames)
    next(pictures).save(
        path,
        format="GIF",
        save_all=True,
        append_images=pictures,
        duration=round(1000.0 / FRAMES_PER_S[".gif"]),
        loop=0,
    )


def _write_by_ffmpeg(path: Path, frames: Iterator[Frame]) -> None:
    first = next(frames)
    rows, columns = first.shape[:2]
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{columns}x{rows}"]
    made = ["-c:v", "h264", "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4"]
    rate = ["-r", f"{FRAMES_PER_S['.mp4']:g}"]
    command = ["ffmpeg", "-loglevel", "error", "-y", *raw, *rate, "-i", "-", *made, str(path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as ffmpeg:
        assert ffmpeg.stdin is not None
        assert ffmpeg.stderr is not None
        try:
            # A pipe that closes early is an encoder that failed, and says why below.
            with contextlib.suppress(BrokenPipeError):
                for frame in itertools.chain([first], frames):
                    ffmpeg.stdin.write(np.ascontiguousarray(frame).tobytes())
                ffmpeg.stdin.close()
        except BaseException:
            ffmpeg.kill()
            raise
        said = " ".join(ffmpeg.stderr.read().decode(errors="replace").split())
    if ffmpeg.returncode != 0:
        raise InputError(f"ffmpeg could not write the film: {said or ffmpeg.returncode}")


def _write_by_opencv(path: Path, frames: Iterator[Frame]) -> None:
    first = next(frames)
    writer = _opencv_writer(path, first.shape[1], first.shape[0])
    try:
        writer.write(_blue_first(first))
        for frame in frames:
            writer.write(_blue_first(frame))
    finally:
        writer.release()


def _opencv_writer(path: Path, columns: int, rows: int) -> Any:
    from driftwalk.core.extras import require_opencv

    cv2 = require_opencv("an MP4")
    for codec in CODECS:
        code = cv2.VideoWriter.fourcc(*codec)
        writer = cv2.VideoWriter(str(path), code, FRAMES_PER_S[".mp4"], (columns, rows))
        if writer.isOpened():
            return writer
    raise InputError("this OpenCV writes no MP4: install the program ffmpeg, or write a .gif")


def _blue_first(frame: Frame) -> Frame:
    return np.ascontiguousarray(frame[:, :, ::-1])
