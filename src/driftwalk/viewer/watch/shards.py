"""The finished work units of a run that is under way, read without disturbing it."""

from __future__ import annotations

import contextlib
import re
import time
from collections.abc import Container, Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple

from driftwalk.core.errors import DriftwalkError
from driftwalk.core.files.run_layout import RECORD_FILE, SHARD_FOLDER, run_file
from driftwalk.core.files.shards import (
    SHARD_SUFFIX,
    SPECIFICATION_FILE,
    Arrays,
    read_specification,
    unpack_shard,
)
from driftwalk.core.text_files import path_inside

_UNIT: Final = re.compile(r"(\d{8,12})-(\d{8,12})", re.ASCII)


class FinishedUnit(NamedTuple):
    """Result of a work unit."""

    start: int
    """Its first setting."""
    stop: int
    """The setting after its last."""
    arrays: Arrays
    """One entry per setting each."""


class StoreReader:
    """Reads the shards of one sweep as they appear.

    Parameters
    ----------
    folder : Path
        A folder in ``.shards``.

    Attributes
    ----------
    sweep : Any
        Everything that determines the sweep's numbers, in addition to the run's specification.

    Raises
    ------
    FormatError
        When its specification leads out of the folder.
    RunDirectoryError
        When the folder says not yet, or no more, what it holds.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        run_file(folder, SPECIFICATION_FILE)
        stored = read_specification(folder / SPECIFICATION_FILE)
        self.sweep: Any = stored["specification"].get("sweep")
        self._fingerprint = str(stored["fingerprint"])
        self._seen: set[str] = set()

    def new_units(self) -> list[FinishedUnit]:
        """Return the units that were finished since the last call."""
        found = []
        for path in sorted(self.folder.glob(f"*{SHARD_SUFFIX}")):
            name = path.name.removesuffix(SHARD_SUFFIX)
            match = _UNIT.fullmatch(name)
            if name in self._seen or match is None:
                continue
            try:
                run_file(self.folder, path.name)
                arrays = unpack_shard(path.read_bytes(), name, self._fingerprint)
            except (DriftwalkError, OSError):
                # The run may have ended in between, and removed it; or it is none of the run's.
                continue
            if arrays is not None:
                self._seen.add(name)
                found.append(FinishedUnit(int(match[1]), int(match[2]), arrays))
        return found


class RunReader:
    """Reads the finished work units of a run, sweep by sweep, as they appear.

    Parameters
    ----------
    run : Path
        A run directory.

    Attributes
    ----------
    sweeps : dict of str to StoreReader
        The sweeps that have begun, by the name of their folder; those that began last at the end.
    """

    def __init__(self, run: Path) -> None:
        self._run = run
        self.sweeps: dict[str, StoreReader] = {}

    def look(self) -> None:
        """Find the sweeps that have begun since the last call."""
        try:
            began = {
                path: (path / SPECIFICATION_FILE).stat().st_mtime_ns
                for path in (self._run / SHARD_FOLDER).iterdir()
                if path.is_dir() and path_inside(self._run, f"{SHARD_FOLDER}/{path.name}")
            }
        except OSError:
            # Between two steps of the run a folder may have no specification yet, or be gone.
            return
        for path in sorted(began, key=began.__getitem__):
            if path.name not in self.sweeps:
                with contextlib.suppress(DriftwalkError):
                    self.sweeps[path.name] = StoreReader(path)

    def new_units(self, names: Container[str] | None = None) -> Iterator[tuple[str, FinishedUnit]]:
        """Look, and yield the units that were finished since the last call, with their sweeps.

        Parameters
        ----------
        names : container of str, optional
            The sweeps that are wanted; default: all.
        """
        self.look()
        for name, reader in self.sweeps.items():
            if names is None or name in names:
                for unit in reader.new_units():
                    yield name, unit


def quiet_time(run: Path) -> float:
    """Return for how long a run has given nothing new [s].

    The lock of the run would tell whether a process holds it, but not without taking it, nor on
    another machine that shares the folder.

    Parameters
    ----------
    run : Path
        A run directory.
    """
    times = []
    # A folder changes when a finished unit is moved into it.
    for path in (run / RECORD_FILE, run / SHARD_FOLDER, *run.glob(f"{SHARD_FOLDER}/*")):
        with contextlib.suppress(OSError):
            times.append(path.stat().st_mtime)
    return max(time.time() - max(times), 0.0) if times else 0.0
