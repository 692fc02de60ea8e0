"""The runs of self-assembly, with its distributions and a film, and of its sensitivity analysis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final, Self

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.runs.resumable_run import FLOW_ERRORS, dataset_hash

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.runs.resumable_run import Run


FIXED_TRIAL: Final = 0
"""Trial of the runs at the stated parameters."""
DRAWN_TRIAL: Final = 1
"""The two sets of runs have different random numbers, so that they can be compared."""
REGION: Final[tuple[str, ...]] = ("region_drag_coefficient", "region_force_std", "refined_surface")
"""Variables of a calibration that parameters are drawn from."""
COVARIANCE: Final[tuple[str, ...]] = ("estimate", "covariance")
"""Those of a fit."""
PATH_RUNS: Final = 4
"""Runs whose paths are kept, for the film and the page; chosen by hand."""
PATH_INTERVAL_S: Final = 0.1
"""Time between samples of such a path [s]: ten frames a second are smooth to the eye."""
PATH_SAMPLES: Final = 6000
"""Most samples of a path that is kept; longer runs are sampled more rarely; chosen by hand."""


@dataclass(frozen=True)
class AssemblyResult:
    """Results, by the names of their files.

    Attributes
    ----------
    assembly : xarray.Dataset
        Kind "assembly", of runs with the study's parameters.
    distribution : xarray.Dataset
        Kind "outcome_distribution", of the same runs.
    class_times : xarray.Dataset
        Kind "class_times", of the same runs.
    distribution_drawn : xarray.Dataset or None
        Kind "outcome_distribution", of runs with drawn parameters.
    sizes, sizes_drawn : xarray.Dataset or None
        Kind "assembly_sizes", of the same two sets of runs; beyond 8 blocks only.
    steady_state : xarray.Dataset or None
        Kind "steady_state", of the runs with the study's parameters; where bonds break only.
    attraction : xarray.Dataset or None
        Kind "attraction", where blocks feel each other at a distance.
    """

    assembly: xr.Dataset
    distribution: xr.Dataset
    class_times: xr.Dataset
    distribution_drawn: xr.Dataset | None
    sizes: xr.Dataset | None = None
    sizes_drawn: xr.Dataset | None = None
    steady_state: xr.Dataset | None = None
    attraction: xr.Dataset | None = None


@dataclass(frozen=True)
class AssemblyWork:
    """Self-assembly.

    Attributes
    ----------
    study : Study
        The model, and what is simulated.
    flow : xarray.Dataset
        The flow field.
    calibration : xarray.Dataset or None
        A `calibration` or a `fit` to draw parameters from, too.
    inputs : mapping of str to Path
        The files that were read, by their role.
    threads : int or None
        Threads; the result does not depend on them.
    film : {"gif", "mp4", "none"}
        Format of a film of the first run, or none.
    quantiles : mapping of str to ndarray
        Further numbers to draw, see `driftwalk.assembly.assemble_drawn`.
    """

    study: Study
    flow: xr.Dataset
    calibration: xr.Dataset | None
    inputs: Mapping[str, Path]
    threads: int | None = None
    film: str = "none"
    quantiles: Mapping[str, Floats] = field(default_factory=dict)

    kind: ClassVar = "assembly"

    @property
    def seeds(self) -> dict[str, int]:
        """The seed of the runs."""
        return {"assembly": self.study.assembly.seed}

    def checked(self) -> Self:
        """Refuse blocks that do not fit and a flow that does not cover the tank."""
        from driftwalk.assembly import check_assembly

        trials = (FIXED_TRIAL,) if self.calibration is None else (FIXED_TRIAL, DRAWN_TRIAL)
        for trial in trials:
            check_assembly(self.study, self.flow, trial=trial, threads=self.threads)
        return self

    def specification(self) -> dict[str, Any]:
        """Return what determines the numbers of the runs."""
        from driftwalk.assembly.runs.draws import drawn_from

        found = self.calibration
        by_covariance = found is not None and drawn_from(found) == "covariance"
        drawn = {key: values.tolist() for key, values in self.quantiles.items()}
        return {
            "study": self.study.to_dict(),
            "flow_sha256": dataset_hash(self.flow, ("u", "v"), where_held=FLOW_ERRORS),
            "calibration_sha256": dataset_hash(found, COVARIANCE if by_covariance else REGION),
            **({"quantiles": drawn} if drawn else {}),
            **table_hash(self.study),
        }

    def compute(self, run: Run) -> AssemblyResult:
        """Simulate with the parameters found and, where they can be drawn, with drawn ones."""
        from driftwalk.assembly import (
            assemble,
            assemble_drawn,
            assembly_path,
            attraction,
            class_times,
            steady_state,
        )

        settings, table = self.study.assembly, table_hash(self.study)
        staged = run.staged_progress(self._usual_parts())
        how: dict[str, Any] = {"threads": self.threads, "executor": run.executor}
        assembly = assemble(
            self.study,
            self.flow,
            trial=FIXED_TRIAL,
            store=run.store("fixed"),
            progress=staged.stage("runs"),
            **how,
        )
        assembly = run.keep_result(assembly)
        self._keep_outcomes(assembly, run, "")
        pull = attraction(self.study)
        if pull is not None:
            run.keep("attraction.nc", pull)
        run.keep("class_times.nc", class_times(assembly, confidence=settings.confidence))
        if settings.bonds_break:
            run.keep("steady_state.nc", steady_state(assembly, confidence=settings.confidence))
        if self.calibration is not None:
            drawn = assemble_drawn(
                self.study,
                self.flow,
                self.calibration,
                quantiles=self.quantiles,
                trial=DRAWN_TRIAL,
                store=run.store("drawn"),
                progress=staged.stage("runs, drawn parameters"),
                **how,
            )
            run.keep("assembly_drawn.nc", drawn)
            self._keep_outcomes(drawn, run, "_drawn")
        # Paths would fill a disk: a few runs are simulated again, with the same random numbers.
        path = assembly_path(
            self.study,
            self.flow,
            runs=range(min(settings.runs, PATH_RUNS)),
            sample_interval=max(PATH_INTERVAL_S, settings.duration_s / PATH_SAMPLES),
            trial=FIXED_TRIAL,
            threads=self.threads,
        )
        if table_hash(self.study) != table:
            raise InputError(
                f"{self.study.interaction.attraction} has changed during the run: start it again"
            )
        path = run.keep("path.nc", path)
        staged.begin("figures")
        run.draw()
        if self.film != "none":
            import driftwalk.plot

            staged.begin("film")
            film = run.directory.folder("figures") / f"run.{self.film}"
            driftwalk.plot.write_animation(path, film)
        kept: dict[str, Any] = {
            one.name: run.datasets.get(f"{one.name}.nc") for one in fields(AssemblyResult)
        }
        return AssemblyResult(**kept)

    def _keep_outcomes(self, assembly: xr.Dataset, run: Run, ending: str) -> None:
        """Keep the distribution of a set of runs and, beyond 8 blocks, their sizes."""
        from driftwalk.assembly import assembly_sizes, outcome_distribution
        from driftwalk.assembly.outcomes.outcome_classes import MOST_BLOCKS

        confidence = self.study.assembly.confidence
        distribution = outcome_distribution(assembly, confidence=confidence)
        run.keep(f"distribution{ending}.nc", distribution)
        if self.study.assembly.blocks > MOST_BLOCKS:
            run.keep(f"sizes{ending}.nc", assembly_sizes(assembly, confidence=confidence))

    def _usual_parts(self) -> dict[str, float]:
        """Return how long each stage takes, of hundred runs: the figures are a small part of it."""
        return {
            "runs": 8.0,
            **({} if self.calibration is None else {"runs, drawn parameters": 8.0}),
            "figures": 1.0,
            **({} if self.film == "none" else {"film": 1.0}),
        }


def table_hash(study: Study) -> dict[str, str]:
    """Return the hash of a table of attractions: a run goes on only with the same one."""
    table = study.interaction.attraction
    if table is None:
        return {}
    return {"attraction_sha256": sha256(Path(table).read_bytes()).hexdigest()}


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
        return {
            "study": self.study.to_dict(),
            "flow_sha256": dataset_hash(self.flow, ("u", "v")),
            "flows_sha256": {key: dataset_hash(one, ("u", "v")) for key, one in self.flows.items()},
            "sobol_samples": self.samples,
            **table_hash(self.study),
        }

    def compute(self, run: Run) -> SensitivityResult:
        """Simulate the reference, the map and, where they are asked for, Sobol' indices."""
        from driftwalk.assembly import (
            principal_components,
            sensitivity_indices,
            sensitivity_map,
            sensitivity_reference,
        )

        # A setting costs the same in each stage.
        staged = run.staged_progress({**self.settings, "figures": 0.0})

        def how(store: str, stage: str) -> dict[str, Any]:
            return {
                "store": run.store(store),
                "progress": staged.stage(stage),
                "threads": self.threads,
                "executor": run.executor,
            }

        reference = sensitivity_reference(self.study, self.flow, **how("reference", "reference"))
        reference = run.keep("reference.nc", reference)
        found = sensitivity_map(
            self.study, self.flow, axes=self.axes, reference=reference, **how("map", "map")
        )
        found = run.keep_result(found)
        try:
            components = principal_components(found)
        except InputError:
            pass  # One setting, or all are alike: there are none.
        else:
            run.keep("components.nc", components)
        if self.samples is not None:
            indices = sensitivity_indices(
                self.study, self.flow, samples=self.samples, **how("sobol", "Sobol")
            )
            run.keep("sobol.nc", indices)
        staged.begin("figures")
        run.draw()
        return SensitivityResult(
            reference, found, run.datasets.get("components.nc"), run.datasets.get("sobol.nc")
        )
