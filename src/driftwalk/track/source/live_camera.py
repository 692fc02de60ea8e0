"""Live camera: a thread reads it and keeps the newest frame."""

from __future__ import annotations

import threading
import time as clock
from collections.abc import Callable, Iterator
from typing import Any
from urllib.parse import urlsplit, urlunsplit

from driftwalk.core.errors import InputError
from driftwalk.core.extras import require_opencv
from driftwalk.track.source.frames import FrameCounts, FrameFilter, open_capture
from driftwalk.track.types import Frame


class LiveCamera:
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
        self.name, self.counts = name, FrameCounts()
        self.interrupted: str | None = None
        self.waited_s = 0.0
        self._capture, self._patience, self._now = capture, patience, now
        self._changed = threading.Condition()
        self._newest: tuple[int, float, Any] | None = None
        self._taken = self._read = 0
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
                frame = keep.accept(index, time - first, image)
                if frame is not None:
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
                if not read:
                    self._gone = True
                    self._changed.notify()
                    return
                if self._newest is not None:
                    self.counts.dropped += 1
                self._newest = (self._read, time, image)
                self._read += 1
                self._changed.notify()

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
