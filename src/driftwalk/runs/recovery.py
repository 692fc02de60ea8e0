"""The run of a recovery study: recordings of known truth, each fitted or calibrated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from driftwalk.core.processors import default_threads
from driftwalk.runs.resumable_run import dataset_hash

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.calibration import ModelRecovery
    from driftwalk.likelihood import FitRecovery
    from driftwalk.model import Study
    from driftwalk.runs.resumable_run import Run


@dataclass(frozen=True)
class RecoveryWork:
    """A recovery study.

    Attributes
    ----------
    method : FitRecovery or ModelRecovery
        The truth, and the way to estimate it.
    inputs : mapping of str to Path
        The files that were read, by their role.
    threads : int or None
        Fits at once, or threads of a calibration; None for as many as there are processors.
    """

    method: FitRecovery | ModelRecovery
    inputs: Mapping[str, Path]
    threads: int | None = None

    @property
    def kind(self) -> str:
        """Name of its kind."""
        return self.method.kind

    @property
    def study(self) -> Study:
        """The study, with the section [recover]."""
        return self.method.study

    @property
    def seeds(self) -> dict[str, int]:
        """The seed of the recordings."""
        return {"recovery": self.study.recover.seed}

    def checked(self) -> Self:
        """Refuse a truth that is not whole or cannot be estimated."""
        self.method.check()
        return self

    def specification(self) -> dict[str, Any]:
        """Return what determines the numbers of the study."""
        from driftwalk.calibration import ModelRecovery

        method = self.method
        said: dict[str, Any] = {
            "study": self.study.to_dict(),
            "flow_sha256": dataset_hash(method.flow, ("u", "v")),
        }
        if not isinstance(method, ModelRecovery):
            return said
        return said | {
            "model": method.model.describe(),
            "truth": dict(method.truth),
            "body": method.body,
            "noise": method.noise,
            "like_sha256": dataset_hash(method.like, ("x", "y", "theta")),
        }

    def compute(self, run: Run) -> xr.Dataset:
        """Simulate and estimate the recordings; return a `recovery` or a `model_recovery`."""
        # A worker has one thread, where none are asked for.
        threads = self.threads or (None if run.executor else default_threads())
        found = self.method.recover(
            store=run.store("recordings"),
            threads=threads,
            executor=run.executor,
            tell=run.progress,
        )
        return run.keep_result(found)
