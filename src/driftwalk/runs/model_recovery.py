"""The run of a recovery study of a motion model: recordings of known truth, each calibrated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self

from driftwalk.runs.dataset_hash import dataset_hash

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.motion import MotionModel
    from driftwalk.runs.resumable_run import Run


@dataclass(frozen=True)
class ModelRecoveryWork:
    """A recovery study of a motion model.

    Attributes
    ----------
    model : MotionModel
        The model; its parameters are those that are estimated.
    truth : mapping of str to float
        Their true values.
    study : Study
        Tank, camera, search, and the section [recover].
    flow : xarray.Dataset or None
        The water's velocity.
    like : xarray.Dataset or None
        A `trajectory` that gives start, time stamps, gaps and camera.
    body : str or None
        Its body.
    inputs : mapping of str to Path
        The files that were read, by their role.
    threads : int or None
        Threads; the result does not depend on them.
    noise : {"estimated", "known"}
        Whether the calibrations know the noise of the camera.
    """

    model: MotionModel
    truth: Mapping[str, float]
    study: Study
    flow: xr.Dataset | None
    like: xr.Dataset | None
    body: str | None
    inputs: Mapping[str, Path]
    threads: int | None = None
    noise: Literal["estimated", "known"] = "estimated"

    kind: ClassVar = "model_recovery"

    @property
    def seeds(self) -> dict[str, int]:
        """The seed of the recordings."""
        return {"recovery": self.study.recover.seed}

    @property
    def _conditions(self) -> dict[str, Any]:
        return {"flow": self.flow, "like": self.like, "body": self.body, "noise": self.noise}

    def checked(self) -> Self:
        """Refuse true values that are not complete, and recordings that cannot be made."""
        from driftwalk.calibration import check_model_recovery

        check_model_recovery(self.model, self.truth, self.study, **self._conditions)
        return self

    def specification(self) -> dict[str, Any]:
        """Return what determines the numbers of the study."""
        like, flow = self.like, self.flow
        return {
            "model": self.model.describe(),
            "truth": dict(self.truth),
            "study": self.study.to_dict(),
            "body": self.body,
            "noise": self.noise,
            "like_sha256": None if like is None else dataset_hash(like, ("x", "y", "theta")),
            "flow_sha256": None if flow is None else dataset_hash(flow, ("u", "v")),
        }

    def compute(self, run: Run) -> xr.Dataset:
        """Simulate and calibrate the recordings; return a `model_recovery`."""
        from driftwalk.calibration import recover_model

        found = recover_model(
            self.model,
            self.truth,
            self.study,
            **self._conditions,
            threads=self.threads,
            executor=run.executor,
            store=run.store("recordings"),
            tell=run.course({"recordings": 1.0}).stage("recordings"),
        )
        return run.keep("model_recovery.nc", found)
