"""The whole calibration: which parameters fit a recording, and how well they are known."""

from __future__ import annotations

from collections.abc import Callable, Container, Sequence
from concurrent.futures import Executor
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.calibration.estimation import Stores, Tell, calibrate_many
from driftwalk.calibration.flow_warning import own_flow_warning
from driftwalk.calibration.goodness_of_fit import (
    FAR_ABOVE_FLOOR,
    GoodnessOfFit,
    Halves,
    goodness_of_fit,
    noise_floor_at,
    validate_on_halves,
)
from driftwalk.calibration.grid.bootstrap_region import (
    Bootstrap,
    Region,
    build_surface,
    confidence_region,
    run_bootstrap,
)
from driftwalk.calibration.grid.boundary_warnings import (
    Boundary,
    interval_warnings,
    optimum_warnings,
)
from driftwalk.calibration.grid.grid_map import Map, Progress
from driftwalk.calibration.grid.grid_refinement import (
    RefinedMap,
    better_cell,
    first_window,
    locate_minimum,
    refine,
)
from driftwalk.calibration.grid.map_stores import MapSimulator, SweepProgress, window_id
from driftwalk.calibration.grid.surface import Optimum, at_settings
from driftwalk.calibration.problem import Problem, limits_of, prepare_problem
from driftwalk.calibration.refuse import MOST_PARAMETERS, require_samples, require_searchable
from driftwalk.calibration.result import (
    CalibrationParts,
    answer_facts,
    build_calibration,
    estimate_facts,
    interval_facts,
)
from driftwalk.calibration.stationarity import Stationarity, stationarity_of
from driftwalk.calibration.wall import wall_warning
from driftwalk.comparison import Statistic, StepDistance
from driftwalk.conditions import (
    jump_warnings,
    neighbours_of,
    recorded_camera,
    require_travel,
    study_in_arena,
    unstated_warning,
)
from driftwalk.core.background_task import run_in_background
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.core.run_stages import share_of_map, share_of_windows, tell_nobody
from driftwalk.motion import BlockModel, Details, MotionModel, ParticleModel
from driftwalk.motion.batches import no_numbers
from driftwalk.motion.protocol import ScoresItself
from driftwalk.motion.score import broken_worlds
from driftwalk.schema import Track, body_track
from driftwalk.simulation.series import series_warnings

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.sweep import Store

FlowSource = Callable[[Track], "xr.Dataset | None"]


def calibrate(
    recording: xr.Dataset,
    model: MotionModel | Study | None = None,
    *,
    study: Study | None = None,
    statistic: Statistic | None = None,
    flow: xr.Dataset | None = None,
    body: str | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    stores: Stores | None = None,
    tell: Tell | None = None,
    meanwhile: Callable[[xr.Dataset], object] | None = None,
) -> xr.Dataset:
    """Find the parameters of a motion model that explain a recording.

    An exhaustive grid over the model's parameters, one or two: every setting is simulated as long
    as the recording, at its time stamps, with its gaps, start and camera noise, and its step
    lengths and turning angles are compared with the recording's by the two-dimensional
    Kolmogorov-Smirnov distance. A second, finer pass around the minimum follows; the optimum is
    that of a smooth surface through it. A parametric bootstrap gives the intervals and the joint
    region, and the distance at the optimum is judged against the noise floor. With the block in
    stirred water, the default, this is the paper's calibration of (C_d, sigma_F).

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    model : MotionModel or Study, optional
        What is calibrated: a `motion_model`, or the block of a study.
    study : Study, optional
        Tank, observation, step interval and search; default: that of `model`, else the paper's,
        for a `motion_model` in the arena of the recording. The ranges are the model's.
    statistic : Statistic, optional
        The distance that is made small; default: `StepDistance`.
    flow : xarray.Dataset, optional
        The water's velocity. For the block it is extracted from the recording when left out.
    body : str, optional
        The body, where the recording has several.
    threads : int, optional
        Default: all processors. The result does not depend on it.
    executor : concurrent.futures.Executor, optional
        Computes the work units of maps, bootstrap and summaries elsewhere, with one thread each;
        see `driftwalk.sweep.run_sweep`. The rest runs here. The result does not depend on it.
    stores : callable, optional
        Where each stage keeps finished work (`driftwalk.core.files.rundir`); memory when left out.
    tell : callable, optional
        Called with the stage and its progress: ``tell("map", 64, 1681)``.
    meanwhile : callable, optional
        Called once with the calibration, as soon as all of it is known that figures show. The
        block's is still without its two halves, which other threads compare in the meantime, if
        there may be several.

    Returns
    -------
    xarray.Dataset
        A `calibration`. ``estimate`` and ``interval`` are the answer, by parameter:
        ``drag_coefficient`` and ``force_std`` [N] of the block. ``optimum_ks_distance`` is to be
        compared with ``noise_floor``; ``explained`` and ``warning`` say what comes of that. Of the
        block also ``force_interval`` [s] and ``force_noise_intensity`` [N2 s], which is what the
        recording can tell.

    Raises
    ------
    InputError
        When the recording is too short, does not move, or several bodies are there and none named;
        when the model has more than two parameters.

    Notes
    -----
    A small distance does not certify the parameters: an error of the flow field is absorbed by
    them (docs/explanation/calibration.md).

    Examples
    --------
    >>> import driftwalk as dw
    >>> found = dw.calibrate(dw.tank30_recording(), flow=dw.tank30_flow())  # doctest: +SKIP
    >>> found["estimate"].sel(parameter="drag_coefficient").item()  # doctest: +SKIP
    0.39
    """
    chosen, searched = _study_and_model(model, study, recording)
    if len(searched.parameters) > MOST_PARAMETERS:
        if statistic is not None:
            raise ConfigurationError(
                f"a statistic of its own is for one or two parameters; {searched.name} has "
                f"{len(searched.parameters)}"
            )
        many = calibrate_many(
            recording,
            searched,
            chosen,
            flow=flow,
            body=body,
            threads=threads,
            executor=executor,
            stores=stores if stores is not None else _in_memory,
            tell=tell if tell is not None else tell_nobody,
        )
        if meanwhile is not None:
            meanwhile(many)
        return many
    require_searchable(searched)
    track = body_track(recording, body)
    require_samples(track)
    of_block = isinstance(searched, BlockModel)
    require_travel(track, chosen, of_block=of_block)
    quantum = float(recording.attrs.get("position_quantum_m", 0.0))
    flow_of = _flow_source(chosen, searched, flow)
    camera = recorded_camera(track, chosen, position_quantum=quantum)
    others = neighbours_of(recording, body, chosen.tank)
    problem = prepare_problem(
        track,
        chosen,
        flow_of(track),
        camera=camera,
        model=searched,
        statistic=statistic,
        neighbours=others,
        threads=threads,
    )
    keep = stores if stores is not None else _in_memory
    say = tell if tell is not None else tell_nobody
    result = _Calibration(problem, keep, say, executor).run()
    is_block = isinstance(searched, BlockModel)
    in_tank = is_block or isinstance(searched, ParticleModel)
    unstated = unstated_warning(chosen, about="block" if is_block else "tank") if in_tank else None
    of_wall = wall_warning(track, chosen) if is_block else None
    stationarity = stationarity_of(problem)
    of_time = None if stationarity is None else stationarity.warning
    of_flow = own_flow_warning(searched, result.quality) if flow is None else None
    result.warnings += jump_warnings(recording, body, track=track)
    said = (unstated, of_flow, of_wall, of_time)
    result.warnings += [text for text in said if text is not None]
    duration = float(problem.like.sample_time[-1])
    result.warnings += series_warnings(problem.like.flow, duration=duration)

    def finish(halves: Halves | None) -> xr.Dataset:
        return _finish(result, halves, stationarity, recording, problem)

    def compare_halves(progress: Progress | None = None) -> Halves | None:
        return _halves(track, problem, result.coarse, flow_of, executor, progress)

    if problem.study.calibration.refine == "none":
        halves = None
    else:
        say("validation", 0, 1)
        if meanwhile is not None and _is_left_to_threads(problem, executor):
            halves = run_in_background(compare_halves, partial(meanwhile, finish(None)))
            meanwhile = None
        else:
            halves = compare_halves(SweepProgress(partial(say, "validation"), share_of_windows))
        say("validation", 1, 1)
    found = finish(halves)
    if meanwhile is not None:
        meanwhile(found)
    return found


def _is_left_to_threads(problem: Problem, executor: Executor | None) -> bool:
    """Return whether the core computes on several threads, and calls no function of a user."""
    native = isinstance(problem.model, ScoresItself) and isinstance(problem.statistic, StepDistance)
    return native and executor is None and problem.like.threads > 1


def _study_and_model(
    model: MotionModel | Study | None, study: Study | None, recording: xr.Dataset
) -> tuple[Study, MotionModel]:
    """Return the conditions and the search, and what is searched."""
    from driftwalk.model import Study

    if isinstance(model, Study):
        if study is not None:
            raise InputError("two studies are given: give one, or a motion model and a study")
        return model, BlockModel(model)
    if model is None:
        chosen = study if study is not None else Study()
        return chosen, BlockModel(chosen)
    if not isinstance(model, MotionModel):
        raise InputError(
            f"expected a motion model or a study, got {type(model).__name__}: a function becomes "
            "one by motion_model(function, speed=(0, 0.1, 'm/s'))"
        )
    if study is not None:
        return study, model
    if isinstance(model, BlockModel):
        return model.study, model
    # Nothing but the recording says in which tank a model without a study moves.
    return study_in_arena(Study(), recording), model


def _in_memory(name: str, fingerprint: dict[str, Any]) -> Store | None:  # noqa: ARG001
    return None


def _flow_source(study: Study, model: MotionModel, flow: xr.Dataset | None) -> FlowSource:
    """Return what gives the flow for a track: the given field, or one extracted from the track."""
    if flow is not None or not model.needs_flow:
        return lambda track: flow  # noqa: ARG005
    from driftwalk.conditions.own_flow import flow_from_track

    return lambda track: flow_from_track(track, study)


class _Calibration:
    """The stages of a calibration in their order, and what each leaves for the next."""

    def __init__(
        self, problem: Problem, keep: Stores, say: Tell, executor: Executor | None
    ) -> None:
        self.problem = problem
        self.warnings: list[str] = []
        self.bootstrap: Bootstrap | None = None
        self.quality: GoodnessOfFit | None = None
        self.region: Region | None = None
        self._keep = keep
        self._executor = executor
        self._say = say
        self._steps = problem.refined_steps

    def run(self) -> _Calibration:
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
        self.warnings += at_ends.values()
        if search.bootstrap >= 2 and self.refined is not None:
            self._bootstrap(self.refined, search.bootstrap, at_ends)
        return self

    def _coarse_map(self, replicates: int) -> Map:
        """Return the coarse map: one replicate of every setting, all where the optimum could be."""
        axes = tuple(np.array(one.coordinates) for one in self.problem.parameters)
        progress = SweepProgress(self._progress("coarse"), share_of_map)
        maps = self._maps("coarse", "all", progress, apart=False)
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

    def _progress(self, stage: str) -> Progress:
        return partial(self._say, stage)

    def _maps(
        self, stage: str, details: Details, progress: Progress, *, apart: bool
    ) -> MapSimulator:
        return MapSimulator(
            self.problem,
            stage,
            details=details,
            apart=apart,
            stores=self._keep,
            executor=self._executor,
            progress=progress,
        )

    def _refine(self, wanted: int) -> None:
        limits = limits_of(self.problem)
        narrowing = SweepProgress(self._progress("refined"), share_of_windows)
        maps = self._maps("refined", "none", narrowing, apart=True)
        located = locate_minimum(maps, first_window(self.coarse, self.floor), limits)
        self.refined = refine(maps, located, limits, self._steps, wanted)
        self.optimum = self.refined.energy_score.optimum
        cell = better_cell(self.refined.map, self.refined.energy_score)
        if cell is not None:
            self.warnings.append(self._unresolved(self.refined.map.point(cell)))

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
        fingerprint = {
            "optimum": [*self.optimum.point, self.optimum.distance],
            "axes": [axis.tolist() for axis in surface.axes],
            "settings": len(surface.apart),
            "count": count,
        }
        self.bootstrap = run_bootstrap(
            self.problem,
            self.optimum,
            surface,
            floor=energy_score.floor_at_optimum,
            count=count,
            store=self._keep(f"bootstrap-{window_id(refined.map.axes)}", fingerprint),
            executor=self._executor,
            progress=self._progress("bootstrap"),
        )
        self.quality = goodness_of_fit(self.bootstrap)
        self.floor = self.quality.floor
        self.region = confidence_region(
            energy_score.smoother,
            energy_score.surface,
            self.bootstrap,
            confidence=self.problem.study.calibration.confidence,
            stretch=self.quality.stretch,
        )
        self.warnings += interval_warnings(
            self.problem.parameters,
            self.region.intervals,
            self.bootstrap.estimates,
            search=self.coarse.axes,
            window=refined.map.axes,
            lattice=surface.axes,
            steps=self._steps,
            known=known,
        )
        if not self.quality.explained:
            self.warnings.append(
                f"the model does not explain the recording: D = {self.quality.distance:.3f} at the "
                f"optimum is {self.quality.distance / self.quality.floor:.1f} times the noise "
                f"floor {self.quality.floor:.3f}; the parameters are the best of bad fits"
            )


def _halves(
    track: Track,
    problem: Problem,
    coarse: Map,
    flow_of: FlowSource,
    executor: Executor | None,
    progress: Progress | None,
) -> Halves | None:
    """Calibrate on the first half, judge on the second; None where a half is too short."""
    middle = 0.5 * (track.time[0] + track.time[-1])
    others = problem.like.neighbours
    if others is not None:
        others = others.since(-float(track.time[0]))
    early = Track(*(values[track.time <= middle] for values in track))
    late = Track(*(values[track.time > middle] for values in track))
    try:
        flow = flow_of(early)
        first, second = (
            prepare_problem(
                half,
                problem.study,
                flow,
                camera=problem.like.camera,
                model=problem.model,
                statistic=problem.statistic,
                neighbours=others,
                threads=problem.like.threads,
            )
            for half in (early, late)
        )
    except InputError:
        return None
    return validate_on_halves(problem, coarse, first, second, executor=executor, progress=progress)


def _finish(
    found: _Calibration,
    halves: Halves | None,
    stationarity: Stationarity | None,
    recording: xr.Dataset,
    problem: Problem,
) -> xr.Dataset:
    """Put the pieces into one dataset and state the answer."""
    lowest = found.coarse.point(found.coarse.cell_of_minimum())
    facts: dict[str, Any] = {
        **answer_facts(problem, found.optimum.point),
        **estimate_facts(problem, lowest, "coarse_"),
        "ks_distance": found.optimum.distance,
        "noise_floor": found.floor,
        "warnings": found.warnings,
        "recording_name": str(recording.attrs.get("source", "")),
        "simulated_recording": str(recording.attrs.get("simulated", "no")),
        "study": problem.study.to_toml(),
    }
    if found.quality is not None and found.region is not None:
        facts |= _quality_facts(found.quality, found.region, problem)
    if halves is not None:
        facts |= estimate_facts(problem, halves.point, "first_half_")
        facts["second_half_ks_distance"] = halves.distance
        facts["second_half_noise_floor"] = halves.floor
    if stationarity is not None:
        facts["halves_ks_distance"] = stationarity.distance
        facts["halves_ks_distance_expected"] = stationarity.expected
        facts["halves_p_value"] = stationarity.p_value
    refined, surface = None, None
    if found.refined is not None:
        refined, surface = found.refined.map, at_settings(found.refined.energy_score.surface)
    pieces = CalibrationParts(found.coarse, refined, surface, found.bootstrap, found.region)
    return build_calibration(problem, pieces, facts)


def _quality_facts(quality: GoodnessOfFit, region: Region, problem: Problem) -> dict[str, Any]:
    """Return what only a bootstrap tells: how sure the answer is, and how good."""
    return {
        **interval_facts(problem, region),
        "confidence": problem.study.calibration.confidence,
        "ks_distance": quality.distance,
        "ks_distance_standard_error": quality.standard_error,
        "noise_floor_upper": quality.floor_upper,
        "distance_to_floor_ratio": quality.distance / quality.floor,
        "far_above_floor": FAR_ABOVE_FLOOR,
        "explained": quality.explained,
        "region_level": region.level,
        "interval_stretch": quality.stretch,
    }
