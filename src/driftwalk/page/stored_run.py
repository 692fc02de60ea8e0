"""A run directory as a page needs it: which kind of run, how far it is, and its datasets."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from driftwalk.core.errors import DriftwalkError, FormatError, InputError
from driftwalk.core.files.file_names import text_of_name
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
from driftwalk.schema.stores.netcdf import open_netcdf

if TYPE_CHECKING:
    import xarray as xr

# The file that each kind of run makes, by which a finished one is known.
MAIN_FILES: Final = {
    "calibration": "calibration.nc",
    "fit": "fit.nc",
    "assembly": "assembly.nc",
    "sensitivity": "sensitivity.nc",
    "recovery": "recovery.nc",
    "model_comparison": "comparison.nc",
    "model_calibration": "model_calibration.nc",
    "model_recovery": "model_recovery.nc",
}


@dataclass
class Run:
    """Contents of a run directory.

    Attributes
    ----------
    folder : Path
        The run directory.
    state : {"finished", "unfinished"}
        Whether the run has come to its end.
    kind : str or None
        A key of `MAIN_FILES`; None when nothing says it.
    manifest : dict
        The manifest; of an unfinished run its specification and when it was started.
    problems : dict of str to str
        Why parts could not be read, by the name of the file, filled by `dataset`.
    read : list of str
        The names of those that were read.
    """

    folder: Path
    state: State
    kind: str | None
    manifest: dict[str, Any]
    problems: dict[str, str] = field(default_factory=dict)
    read: list[str] = field(default_factory=list)

    @property
    def name(self) -> str:
        """Name of the folder."""
        return text_of_name(self.folder.resolve().name)

    @property
    def body(self) -> str | None:
        """The body of the recording that was used, where it was named."""
        found = self.specification.get("body")
        return None if found is None else str(found)

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

    def recordings(self) -> list[xr.Dataset]:
        """Return the recordings of the run, in their order."""
        names = ["recording.nc"]
        while self.holds(f"recording-{len(names) + 1}.nc"):
            names.append(f"recording-{len(names) + 1}.nc")
        return [found for name in names if (found := self.dataset(name)) is not None]

    def holds(self, name: str) -> bool:
        """Return whether anything has the name, which `dataset` may refuse."""
        try:
            return run_file(self.folder, name) is not None
        except FormatError:
            return True


def open_run_folder(folder: Path) -> Run:
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
    run = Run(folder, state, None, manifest)
    run.kind = next((kind for kind, name in MAIN_FILES.items() if run.holds(name)), None)
    if run.kind is None:
        run.kind = kind_of_run(run.specification)
    return run


def kind_of_run(specification: Mapping[str, Any]) -> str | None:
    """Return the kind of a run that has no result yet.

    Parameters
    ----------
    specification : mapping
        Everything that determines its numbers.

    Returns
    -------
    str or None
        A key of `MAIN_FILES`; None when nothing says it.

    Examples
    --------
    >>> kind_of_run({"kind": "model_comparison", "recording_sha256": "5f3a"})
    'model_comparison'
    """
    if specification.get("kind") in MAIN_FILES:
        return str(specification["kind"])
    # Those whose specification does not name it.
    telling = {
        "recording_sha256": "calibration",
        "calibration_sha256": "assembly",
        "flows_sha256": "sensitivity",
    }
    return next((kind for key, kind in telling.items() if key in specification), None)


def _no_run(folder: Path) -> str:
    if not folder.is_dir():
        return f"{folder} does not exist" if not folder.exists() else f"{folder} is not a directory"
    inside = []
    for entry in visible(folder):
        try:
            if entry.is_dir() and state_of(entry) != "new":
                inside.append(entry.name)
        except DriftwalkError:
            continue
    if inside:
        return f"{folder} is not a run directory, but holds some: name {' or '.join(inside)} in it"
    return (
        f"{folder} is not a run directory: give one that calibrate, compare-models, fit, assemble, "
        "sensitivity or study recover made, or a recording"
    )
