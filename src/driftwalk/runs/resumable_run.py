"""The run directory of one piece of work: made or continued, and finished with its manifest."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Protocol, Self

from driftwalk.core.errors import InputError
from driftwalk.core.progress import StagedProgress, ignore_progress
from driftwalk.schema.description import SOURCE_WARNINGS
from driftwalk.schema.kinds import find_kind
from driftwalk.schema.runs import RunContents, run_kind
from driftwalk.schema.stores.netcdf import netcdf_bytes

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.core.files.rundir import RunDirectory
    from driftwalk.model import Study
    from driftwalk.sweep import Store


FLOW_ERRORS: Final = ("u_standard_error", "v_standard_error")
"""Variables of a flow field that was measured with its errors."""


class Progress(Protocol):
    """Takes note of how much of a run is done."""

    def __call__(self, done: int, total: int, text: str = "", /) -> None:
        """Take note that `done` of `total` parts are complete, and what is under way."""


class Work(Protocol):
    """The work of a run: its settings, its inputs, and the computation of its result."""

    @property
    def kind(self) -> str:
        """Name of its `driftwalk.schema.runs.RunKind`."""

    @property
    def study(self) -> Study:
        """The study, for the manifest."""

    @property
    def inputs(self) -> Mapping[str, Path]:
        """The files that were read, by their role; hashed before the work begins."""

    @property
    def seeds(self) -> Mapping[str, int]:
        """The seeds, for the manifest."""

    def checked(self) -> Self:
        """Return the work with what a check of it found; raise what forbids it."""

    def specification(self) -> dict[str, Any]:
        """Return everything that determines the numbers, as JSON holds it."""

    def compute(self, run: Run) -> Any:
        """Compute, keep the datasets in the run, and return the result."""


@dataclass(kw_only=True)
class Run(RunContents):
    """A run under way: its directory and the datasets that it has kept.

    Attributes
    ----------
    directory : RunDirectory
        Its directory, for other files than datasets.
    kind : str
        Name of its kind.
    progress : Progress
        Takes note of how much is done.
    executor : concurrent.futures.Executor or None
        Computes work units elsewhere.
    drawn : bool
        Whether its figures are there.
    warnings : sequence of str
        Warnings of what its parameters were taken from; its results hold them.
    """

    directory: RunDirectory
    kind: str
    progress: Progress = ignore_progress
    executor: Executor | None = None
    drawn: bool = False
    warnings: Sequence[str] = ()

    def keep(self, name: str, dataset: xr.Dataset) -> xr.Dataset:
        """Write a dataset and return it as one that knows its file, as if it were read from it."""
        kind = find_kind(dataset)
        if self.warnings and kind is not None and {*SOURCE_WARNINGS} <= {*kind.attributes}:
            dataset = dataset.assign_attrs(warnings=json.dumps([*self.warnings]))
        path = self.directory.write(name, netcdf_bytes(dataset))
        kept = dataset.copy(deep=False)
        kept.encoding = {**dataset.encoding, "source": str(path.absolute())}
        self.datasets[name] = kept
        return kept

    def keep_result(self, dataset: xr.Dataset) -> xr.Dataset:
        """Write the result of the run, under the name that its kind declares; see `keep`."""
        return self.keep(run_kind(self.kind).file, dataset)

    def store(self, name: str, fingerprint: Mapping[str, Any] | None = None) -> Store:
        """Return the store of a sweep's work units, which a continued run finds again."""
        return self.directory.store(name, fingerprint=fingerprint)

    def staged_progress(self, parts: Mapping[str, float]) -> StagedProgress:
        """Return the progress of work of several stages."""
        return StagedProgress(self.progress, parts)

    def draw(self, early: Mapping[str, xr.Dataset] | None = None) -> None:
        """Write all figures of what the run has kept, and of datasets that it has not yet."""
        import driftwalk.figures

        kind = run_kind(self.kind)
        if kind.figures is not None:
            contents = RunContents({**self.datasets, **(early or {})}, self.body)
            table = contents.make(kind, kind.figures, lacking="its figures cannot be drawn")
            driftwalk.figures.write_figures(table, self.directory.folder("figures"))
        self.drawn = True


def run_work(
    work: Work,
    folder: Path,
    *,
    overwrite: bool = False,
    begun: Callable[[], None] = ignore_progress,
    executor: Executor | None = None,
    progress: Progress = ignore_progress,
    command: str | Sequence[str] = "driftwalk.runs.run_work(...)",
    warnings: Sequence[str] = (),
) -> Any:
    """Do a piece of work in a run directory and return its result.

    Writes the datasets of its kind, ``figures/`` and, last, ``manifest.json``. Killed at any moment
    and started again it continues with the work units that are not done.

    Parameters
    ----------
    work : Work
        The work to do, such as a `FitWork`.
    folder : Path
        The run directory.
    overwrite : bool
        Whether a finished run there is moved aside; it is refused otherwise.
    begun : callable, optional
        Called when everything is checked and the work begins.
    executor : concurrent.futures.Executor, optional
        Computes work units elsewhere; the result does not depend on it.
    progress : callable, optional
        Called as ``progress(done, total, text)`` while the work goes on.
    command : str or sequence of str, optional
        The command line or the call, for the manifest.
    warnings : sequence of str, optional
        Warnings of what the parameters were taken from, for the results and their pages.

    Returns
    -------
    object
        What the work computed. Its datasets know the files that hold them.

    Raises
    ------
    DriftwalkError
        When the inputs do not allow the work; nothing is written then.
    RunDirectoryError
        When the directory is in use, holds another run, or cannot be written.

    Examples
    --------
    >>> import driftwalk as dw
    >>> work = FitWork([dw.tank30_recording()], dw.Study(), None, {})  # doctest: +SKIP
    >>> found = run_work(work, Path("fit"))  # doctest: +SKIP
    """
    from driftwalk import _core
    from driftwalk.core.files.rundir import RunDirectory
    from driftwalk.core.provenance import manifest

    run_kind(work.kind)
    work = work.checked()
    with RunDirectory(
        folder,
        specification={"kind": work.kind, **work.specification()},
        overwrite=overwrite,
    ) as directory:
        about = manifest(
            command=command,
            study=work.study.to_dict(),
            seeds=dict(work.seeds),
            inputs=dict(work.inputs),
            instruction_set=_core.instruction_set(),
        )
        # What is said first comes after the folder was accepted: a refusal stands alone.
        begun()
        run = Run(
            body=getattr(work, "body", None),
            directory=directory,
            kind=work.kind,
            progress=progress,
            executor=executor,
            warnings=warnings,
        )
        result = work.compute(run)
        if not run.drawn:
            run.draw()
        directory.finish(about)
    return result


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


def dataset_hash(
    dataset: xr.Dataset | None, names: tuple[str, ...], *, where_held: tuple[str, ...] = ()
) -> str | None:
    """Return a hash of the coordinates and the named variables of a dataset, None without one.

    A variable of `where_held` is hashed where the dataset has it.
    """
    if dataset is None:
        return None
    digest = hashlib.sha256()
    held = [name for name in where_held if name in dataset]
    for name in (*sorted(map(str, dataset.indexes)), *names, *held):
        values = dataset[name].values
        digest.update(
            repr(values.tolist()).encode() if values.dtype == object else values.tobytes()
        )
    return digest.hexdigest()
