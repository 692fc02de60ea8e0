"""Files that exist whole or not at all: written next to their place, then renamed into it."""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from driftwalk.core.errors import InputError, RunDirectoryError

# In the name of every temporary file, which distinguishes the leftovers of a killed process from a
# file of the user's.
PARTIAL: Final = ".driftwalk-partial-"

_FREE_SPACE: Final = "free some space"
_REASONS: Final[dict[int, tuple[str, str]]] = {
    errno.ENOSPC: ("the disk is full", _FREE_SPACE),
    errno.EDQUOT: ("the disk quota is used up", _FREE_SPACE),
    errno.EFBIG: ("files of this size are not allowed here", "raise the limit on file sizes"),
    errno.EIO: ("the disk reports an input/output error", "check the disk"),
    errno.EROFS: ("the file system is read-only", "choose another directory"),
    errno.EACCES: ("permission denied", "change the permissions or choose another directory"),
    errno.EPERM: ("operation not permitted", "choose another directory"),
    errno.ENOENT: ("its folder does not exist", "make the folder or choose another directory"),
    errno.ENOTDIR: ("a part of its path is a file", "choose another directory"),
    errno.EISDIR: ("it is a directory", "choose another name"),
    errno.ENAMETOOLONG: ("its name is too long", "choose a shorter name"),
}
# Windows refuses to rename over a file, or to move one, that another program has open: a live page
# reads for milliseconds, a scanner of files for a second, a spreadsheet until it is closed.
OPEN_FILES_STAY: Final = os.name == "nt"
PAUSES_S: Final = (0.01, 0.03, 0.1, 0.3, 1.0, 2.0)
"""Waits between attempts [s], 3.4 s together: longer than a scanner holds a file. Chosen by
hand."""
# Errors of the storage, whatever file they came from; the others count only for a file of ours.
_STORAGE: Final = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO})


@contextlib.contextmanager
def atomic_path(path: str | Path) -> Iterator[Path]:
    """Give a temporary path to write to; it becomes `path` when the block ends without error.

    The temporary file lies in the same folder and has the same suffix. It is flushed to the disk
    before it is renamed, so that after a crash `path` holds the old content or the new, never a
    part. On an error, Ctrl-C among them, `path` is untouched and the temporary file is removed.

    Parameters
    ----------
    path : path-like
        A regular file, or one to be made. Its folder must exist.

    Yields
    ------
    pathlib.Path
        Where to write; the file must exist when the block ends.

    Raises
    ------
    RunDirectoryError
        When the disk is full, the place is not writable, or `path` is no regular file.

    Notes
    -----
    HDF5 may crash the process when the disk fills under it: build a NetCDF file in memory
    (``dataset.to_netcdf()`` without a path returns its bytes) and use `write_atomic`.

    Examples
    --------
    >>> with atomic_path("flow.txt") as temporary:  # doctest: +SKIP
    ...     temporary.write_text("0.1 0.2")
    """
    target = Path(path)
    token = f"{os.getpid()}-{secrets.token_hex(4)}"
    temporary = target.with_name(f".{target.stem}{PARTIAL}{token}{target.suffix}")
    try:
        # Renaming over a device such as /dev/null would replace it.
        if target.exists() and not target.is_file():
            raise RunDirectoryError(f"cannot write {target}: it exists and is not a regular file")
        yield temporary
        # A full disk may show only here.
        with temporary.open("r+b") as file:
            os.fsync(file.fileno())
        rename(temporary, target)
        _flush_folder(target.parent)
    except BaseException as error:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        refusal = storage_error(error, target)
        if refusal is None:
            raise
        raise refusal from error


def write_atomic(path: str | Path, data: bytes | memoryview) -> None:
    """Write a whole file at once: afterwards it holds `data`, or what it held before.

    Parameters
    ----------
    path : path-like
        A regular file, or one to be made. Its folder must exist.
    data : bytes or memoryview
        The content.

    Raises
    ------
    RunDirectoryError
        When the disk is full, the place is not writable, or `path` is no regular file.

    Examples
    --------
    >>> write_atomic("seed.txt", b"1")  # doctest: +SKIP
    """
    with atomic_path(path) as temporary, temporary.open("xb") as file:
        file.write(data)


def remove_partials(folder: str | Path) -> None:
    """Remove the temporary files that killed processes left in a folder (not in its subfolders).

    Only for a folder that no other process writes to: theirs would be removed as well.
    """
    for leftover in Path(folder).glob(f".*{PARTIAL}*"):
        with contextlib.suppress(OSError):
            leftover.unlink()


def storage_error(error: BaseException, path: str | Path) -> RunDirectoryError | None:
    """Return the sentence for an error of the storage that holds `path`; None for other errors."""
    if isinstance(error, RunDirectoryError):
        return None
    number = _errno_of(error)
    if number not in _REASONS or not (number in _STORAGE or _is_about(error, Path(path))):
        return None
    reason, remedy = _REASONS[number]
    if number not in _STORAGE:
        return RunDirectoryError(f"cannot write {path}: {reason}; {remedy}")
    return RunDirectoryError(
        f"cannot write {path}: {reason}; what was finished before is kept: {remedy}, "
        "then run the same command again to continue"
    )


def rename(path: Path, target: Path) -> None:
    """Rename a file or folder over `target`; where an open file stands in the way, wait for it.

    Raises
    ------
    RunDirectoryError
        When another program keeps it open.
    """
    for pause in PAUSES_S if OPEN_FILES_STAY else ():
        with contextlib.suppress(PermissionError):
            path.replace(target)
            return
        time.sleep(pause)
    try:
        path.replace(target)
    except PermissionError as error:
        if not OPEN_FILES_STAY:
            raise
        raise RunDirectoryError(
            f"cannot write {target}: another program has it open, or it may not be changed; close "
            "that program, then run the same command again"
        ) from error


def _errno_of(error: BaseException) -> int | None:
    if isinstance(error, OSError) and error.errno is not None:
        return error.errno
    # HDF5 reports a full disk as a RuntimeError or OSError with the reason in the text alone.
    if isinstance(error, (OSError, RuntimeError)):
        text = str(error)
        return next((number for number in _STORAGE if f"errno = {number}," in text), None)
    return None


def _is_about(error: BaseException, path: Path) -> bool:
    named = getattr(error, "filename", None)
    return named is None or Path(os.fsdecode(named)).parent in (path.parent, path)


def _flush_folder(folder: Path) -> None:
    """Put a rename on the disk, where the system can do that to a folder."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def require_target(path: Path, *, existing: str, endings: tuple[str, ...]) -> None:
    """Refuse a file that must not, or cannot, be written.

    Parameters
    ----------
    path : Path
        The file to write.
    existing : {"error", "replace"}
        Behaviour if the file exists already.
    endings : tuple of str
        Endings that its name may have, such as ``".nc"``.

    Raises
    ------
    InputError
        When the ending is another one, the folder does not exist, or the file does.
    """
    if path.suffix.lower() not in endings:
        raise InputError(f"{path}: write to a file that ends in {' or '.join(endings)}")
    require_free(path, existing=existing)


def require_free(path: Path, *, existing: str) -> None:
    """Refuse a file that is there and not to be replaced, or whose folder is not there.

    Parameters
    ----------
    path : Path
        The file to write.
    existing : {"error", "replace"}
        Behaviour if the file exists already.

    Raises
    ------
    InputError
        When the folder does not exist, or the file does.
    """
    if existing not in ("error", "replace"):
        raise InputError(f"existing is 'error' or 'replace', got '{existing}'")
    if not path.parent.is_dir():
        raise InputError(f"{path}: the folder {path.parent} does not exist")
    if path.exists() and existing == "error":
        raise InputError(f'{path} exists already: name another file, or add `existing="replace"`')
