"""The run of parameters from outcomes alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

from driftwalk.runs.resumable_run import dataset_hash

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.assembly.outcome_posterior.observed import Outcomes
    from driftwalk.model import Study
    from driftwalk.runs.resumable_run import Run


@dataclass(frozen=True)
class OutcomePosteriorWork:
    """Parameters from outcomes alone.

    Attributes
    ----------
    outcomes : mapping, sequence of Record, or sequence of xarray.Dataset
        As `driftwalk.assembly.infer_outcomes` takes them.
    flow : xarray.Dataset
        The flow field.
    study : Study
        All else about the tank and the blocks.
    options : mapping
        ``vary``, ``after``, ``runs``, ``truths``, ``seed`` of `driftwalk.assembly.infer_outcomes`.
    inputs : mapping of str to Path
        The files that were read, by their role.
    threads : int or None
        Threads; the result does not depend on them.
    """

    outcomes: Outcomes | xr.Dataset
    flow: xr.Dataset
    study: Study
    options: Mapping[str, Any] = field(default_factory=dict)
    inputs: Mapping[str, Path] = field(default_factory=dict)
    threads: int | None = None

    kind: ClassVar = "outcome_posterior"

    @property
    def seeds(self) -> dict[str, int]:
        """The seed of the simulations."""
        return {"outcomes": int(self.options.get("seed", 1))}

    def checked(self) -> Self:
        """Refuse outcomes that are none of the study, and ranges that cannot be simulated."""
        from driftwalk.assembly import check_outcomes

        check_outcomes(self.outcomes, self.flow, self.study, **self.options, threads=self.threads)
        return self

    def specification(self) -> dict[str, Any]:
        """Return what determines the numbers."""
        from driftwalk.assembly import check_outcomes

        problem = check_outcomes(self.outcomes, self.flow, self.study, **self.options)
        records = repr(sorted(problem.observed.records, key=repr))
        return {
            "study": problem.study.to_dict(),
            "flow_sha256": dataset_hash(self.flow, ("u", "v")),
            "outcomes_sha256": sha256(records.encode()).hexdigest(),
            "vary": {
                name: [float(low), float(high)]
                for name, low, high in zip(problem.names, problem.low, problem.high, strict=True)
            },
            "truths": problem.truths,
        }

    def compute(self, run: Run) -> xr.Dataset:
        """Refine the emulator, check it, and keep the posterior."""
        from driftwalk.assembly import infer_outcomes

        found = infer_outcomes(
            self.outcomes,
            self.flow,
            self.study,
            **self.options,
            store=run.store,
            executor=run.executor,
            threads=self.threads,
            progress=lambda done, total: run.progress(done, total, "runs"),
        )
        return run.keep("posterior.nc", found)
