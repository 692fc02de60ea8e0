"""The run directory: made or continued, and finished with its manifest."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from driftwalk.core.errors import InputError

if TYPE_CHECKING:
    from driftwalk.core.files.rundir import RunDirectory
    from driftwalk.model import Study


class Progress(Protocol):
    """Takes note of how much of a run is done."""

    def __call__(self, done: int, total: int, text: str = "") -> None:
        """Take note that `done` of `total` parts are complete, and what is under way."""


def silent(done: int, total: int, text: str = "") -> None:
    """Tell nobody how much of a run is done."""


@contextmanager
def naming_recording(inputs: Mapping[str, Path]) -> Iterator[None]:
    """Put the file of the recording in front of what is said against it, where there is one.

    Raises
    ------
    InputError
        The one that ends what is within.
    """
    try:
        yield
    except InputError as error:
        if "recording" not in inputs:
            raise
        raise InputError(f"{inputs['recording']}: {error}") from error


@contextmanager
def open_run(
    folder: Path,
    *,
    specification: Mapping[str, Any],
    study: Study,
    seeds: Mapping[str, int],
    inputs: Mapping[str, Path],
    overwrite: bool,
    command: str | Sequence[str],
) -> Iterator[RunDirectory]:
    """Open a run directory; when the work in it is done, write its manifest.

    Parameters
    ----------
    folder : Path
        The run directory.
    specification : mapping
        Everything that determines the numbers of the run.
    study : Study
        For the manifest.
    seeds : mapping of str to int
        For the manifest.
    inputs : mapping of str to Path
        The files that were read, by their role; hashed before the work begins.
    overwrite : bool
        Whether a finished run there is moved aside; it is refused otherwise.
    command : str or sequence of str
        The command line, or the function that was called, for the manifest.

    Raises
    ------
    RunDirectoryError
        When the directory is in use, holds another run, or cannot be written.
    """
    from driftwalk import _core
    from driftwalk.core.files.rundir import RunDirectory
    from driftwalk.core.provenance import manifest

    with RunDirectory(
        folder, specification=specification, on_existing="overwrite" if overwrite else "resume"
    ) as run:
        about = manifest(
            command=command,
            study=study.to_dict(),
            seeds=dict(seeds),
            inputs=dict(inputs),
            instruction_set=_core.instruction_set(),
        )
        yield run
        run.finish(about)
