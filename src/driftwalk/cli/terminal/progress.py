"""How far a long command is: a bar with the time left on a terminal, plain lines elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Self, TextIO

from driftwalk.core.progress import WHOLE

SECONDS_BETWEEN_LINES = 10.0
"""In a log file, where lines stay: six a minute, chosen by hand."""
SECONDS_TO_JUDGE = 1.0
"""The time left is judged from so much of the work at least; chosen by hand."""


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
    clock : callable
        Returns the time [s].

    Attributes
    ----------
    remark : callable
        Returns what is said behind the present task.

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
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._title = title
        self._stream = stream if stream is not None else sys.stderr
        self._seconds_between_lines = seconds_between_lines
        self._clock = clock
        self._last_line = clock()
        self._first: tuple[float, float] | None = None
        self._ends: float | None = None
        self.remark: Callable[[], str] = str
        self._bar: Any = None
        self._task: Any = None

    def __enter__(self) -> Self:
        if self._stream.isatty():
            self._start_bar()
        return self

    def __exit__(self, *_error: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    @property
    def left_s(self) -> float | None:
        """The time left [s], from the work done so far; None while too little is done to say.

        Work of an earlier run that was killed does not count: it took no time now.
        """
        return None if self._ends is None else max(self._ends - self._clock(), 0.0)

    @property
    def left(self) -> str:
        """The time left in words; empty where it is unknown, or nothing is left."""
        from driftwalk.schema.answers.parts import duration_text

        return f"{duration_text(self.left_s)} left" if self.left_s else ""

    def __call__(self, done: int, total: int, text: str = "") -> None:
        """Say that `done` of `total` parts are complete, and what is under way."""
        now = self._clock()
        self._judge(done / total if total > 0 else 0.0, now)
        text = ", ".join(part for part in (text, self.remark()) if part)
        count = _count(done, total)
        if self._bar is not None:
            title = f"{self._title} {text}".rstrip()
            self._bar.update(
                self._task, completed=done, total=total, description=title, count=count
            )
            return
        if now - self._last_line >= self._seconds_between_lines:
            self._last_line = now
            left = f", {self.left}" if self.left else ""
            remark = f": {text}" if text else ""
            print(f"{self._title}: {count}{left}{remark}", file=self._stream, flush=True)

    def _judge(self, share: float, now: float) -> None:
        """Judge when the work will end."""
        if self._first is None:
            self._first = share, now
        before, began = self._first
        if share > before and now - began >= SECONDS_TO_JUDGE:
            self._ends = now + (now - began) * (1.0 - share) / (share - before)

    def _start_bar(self) -> None:
        from rich import progress as bar
        from rich.console import Console
        from rich.text import Text

        reporter = self

        class Left(bar.ProgressColumn):
            """The time left, which runs down between two calls."""

            def render(self, _task: bar.Task) -> Text:
                return Text(reporter.left)

        self._bar = bar.Progress(
            bar.TextColumn("{task.description}"),
            bar.BarColumn(),
            bar.TextColumn("{task.fields[count]}"),
            Left(),
            console=Console(file=self._stream),
            transient=True,
            # What is printed meanwhile stands above the bar, but in a file if stdout is one.
            redirect_stdout=sys.stdout is not None and sys.stdout.isatty(),
        )
        self._task = self._bar.add_task(self._title, total=None, count="")
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
        yield {"progress": progress, "command": ["driftwalk", *sys.argv[1:]]}


def _count(done: int, total: int) -> str:
    """Return how much is done: a share where stages were added up, units otherwise."""
    if total <= 0:
        return f"{done} of {total}"
    share = f"{100 * done / total:.0f} %"
    return share if total == WHOLE else f"{done} of {total} ({share})"
