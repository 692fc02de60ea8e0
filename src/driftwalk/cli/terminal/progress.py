"""How far a long command is: a bar with the time left on a terminal, plain lines elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Any, Self, TextIO

SECONDS_BETWEEN_LINES = 10.0


class ProgressReporter:
    """Reports progress on stderr; the object itself is what a stage takes as ``progress``.

    Parameters
    ----------
    title : str
        The present task.
    stream : text file, optional
        Where to write; stderr when left out.
    seconds_between_lines : float
        Where the stream is no terminal, write a line no more often than this [s].

    Examples
    --------
    >>> with ProgressReporter("simulate", stream=sys.stdout, seconds_between_lines=0) as progress:
    ...     progress(5, 10)
    simulate: 5 of 10 (50 %)
    """

    def __init__(
        self,
        title: str,
        *,
        stream: TextIO | None = None,
        seconds_between_lines: float = SECONDS_BETWEEN_LINES,
    ) -> None:
        self._title = title
        self._stream = stream if stream is not None else sys.stderr
        self._seconds_between_lines = seconds_between_lines
        self._began = self._last_line = time.monotonic()
        self._bar: Any = None
        self._task: Any = None

    def __enter__(self) -> Self:
        if self._stream.isatty():
            self._start_bar()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if self._bar is not None:
            self._bar.stop()

    def __call__(self, done: int, total: int) -> None:
        """Say that `done` of `total` parts are complete."""
        self.update(done, total)

    def update(self, done: int, total: int, text: str = "") -> None:
        """Say that `done` of `total` parts are complete, and what is under way."""
        if self._bar is not None:
            title = f"{self._title} {text}".rstrip()
            self._bar.update(self._task, completed=done, total=total, description=title)
            return
        now = time.monotonic()
        if now - self._last_line >= self._seconds_between_lines:
            self._last_line = now
            print(self._line(done, total, text, now - self._began), file=self._stream, flush=True)

    def _line(self, done: int, total: int, text: str, elapsed_s: float) -> str:
        share = f" ({100 * done / total:.0f} %)" if total > 0 else ""
        left = ""
        if 0 < done < total and elapsed_s >= 1.0:
            left = f", {duration_text(elapsed_s * (total - done) / done)} left"
        remark = f": {text}" if text else ""
        return f"{self._title}: {done} of {total}{share}{left}{remark}"

    def _start_bar(self) -> None:
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            Progress,
            TextColumn,
            TimeRemainingColumn,
        )

        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
            console=Console(file=self._stream),
            transient=True,
        )
        self._task = self._bar.add_task(self._title, total=None)
        self._bar.start()


@contextmanager
def reported(title: str) -> Iterator[dict[str, Any]]:
    """Give a run of `driftwalk.runs` its progress bar and the command line for its manifest.

    Parameters
    ----------
    title : str
        What is being done.
    """
    with ProgressReporter(title) as progress:
        yield {"progress": progress.update, "command": ["driftwalk", *sys.argv[1:]]}


def duration_text(seconds: float) -> str:
    """Return a duration in words of at most two units.

    Examples
    --------
    >>> duration_text(3725)
    '1 h 2 min'
    """
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
