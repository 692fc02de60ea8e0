"""The run of a comparison of motion models."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

from driftwalk.core.run_stages import tell_nobody
from driftwalk.runs.dataset_hash import dataset_hash
from driftwalk.runs.resumable_run import naming_recording

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.motion import MotionModel
    from driftwalk.runs.resumable_run import Run


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
    finished: Callable[[str, float, float, int], None] = tell_nobody

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
        return {
            "models": [one.describe() for one in self.models if not isinstance(one, str)],
            "study": self.study.to_dict(),
            "body": self.body,
            "recording_sha256": dataset_hash(self.recording, ("x", "y", "theta")),
            "flow_sha256": None if self.flow is None else dataset_hash(self.flow, ("u", "v")),
        }

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
        return run.keep("comparison.nc", found)
