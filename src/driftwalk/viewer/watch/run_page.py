"""The page of a run directory: what a finished run found, or what one under way has so far."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Container, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from driftwalk.core.errors import DriftwalkError, InputError, RunDirectoryError
from driftwalk.core.files.run_layout import MANIFEST_FILE, RECORD_FILE, state_of
from driftwalk.core.files.shards import read_specification
from driftwalk.core.progress import ignore_progress
from driftwalk.core.provenance import read_manifest, refuse_other_version
from driftwalk.core.text_files import path_inside, text_of_name
from driftwalk.page.html import page_frame
from driftwalk.page.parts import Section, empty_section
from driftwalk.schema.runs import RUN_KINDS, load_maker
from driftwalk.schema.runs.contents import holds_run
from driftwalk.viewer.hub import Content, Publish, Source
from driftwalk.viewer.watch.shards import FinishedUnit, RunReader, quiet_time

SPANS: Final = ((86400.0, "days"), (3600.0, "h"), (60.0, "min"))
"""Units in which that is said, each from two of it on; the last from one."""


NO_CELL: Final[dict[str, Any]] = dict.fromkeys(
    (
        *("excerpt_time", "excerpt_x", "excerpt_y", "density"),
        *("ks_step_length", "ks_turning_angle", "over_time"),
    )
)
"""Answer for a setting that has not been simulated."""


class Running:
    """A run that is under way; of a kind without a view of its own the finished work is counted.

    Parameters
    ----------
    folder : Path
        The run directory.
    specification : mapping
        Everything that determines its numbers.
    """

    _sweeps: Container[str] | None = None
    """Names of the sweeps that are read, None for all."""

    def __init__(self, folder: Path, specification: Mapping[str, Any]) -> None:
        self._reader = RunReader(folder)
        self._done = 0
        kind = RUN_KINDS.get(str(specification.get("kind")))
        self.title = "A run under way" if kind is None else kind.under_way

    def look(self) -> list[Section]:
        """Read what is new, and return the sections that it may have changed."""
        new = False
        for name, unit in self._reader.new_units(self._sweeps):
            self._take(name, unit)
            new = True
        return self.sections() if new else []

    def _take(self, name: str, unit: FinishedUnit) -> None:  # noqa: ARG002
        """Take a finished unit of a sweep."""
        self._done += 1

    def sections(self) -> list[Section]:
        """Return all sections as they are now."""
        reason = "This kind of run shows its results when it is finished. The page waits for it."
        return [empty_section("waiting", self.title, reason)]

    def state(self) -> tuple[float | None, str]:
        """Return how far the run is, 0 to 1 or None, and what is under way in words."""
        units = f": {self._done} work units are finished" if self._done else ""
        return None, f"under way{units}"

    def cell(self, row: int, column: int) -> dict[str, Any]:  # noqa: ARG002
        """Return what is kept of a setting of the map."""
        return dict(NO_CELL)


class RunSource(Source):
    """Shows a run directory: a finished run, or one under way until and after it finishes.

    Parameters
    ----------
    folder : path-like
        The run directory.
    tell : callable
        Called with each sentence on files of a finished run that are missing or damaged.

    Raises
    ------
    InputError
        When there is no such directory, it holds no run, or one of another version of driftwalk.

    Examples
    --------
    >>> RunSource("no/such/run")
    Traceback (most recent call last):
    driftwalk.core.errors.InputError: no/such/run: there is no such directory
    """

    view = "run"

    def __init__(
        self, folder: str | Path, *, tell: Callable[[str], None] = ignore_progress
    ) -> None:
        self._folder = Path(folder)
        self._tell = tell
        require_run(self._folder)
        self.title = text_of_name(self._folder.resolve().name)
        self._page = page_frame(self.view, self.title)
        self._running: Running | None = None
        self._shown: tuple[Any, ...] = ()
        self._refused: tuple[Any, ...] = ()
        self.look()

    def greeting(self) -> Sequence[Content]:
        """Return the page as it is now."""
        return [{"type": "page", "page": self._page}]

    async def run(self, publish: Publish) -> None:
        """Look at the run directory now and then, and publish what has changed."""
        while True:
            await asyncio.sleep(0.25)
            for content in await asyncio.to_thread(self.look):
                publish(content)

    async def receive(self, content: Content, reply: Publish) -> None:
        """Answer what is asked of a setting of the map."""
        if content.get("type") != "cell":
            return
        row, column = content.get("row"), content.get("column")
        found = NO_CELL
        if self._running is not None and isinstance(row, int) and isinstance(column, int):
            found = self._running.cell(row, column)
        # Only what can be a setting goes back: whatever else a browser sends may not be writable.
        named = {"id": str, "row": int, "column": int}
        asked = {
            key: value if isinstance(value := content.get(key), kind) else None
            for key, kind in named.items()
        }
        reply({"type": "cell", **asked, **found})

    def file(self, name: str) -> Path | None:
        """Return a file of the run."""
        return file_in(self._folder, name)

    def report(self) -> str | None:
        """Return the page of a finished run as a file that works alone."""
        from driftwalk.page import report_html

        if self._running is not None:
            return None
        return report_html({**self._page, "view": "report"})

    def look(self) -> list[Content]:
        """Look once; return what is to be published."""
        try:
            state, stamp = state_of(self._folder), _stamp(self._folder)
            if state == "finished":
                # Datasets may be replaced under the same manifest.
                results = sorted(path.name for path in self._folder.glob("*.nc"))
                stamp = _stamp(self._folder, (MANIFEST_FILE, *results))
                return [] if stamp in (self._shown, self._refused) else self._show_finished(stamp)
            if state == "unfinished":
                return self._look_at_running(stamp)
        except (DriftwalkError, OSError) as error:
            # What was there when the page was opened has become unreadable; it may come back.
            return self._say(f"the run cannot be read: {error}")
        return self._say("the run is no longer there; the page waits for it")

    def _show_finished(self, stamp: tuple[Any, ...]) -> list[Content]:
        from driftwalk.page import report_page

        # Should it fail, then not again before something has changed.
        self._refused = stamp
        self._page = {**report_page(self._folder, tell=self._tell), "view": self.view}
        self._running, self._shown, self._refused = None, stamp, ()
        return [{"type": "page", "page": self._page}]

    def _look_at_running(self, stamp: tuple[Any, ...]) -> list[Content]:
        running = self._running
        if running is None or stamp != self._shown:
            self._running = running = running_view(self._folder)
            self._shown = stamp
            running.look()
            self._page = self._page_of(running)
            return [{"type": "page", "page": self._page}]
        changed = running.look()
        page = self._page_of(running)
        before, self._page = self._page, page
        if _ids(page) != _ids(before):
            return [{"type": "page", "page": page}]
        same = page["state"] == before["state"]
        sections: list[Content] = [
            {"type": "section", "section": one} for one in changed if one not in before["sections"]
        ]
        return sections + ([] if same else [{"type": "state", "state": page["state"]}])

    def _page_of(self, running: Running) -> dict[str, Any]:
        progress, words = running.state()
        words += quiet_words(quiet_time(self._folder))
        return page_frame(
            self.view,
            running.title,
            subtitle=self.title,
            state={"finished": False, "progress": progress, "words": words},
            sections=running.sections(),
        )

    def _say(self, words: str) -> list[Content]:
        state = {"finished": False, "progress": None, "words": words}
        if self._page["state"] == state:
            return []
        self._page = {**self._page, "state": state}
        self._shown = ()
        return [{"type": "state", "state": state}]


def quiet_words(duration_s: float) -> str:
    """Return what there is to say about a run that has given nothing new for some time.

    Examples
    --------
    >>> quiet_words(200.0)
    '; the last result came 3 min ago (if it was stopped, the same command continues it)'
    """
    if duration_s < 60.0:
        return ""
    length, unit = next((s for s in SPANS if duration_s >= 2.0 * s[0]), SPANS[-1])
    ago = f"{duration_s // length:.0f} {unit}"
    return f"; the last result came {ago} ago (if it was stopped, the same command continues it)"


def running_view(folder: Path) -> Running:
    """Return the view of a run under way, as its kind declares it.

    Raises
    ------
    InputError
        When that is of another version, or no specification that driftwalk writes.
    """
    specification = unfinished_specification(folder)
    kind = RUN_KINDS.get(str(specification.get("kind")))
    view = Running if kind is None or kind.live is None else load_maker(kind.live)
    try:
        running: Running = view(folder, specification)
        return running
    except (AttributeError, LookupError, TypeError, ValueError) as error:
        raise InputError(
            f"{folder / RECORD_FILE} does not describe the run: it has been changed "
            "or damaged; run the same command again, or move the directory away"
        ) from error


def require_run(folder: Path) -> None:
    """Refuse a folder that holds no run, or a run of another version.

    Raises
    ------
    InputError
        Says what is there instead.
    """
    if not folder.is_dir():
        if folder.exists():
            raise InputError(
                f"{folder}: is a file, expected a run directory; the page of a recording is "
                f"written by 'driftwalk report {folder.name}'"
            )
        raise InputError(f"{folder}: there is no such directory")
    state = state_of(folder)
    if state == "finished":
        refuse_other_version(folder, read_manifest(folder / MANIFEST_FILE))
    elif state == "unfinished":
        unfinished_specification(folder)
    else:
        inside = [path.name for path in sorted(folder.iterdir()) if holds_run(path)]
        hint = f"; there are runs in it: {', '.join(inside[:3])}" if inside else ""
        raise InputError(f"{folder}: this directory holds no run of driftwalk{hint}")


def unfinished_specification(folder: Path) -> dict[str, Any]:
    """Return what determines the numbers of a run that is under way.

    Raises
    ------
    InputError
        When another version of driftwalk works on it, or it is damaged.
    """
    from driftwalk import __version__

    try:
        found: dict[str, Any] = read_specification(folder / RECORD_FILE)["specification"]
    except RunDirectoryError as error:
        raise InputError(str(error)) from error
    version = found.get("driftwalk_version")
    if version != __version__:
        raise InputError(
            f"{folder}: this unfinished run was made by driftwalk {version}, this is "
            f"{__version__}; "
            "look at it with that version, or when it is finished"
        )
    return found


def file_in(folder: Path, name: str) -> Path | None:
    """Return a visible file inside a folder, None when the name leads elsewhere or nowhere.

    Parameters
    ----------
    folder : Path
        The folder.
    name : str
        Path in it, parts joined by "/"; from a browser, so it may be anything.

    Examples
    --------
    >>> file_in(Path("."), "../secret") is None
    True
    """
    parts = name.split("/")
    if any(part in ("", "..") or part[0] == "." or "\\" in part for part in parts):
        return None
    path = path_inside(folder, name)
    if path is None or not path.is_file():
        return None
    hidden = any(part[0] == "." for part in path.relative_to(folder.resolve()).parts)
    return None if hidden else path


def _ids(page: Mapping[str, Any]) -> list[str]:
    return [section["id"] for section in page["sections"]]


def _stamp(folder: Path, names: Sequence[str] = (MANIFEST_FILE, RECORD_FILE)) -> tuple[Any, ...]:
    """Return what changes when files of a folder do: those that say which run it is, or others."""
    stamps = []
    for name in names:
        try:
            stat = (folder / name).stat()
            stamps.append((name, stat.st_mtime_ns, stat.st_ino, stat.st_size))
        except OSError:
            stamps.append((name, 0, 0, 0))
    return tuple(stamps)
