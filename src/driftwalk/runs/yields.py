"""The run of a maximised yield: which setting gives the most of a target."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

from driftwalk.runs.assembly import table_hash
from driftwalk.runs.resumable_run import dataset_hash

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.runs.resumable_run import Run


@dataclass(frozen=True)
class YieldWork:
    """A maximised yield.

    Attributes
    ----------
    study : Study
        The model, and in [sensitivity] the values to compare.
    flow : xarray.Dataset
        The flow field of settings without one of their own.
    options : mapping
        The other arguments of `driftwalk.assembly.maximise_yield`: target, by, ranges, runs,
        fresh_runs, indifference.
    flows : mapping of str to xarray.Dataset
        Flow fields to compare, by name.
    inputs : mapping of str to Path
        The files that were read, by their role.
    threads : int or None
        Threads; the result does not depend on them.
    """

    study: Study
    flow: xr.Dataset
    options: Mapping[str, Any]
    flows: Mapping[str, xr.Dataset] = field(default_factory=dict)
    inputs: Mapping[str, Path] = field(default_factory=dict)
    threads: int | None = None

    kind: ClassVar = "yield"

    @property
    def seeds(self) -> dict[str, int]:
        """The seed of the runs."""
        return {"yield": self.study.sensitivity.seed}

    @property
    def _arguments(self) -> dict[str, Any]:
        axes: dict[str, Any] = dict(self.study.sensitivity.lists)
        return {
            **self.options,
            "axes": axes | ({"flow": dict(self.flows)} if "flow" in axes else {}),
            "threads": self.threads,
        }

    def checked(self) -> Self:
        """Refuse a target, a time and settings that cannot be."""
        from driftwalk.assembly import check_yield

        check_yield(self.study, self.flow, **self._arguments)
        return self

    def specification(self) -> dict[str, Any]:
        """Return what determines the numbers."""
        return {
            "study": self.study.to_dict(),
            "flow_sha256": dataset_hash(self.flow, ("u", "v")),
            "flows_sha256": {k: dataset_hash(one, ("u", "v")) for k, one in self.flows.items()},
            **self.options,
            **table_hash(self.study),
        }

    def compute(self, run: Run) -> xr.Dataset:
        """Choose the setting, and simulate it again."""
        from driftwalk.assembly import maximise_yield

        found = maximise_yield(
            self.study,
            self.flow,
            **self._arguments,
            store=run.store,
            executor=run.executor,
            progress=lambda done, total: run.progress(done, total, "runs"),
        )
        return run.keep("yields.nc", found)
