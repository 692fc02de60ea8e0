"""The run of the kinetics of self-assembly: rates between the outcome classes of other runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

from driftwalk.runs.resumable_run import dataset_hash

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.runs.resumable_run import Run


def _no_study() -> Study:
    from driftwalk.model import Study

    return Study()


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
    study: Study = field(default_factory=_no_study)

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
            "histories_sha256": [[_hash(one) for one in found] for found in self.sets],
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
        return run.keep("kinetics.nc", found)


def _hash(found: xr.Dataset) -> str | None:
    names = ("outcome", "event_time", "event_class", "end_time", "split_time", "split_class")
    return dataset_hash(found, tuple(name for name in names if name in found))
