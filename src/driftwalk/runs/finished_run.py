"""Read a finished run, its directory or its dataset, as the start of further work."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.conditions import estimated_study, recording_flow
from driftwalk.core.errors import ConfigurationError, FormatError, InputError
from driftwalk.core.files.run_layout import MANIFEST_FILE, faults_of, run_file, state_of
from driftwalk.core.provenance import read_manifest
from driftwalk.flow import load_flow
from driftwalk.model import Study, apply_overrides, parse_study
from driftwalk.motion import MotionModel, estimated_values
from driftwalk.schema.answers.facts import sentences
from driftwalk.schema.answers.verdict import stored_verdict
from driftwalk.schema.check import check_contents, refuse_other_version, require_kind
from driftwalk.schema.parameters import is_block
from driftwalk.schema.runs import RUN_KINDS, RunKind, kind_of, load_maker
from driftwalk.schema.stores.netcdf import is_netcdf, open_netcdf

if TYPE_CHECKING:
    import xarray as xr

BLOCK: Final = "block"
FLOW_FILE: Final = "flow.nc"
GIVE: Final = (
    "give the directory of a finished fit, calibration or comparison of models, or a flow field "
    "(`flow`)"
)


@dataclass(frozen=True)
class FoundRun:
    """A model with the values that a run has found for it.

    Attributes
    ----------
    found : xarray.Dataset
        The `fit`, `calibration`, `model_calibration` or `model_comparison`.
    file : Path or None
        Its file, None where it is from none.
    folder : Path or None
        The run directory that the file lies in, None where it lies in none.
    """

    found: xr.Dataset
    file: Path | None
    folder: Path | None

    @property
    def kind(self) -> RunKind | None:
        """The kind of run that the dataset is the result of."""
        return kind_of(self.found)

    @property
    def words(self) -> str:
        """Name of the dataset in a sentence."""
        return "dataset" if self.kind is None else self.kind.words

    @property
    def name(self) -> str:
        """Name of this run in a sentence: its directory or file, or its kind."""
        place = self.folder or self.file
        return f"the {self.words}" if place is None else str(place)

    @property
    def model(self) -> str:
        """Name of the model, "block" for the block in stirred water; of a comparison its best."""
        found = self.found
        if "model" in found.dims:
            return str(found["model"].values[_best(found)])
        # A calibration of a user's own model may not name it.
        return str(found.attrs.get("model", BLOCK if is_block(found) else "of a user"))

    @property
    def inputs(self) -> dict[str, Path]:
        """The files that `block_study` and `flow` read, by their role."""
        role = "dataset" if self.kind is None else self.kind.name
        read = {} if self.file is None else {role: self.file}
        stored = self._stored(FLOW_FILE)
        return read if stored is None else {**read, "flow": stored}

    @property
    def uncertainty(self) -> xr.Dataset | None:
        """The dataset where parameters can be drawn from it, as `assembly.draw_parameters` does."""
        from driftwalk.assembly import has_uncertainty

        return self.found if has_uncertainty(self.found) else None

    @property
    def warnings(self) -> list[str]:
        """Sentences for a user who simulates the block with these values."""
        said = [*self.faults]
        said += [f"of the {self.words}: {text}" for text in sentences(self.found, "warning")]
        verdict = stored_verdict(self.found)
        if verdict is not None and not verdict.explains:
            said += [f"of the {self.words}: {verdict.word}: {text}" for text in verdict.reasons]
        said += [] if self.first_force is None else [self.first_force]
        left_out = self.found.attrs.get("flow_strength_left_out")
        said += [] if left_out is None else [f"of the {self.words}: {left_out}"]
        return said

    @property
    def first_force(self) -> str | None:
        """The one of `warnings` on σ_F of the first flow in all, None where flows have one σ_F."""
        if "flow_force_std" not in self.found:
            return None
        return (
            f"of the {self.words}: each flow has its own σ_F; the one of flow "
            f"{self.found['flow'].values[0]} is taken for all (`flow_settings` gives the others)"
        )

    @property
    def faults(self) -> list[str]:
        """Sentences on files that are not those of the manifest of the run."""
        if self.folder is None:
            return []
        names = [path.name for path in self.inputs.values()]
        return [f"of {self.folder}: {fault}" for fault in faults_of(self.folder, names)]

    @property
    def not_drawn(self) -> str | None:
        """Why no parameters can be drawn from the run, None where they can."""
        if self.uncertainty is not None:
            return None
        lacks = RunKind.no_draws if self.kind is None else self.kind.no_draws
        return f"the {self.words} has {lacks}: only the parameters that it found are simulated"

    @property
    def has_study(self) -> bool:
        """Whether the dataset or the run directory holds the study of the run."""
        return "study" in self.found.attrs or self.folder is not None

    def study(self) -> Study:
        """Return the study of the run, as it was before the estimates.

        Raises
        ------
        InputError
            When neither the dataset nor the run directory holds one.
        """
        if "study" in self.found.attrs:
            return parse_study(self.found.attrs["study"], source=f"{self.file}: its study")
        stored = self._manifest.get("study")
        if not isinstance(stored, Mapping):
            raise InputError(f"{self.name} does not hold the study that it used")
        try:
            return Study(**stored)
        except (ConfigurationError, ValueError, TypeError) as error:
            raise InputError(f"{self.name}: its manifest holds no study of this version") from error

    def block_study(
        self,
        overrides: Mapping[str, Any] | None = None,
        *,
        why: str = "self-assembly simulates blocks: give a run about the block",
    ) -> Study:
        """Return the study of a run about the block, with what the run has found in it.

        Parameters
        ----------
        overrides : mapping, optional
            Over the study, from ``"section.key"`` to the value.
        why : str
            Why the model has to be the block, for the error.

        Raises
        ------
        InputError
            When the run is about another model.
        """
        if self.model != BLOCK:
            is_best = "model" in self.found.dims
            about = "closest to its recording is" if is_best else "is about"
            raise InputError(f"{self.name} {about} the model {self.model}, and {why}")
        if "model" not in self.found.dims:
            return estimated_study(self.found, overrides, source=f"{self.file}: its study")
        row = self.found["estimate"].sel(model=BLOCK)
        names = {"drag_coefficient": "drag_coefficient", "force_std": "force_std_N"}
        values = {f"forces.{key}": float(row.sel(parameter=name)) for name, key in names.items()}
        return apply_overrides(self.study(), {**values, **(overrides or {})})

    def flow(self, study: Study) -> xr.Dataset:
        """Return the flow field that the run used or found.

        Parameters
        ----------
        study : Study
            The study of the run: its tank is that of the flow.

        Raises
        ------
        InputError
            When the run does not hold it.
        """
        held = flow_of_result(self.found)
        if held is not None:
            return held
        stored = self._stored(FLOW_FILE)
        if stored is not None:
            return load_flow(stored, arena=study.tank.to_arena(), own_flags="keep")
        recording = self.recording()
        # Without a given flow it took that of its recording, which a calibration stores.
        own = self._specification.get("flow_sha256", "given") is None
        if "model" in self.found.dims and recording is not None and own:
            return recording_flow(recording, study, body=self.body)
        if self.folder is None:
            raise InputError(
                f"a {self.words} does not hold the flow field that it used: give `flow`, or "
                "calibrate with `folder`"
            )
        raise InputError(
            f"{self.folder} holds a finished run, but not its flow field ({FLOW_FILE}): give one "
            "(`flow`)"
        )

    def mean_flow(self, study: Study) -> tuple[xr.Dataset, str | None]:
        """Return the flow field of a run for what takes a steady one alone, and what it lacks.

        Of a fit whose flow changes its strength or its shape it is the mean flow.

        Parameters
        ----------
        study : Study
            The study of the run.
        """
        flow = self.flow(study)
        own = self.kind is not None and self.kind.flow is not None
        if "time" not in flow["u"].dims or "flow" in self.found.dims or not own:
            return flow, None
        from driftwalk.likelihood import fitted_flow

        lacks = f"the flow of {self.name} changes in time, and is taken with its mean"
        return fitted_flow(self.found, interval=0), lacks

    def recording(self) -> xr.Dataset | None:
        """Return the first recording of the run, None where there is none."""
        stored = self._stored("recording.nc")
        return None if stored is None else open_netcdf(stored)

    @property
    def body(self) -> str | None:
        """The body of the recording, where one was named."""
        found = self._specification.get("body")
        return None if found is None else str(found)

    def known(self, name: str | None = None) -> dict[str, float]:
        """Return what the run was given: the known values of its model, with the clearance.

        Parameters
        ----------
        name : str, optional
            Name of the model, where the run is about several; default: the best.
        """
        model = self._specification.get("model")
        for one in self._specification.get("models", ()):
            if isinstance(one, Mapping) and one.get("name") == (name or self.model):
                model = one
        if not isinstance(model, Mapping):
            return {}
        fixed = model.get("fixed")
        given: dict[str, Any] = dict(fixed) if isinstance(fixed, Mapping) else {}
        if "clearance_m" in model:
            given["clearance"] = model["clearance_m"]
        # With many parameters it may come from the recording.
        if "fixed" in self.found.attrs:
            given |= json.loads(self.found.attrs["fixed"])
        return {name: float(one) for name, one in given.items() if _is_number(one)}

    def values(self, model: MotionModel) -> dict[str, float]:
        """Return the values of a model, by the names of its parameters.

        Parameters
        ----------
        model : MotionModel
            The model that the run was about.

        Raises
        ------
        InputError
            When the run was about another model.
        """
        try:
            values = estimated_values(self.found, model)
        except InputError as error:
            raise InputError(f"{self.file}: {error}") from error
        names = {one.name for one in model.parameters}
        known = {name: one for name, one in self.known(model.name).items() if name in names}
        return {**known, **{name: value for name, value in values.items() if name in names}}

    def is_outdated(self, model: MotionModel) -> bool:
        """Return whether the source of the model is not the one that the run had."""
        known = self.found.attrs.get("model_source_sha256")
        own = model.facts(self.values(model)).get("model_source_sha256")
        return known is not None and own != known

    def _stored(self, name: str) -> Path | None:
        """Return a file of the run directory, None where it is not there."""
        return None if self.folder is None else run_file(self.folder, name)

    @property
    def _manifest(self) -> Mapping[str, Any]:
        return {} if self.folder is None else read_manifest(self.folder / MANIFEST_FILE)

    @property
    def _specification(self) -> dict[str, Any]:
        """Everything that determined the numbers of the run; empty where nothing says it."""
        found = self._manifest.get("specification")
        return dict(found) if isinstance(found, Mapping) else {}


def read_found(source: Path | xr.Dataset, *, give: str = GIVE) -> FoundRun:
    """Read what a finished run has found, as the start of further work.

    Nothing that the run names is loaded or executed, such as the file of a user's own model.

    Parameters
    ----------
    source : Path or xarray.Dataset
        The run directory of a finished fit, calibration or comparison of models; a dataset of it,
        or its file.
    give : str
        What to give instead, for an error.

    Returns
    -------
    FoundRun
        The model with its values; its flow and study on demand.

    Raises
    ------
    InputError
        When there is none, or the run has not come to its end.

    Examples
    --------
    >>> read_found(Path("fit")).block_study().forces.drag_coefficient  # doctest: +SKIP
    0.39
    >>> read_found(Path("compare")).model  # doctest: +SKIP
    'active'
    """
    if not isinstance(source, Path):
        origin = source.encoding.get("source")
        file = None if origin is None else Path(origin)
        return FoundRun(refuse_other_version(source), file, run_folder(source))
    if source.is_file():
        if give == GIVE and not is_netcdf(source):
            raise InputError(f"{source} is not a run directory: {give}")
        found, file = open_netcdf(source), source
    else:
        found, file = _dataset_in(source, give)
    if "estimate" not in found:
        raise InputError(f"{file} holds no estimate of parameters: {give}")
    is_run = state_of(file.parent) == "finished"
    return FoundRun(found, file, file.parent if is_run else None)


def flow_of_result(found: xr.Dataset) -> xr.Dataset | None:
    """Return the flow field that the result of a run holds, such as a fit; None without one.

    Parameters
    ----------
    found : xarray.Dataset
        Any dataset.

    Examples
    --------
    >>> import xarray as xr
    >>> flow_of_result(xr.Dataset()) is None
    True
    """
    kind = kind_of(found)
    if kind is None or kind.flow is None:
        return None
    flow: xr.Dataset = load_maker(kind.flow)(found)
    return flow


def run_folder(found: xr.Dataset) -> Path | None:
    """Return the run directory that a dataset was read from, None where it is from none.

    Parameters
    ----------
    found : xarray.Dataset
        Any dataset.

    Examples
    --------
    >>> import xarray as xr
    >>> run_folder(xr.Dataset()) is None
    True
    """
    source = found.encoding.get("source")
    if source is None:
        return None
    folder = Path(source).parent
    return None if run_file(folder, MANIFEST_FILE) is None else folder


def _dataset_in(folder: Path, give: str) -> tuple[xr.Dataset, Path]:
    state = state_of(folder)
    if state == "unfinished":
        raise InputError(
            f"{folder} holds a run that is not finished: run its command again, which continues it"
        )
    if state == "new":
        what = "is not a run directory" if folder.exists() else "does not exist"
        raise InputError(f"{folder} {what}: {give}")
    for kind in RUN_KINDS.values():
        path = run_file(folder, kind.file) if kind.gives_model else None
        if path is not None:
            try:
                return require_kind(check_contents(open_netcdf(path), path), kind.name), path
            except FormatError:
                raise
            except InputError as error:
                raise InputError(f"{path}: {error}") from error
    raise InputError(
        f"{folder} holds a finished run, but no fit, calibration or comparison of models: {give}"
    )


def _best(comparison: xr.Dataset) -> int:
    """Return which model of a comparison is the best: the one named, or the closest one."""
    if "named" in comparison and bool(comparison["named"].any()):
        return int(np.argmax(comparison["named"].values))
    # A walk of recorded steps explains nothing. Models are sorted from the closest on.
    return int(np.argmin(comparison["baseline"].values))


def _is_number(value: Any) -> bool:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return is_number and math.isfinite(value)
