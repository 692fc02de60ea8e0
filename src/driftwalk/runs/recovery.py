"""The run of a recovery study: recordings of known truth, each fitted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

from driftwalk.core.processors import default_threads
from driftwalk.runs.dataset_hash import dataset_hash

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.runs.resumable_run import Run


@dataclass(frozen=True)
class RecoveryWork:
    """A recovery study.

    Attributes
    ----------
    study : Study
        The truth and the section [recover].
    flow : xarray.Dataset or None
        The true flow; None for random ones.
    inputs : mapping of str to Path
        The files that were read, by their role.
    threads : int or None
        Fits at once; None for as many as there are processors.
    """

    study: Study
    flow: xr.Dataset | None
    inputs: Mapping[str, Path]
    threads: int | None = None

    kind: ClassVar = "recovery"

    @property
    def seeds(self) -> dict[str, int]:
        """The seed of the recordings."""
        return {"recovery": self.study.recover.seed}

    def checked(self) -> Self:
        """Refuse a truth that is not whole or cannot be fitted."""
        from driftwalk.likelihood import check_recovery

        check_recovery(self.study, self.flow)
        return self

    def specification(self) -> dict[str, Any]:
        """Return what determines the numbers of the study."""
        flow = self.flow
        return {
            "study": self.study.to_dict(),
            "flow_sha256": None if flow is None else dataset_hash(flow, ("u", "v")),
        }

    def compute(self, run: Run) -> xr.Dataset:
        """Simulate and fit the recordings; return a `recovery`."""
        from driftwalk.likelihood import recovery_study

        found = recovery_study(
            self.study,
            self.flow,
            store=run.store("recordings"),
            threads=self.threads or default_threads(),
            executor=run.executor,
            tell=lambda done, total: run.progress(done, total, "fits"),
        )
        return run.keep("recovery.nc", found)
