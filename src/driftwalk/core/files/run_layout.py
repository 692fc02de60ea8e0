"""Files of a run directory, and the moves, removals and the lock that keep it whole.

A run directory may come from someone else. So a path or a link that is found in one is data: it is
followed inside the directory, and nothing is read or written through it anywhere else.
"""

from __future__ import annotations

import contextlib
import itertools
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

from driftwalk.core.errors import DriftwalkError, FormatError, InputError, RunDirectoryError
from driftwalk.core.files.atomic import remove_partials, rename, write_atomic
from driftwalk.core.files.shards import make_folder, remove_shards
from driftwalk.core.provenance import MANIFEST_KIND, file_sha256, read_manifest, utc_now
from driftwalk.core.text_files import path_inside, read_bounded

if TYPE_CHECKING:
    from filelock import BaseFileLock

State = Literal["new", "unfinished", "finished"]

MANIFEST_FILE: Final = "manifest.json"
RECORD_FILE: Final = ".run.json"
SHARD_FOLDER: Final = ".shards"
LOCK_FILE: Final = ".lock"
MOVING_FILE: Final = ".moving"
PREVIOUS_FOLDER: Final = "previous"
# The names that `move_aside` gives: 20110925T120000Z, 20110925T120000Z-2.
_MOVED: Final = re.compile(r"\d{8}T\d{6}Z(-\d{1,6})?", re.ASCII)
_JOURNAL_BYTES: Final = 64
"""Bytes of the journal that are read: more than twice what a name of `_MOVED` has."""
_MOST_FAULTS: Final = 8
"""Faults that a message names before it counts the others."""


def state_of(path: str | Path) -> State:
    """Return what a folder holds: a "finished" run, an "unfinished" one, or none ("new").

    Raises
    ------
    InputError
        When the manifest is damaged, or leads out of the folder.

    Examples
    --------
    >>> state_of("no/such/folder")
    'new'
    """
    path = Path(path)
    try:
        manifest = run_file(path, MANIFEST_FILE)
        if manifest is not None and read_manifest(manifest).get("kind") == MANIFEST_KIND:
            return "finished"
    except DriftwalkError as error:
        raise InputError(f"the manifest of the run is damaged: {error}") from error
    return "new" if run_file(path, RECORD_FILE) is None else "unfinished"


def run_file(folder: Path, name: str) -> Path | None:
    """Return a file of a run to read, None when there is none of this name.

    Every reader of run directories takes its files from here.

    Parameters
    ----------
    folder : Path
        The run directory.
    name : str
        Path in it, parts joined by "/".

    Raises
    ------
    FormatError
        When what has the name leads out of the directory, or is no regular file: a pipe that is
        opened waits for a writer.

    Examples
    --------
    >>> run_file(Path("run"), "fit.nc") is None
    True
    """
    path = folder / name
    if not _is_there(path):
        return None
    found = path_inside(folder, name)
    if found is None:
        raise FormatError("leads out of the run directory, or nowhere", path=path)
    if not found.is_file():
        raise FormatError("is no regular file", path=path)
    return path


def run_files(folder: Path, pattern: str) -> list[Path]:
    """Return the files of a run whose names match a pattern, sorted; each as of `run_file`."""
    found = (run_file(folder, path.name) for path in sorted(folder.glob(pattern)))
    return [path for path in found if path is not None]


def faults_of(folder: Path, read: Iterable[str] = (), *, unread: bool = False) -> list[str]:
    """Return what is wrong with the files of a finished run by its manifest, a sentence each.

    Parameters
    ----------
    folder : Path
        The run directory; of one that is not finished nothing is known.
    read : iterable of str
        Names of the files that are read.
    unread : bool
        Whether the others that the manifest lists are looked at too.

    Examples
    --------
    >>> faults_of(Path("run"), ["fit.nc"])
    []
    """
    if state_of(folder) != "finished":
        return []
    files = read_manifest(folder / MANIFEST_FILE).get("files")
    if not isinstance(files, list):
        return []
    listed = {str(one.get("path")): one for one in files if isinstance(one, Mapping)}
    names = dict.fromkeys([*read, *(listed if unread else ())])
    faults = [one for name in names if (one := _fault(folder, name, listed.get(name))) is not None]
    more = len(faults) - _MOST_FAULTS
    if more < 2:
        return faults
    return [*faults[:_MOST_FAULTS], f"{more} more files are missing or changed"]


def _fault(folder: Path, name: str, listed: Mapping[str, Any] | None) -> str | None:
    shown = name if name.isprintable() else ascii(name)
    try:
        path = run_file(folder, name)
        if path is None:
            return None if listed is None else f"{shown} is missing"
        if listed is None:
            return f"{shown} is not in the manifest: it was put there after the run"
        # The size first: what has another one need not be read.
        same = path.stat().st_size == listed.get("size_bytes")
        if same and file_sha256(path) == listed.get("sha256"):
            return None
    except FormatError as error:
        return f"{shown} {error.reason}"
    except (InputError, OSError) as error:
        return f"{shown} cannot be read: {getattr(error, 'strerror', None) or error}"
    return f"{shown} was changed after the run wrote it: its hash differs from the manifest's"


def _is_there(path: Path) -> bool:
    """Return whether anything has the name, a link that leads nowhere among them."""
    return path.is_symlink() or path.exists()


def refuse_foreign(path: Path) -> None:
    """Refuse a folder with files of someone else's, before anything is put into it."""
    if state_of(path) != "new" or (path / MOVING_FILE).exists():
        return
    if foreign := visible(path):
        raise RunDirectoryError(
            f"{path} holds files but no run of driftwalk ({foreign[0].name}, ...); choose an empty "
            "or a new directory"
        )


def refuse_leading_out(path: Path) -> None:
    """Refuse to write into a folder where a link leads out, or a pipe or a device lies.

    The runs in ``previous`` are left out, as nothing is written into them.
    """
    folders = [path]
    while folders:
        for entry in _entries_if_there(folders.pop()):
            name = entry.relative_to(path).as_posix()
            linked, is_folder = entry.is_symlink(), entry.is_dir()
            # A folder of Windows may be a junction, which is no symbolic link.
            if (linked or is_folder) and path_inside(path, name) is None:
                raise RunDirectoryError(_leads_out(entry))
            if is_folder and not linked and name != PREVIOUS_FOLDER:
                folders.append(entry)
            elif entry.exists() and not (is_folder or entry.is_file()):
                raise RunDirectoryError(f"{entry} is no regular file; remove it")


def _entries_if_there(folder: Path) -> list[Path]:
    """Return what lies in a folder, which the process that works there may just have removed."""
    try:
        return entries(folder)
    except RunDirectoryError:
        if folder.exists():
            raise
        return []


def _leads_out(entry: Path) -> str:
    return (
        f"{entry} is a link that leads out of the run directory, or nowhere; remove it, or put in "
        "its place what it leads to"
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
        if entry.is_dir():
            yield from sorted(file for file in entry.rglob("*") if file.is_file())
        elif entry.name != MANIFEST_FILE:
            yield entry


def remove_leftovers(path: Path) -> None:
    """Remove the temporary files that a killed run left among its results, subfolders included."""
    for folder in (path, *(entry for entry in visible(path) if entry.is_dir())):
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
    target = path / PREVIOUS_FOLDER / _moved_name(journal)
    make_folder(target)
    if path_inside(path, f"{PREVIOUS_FOLDER}/{target.name}") is None:
        raise RunDirectoryError(_leads_out(target))
    hidden = [p for p in (path / SHARD_FOLDER, path / RECORD_FILE) if p.exists()]
    try:
        for entry in [*visible(path), *hidden]:
            place = target / entry.name
            # What a kill left behind is not there yet: a file of the same name is another one.
            if _is_there(place):
                raise RunDirectoryError(
                    f"cannot move {entry} to {place}, which exists; move one of them away"
                )
            rename(entry, place)
        journal.unlink()
    except RunDirectoryError:
        raise
    except OSError as error:
        raise RunDirectoryError(
            f"cannot move the results in {path} to {target}: {error.strerror}"
        ) from error


def _moved_name(journal: Path) -> str:
    """Return the name that `move_aside` wrote; anything else may lead anywhere."""
    try:
        name = read_bounded(journal, most=_JOURNAL_BYTES).decode("ascii").strip()
    except (InputError, OSError, UnicodeDecodeError):
        name = ""
    if _MOVED.fullmatch(name) is None:
        raise RunDirectoryError(
            f"{journal} does not say where earlier results are being moved to, such as "
            "20110925T120000Z: remove it, or choose another directory"
        )
    return name


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
