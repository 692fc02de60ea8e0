"""The runs of a calibration and of a comparison of motion models."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

from driftwalk.conditions import recording_flow
from driftwalk.core.calibration_stages import CALIBRATION_STAGES
from driftwalk.core.errors import ConfigurationError
from driftwalk.core.progress import ignore_progress
from driftwalk.runs.resumable_run import dataset_hash, naming_recording
from driftwalk.schema.parameters import unit_suffix
from driftwalk.schema.runs import run_kind

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.motion import MotionModel
    from driftwalk.runs.resumable_run import Run


@dataclass(frozen=True)
class CalibrationWork:
    """A calibration of a motion model.

    Attributes
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    study : Study
        The model and the search.
    flow : xarray.Dataset or None
        A given flow field; None takes it from the recording.
    body : str or None
        The body.
    inputs : mapping of str to Path
        The files that were read, by their role.
    threads : int or None
        Threads; the result does not depend on them.
    model : MotionModel or None
        The model to calibrate; None for the block of the study.
    posterior : bool
        Whether the values that could have given the recording are written as a table, too.
    used_flow : xarray.Dataset or None
        The flow that is used, found by the check.
    """

    recording: xr.Dataset
    study: Study
    flow: xr.Dataset | None
    body: str | None
    inputs: Mapping[str, Path]
    threads: int | None = None
    model: MotionModel | None = None
    posterior: bool = False
    used_flow: xr.Dataset | None = None

    @property
    def kind(self) -> str:
        """Name of its kind: more parameters than a grid takes are found by summaries."""
        return "model_calibration" if self._is_searched else "calibration"

    @property
    def seeds(self) -> dict[str, int]:
        """The seed of the simulations."""
        return {"calibration": self.study.calibration.seed}

    @property
    def _is_searched(self) -> bool:
        from driftwalk.calibration import MOST_PARAMETERS

        return self.model is not None and len(self.model.parameters) > MOST_PARAMETERS

    def checked(self) -> Self:
        """Return the work with the flow that it uses; refuse a recording that does not do.

        A model that needs no flow has one only if it was given.
        """
        from driftwalk.calibration import check_recording

        if self.posterior:
            self._require_draws()
        about: dict[str, Any] = {"body": self.body}
        with naming_recording(self.inputs):
            flow = self.flow
            if flow is None and (self.model is None or self.model.needs_flow):
                flow = recording_flow(self.recording, self.study, **about)
            check_recording(self.recording, self.study, flow=flow, model=self.model, **about)
        return replace(self, used_flow=flow)

    def _require_draws(self) -> None:
        """Refuse to write draws where there will be none."""
        if not self._is_searched:
            raise ConfigurationError(
                "a posterior is drawn for models with more than two parameters; with one or two, "
                "the bootstrap's estimates are in the calibration"
            )
        if self.study.calibration.bootstrap < 2 or self.study.calibration.refine == "none":
            raise ConfigurationError(
                "a posterior needs the summaries: `calibration.bootstrap` of 2 or more"
            )

    def specification(self) -> dict[str, Any]:
        """Return what determines the numbers of the calibration."""
        about_model = {} if self.model is None else {"model": self.model.describe()}
        return {**_specification(self), **about_model}

    def compute(self, run: Run) -> xr.Dataset:
        """Calibrate; return a `calibration`, or of many parameters a `model_calibration`."""
        from driftwalk.calibration import calibrate

        if self.used_flow is not None:
            run.keep("flow.nc", self.used_flow)
        run.keep("recording.nc", self.recording)
        tell = run.staged_progress({"calibration": 1.0}).stage("calibration")
        found = calibrate(
            self.recording,
            self.model,
            study=self.study,
            flow=self.flow,
            body=self.body,
            threads=self.threads,
            executor=run.executor,
            stores=run.store,
            tell=lambda stage, done, total: tell(*_overall(stage, done, total)),
            # The figures are drawn beside the last simulations, which change none of them.
            meanwhile=lambda early: run.draw({run_kind(self.kind).file: early}),
        )
        tell(100, 100, "results")
        found = run.keep_result(found)
        if self.posterior:
            run.directory.write("posterior.csv", _posterior_table(found))
        return found


def _posterior_table(found: xr.Dataset) -> bytes:
    """Return the draws as CSV, a column for each parameter with its unit in the name."""
    names, units = found["parameter"].values.tolist(), found["unit"].values.tolist()
    suffixes = [unit_suffix(unit) for unit in units]
    keys = [f"{name}_{end}" if end else name for name, end in zip(names, suffixes, strict=True)]
    rows = [",".join(map(repr, row)) for row in found["posterior_sample"].values.tolist()]
    return "\n".join([",".join(keys), *rows, ""]).encode()


def _overall(name: str, done: int, total: int) -> tuple[float, int, str]:
    stage = CALIBRATION_STAGES[name]
    return stage.percent(done / total if total else 1.0), 100, stage.words


@dataclass(frozen=True)
class ModelComparisonWork:
    """A comparison of motion models.

    Attributes
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    models : sequence of str or MotionModel
        The models, or their names.
    study : Study
        Tank, camera, step interval and seed.
    flow : xarray.Dataset or None
        A given flow field; None takes it from the recording, for the block.
    body : str or None
        The body.
    inputs : mapping of str to Path
        The files that were read, by their role.
    threads : int or None
        Threads; the result does not depend on them.
    finished : callable
        Called with each model's name, its distance, the standard error of that and the number of
        models, as soon as it is judged.
    """

    recording: xr.Dataset
    models: Sequence[str | MotionModel]
    study: Study
    flow: xr.Dataset | None
    body: str | None
    inputs: Mapping[str, Path]
    threads: int | None = None
    finished: Callable[[str, float, float, int], None] = ignore_progress

    kind: ClassVar = "model_comparison"

    @property
    def seeds(self) -> dict[str, int]:
        """The seed of the searches."""
        return {"calibration": self.study.calibration.seed}

    def checked(self) -> Self:
        """Return the work with the models of the names; refuse a recording that does not do."""
        from driftwalk.calibration import check_models

        with naming_recording(self.inputs):
            models = check_models(
                self.recording, self.models, study=self.study, flow=self.flow, body=self.body
            )
        return replace(self, models=models)

    def specification(self) -> dict[str, Any]:
        """Return what determines the numbers of the comparison, once it is checked."""
        models = [one.describe() for one in self.models if not isinstance(one, str)]
        return {**_specification(self), "models": models}

    def compute(self, run: Run) -> xr.Dataset:
        """Search and judge every model; return a `model_comparison`."""
        from driftwalk.calibration import compare_models

        run.keep("recording.nc", self.recording)
        if self.flow is not None:
            run.keep("flow.nc", self.flow)
        found = compare_models(
            self.recording,
            self.models,
            study=self.study,
            flow=self.flow,
            body=self.body,
            threads=self.threads,
            executor=run.executor,
            stores=run.store,
            tell=run.progress,
            finished=self.finished,
        )
        return run.keep_result(found)


def _specification(work: CalibrationWork | ModelComparisonWork) -> dict[str, Any]:
    """Return what determines the numbers of either, but for the models."""
    return {
        "study": work.study.to_dict(),
        "body": work.body,
        "recording_sha256": dataset_hash(work.recording, ("x", "y", "theta")),
        "flow_sha256": dataset_hash(work.flow, ("u", "v")),
    }
