"""One running program: a line is written to it, a line is read from it, within a time.

Everything happens in the thread that asks: it writes, reads the answer and empties standard error
as the program is ready for it. So neither side blocks the other, and no thread has to be ended.
"""

from __future__ import annotations

import os
import selectors
import signal
import subprocess
import time
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from threading import Event
from typing import Final

from driftwalk.core.bounded import MIB
from driftwalk.core.errors import ConfigurationError

CHUNK: Final = 1 << 16
TICK_S: Final = 0.1
"""How often a request looks whether it is still wanted."""
GRACE_S: Final = 1.0
"""Time that a program has to end by itself."""
KEPT_ERRORS: Final = 4096
"""Bytes of standard error that are kept, the last ones."""
SHOWN_LINES: Final = 5


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


class Program:
    """A running program, in a process group of its own.

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
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        assert self._process.stderr is not None
        self._pipes = (self._process.stdin, self._process.stdout, self._process.stderr)
        self._input, self._output, self._errors = (one.fileno() for one in self._pipes)
        self._selector = selectors.DefaultSelector()
        for pipe in (self._output, self._errors):
            os.set_blocking(pipe, False)
            self._selector.register(pipe, selectors.EVENT_READ)
        os.set_blocking(self._input, False)
        self._unread = b""
        self._last_errors = b""

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
        end = time.monotonic() + timeout
        unwritten = memoryview(request.line)
        answer = bytearray(self._unread)
        complete = b"\n" in answer
        self._selector.register(self._input, selectors.EVENT_WRITE)
        try:
            while unwritten or not complete:
                if stop.is_set():
                    raise ProgramFault(request.where, "it was stopped")
                if (left := end - time.monotonic()) <= 0.0:
                    raise ProgramFault(request.where, self._late(timeout, started=bool(answer)))
                if len(answer) > request.most:
                    most = f"{request.most / MIB:.3g} MiB"
                    raise ProgramFault(request.where, f"its answer is longer than {most}")
                ready = {key.fd for key, _ in self._selector.select(min(left, TICK_S))}
                if self._errors in ready:
                    self._read_errors()
                if self._input in ready:
                    unwritten = self._write(unwritten, request)
                if self._output in ready:
                    chunk = self._read(request)
                    complete = complete or b"\n" in chunk
                    answer += chunk
        finally:
            with suppress(KeyError):
                self._selector.unregister(self._input)
        line, _, self._unread = bytes(answer).partition(b"\n")
        return line

    def last_errors(self) -> str:
        """Return the last lines that it wrote to standard error, for the end of a message."""
        text = self._last_errors.decode("utf-8", "replace")
        lines = [line.strip() for line in text.splitlines() if line.strip()][-SHOWN_LINES:]
        if not lines:
            return ""
        shown = " | ".join(lines)
        return "; its last messages: " + "".join(c if c.isprintable() else " " for c in shown)

    def close_input(self) -> None:
        """Close its standard input: a program that reads to the end then ends by itself."""
        self._pipes[0].close()

    def close(self, *, patience: float = 0.0) -> None:
        """End it and all that it started, after `patience` [s] to do so by itself."""
        self._selector.close()
        self.close_input()
        if self.is_own:
            with suppress(subprocess.TimeoutExpired):
                if patience > 0.0:
                    self._process.wait(patience)
            self._kill()
            self._process.wait()
        for pipe in self._pipes:
            pipe.close()

    def _write(self, unwritten: memoryview, request: Request) -> memoryview:
        try:
            unwritten = unwritten[os.write(self._input, unwritten[:CHUNK]) :]
        except BlockingIOError:
            return unwritten
        except BrokenPipeError:
            raise self._ended(request) from None
        if not unwritten:
            self._selector.unregister(self._input)
        return unwritten

    def _read(self, request: Request) -> bytes:
        try:
            chunk = os.read(self._output, CHUNK)
        except BlockingIOError:
            return b""
        if not chunk:
            raise self._ended(request)
        return chunk

    def _read_errors(self) -> None:
        try:
            chunk = os.read(self._errors, CHUNK)
        except BlockingIOError:
            return
        if chunk:
            self._last_errors = (self._last_errors + chunk)[-KEPT_ERRORS:]
        else:
            self._selector.unregister(self._errors)

    def _late(self, timeout: float, *, started: bool) -> str:
        hint = "a line break ends an answer" if started else "an answer has to be flushed"
        return (
            f"it gave no answer within {timeout:g} s ({hint}; `timeout` gives it longer)"
            f"{self.last_errors()}"
        )

    def _ended(self, request: Request) -> ProgramEnded:
        """Return how it ended; one that only closed its output is ended here."""
        end = time.monotonic() + GRACE_S
        while self._process.poll() is None and time.monotonic() < end:
            # It may be writing its last words, and wait until somebody reads them.
            self._wait_for_errors(0.01)
        code = self._process.poll()
        self._kill()
        # More than a pipe holds; somebody else may go on writing to it.
        for _ in range(32):
            if not self._wait_for_errors(0.0):
                break
        return ProgramEnded(request.where, f"it {_exit_words(code)}{self.last_errors()}")

    def _wait_for_errors(self, seconds: float) -> bool:
        """Read standard error if something comes; return whether something did."""
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

    def _kill(self) -> None:
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
