"""The runs about outcomes of self-assembly: kinetics, parameters inferred from outcomes, yield."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final, Self

from driftwalk.model import Study
from driftwalk.runs.assembly import table_hash
from driftwalk.runs.resumable_run import dataset_hash

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.assembly.outcome_posterior.records import Outcomes
    from driftwalk.runs.resumable_run import Run


HISTORY: Final = ("outcome", "event_time", "event_class", "end_time", "split_time", "split_class")
"""Variables that say what happened to blocks, of a simulation or of a recording."""


@dataclass(frozen=True)
class KineticsWork:
    """Kinetics.

    Attributes
    ----------
    sets : sequence of sequence of xarray.Dataset
        One or two data sets, each of `assembly` and `classification` datasets.
    target : str or None
        Outcome class to be reached.
    blocks : int or None
        Another number of blocks, to extrapolate to.
    seed : int
        Seed of the bootstrap.
    inputs : mapping of str to Path
        The files that were read, by their role.
    study : Study
        For the manifest: nothing of it is used.
    """

    sets: Sequence[Sequence[xr.Dataset]]
    target: str | None = None
    blocks: int | None = None
    seed: int = 1
    inputs: Mapping[str, Path] = field(default_factory=dict)
    study: Study = field(default_factory=Study)

    kind: ClassVar = "kinetics"

    @property
    def seeds(self) -> dict[str, int]:
        """The seed of the bootstrap."""
        return {"kinetics": self.seed}

    def checked(self) -> Self:
        """Refuse data sets that cannot tell, and a target that they do not have."""
        from driftwalk.assembly import check_kinetics

        check_kinetics(*self.sets, target=self.target, blocks=self.blocks)
        return self

    def specification(self) -> dict[str, Any]:
        """Return what determines the numbers."""
        return {
            "histories_sha256": [
                [dataset_hash(one, (), where_held=HISTORY) for one in found] for found in self.sets
            ],
            "target": self.target,
            "blocks": self.blocks,
            "seed": self.seed,
        }

    def compute(self, run: Run) -> xr.Dataset:
        """Fit the chains, choose one and keep it."""
        from driftwalk.assembly import kinetics

        found = kinetics(
            *self.sets,
            target=self.target,
            blocks=self.blocks,
            seed=self.seed,
            store=run.store,
            executor=run.executor,
            progress=lambda done, total: run.progress(done, total, "models"),
        )
        return run.keep_result(found)


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
        return run.keep_result(found)


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
        return run.keep_result(found)
