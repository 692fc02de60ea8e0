"""Files of a run directory, and the moves, removals and the lock that keep it whole."""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

from driftwalk.core.atomic import remove_partials, rename, write_atomic
from driftwalk.core.errors import DriftwalkError, RunDirectoryError
from driftwalk.core.provenance import MANIFEST_KIND, read_manifest, utc_now
from driftwalk.core.shards import make_folder, remove_shards

if TYPE_CHECKING:
    from filelock import BaseFileLock

State = Literal["new", "unfinished", "finished"]

MANIFEST_FILE: Final = "manifest.json"
RECORD_FILE: Final = ".run.json"
SHARD_FOLDER: Final = ".shards"
LOCK_FILE: Final = ".lock"
MOVING_FILE: Final = ".moving"
PREVIOUS_FOLDER: Final = "previous"


def state_of(path: str | Path) -> State:
    """Return what a folder holds: a "finished" run, an "unfinished" one, or none ("new").

    Examples
    --------
    >>> state_of("no/such/folder")
    'new'
    """
    path = Path(path)
    if _is_manifest(path / MANIFEST_FILE):
        return "finished"
    return "unfinished" if (path / RECORD_FILE).is_file() else "new"


def _is_manifest(path: Path) -> bool:
    try:
        return read_manifest(path).get("kind") == MANIFEST_KIND
    except DriftwalkError:
        return False


def refuse_foreign(path: Path) -> None:
    """Refuse a folder with files of someone else's, before anything is put into it."""
    if state_of(path) != "new" or (path / MOVING_FILE).exists():
        return
    foreign = visible(path)
    if foreign:
        raise RunDirectoryError(
            f"{path} holds files but no run of driftwalk ({foreign[0].name}, ...); choose an empty "
            "or a new directory"
        )


def entries(path: Path) -> list[Path]:
    """Return everything that lies in a folder, sorted."""
    try:
        return sorted(path.iterdir())
    except OSError as error:
        raise RunDirectoryError(f"cannot read {path}: {error.strerror}") from error


def visible(path: Path) -> list[Path]:
    """Return what lies in a folder apart from dot files and earlier runs."""
    return [p for p in entries(path) if p.name[0] != "." and p.name != PREVIOUS_FOLDER]


def visible_files(path: Path) -> Iterator[Path]:
    """Yield the files of a run, subfolders included, except its manifest."""
    for entry in visible(path):
        if entry.name == MANIFEST_FILE:
            continue
        if entry.is_dir():
            yield from sorted(file for file in entry.rglob("*") if file.is_file())
        else:
            yield entry


def remove_leftovers(path: Path) -> None:
    """Remove the temporary files that a killed run left among its results, subfolders included."""
    remove_partials(path)
    for folder in (entry for entry in visible(path) if entry.is_dir()):
        remove_partials(folder)


def lock_folder(path: Path) -> BaseFileLock:
    """Take the lock of a folder, which the system opens when the process ends in any way."""
    from filelock import FileLock, Timeout

    lock = FileLock(path / LOCK_FILE, thread_local=False)
    try:
        lock.acquire(blocking=False)
    except Timeout:
        raise RunDirectoryError(
            f"{path} is in use by another process; wait until it is done or choose another "
            "directory"
        ) from None
    except (OSError, NotImplementedError) as error:
        reason = getattr(error, "strerror", None) or error
        raise RunDirectoryError(
            f"cannot lock the directory {path} for writing: {reason}; choose another directory"
        ) from error
    return lock


def move_aside(path: Path) -> Path:
    """Move everything of a run into ``previous/<UTC time>/`` and return that folder."""
    time = utc_now().replace("-", "").replace(":", "")
    names = itertools.chain([time], (f"{time}-{number}" for number in itertools.count(2)))
    target = next(t for t in (path / PREVIOUS_FOLDER / name for name in names) if not t.exists())
    # A kill between two renames would leave half a run that nothing tells from foreign files.
    write_atomic(path / MOVING_FILE, target.name.encode())
    complete_move(path)
    return target


def complete_move(path: Path) -> None:
    """Do, or after a kill go on with, the move that ``.moving`` names."""
    journal = path / MOVING_FILE
    if not journal.exists():
        return
    target = path / PREVIOUS_FOLDER / journal.read_text(encoding="utf-8").strip()
    make_folder(target)
    hidden = [p for p in (path / SHARD_FOLDER, path / RECORD_FILE) if p.exists()]
    try:
        for entry in [*visible(path), *hidden]:
            rename(entry, target / entry.name)
        journal.unlink()
    except OSError as error:
        raise RunDirectoryError(
            f"cannot move the results in {path} to {target}: {error.strerror}"
        ) from error


def remove_traces(path: Path) -> None:
    """Remove what only an unfinished run needs."""
    shards = path / SHARD_FOLDER
    if shards.is_dir():
        for folder in entries(shards):
            remove_partials(folder)
            remove_shards(folder)
        with contextlib.suppress(OSError):
            shards.rmdir()
    (path / RECORD_FILE).unlink(missing_ok=True)
    remove_partials(path)
