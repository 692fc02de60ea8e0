"""The contents of a run: datasets by the names of their files, in memory or in a run directory."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Set
from dataclasses import dataclass, field
from inspect import Parameter, signature
from pathlib import Path
from typing import TYPE_CHECKING, Any

from driftwalk.core.errors import DriftwalkError, FormatError, InputError
from driftwalk.core.files.run_layout import (
    MANIFEST_FILE,
    RECORD_FILE,
    State,
    faults_of,
    run_file,
    state_of,
    visible,
)
from driftwalk.core.files.shards import read_specification
from driftwalk.core.provenance import read_manifest, refuse_other_version
from driftwalk.core.text_files import text_of_name
from driftwalk.schema.runs.run_kinds import (
    RUN_KINDS,
    Maker,
    RunKind,
    kind_of_folder,
    load_maker,
    with_source_warnings,
)
from driftwalk.schema.stores.netcdf import open_netcdf

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.schema.answers.parts import Answer


@dataclass
class RunContents:
    """Datasets of a run.

    Attributes
    ----------
    datasets : dict of str to xarray.Dataset
        By the names of their files.
    body : str or None
        The body of the recording that was used, where it was named.
    """

    datasets: dict[str, xr.Dataset] = field(default_factory=dict)
    body: str | None = None

    @property
    def place(self) -> str:
        """The run, in the sentence of an error."""
        return "the run"

    def dataset(self, name: str) -> xr.Dataset | None:
        """Return a dataset of the run, None when it is not there or cannot be read."""
        return self.datasets.get(name)

    def holds(self, name: str) -> bool:
        """Return whether anything has the name, which `dataset` may refuse."""
        return name in self.datasets

    def recordings(self) -> list[xr.Dataset]:
        """Return the recordings of the run, in their order."""
        names = ["recording.nc"]
        while self.holds(f"recording-{len(names) + 1}.nc"):
            names.append(f"recording-{len(names) + 1}.nc")
        return [found for name in names if (found := self.dataset(name)) is not None]

    def make(self, kind: RunKind, maker: Maker, *, lacking: str = "") -> Any:
        """Call a maker with the datasets that its parameters name.

        Parameters
        ----------
        kind : RunKind
            The kind of the run.
        maker : callable or str
            One of the kind's own: its figures or its page.
        lacking : str
            What cannot be done where a dataset is missing that has no default; without it the maker
            gets None.

        Raises
        ------
        InputError
            When such a dataset is missing.
        """
        function = load_maker(maker)
        known = {Path(kind.file).stem, *kind.datasets, "recordings", "body"}
        return function(**self._arguments(function, known, lacking))

    def answer(self, kind: RunKind, found: xr.Dataset) -> Answer | None:
        """Return the answer of a result with the run's other datasets; None of a kind without one.

        Raises
        ------
        InputError
            When the run lacks a dataset that the answer needs.
        """
        if kind.answer is None:
            return None
        function = load_maker(kind.answer)
        more = self._arguments(function, {*kind.datasets}, "its answer cannot be printed")
        return with_source_warnings(function(found, **more), found)

    def _arguments(
        self, function: Callable[..., Any], known: Set[str], lacking: str
    ) -> dict[str, Any]:
        """Return the arguments of a maker: those of its parameters that are known by name.

        The others are options, of which a file of the same name is none of the run's.
        """
        given: dict[str, Any] = {}
        for name, one in signature(function).parameters.items():
            if name not in known:
                continue
            given[name] = self._argument(name, drawn=bool(lacking))
            if lacking and given[name] is None and one.default is Parameter.empty:
                raise InputError(f"{self.place} lacks {name}.nc: {lacking}")
        return given

    def _argument(self, name: str, *, drawn: bool) -> Any:
        if name == "body":
            return self.body
        if name not in ("recording", "recordings") or (drawn and name == "recording"):
            return self.dataset(f"{name}.nc")
        # A page reads all for the first one too, and tells of one that the run did not write.
        found = self.recordings()
        return found if name == "recordings" else next(iter(found), None)


@dataclass
class StoredRun(RunContents):
    """Contents of a run directory, each read when it is asked for.

    Attributes
    ----------
    folder : Path
        The run directory.
    state : {"finished", "unfinished"}
        Whether the run has come to its end.
    kind : RunKind or None
        Its kind; None when nothing says it.
    manifest : dict
        The manifest; of an unfinished run its specification and when it was started.
    problems : dict of str to str
        Why parts could not be read, by the name of the file, filled by `dataset`.
    read : list of str
        The names of those that were read.
    """

    folder: Path = Path()
    state: State = "new"
    kind: RunKind | None = None
    manifest: dict[str, Any] = field(default_factory=dict)
    problems: dict[str, str] = field(default_factory=dict)
    read: list[str] = field(default_factory=list)

    @property
    def place(self) -> str:
        """The folder."""
        return str(self.folder)

    @property
    def name(self) -> str:
        """Name of the folder."""
        return text_of_name(self.folder.resolve().name)

    @property
    def specification(self) -> Mapping[str, Any]:
        """Everything that determines the numbers of the run."""
        found = self.manifest.get("specification")
        return found if isinstance(found, Mapping) else {}

    @property
    def version(self) -> str | None:
        """The version of driftwalk that made the run, None when it does not say."""
        software = self.manifest.get("software")
        found = software.get("driftwalk") if isinstance(software, Mapping) else None
        found = found or self.specification.get("driftwalk_version")
        return None if found is None else str(found)

    def dataset(self, name: str) -> xr.Dataset | None:
        """Return a dataset of the run, None when it is not there or cannot be read."""
        try:
            path = run_file(self.folder, name)
            if path is None:
                return None
            found = open_netcdf(path)
        except FormatError as error:
            self.problems[name] = f"{name} cannot be read: it {error.reason}"
            return None
        self.read.append(name)
        return found

    def faults(self) -> list[str]:
        """Return what the manifest says against files of the run, apart from the problems."""
        found = faults_of(self.folder, self.read, unread=True)
        return [one for one in found if one.partition(" ")[0] not in self.problems]

    def holds(self, name: str) -> bool:
        """Return whether anything has the name, which `dataset` may refuse."""
        try:
            return run_file(self.folder, name) is not None
        except FormatError:
            return True


def open_run_folder(folder: Path) -> StoredRun:
    """Look at a run directory, finished or not; nothing in it is changed.

    Parameters
    ----------
    folder : Path
        The directory.

    Raises
    ------
    InputError
        When it is not there, holds no run, or one whose manifest is of another version; names the
        runs in its subfolders.
    RunDirectoryError
        When it cannot be read.
    """
    state = state_of(folder)
    if state == "new":
        raise InputError(_no_run(folder))
    manifest: dict[str, Any]
    if state == "finished":
        manifest = read_manifest(folder / MANIFEST_FILE)
        refuse_other_version(folder, manifest)
    else:
        stored = read_specification(folder / RECORD_FILE)
        manifest = {key: stored[key] for key in ("started_utc", "specification") if key in stored}
        manifest["study"] = stored["specification"].get("study")
    run = StoredRun(folder=folder, state=state, manifest=manifest)
    body = run.specification.get("body")
    run.body = None if body is None else str(body)
    run.kind = kind_of_folder(folder, run.specification)
    return run


def holds_run(path: Path) -> bool:
    """Return whether a folder holds a run that can be read, finished or not."""
    try:
        return path.is_dir() and state_of(path) != "new"
    except DriftwalkError:
        return False


def _no_run(folder: Path) -> str:
    if not folder.is_dir():
        return f"{folder} does not exist" if not folder.exists() else f"{folder} is not a directory"
    inside = [entry.name for entry in visible(folder) if holds_run(entry)]
    if inside:
        return f"{folder} is not a run directory, but holds some: name {' or '.join(inside)} in it"
    *most, last = dict.fromkeys(kind.command for kind in RUN_KINDS.values())
    return (
        f"{folder} is not a run directory: give one that {', '.join(most)} or {last} made, or a "
        "recording"
    )
