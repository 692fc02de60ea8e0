"""The run of a sensitivity analysis of self-assembly."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

from driftwalk.core.errors import InputError
from driftwalk.runs.dataset_hash import dataset_hash

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.runs.resumable_run import Run


@dataclass(frozen=True)
class SensitivityResult:
    """Results.

    Attributes
    ----------
    reference : xarray.Dataset
        Kind "outcome_distribution", with its realisations.
    sensitivity : xarray.Dataset
        Kind "sensitivity".
    components : xarray.Dataset or None
        Kind "components", None where nothing varies.
    indices : xarray.Dataset or None
        Kind "sobol_indices", where they were asked for.
    """

    reference: xr.Dataset
    sensitivity: xr.Dataset
    components: xr.Dataset | None
    indices: xr.Dataset | None


@dataclass(frozen=True)
class SensitivityWork:
    """A sensitivity analysis of self-assembly.

    Attributes
    ----------
    study : Study
        The reference, and what varies.
    flow : xarray.Dataset
        The flow field of the reference.
    flows : dict of str to xarray.Dataset
        Flow fields to compare, by name.
    samples : int or None
        Base samples for Sobol' indices.
    inputs : mapping of str to Path
        The files that were read, by their role.
    threads : int or None
        Threads; the result does not depend on them.
    settings : mapping of str to int
        How many settings each stage has, found by the check.
    """

    study: Study
    flow: xr.Dataset
    flows: dict[str, xr.Dataset]
    samples: int | None
    inputs: Mapping[str, Path]
    threads: int | None = None
    settings: Mapping[str, int] = field(default_factory=dict)

    kind: ClassVar = "sensitivity"

    @property
    def axes(self) -> dict[str, Any]:
        """The axes of the map, with the flow fields themselves."""
        axes: dict[str, Any] = dict(self.study.sensitivity.axes)
        return axes | ({"flow": self.flows} if "flow" in axes else {})

    @property
    def seeds(self) -> dict[str, int]:
        """The seed of the runs."""
        return {"sensitivity": self.study.sensitivity.seed}

    def checked(self) -> Self:
        """Return the work with the settings of each stage; refuse what cannot be simulated."""
        from driftwalk.assembly import check_indices, check_sensitivity

        how: dict[str, Any] = {"threads": self.threads}
        settings = {
            "reference": self.study.sensitivity.reference_realisations,
            "map": check_sensitivity(self.study, self.flow, axes=self.axes, **how),
        }
        if self.samples is not None:
            settings["Sobol"] = check_indices(self.study, self.flow, samples=self.samples, **how)
        return replace(self, settings=settings)

    def specification(self) -> dict[str, Any]:
        """Return what determines the numbers of the analysis."""
        flows = {name: dataset_hash(flow, ("u", "v")) for name, flow in self.flows.items()}
        return {
            "study": self.study.to_dict(),
            "flow_sha256": dataset_hash(self.flow, ("u", "v")),
            "flows_sha256": flows,
            "sobol_samples": self.samples,
        }

    def compute(self, run: Run) -> SensitivityResult:
        """Simulate the reference, the map and, where they are asked for, Sobol' indices."""
        from driftwalk.assembly import sensitivity_indices, sensitivity_map, sensitivity_reference

        # A setting costs the same in each stage.
        course = run.course({**self.settings, "figures": 0.0})

        def how(store: str, stage: str) -> dict[str, Any]:
            return {
                "store": run.store(store),
                "progress": course.stage(stage),
                "threads": self.threads,
                "executor": run.executor,
            }

        reference = sensitivity_reference(self.study, self.flow, **how("reference", "reference"))
        reference = run.keep("reference.nc", reference)
        found = sensitivity_map(
            self.study, self.flow, axes=self.axes, reference=reference, **how("map", "map")
        )
        found = run.keep("sensitivity.nc", found)
        components = _components(found)
        if components is not None:
            components = run.keep("components.nc", components)
        indices = None
        if self.samples is not None:
            indices = sensitivity_indices(
                self.study, self.flow, samples=self.samples, **how("sobol", "Sobol")
            )
            indices = run.keep("sobol.nc", indices)
        course.begin("figures")
        run.draw()
        return SensitivityResult(reference, found, components, indices)


def _components(sensitivity: xr.Dataset) -> xr.Dataset | None:
    """Return the principal components; None where there is one setting or all are alike."""
    from driftwalk.assembly import principal_components

    try:
        return principal_components(sensitivity)
    except InputError:
        return None
