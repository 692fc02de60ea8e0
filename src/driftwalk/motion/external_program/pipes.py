"""The three pipes of a running program, read and written without either side blocking the other.

`SelectedPipes` does it in the thread that asks, so that no thread has to be ended. Windows cannot
wait for a pipe in that way: `ThreadedPipes` has a thread for each pipe, and works everywhere.
"""

from __future__ import annotations

import os
import selectors
import subprocess
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from threading import Condition, Thread
from typing import IO, Final, NamedTuple, Protocol


class PipePolicy(NamedTuple):
    """How the pipes of a program are read, and how long it may take to end."""

    chunk: int = 1 << 16
    """Bytes that are read or written at once; chosen by hand."""
    kept_errors: int = 4096
    """Last bytes of standard error that are kept; chosen by hand."""
    most_chunks: int = 16
    """Chunks that a thread reads ahead; chosen by hand."""
    join_s: float = 1.0
    """Time for a thread to end after its program [s]; chosen by hand."""
    last_words_s: float = 0.1
    """Time to read what a program wrote last [s]; chosen by hand."""


PIPES: Final = PipePolicy()


class Pipes(Protocol):
    """The standard streams of a running program."""

    errors: bytes
    """The last bytes of its standard error."""

    @property
    def sending(self) -> bool:
        """Whether a part of a line is still to be written."""

    def send(self, line: bytes) -> None:
        """Begin to write a line."""

    def receive(self, seconds: float) -> bytes | None:
        """Go on writing, and return what comes: nothing is None, the end is empty.

        Raises
        ------
        BrokenPipeError
            When the program takes no more lines.
        """

    def hear_errors(self, seconds: float) -> bool:
        """Read standard error if something comes in time; return whether something did."""

    def close_input(self) -> None:
        """Close the program's input."""

    def close(self) -> None:
        """Give all pipes back; the program has ended, or belongs to another process."""


def _streams(process: subprocess.Popen[bytes]) -> tuple[IO[bytes], IO[bytes], IO[bytes]]:
    assert process.stdin is not None
    assert process.stdout is not None
    assert process.stderr is not None
    return process.stdin, process.stdout, process.stderr


class SelectedPipes:
    """Pipes that the system tells the state of."""

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        self.errors = b""
        self._streams = _streams(process)
        self._input, self._output, self._errors = (one.fileno() for one in self._streams)
        self._unwritten = memoryview(b"")
        self._selector = selectors.DefaultSelector()
        for pipe in (self._output, self._errors):
            os.set_blocking(pipe, False)
            self._selector.register(pipe, selectors.EVENT_READ)
        os.set_blocking(self._input, False)

    @property
    def sending(self) -> bool:
        """Whether a part of a line is still to be written."""
        return len(self._unwritten) > 0

    def send(self, line: bytes) -> None:
        """Begin to write a line."""
        self._unwritten = memoryview(line)
        self._selector.register(self._input, selectors.EVENT_WRITE)

    def receive(self, seconds: float) -> bytes | None:
        """Go on writing, and return what comes: nothing is None, the end is empty."""
        ready = {key.fd for key, _ in self._selector.select(seconds)}
        if self._errors in ready:
            self._read_errors()
        if self._input in ready:
            self._write()
        if self._output not in ready:
            return None
        with suppress(BlockingIOError):
            return os.read(self._output, PIPES.chunk)
        return None

    def hear_errors(self, seconds: float) -> bool:
        """Read standard error if something comes in time; return whether something did."""
        if self._errors not in self._selector.get_map():
            time.sleep(seconds)
            return False
        for pipe in (self._input, self._output):
            if pipe in self._selector.get_map():
                self._selector.unregister(pipe)
        if not self._selector.select(seconds):
            return False
        self._read_errors()
        return True

    def close_input(self) -> None:
        """Close the program's input."""
        with suppress(KeyError, ValueError):
            self._selector.unregister(self._input)
        self._streams[0].close()

    def close(self) -> None:
        """Give all pipes back."""
        self._selector.close()
        for pipe in self._streams:
            pipe.close()

    def _write(self) -> None:
        with suppress(BlockingIOError):
            self._unwritten = self._unwritten[
                os.write(self._input, self._unwritten[: PIPES.chunk]) :
            ]
        if not self.sending:
            self._selector.unregister(self._input)

    def _read_errors(self) -> None:
        with suppress(BlockingIOError):
            chunk = os.read(self._errors, PIPES.chunk)
            if chunk:
                self.errors = (self.errors + chunk)[-PIPES.kept_errors :]
            else:
                self._selector.unregister(self._errors)


class ThreadedPipes:
    """Pipes with a thread each, which ends when the program does."""

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        self.errors = b""
        self._streams = _streams(process)
        self._input, self._output, self._errors = (one.fileno() for one in self._streams)
        # Guards all that follows, and is told of every change.
        self._changed = Condition()
        self._line = b""
        self._chunks: deque[bytes] = deque()
        self._heard = 0
        self._errors_ended = False
        self._broken = False
        self._closed = False
        work: tuple[Callable[[], None], ...] = (self._write, self._read, self._read_errors)
        self._threads = [Thread(target=one, daemon=True) for one in work]
        for thread in self._threads:
            thread.start()

    @property
    def sending(self) -> bool:
        """Whether a part of a line is still to be written."""
        return bool(self._line)

    def send(self, line: bytes) -> None:
        """Begin to write a line."""
        with self._changed:
            self._line = line
            self._changed.notify_all()

    def receive(self, seconds: float) -> bytes | None:
        """Return what comes: nothing is None, the end is empty."""
        with self._changed:
            sent = not self._line
            self._changed.wait_for(
                lambda: self._chunks or self._broken or (not sent and not self._line), seconds
            )
            if self._chunks:
                chunk = self._chunks.popleft()
                self._changed.notify_all()
                return chunk
            if self._broken:
                raise BrokenPipeError
            return None

    def hear_errors(self, seconds: float) -> bool:
        """Wait until something comes to standard error; return whether something did."""
        with self._changed:
            before = self._heard
            if not self._errors_ended:
                self._changed.wait_for(
                    lambda: self._heard != before or self._errors_ended,
                    max(seconds, PIPES.last_words_s),
                )
                return self._heard != before
        time.sleep(seconds)
        return False

    def close_input(self) -> None:
        """Close the program's input."""
        # A thread in the middle of a line holds the pipe until the program has ended.
        if not self.sending:
            self._streams[0].close()

    def close(self) -> None:
        """Give all pipes back, when the threads have let go of them."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        for thread in self._threads:
            thread.join(PIPES.join_s)
        for pipe in self._streams:
            pipe.close()

    def _write(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._line or self._closed)
                if self._closed:
                    return
                unwritten = memoryview(self._line)
            broken = False
            try:
                while unwritten:
                    unwritten = unwritten[os.write(self._input, unwritten[: PIPES.chunk]) :]
            except OSError:
                broken = True
            with self._changed:
                self._line = b""
                self._broken = broken
                self._changed.notify_all()

    def _read(self) -> None:
        chunk = b"-"
        while chunk:
            chunk = _read_or_end(self._output)
            with self._changed:
                self._changed.wait_for(
                    lambda: len(self._chunks) < PIPES.most_chunks or self._closed
                )
                self._chunks.append(chunk)
                self._changed.notify_all()
                if self._closed:
                    return

    def _read_errors(self) -> None:
        while chunk := _read_or_end(self._errors):
            with self._changed:
                self.errors = (self.errors + chunk)[-PIPES.kept_errors :]
                self._heard += 1
                self._changed.notify_all()
        with self._changed:
            self._errors_ended = True
            self._changed.notify_all()


def _read_or_end(pipe: int) -> bytes:
    try:
        return os.read(pipe, PIPES.chunk)
    except OSError:
        return b""


def pipes_of(process: subprocess.Popen[bytes]) -> Pipes:
    """Return the pipes of a program in the form for this system."""
    return ThreadedPipes(process) if os.name == "nt" else SelectedPipes(process)
