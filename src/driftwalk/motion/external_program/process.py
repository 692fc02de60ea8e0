"""One running program: a line is written to it, a line is read from it, within a time.

Each of its three pipes has a thread, so that neither side blocks the other: Windows cannot wait
for several pipes at once.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from threading import Condition, Event, Thread
from typing import Final, NamedTuple

from driftwalk.core.errors import ConfigurationError
from driftwalk.core.text_files import MIB

GRACE_S: Final = 1.0
"""Time that a program has to end by itself; chosen by hand."""
# The same on Windows, where there are no sessions.
_OWN_GROUP: Final[int] = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)


@dataclass(frozen=True)
class Request:
    """A line for a program."""

    line: bytes
    where: str
    """The end of a message about it: "at speed=0.1"."""
    most: int
    """Bytes that the answer may have."""


class ProgramFault(Exception):
    """A program did not do what was asked of it."""

    def __init__(self, where: str, reason: str) -> None:
        super().__init__(where, reason)
        self.where = where
        self.reason = reason


class ProgramEnded(ProgramFault):
    """It ended before it had answered."""


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


PIPES: Final = PipePolicy()


class Pipes:
    """The standard streams of a running program; a thread for each ends when the program does."""

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        self.errors = b""
        """The last bytes of its standard error."""
        pipes = (process.stdin, process.stdout, process.stderr)
        self._streams = [one for one in pipes if one is not None]
        self._input, self._output, self._errors = (one.fileno() for one in self._streams)
        # Guards all that follows, and is told of every change.
        self._changed = Condition()
        self._line = b""
        self._chunks: deque[bytes] = deque()
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
        """Return what comes: nothing is None, the end is empty.

        Raises
        ------
        BrokenPipeError
            When the program takes no more lines.
        """
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

    def await_errors(self) -> None:
        """Wait until standard error has ended, but not where another process keeps it open."""
        self._threads[-1].join(PIPES.join_s)

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
        for thread, pipe in zip(self._threads, self._streams, strict=True):
            thread.join(PIPES.join_s)
            # While a thread reads, the number of its pipe must not become that of another file.
            if not thread.is_alive():
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
            self.errors = (self.errors + chunk)[-PIPES.kept_errors :]


def _read_or_end(pipe: int) -> bytes:
    try:
        return os.read(pipe, PIPES.chunk)
    except OSError:
        return b""


class Program:
    """A running program, in its own process group.

    Parameters
    ----------
    words : sequence of str
        The command.
    folder : str
        The folder that it runs in.

    Raises
    ------
    ConfigurationError
        When it cannot be started.
    """

    def __init__(self, words: Sequence[str], folder: str) -> None:
        self.greeting = b""
        """Its answer to the first request."""
        self.repeats = False
        """Whether it was seen to make the same world again."""
        self._owner = os.getpid()
        self._process = _start(words, folder)
        self._pipes = Pipes(self._process)
        self._unread = b""
        self._output_ended = False

    @property
    def is_own(self) -> bool:
        """Whether this process started it, and not one of which this process is a copy."""
        return os.getpid() == self._owner

    def ask(self, request: Request, *, timeout: float, stop: Event) -> bytes:
        """Return the line that the program answers with.

        Raises
        ------
        ProgramEnded
            When it ends before.
        ProgramFault
            When it takes longer than `timeout` [s], writes more than it may, or `stop` is set. It
            is of no use after that.
        """
        if self._output_ended:
            raise self._ended(request)
        end = time.monotonic() + timeout
        answer = bytearray(self._unread)
        complete = b"\n" in answer
        self._pipes.send(request.line)
        while self._pipes.sending or not complete:
            if stop.is_set():
                raise ProgramFault(request.where, "it was stopped")
            if (left := end - time.monotonic()) <= 0.0:
                raise ProgramFault(request.where, self._late(timeout, started=bool(answer)))
            if len(answer) > request.most:
                most = f"{request.most / MIB:.3g} MiB"
                raise ProgramFault(request.where, f"its answer is longer than {most}")
            try:
                chunk = self._pipes.receive(min(left, 0.1))
            except BrokenPipeError:
                raise self._ended(request) from None
            if chunk == b"":
                self._output_ended = True
                # A thread may not have noticed yet that the request was read to its end.
                if complete:
                    break
                raise self._ended(request)
            if chunk is not None:
                complete = complete or b"\n" in chunk
                answer += chunk
        line, _, self._unread = bytes(answer).partition(b"\n")
        return line

    def last_errors(self) -> str:
        """Return the last lines that it wrote to standard error, for the end of a message."""
        text = self._pipes.errors.decode("utf-8", "replace")
        lines = [line.strip() for line in text.splitlines() if line.strip()][-5:]
        if not lines:
            return ""
        shown = " | ".join(lines)
        return "; its last messages: " + "".join(c if c.isprintable() else " " for c in shown)

    def close_input(self) -> None:
        """Close its standard input: a program that reads to the end then ends by itself."""
        self._pipes.close_input()

    def close(self, *, patience: float = 0.0) -> None:
        """End it and all that it started, after `patience` [s] to do so by itself."""
        self.close_input()
        if self.is_own:
            with suppress(subprocess.TimeoutExpired):
                if patience > 0.0:
                    self._process.wait(patience)
            self._kill()
            self._process.wait()
        self._pipes.close()

    def _late(self, timeout: float, *, started: bool) -> str:
        hint = "a line break ends an answer" if started else "an answer has to be flushed"
        return (
            f"it gave no answer within {timeout:g} s ({hint}; `timeout` gives it longer)"
            f"{self.last_errors()}"
        )

    def _ended(self, request: Request) -> ProgramEnded:
        """Return how it ended; one that only closed its output is ended here."""
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(GRACE_S)
        code = self._process.poll()
        self._kill()
        self._pipes.await_errors()
        return ProgramEnded(request.where, f"it {_exit_words(code)}{self.last_errors()}")

    def _kill(self) -> None:
        if sys.platform == "win32":
            # With all that it started: Windows has no groups of processes to end.
            words = ["taskkill", "/F", "/T", "/PID", str(self._process.pid)]
            subprocess.run(words, capture_output=True, check=False)
            self._process.kill()
        else:
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self._process.pid, signal.SIGKILL)


def close_programs(programs: Iterable[Program]) -> None:
    """End programs that wait for a request, all in the time of one."""
    ending = list(programs)
    for program in ending:
        program.close_input()
    end = time.monotonic() + GRACE_S
    for program in ending:
        program.close(patience=max(end - time.monotonic(), 0.0))


def _start(words: Sequence[str], folder: str) -> subprocess.Popen[bytes]:
    try:
        return subprocess.Popen(
            words,
            cwd=folder,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            bufsize=0,
            # Ctrl-C is for this process, which then ends the program and what that has started.
            start_new_session=True,
            creationflags=_OWN_GROUP,
        )
    except OSError as error:
        hint = (
            "; a script needs its interpreter ('command:python3 simulator.py'), or a first line "
            "that names it and the right to be run"
        )
        raise ConfigurationError(
            f"cannot start the program {words[0]}: {error.strerror or error}"
            f"{'' if isinstance(error, FileNotFoundError) else hint}"
        ) from error
    except ValueError as error:
        raise ConfigurationError(f"cannot start the program {words[0]!r}: {error}") from error


def _exit_words(code: int | None) -> str:
    if code is None:
        return "closed its standard output"
    if code >= 0:
        return f"ended with exit code {code}"
    names = {one.value: one.name for one in signal.Signals}
    return f"was ended by {names.get(-code, f'signal {-code}')}"
