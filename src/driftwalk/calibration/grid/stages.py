"""The stages of a grid calibration: coarse map, refined map, bootstrap; and their dataset."""

from __future__ import annotations

from collections.abc import Callable, Container, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from driftwalk.calibration.goodness_of_fit import (
    GoodnessOfFit,
    goodness_of_fit,
    noise_floor_at,
    within_chance,
)
from driftwalk.calibration.grid.bootstrap_region import (
    Bootstrap,
    Region,
    build_surface,
    confidence_region,
    run_bootstrap,
)
from driftwalk.calibration.grid.energy_score import Optimum
from driftwalk.calibration.grid.grid_map import Map, MapSimulator, SweepProgress, window_id
from driftwalk.calibration.grid.grid_refinement import (
    RefinedMap,
    better_cell,
    first_window,
    locate_minimum,
    refine,
)
from driftwalk.calibration.problem import Execution, Problem, limits_of
from driftwalk.calibration.warnings import (
    Boundary,
    drawn_distance,
    interval_warnings,
    optimum_warnings,
    step_differences,
    undetermined,
)
from driftwalk.core.calibration_stages import share_of_map, share_of_windows
from driftwalk.core.errors import InputError
from driftwalk.motion.protocol import no_numbers
from driftwalk.motion.score import broken_worlds
from driftwalk.schema.answers.verdict import Verdict, verdict_of


class GridCalibration:
    """The stages in their order, and what each leaves for the next."""

    def __init__(self, problem: Problem, how: Execution) -> None:
        self.problem = problem
        self.warnings: list[str] = []
        self.against: list[str] = []
        self.unable: list[str] = []
        self.bootstrap: Bootstrap | None = None
        self.quality: GoodnessOfFit | None = None
        self.region: Region | None = None
        self._how = how

    @property
    def verdict(self) -> Verdict | None:
        """Whether the model explains the recording; None without a bootstrap."""
        return None if self.quality is None else verdict_of(self.against, self.unable)

    def run(self) -> GridCalibration:
        """Run every stage that the study asks for."""
        search = self.problem.study.calibration
        self.coarse = self._coarse_map(search.replicates)
        self._require_numbers()
        cell = self.coarse.cell_of_minimum()
        self.optimum = Optimum(self.coarse.point(cell), float(self.coarse.mean[cell]))
        self.refined: RefinedMap | None = None
        if search.refine == "auto":
            self._refine(search.refined_replicates)
        at_ends = optimum_warnings(self.problem.parameters, self.coarse.axes, self.optimum.point)
        # No search goes on beyond 0.
        extensible = [
            text
            for (index, side), text in at_ends.items()
            if self.problem.parameters[index].to_value(self.coarse.axes[index][side]) != 0.0
        ]
        self.warnings += [text for text in at_ends.values() if text not in extensible]
        self.unable += extensible
        if search.bootstrap >= 2 and self.refined is not None:
            self._bootstrap(self.refined, search.bootstrap, at_ends)
            self._say_how_far(at_end=bool(extensible))
        return self

    def _coarse_map(self, replicates: int) -> Map:
        """Return the coarse map: one replicate of every setting, all where the optimum could be."""
        axes = tuple(np.array(one.coordinates) for one in self.problem.parameters)
        maps = replace(self._maps("coarse", share_of_map), details="all", apart=False)
        once = maps.full(axes, 1)
        self.floor = noise_floor_at(self.problem, once.point(once.cell_of_minimum()))
        return maps.more(once, once.mean <= once.mean.min() + self.floor, replicates)

    def _require_numbers(self) -> None:
        """Refuse a model that has lost its numbers in every world."""
        if not broken_worlds(self.coarse.arrays["status"])[self.coarse.simulated].all():
            return
        first = self.coarse.point((0,) * len(self.coarse.axes))
        setting = {
            one.name: float(one.to_value(value))
            for one, value in zip(self.problem.parameters, first, strict=True)
        }
        raise InputError(no_numbers(self.problem.model.name, setting))

    def _maps(self, stage: str, share_of: Callable[[Sequence[float]], float]) -> MapSimulator:
        how = self._how
        progress = SweepProgress(partial(how.tell, stage), share_of)
        return MapSimulator(
            self.problem, stage, stores=how.stores, executor=how.executor, progress=progress
        )

    def _refine(self, wanted: int) -> None:
        limits = limits_of(self.problem)
        maps = self._maps("refined", share_of_windows)
        located = locate_minimum(maps, first_window(self.coarse, self.floor), limits)
        self.refined = refine(maps, located, limits, self.problem.refined_steps, wanted)
        self.optimum = self.refined.energy_score.optimum
        cell = better_cell(self.refined.map, self.refined.energy_score)
        if cell is not None:
            self.unable.append(self._unresolved(self.refined.map.point(cell)))

    def _unresolved(self, point: Sequence[float]) -> str:
        """Return the warning of a setting that is nearer to the recording than the optimum."""
        place = ", ".join(
            f"{one.label} = {float(one.to_value(value)):.4g}"
            for one, value in zip(self.problem.parameters, point, strict=True)
        )
        return (
            f"the setting {place} is closer to the recording than the optimum, by more than "
            "chance: the valley is narrower than the refined grid resolves, and the intervals are "
            "wider than stated"
        )

    def _bootstrap(self, refined: RefinedMap, count: int, known: Container[Boundary]) -> None:
        surface = build_surface(self.problem, refined)
        energy_score = refined.energy_score
        # A moved optimum, window or surface makes other recordings: finished ones do not count.
        fingerprint = {
            "optimum": [*self.optimum.point, self.optimum.distance],
            "axes": [axis.tolist() for axis in surface.axes],
            "settings": len(surface.apart),
            "count": count,
        }
        self.bootstrap = run_bootstrap(
            self.problem,
            energy_score,
            surface,
            count=count,
            store=self._how.stores(f"bootstrap-{window_id(refined.map.axes)}", fingerprint),
            executor=self._how.executor,
            progress=partial(self._how.tell, "bootstrap"),
        )
        # From here on the floor is that of recordings as long as the real one, at the optimum.
        self.quality = goodness_of_fit(self.bootstrap)
        self.floor = self.quality.floor
        self.region = confidence_region(
            energy_score.smoother,
            within_chance(energy_score, self.bootstrap, self.quality.stretch),
            self.bootstrap,
            confidence=self.problem.study.calibration.confidence,
            stretch=self.quality.stretch,
        )
        self.unable += interval_warnings(
            self.problem.parameters,
            self.region.intervals,
            self.bootstrap.estimates,
            border=self.region.border,
            search=self.coarse.axes,
            window=refined.map.axes,
            lattice=surface.axes,
            steps=self.problem.refined_steps,
            known=known,
        )
        self.unable += undetermined(
            self.problem.parameters, self.region.intervals, self.optimum.point
        )

    def _say_how_far(self, *, at_end: bool) -> None:
        """Say where the model differs, or why that tells nothing of the model."""
        quality, bootstrap = self.quality, self.bootstrap
        if quality is None or bootstrap is None or quality.explained:
            return
        far = (
            f"D = {quality.distance:.3f} at the optimum is {quality.distance / quality.floor:.1f} "
            f"times the noise floor {quality.floor:.3f}"
        )
        drawn = drawn_distance(self.problem, bootstrap)
        if at_end:
            self.unable.append(f"{far}, and other values than the searched ones may be closer")
        elif quality.distance <= drawn:
            self.unable.append(
                f"{far}, but simulations with other values that chance allows are {drawn:.3f} "
                "apart: record longer"
            )
        else:
            self.against += [
                f"{far}; the parameters are the best of bad fits",
                *step_differences(self.problem, self.optimum.point),
            ]
