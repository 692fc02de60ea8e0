"""Frames with the times at which they were taken: from a video, from images, from a camera.

A frame's time is the stream's presentation time, never its number over a nominal rate. Irregular
frames are counted: frames that are missing, that come twice, that show nothing new.
"""

from __future__ import annotations

import csv
import dataclasses
import math
import os
import threading
import time as clock
from bisect import bisect_right, insort
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple, Protocol
from urllib.parse import urlsplit, urlunsplit

import numpy as np

from driftwalk.core.errors import FormatError, InputError
from driftwalk.core.extras import read_image, require_opencv
from driftwalk.track.types import Frame, Image

_IMAGES: Final = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp")
_TIMES: Final = "times.csv"
_FFMPEG_LOG: Final = "OPENCV_FFMPEG_LOGLEVEL"


@dataclass
class FrameCounts:
    """Counts of a source's frames.

    Parameters
    ----------
    frames : int
        Frames that were handed on.
    dropped : int
        Frames that are missing between those there are: from gaps in the times, or taken by a
        camera while the frame before was still being worked on. While a file is read it is counted
        by the usual gap up to then, which the first few frames teach; it is final at the end.
    duplicates : int
        Frames with the time of the one before, or an earlier one; left out.
    stale : int
        Frames with a new time and exactly the old image, as a camera or a converter makes them to
        keep its rate; left out.

    Examples
    --------
    >>> FrameCounts(frames=10).to_dict()
    {'frames': 10, 'dropped': 0, 'duplicates': 0, 'stale': 0}
    """

    frames: int = 0
    dropped: int = 0
    duplicates: int = 0
    stale: int = 0

    def to_dict(self) -> dict[str, int]:
        """Return the counts by name."""
        return dataclasses.asdict(self)


class FrameSource(Protocol):
    """A source of frames; iterated once."""

    name: str
    counts: FrameCounts
    interrupted: str | None
    waited_s: float
    """How long the last frame lay there before it was handed on [s]; 0 for files."""

    def __iter__(self) -> Iterator[Frame]:
        """Yield the frames in the order of their times."""

    def close(self) -> None:
        """Let go of the file or the camera."""


class FrameGapPolicy(NamedTuple):
    """When a frame is missing between two."""

    long: float = 1.5
    """Usual gaps that one has to last for a frame to be missing in it; chosen by hand."""
    learnt: int = 8
    """Gaps that teach the usual one; before them no frame is missing; chosen by hand."""
    same: float = 0.01
    """Relative change of the usual gap above which all gaps are counted again; chosen by hand."""


_GAPS: Final = FrameGapPolicy()


class FrameGaps:
    """The times between frames.

    Frames that are missing are counted with each gap, by the usual gap up to then. When the usual
    gap turns out to be another one, all are counted again; ``settle`` does so at the end.

    Examples
    --------
    >>> gaps = FrameGaps()
    >>> for gap in [0.1] * 8 + [0.3]:
    ...     gaps.add(gap)
    >>> gaps.missing
    2
    """

    def __init__(self) -> None:
        self._sorted: list[float] = []
        self._counted_by = 0.0
        self.missing = 0

    @property
    def usual(self) -> float:
        """The median of the gaps [s]; 0 where there is none."""
        number = len(self._sorted)
        if not number:
            return 0.0
        return (self._sorted[(number - 1) // 2] + self._sorted[number // 2]) / 2

    def add(self, gap: float) -> None:
        """Take in the time between a frame and the one before [s], above zero."""
        insort(self._sorted, gap)
        if len(self._sorted) < _GAPS.learnt:
            return
        usual = self.usual
        if abs(usual - self._counted_by) > _GAPS.same * self._counted_by:
            self._count_anew(usual)
        elif gap > _GAPS.long * self._counted_by:
            self.missing += round(gap / self._counted_by) - 1

    def settle(self) -> None:
        """Count by the usual one of all gaps; one gap alone says nothing."""
        if len(self._sorted) > 1:
            self._count_anew(self.usual)

    def _count_anew(self, usual: float) -> None:
        long = self._sorted[bisect_right(self._sorted, _GAPS.long * usual) :]
        self.missing = sum(round(gap / usual) - 1 for gap in long)
        self._counted_by = usual


@dataclass
class FrameFilter:
    """Leaves out frames that come twice or show nothing new, and checks the size.

    Parameters
    ----------
    name : str
        The source, for messages.
    counts : FrameCounts
        The counts to update.
    keep_stale : bool
        Whether frames with exactly the image before are handed on, as a drawn video needs it in
        which nothing moves.
    gaps : FrameGaps, optional
        Counter of the gaps between frames. Left out for a camera, whose frames are
        counted where they are lost.
    """

    name: str
    counts: FrameCounts
    keep_stale: bool = field(default=False, kw_only=True)
    gaps: FrameGaps | None = field(default=None, kw_only=True)
    _last: Image | None = field(default=None, init=False)
    _time: float = field(default=-np.inf, init=False)

    def accept(self, index: int, time: float, image: Any) -> Frame | None:
        """Return the frame, None when it is left out."""
        picture = np.asarray(image, dtype=np.uint8)
        if picture.ndim != 3:
            picture = np.repeat(picture[..., None], 3, axis=2)
        if self._last is not None and picture.shape != self._last.shape:
            was, now = self._last.shape, picture.shape
            raise FormatError(
                f"frame {index} is {now[1]} x {now[0]} pixels, the frames before are "
                f"{was[1]} x {was[0]}: a recording has one size",
                path=self.name,
            )
        if not time > self._time:
            self.counts.duplicates += 1
            return None
        stale = self._last is not None and _same(picture, self._last)
        if self._last is not None and self.gaps is not None:
            self.gaps.add(time - self._time)
            self.counts.dropped = self.gaps.missing
        self._last, self._time = picture, time
        if stale:
            self.counts.stale += 1
            if not self.keep_stale:
                return None
        self.counts.frames += 1
        return Frame(index, time, picture)

    def settle(self) -> None:
        """Count the frames that are missing by all gaps, when no more will come."""
        if self.gaps is not None:
            self.gaps.settle()
            self.counts.dropped = self.gaps.missing


class _Source:
    """The fields of every source."""

    def __init__(self, name: str) -> None:
        self.name, self.counts = name, FrameCounts()
        self.interrupted: str | None = None
        self.waited_s = 0.0


class VideoFile(_Source):
    """A video file, read once from its start.

    Parameters
    ----------
    path : path-like
        Anything that OpenCV reads.
    keep_stale : bool
        See `FrameCounts`.

    Raises
    ------
    FormatError
        When there is no such file, or it is no video.
    """

    def __init__(self, path: str | Path, *, keep_stale: bool = False) -> None:
        cv2 = require_opencv()
        super().__init__(str(path))
        self._keep_stale = keep_stale
        if not Path(path).exists():
            raise FormatError("no such video", path=path)
        if Path(path).is_dir() or Path(path).stat().st_size == 0:
            raise FormatError("is not a video: nothing to read in it", path=path)
        self._position = cv2.CAP_PROP_POS_MSEC
        self._capture = open_capture(str(path))
        if not self._capture.isOpened():
            raise FormatError("is not a video that OpenCV can read", path=path)
        self._rate = float(self._capture.get(cv2.CAP_PROP_FPS))
        self._promised = int(self._capture.get(cv2.CAP_PROP_FRAME_COUNT))

    def __iter__(self) -> Iterator[Frame]:
        """Yield the frames.

        Raises
        ------
        FormatError
            When there is no frame, the size changes, or the stream has no times.
        """
        gaps = FrameGaps()
        keep = FrameFilter(self.name, self.counts, keep_stale=self._keep_stale, gaps=gaps)
        index, time = 0, 0.0
        try:
            while self._capture.grab():
                time = float(self._capture.get(self._position)) / 1000.0
                read, image = self._capture.retrieve()
                if read and (frame := keep.accept(index, time, image)) is not None:
                    yield frame
                index += 1
        finally:
            keep.settle()
            self.close()
        if index == 0:
            raise FormatError("holds no frame", path=self.name)
        if index > 1 and self.counts.duplicates == index - 1:
            raise FormatError(
                "has no presentation times: write it again with another program", path=self.name
            )
        self.interrupted = self._cut_off(index, time + gaps.usual)

    def close(self) -> None:
        """Let go of the file."""
        self._capture.release()

    def _cut_off(self, frames: int, end: float) -> str | None:
        """Return that the file ends early, None when it does not.

        Where the rate varies, the number of frames that a file states is often its duration times
        a rate: only the duration tells.
        """
        if frames >= self._promised - 1 or not self._rate > 0:
            return None
        duration = self._promised / self._rate
        # A file whose pictures end this long before its stated end was cut off; sound may
        # continue a little.
        if duration - end < max(0.5, 2 / self._rate):
            return None
        return f"{self.name} ends after {frames} frames, at {end:.1f} s of {duration:.1f} s"


class ImageSequence(_Source):
    """Images in a folder, in the order of their names.

    Parameters
    ----------
    folder : path-like
        With a file ``times.csv`` of columns ``file``, ``time_s``, or with a stated rate.
    rate : float, optional
        Images per second [Hz]; not used when there is a ``times.csv``.
    keep_stale : bool
        See `FrameCounts`.

    Raises
    ------
    InputError
        When there are no images, no times and no rate, or the times cannot be read.
    """

    def __init__(
        self, folder: str | Path, *, rate: float | None = None, keep_stale: bool = False
    ) -> None:
        require_opencv()
        super().__init__(str(folder))
        self._keep_stale = keep_stale
        self._files = _timed_images(Path(folder), rate)

    def __iter__(self) -> Iterator[Frame]:
        """Yield the frames."""
        keep = FrameFilter(self.name, self.counts, keep_stale=self._keep_stale, gaps=FrameGaps())
        try:
            for index, (file, time) in enumerate(self._files):
                if (frame := keep.accept(index, time, read_image(file))) is not None:
                    yield frame
        finally:
            keep.settle()

    def close(self) -> None:
        """Do nothing: no file stays open."""


class LiveCamera(_Source):
    """Frames of a camera as they come; the newest one when the work takes longer than a frame.

    A frame's time is counted from the first frame. When the camera disappears, the iteration ends,
    and ``interrupted`` says so: what came before is complete.

    Parameters
    ----------
    capture : object
        Has ``read()`` as `cv2.VideoCapture` has it, and ``release()``.
    name : str
        For messages.
    patience : float
        How long to wait for a frame before the camera counts as gone [s].
    now : callable
        The clock [s].

    Examples
    --------
    >>> import numpy as np
    >>> class OneFrame:
    ...     left = [np.zeros((4, 6, 3), np.uint8)]
    ...     def read(self):
    ...         return (True, self.left.pop()) if self.left else (False, None)
    ...     def release(self):
    ...         pass
    >>> camera = LiveCamera(OneFrame(), "camera:0")
    >>> [frame.image.shape for frame in camera], camera.interrupted
    ([(4, 6, 3)], 'camera:0 stopped after 1 frame')
    """

    def __init__(
        self,
        capture: Any,
        name: str,
        *,
        patience: float = 5.0,
        now: Callable[[], float] = clock.monotonic,
    ) -> None:
        super().__init__(name)
        self._capture, self._patience, self._now = capture, patience, now
        self._changed = threading.Condition()
        self._newest: tuple[int, float, Any] | None = None
        self._read = 0
        self._gone = self._stop = False
        self._thread = threading.Thread(target=self._reading, name=f"reads {name}", daemon=True)

    @classmethod
    def open(cls, text: str) -> LiveCamera:
        """Open a camera by number, ``camera:0``, or by address, ``camera:rtsp://...``.

        Raises
        ------
        InputError
            When there is none.
        """
        cv2 = require_opencv()
        _, _, which = text.partition(":")
        capture = open_capture(int(which) if which.isdigit() else which)
        if not capture.isOpened():
            raise InputError(f"{public_name(text)}: no such camera, or another program uses it")
        # A queue in the driver would hand out old frames.
        capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)
        return cls(capture, public_name(text))

    def __iter__(self) -> Iterator[Frame]:
        """Yield the newest frame each time."""
        keep = FrameFilter(self.name, self.counts)
        first: float | None = None
        self._thread.start()
        try:
            while (newest := self._next()) is not None:
                index, time, image = newest
                first = time if first is None else first
                if (frame := keep.accept(index, time - first, image)) is not None:
                    self.waited_s = self._now() - time
                    yield frame
        finally:
            self.close()
        number = f"{self._read} frame{'' if self._read == 1 else 's'}"
        self.interrupted = f"{self.name} stopped after {number}"

    def close(self) -> None:
        """Let go of the camera."""
        self._stop = True
        if self._thread.is_alive():
            self._thread.join(timeout=self._patience)
        # To release a camera that a thread still reads from could end the whole program.
        if not self._thread.is_alive():
            self._capture.release()

    def _reading(self) -> None:
        while not self._stop:
            read, image = self._capture.read()
            time = self._now()
            with self._changed:
                self._changed.notify()
                if not read:
                    self._gone = True
                    return
                if self._newest is not None:
                    self.counts.dropped += 1
                self._newest = (self._read, time, image)
                self._read += 1

    def _next(self) -> tuple[int, float, Any] | None:
        """Return the newest frame, waiting for it; None when the camera is gone."""
        with self._changed:
            self._changed.wait_for(
                lambda: self._newest is not None or self._gone, timeout=self._patience
            )
            newest, self._newest = self._newest, None
            return newest


def public_name(text: str) -> str:
    """Return the name of a camera without the password that its address may hold.

    Examples
    --------
    >>> public_name("camera:rtsp://me:secret@192.0.2.7:554/stream?key=1")
    'camera:rtsp://192.0.2.7:554/stream'
    >>> public_name("camera:0")
    'camera:0'
    """
    kind, _, address = text.partition(":")
    parts = urlsplit(address)
    if not parts.netloc:
        return text
    host = parts.netloc.rpartition("@")[2]
    return f"{kind}:{urlunsplit((parts.scheme, host, parts.path, '', ''))}"


def open_capture(source: str | int) -> Any:
    """Return OpenCV's reader; what its libraries would print on failure, our own error says."""
    cv2 = require_opencv()
    log = cv2.utils.logging
    level = log.setLogLevel(log.LOG_LEVEL_SILENT)
    # Read by OpenCV when it opens the first video; who has set it wants to see more.
    quiet = _FFMPEG_LOG not in os.environ
    if quiet:
        os.environ[_FFMPEG_LOG] = "-8"
    try:
        return cv2.VideoCapture(source)
    finally:
        if quiet:
            del os.environ[_FFMPEG_LOG]
        log.setLogLevel(level)


def _timed_images(folder: Path, rate: float | None) -> list[tuple[Path, float]]:
    if (folder / _TIMES).exists():
        return _listed_images(folder)
    files = images_in(folder)
    if not files:
        raise InputError(f"{folder}: no images ({', '.join(_IMAGES)}) in this folder")
    if rate is None:
        raise InputError(
            f"{folder}: images have no times: state their rate in Hz (`rate`), "
            f"or put a {_TIMES} with the columns file, time_s in the folder"
        )
    if not (math.isfinite(rate) and rate > 0):
        raise InputError(f"the rate of images must be above zero, got {rate:g} Hz")
    return [(file, index / rate) for index, file in enumerate(files)]


def images_in(folder: Path) -> list[Path]:
    """Return the images in a folder, in the order of their names."""
    return sorted(file for file in folder.iterdir() if file.suffix.lower() in _IMAGES)


def _listed_images(folder: Path) -> list[tuple[Path, float]]:
    path = folder / _TIMES
    with path.open(newline="", encoding="utf-8-sig") as stream:
        rows = csv.DictReader(stream)
        try:
            found = [(folder / row["file"], float(row["time_s"])) for row in rows]
        except (KeyError, TypeError, ValueError, csv.Error):
            raise FormatError(
                "needs the columns file and time_s, a time in each row",
                path=path,
                line=rows.line_num,
            ) from None
    if not found:
        raise FormatError("lists no image", path=path)
    for number, (_, time) in enumerate(found, start=2):
        # 30,000 years: beyond any clock, and its gaps can still be counted in frames.
        if not abs(time) <= 1e12:
            raise FormatError(
                f"has a time of {time:g} s, which no clock shows", path=path, line=number
            )
    return found


def _same(first: Image, second: Image) -> bool:
    # Every sixteenth pixel is enough to see that most frames are not repeated.
    coarse = np.s_[::16, ::16]
    return np.array_equal(first[coarse], second[coarse]) and np.array_equal(first, second)
