"""The run directory: results of one piece of work, safe against kills, repeats and concurrent runs.

While a run is under way its folder holds ``.run.json`` (what determines the numbers) and
``.shards/`` (finished work units). A finished run holds its results and ``manifest.json``, which is
written last: its presence is what "finished" means. ``.lock`` is an empty file that stays;
``.moving`` names the place that earlier results are being moved to.

A directory may come from someone else: nothing is written through a link that lies in it, nor read
or moved out of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Final, Self

from driftwalk.core.errors import InputError, RunDirectoryError
from driftwalk.core.files.atomic import atomic_path, remove_partials, write_atomic
from driftwalk.core.files.run_layout import (
    LOCK_FILE,
    MANIFEST_FILE,
    PREVIOUS_FOLDER,
    RECORD_FILE,
    SHARD_FOLDER,
    State,
    complete_move,
    lock_folder,
    move_aside,
    refuse_foreign,
    refuse_leading_out,
    remove_leftovers,
    remove_traces,
    state_of,
    visible_files,
)
from driftwalk.core.files.shards import (
    ShardStore,
    checked_name,
    make_folder,
    read_specification,
    refuse_other_specification,
    write_specification,
)
from driftwalk.core.provenance import (
    MANIFEST_KIND,
    describe_file,
    fingerprint_of,
    plain,
    utc_now,
    write_manifest,
)

if TYPE_CHECKING:
    from filelock import BaseFileLock

_OVERWRITE: Final = f"`overwrite=True`, which moves what is there into {PREVIOUS_FOLDER}/"


class RunDirectory:
    """A folder for the results of one run, held by this process inside a ``with`` block.

    Parameters
    ----------
    path : path-like
        The folder; made when absent. A folder with files but no run in it is refused.
    specification : mapping
        Everything that determines the numbers: the resolved study, seeds, hashes of the inputs. The
        version of driftwalk is added. A run continues only under the same specification.
    overwrite : bool
        Behaviour if the directory holds a run already. An unfinished run of the same specification
        is continued in either case, so that a killed command can be repeated as it stands. A
        finished run, or an unfinished one of another specification, is refused, or moved into
        ``previous/<UTC time>/``. Nothing is deleted.

    Attributes
    ----------
    path : pathlib.Path
        The folder.
    specification : dict
        Everything that determines the numbers, in JSON's types.
    state : {"new", "unfinished"}
        Whether the run began with this ``with`` block or continues.
    moved_to : pathlib.Path or None
        Where earlier results were moved by this ``with`` block.

    Raises
    ------
    RunDirectoryError
        On entry, when another process holds the folder, it cannot be written, or what it holds
        stands in the way. On a write, when the disk is full.

    Examples
    --------
    >>> with RunDirectory("run", specification={"seed": 1}) as run:  # doctest: +SKIP
    ...     store = run.store("coarse")
    ...     run.write("calibration.nc", b"...")
    ...     run.finish({"seeds": {"calibration": 1}})
    """

    def __init__(
        self, path: str | Path, *, specification: Mapping[str, Any], overwrite: bool = False
    ) -> None:
        from driftwalk import __version__

        self.path = Path(path)
        self.specification = plain({"driftwalk_version": __version__, **specification})
        self.state: State = "new"
        self.moved_to: Path | None = None
        self._overwrite = overwrite
        self._started = utc_now()
        self._lock: BaseFileLock | None = None

    def __enter__(self) -> Self:
        make_folder(self.path)
        # First, as what links lead to in a folder of someone else's is none of a run's business.
        if not (self.path / LOCK_FILE).exists():
            refuse_foreign(self.path)
        # Before anything is opened: the lock is a file of the directory too.
        refuse_leading_out(self.path)
        self._lock = lock_folder(self.path)
        try:
            # Again: only under the lock does nothing change what is looked at.
            refuse_foreign(self.path)
            self._take_over()
        except BaseException:
            self._release()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._release()

    def store(self, name: str, *, fingerprint: Mapping[str, Any] | None = None) -> ShardStore:
        """Return the store of a sweep of this run, under ``.shards/name``.

        Parameters
        ----------
        name : str
            Name of the sweep, such as "coarse".
        fingerprint : mapping, optional
            Everything that determines the sweep's numbers, in addition to the run's own
            specification.
        """
        self._require_held()
        folder = self.path / SHARD_FOLDER / checked_name(name, kind="store")
        remove_partials(folder)
        return ShardStore(folder, fingerprint={"run": self.specification, "sweep": fingerprint})

    def file(self, name: str) -> AbstractContextManager[Path]:
        """Give a temporary path for a result; it becomes ``name`` when the block ends."""
        return atomic_path(self._result(name))

    def write(self, name: str, data: bytes | memoryview) -> Path:
        """Write a result whole, and return its path; `name` may name a subfolder."""
        path = self._result(name)
        write_atomic(path, data)
        return path

    def folder(self, name: str) -> Path:
        """Make a subfolder for results, and return it."""
        folder = self._result(name)
        make_folder(folder)
        return folder

    def finish(self, manifest: Mapping[str, Any]) -> None:
        """Write ``manifest.json``, which makes the run a finished one, then remove the shards.

        Parameters
        ----------
        manifest : mapping
            Result of `driftwalk.core.provenance.manifest`. Start and end, fingerprint,
            specification, and hash and size of every file in the folder are added.
        """
        self._require_held()
        values = {
            **manifest,
            "kind": MANIFEST_KIND,
            "started_utc": self._started,
            "finished_utc": utc_now(),
            "fingerprint": fingerprint_of(self.specification),
            "specification": self.specification,
            "files": [
                {**describe_file(path), "path": path.relative_to(self.path).as_posix()}
                for path in visible_files(self.path)
            ],
        }
        write_manifest(self.path / MANIFEST_FILE, values)
        self.state = "finished"
        remove_traces(self.path)

    def _take_over(self) -> None:
        """Decide what to do with what is there; called with the lock held."""
        complete_move(self.path)
        remove_leftovers(self.path)
        state = state_of(self.path)
        if state == "finished":
            # What a kill in `finish` may have left; the manifest says that it is not needed.
            remove_traces(self.path)
        if self._must_move(state):
            self.moved_to = move_aside(self.path)
            state = "new"
        if state == "unfinished":
            self._started = read_specification(self.path / RECORD_FILE).get(
                "started_utc", self._started
            )
        self.state = state
        # Written on a continuation too: a full or read-only disk then shows before any work.
        write_specification(self.path / RECORD_FILE, self.specification, started_utc=self._started)

    def _must_move(self, state: State) -> bool:
        """Return whether what is there has to be moved away; raise when it must not be."""
        if state == "finished" and not self._overwrite:
            raise RunDirectoryError(
                f"{self.path} holds a finished run; choose another directory or {_OVERWRITE}"
            )
        if state != "unfinished":
            return state == "finished"
        stored = read_specification(self.path / RECORD_FILE)
        if self._overwrite:
            return bool(stored["fingerprint"] != fingerprint_of(self.specification))
        refuse_other_specification(
            stored,
            self.specification,
            place=self.path,
            way_out=f"give the same study and inputs, choose another directory or {_OVERWRITE}",
        )
        return False

    def _result(self, name: str) -> Path:
        self._require_held()
        parts = name.split("/")
        for part in parts:
            checked_name(part, kind="result")
        if parts[0] == PREVIOUS_FOLDER or name == MANIFEST_FILE:
            raise InputError(f"result name {name!r} is reserved in a run directory")
        if len(parts) > 1:
            make_folder(self.path.joinpath(*parts[:-1]))
        return self.path.joinpath(*parts)

    def _require_held(self) -> None:
        if self._lock is None or self.state == "finished":
            raise RunDirectoryError(f"{self.path} is not open for writing: use it in a with block")

    def _release(self) -> None:
        if self._lock is not None:
            self._lock.release()
            self._lock = None
