"""The whole calibration: which parameters fit a recording, and how well they are known."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from driftwalk.calibration.problem import Problem, prepare_problem
from driftwalk.calibration.quality import (
    FAR_ABOVE_FLOOR,
    Halves,
    Quality,
    noise_floor_at,
    quality_of_fit,
    validate_on_halves,
)
from driftwalk.calibration.region import (
    Bootstrap,
    Region,
    build_surface,
    confidence_region,
    run_bootstrap,
)
from driftwalk.calibration.result import add_uncertainty, answer_attrs, as_json, build_calibration
from driftwalk.calibration.search import (
    Map,
    Window,
    recentre,
    refined_replicates,
    refined_window,
    run_map,
    window_smoother,
)
from driftwalk.calibration.surface import FINENESS, Optimum
from driftwalk.core.errors import InputError
from driftwalk.schema import Track, body_track
from driftwalk.simulation import recorded_camera

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.sweep import Store

MOST_RECENTRINGS = 3
WIDE_SHARE = 0.05

Tell = Callable[[str, int, int], None]
FlowSource = Callable[[Track], "xr.Dataset"]


class Stores(Protocol):
    """Gives the store in which a stage of a calibration keeps its finished work units."""

    def __call__(self, name: str, fingerprint: dict[str, Any]) -> Store | None:
        """Return the store of a stage; None keeps results in memory."""


def calibrate(
    recording: xr.Dataset,
    study: Study | None = None,
    *,
    flow: xr.Dataset | None = None,
    body: str | None = None,
    threads: int | None = None,
    stores: Stores | None = None,
    tell: Tell | None = None,
) -> xr.Dataset:
    """Calibrate drag coefficient and stochastic force on a recording.

    The paper's exhaustive grid over (C_d, sigma_F): every setting is simulated as long as the
    recording, at its time stamps, with its gaps, start and camera noise, and its step lengths and
    turning angles are compared with the recording's by the two-dimensional Kolmogorov-Smirnov
    distance. A second, finer pass around the minimum follows; the optimum is that of a smooth
    surface through it. A parametric bootstrap gives the intervals and the joint region, and the
    distance at the optimum is judged against the noise floor.

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    study : Study, optional
        Model and search; default: the paper's.
    flow : xarray.Dataset, optional
        The water's velocity. Without it the field is extracted from the recording.
    body : str, optional
        The body, where the recording has several.
    threads : int, optional
        Default: all processors. The result does not depend on it.
    stores : callable, optional
        Where each stage keeps finished work (`driftwalk.core.rundir`); memory when left out.
    tell : callable, optional
        Told the stage and how much of it is done: ``tell("map", 64, 1681)``.

    Returns
    -------
    xarray.Dataset
        See `driftwalk.calibration.result`. The answer stands in its attributes:
        ``drag_coefficient``, ``force_std_N``, both with ``_interval``, ``force_interval_s``,
        ``force_noise_intensity_N2_s`` (what the recording can tell), ``ks_distance``,
        ``noise_floor``, ``warnings``.

    Raises
    ------
    InputError
        When the recording is too short, does not move, or several bodies are there and none named.

    Notes
    -----
    A small distance does not certify the parameters: an error of the flow field is absorbed by
    them (docs/explanation/calibration.md).

    Examples
    --------
    >>> import driftwalk as dw
    >>> found = dw.calibrate(dw.tank30_recording(), flow=dw.tank30_flow())  # doctest: +SKIP
    >>> found.attrs["drag_coefficient"]  # doctest: +SKIP
    0.39
    """
    from driftwalk.model import Study

    chosen = study if study is not None else Study()
    track = body_track(recording, body)
    quantum = float(recording.attrs.get("position_quantum_m", 0.0))
    flow_of = _flow_source(chosen, flow)
    camera = recorded_camera(track, chosen, position_quantum=quantum)
    problem = prepare_problem(track, chosen, flow_of(track), camera=camera, threads=threads)
    keep = stores if stores is not None else _in_memory
    say = tell if tell is not None else _silent
    result = _Calibration(problem, keep, say).run()
    halves = _halves(track, problem, flow_of, say)
    return _finish(result, halves, recording, problem)


def _in_memory(name: str, fingerprint: dict[str, Any]) -> Store | None:  # noqa: ARG001
    return None


def _silent(stage: str, done: int, total: int) -> None:
    """Tell nobody."""


def _flow_source(study: Study, flow: xr.Dataset | None) -> FlowSource:
    """Return what gives the flow for a track: the given field, or one extracted from the track."""
    if flow is not None:
        return lambda track: flow  # noqa: ARG005
    from driftwalk.calibration.own_flow import flow_from_track

    return lambda track: flow_from_track(track, study)


class _Calibration:
    """The stages of a calibration in their order, and what each leaves for the next."""

    def __init__(self, problem: Problem, keep: Stores, say: Tell) -> None:
        self.problem = problem
        self.warnings: list[str] = []
        self.bootstrap: Bootstrap | None = None
        self.quality: Quality | None = None
        self.region: Region | None = None
        self._keep = keep
        self._say = say
        grid = problem.study.calibration
        self._steps = (grid.refined_drag_coefficient_step, grid.refined_force_std_step_N)

    def run(self) -> _Calibration:
        """Run every stage that the study asks for."""
        search = self.problem.study.calibration
        self.coarse = self._map(
            "coarse",
            Window(np.array(search.drag_coefficients), np.array(search.force_stds_N)),
            search.replicates,
            "all",
        )
        row, column = self.coarse.cell_of_minimum()
        cell = self.coarse.drag_coefficient[row], self.coarse.force_std[column]
        self.optimum = Optimum(float(cell[0]), float(cell[1]), float(self.coarse.mean[row, column]))
        self.floor = noise_floor_at(self.problem, *cell)
        self.refined: Map | None = None
        self.surface: Any = None
        if search.refine == "auto":
            self._refine(search.refined_replicates)
        self._check_edges()
        if search.bootstrap >= 2 and self.refined is not None:
            self._bootstrap(search.bootstrap)
        return self

    def _map(self, stage: str, window: Window, replicates: int, details: str) -> Map:
        store = self._keep(
            f"{stage}-{_window_id(window)}",
            {"axes": [axis.tolist() for axis in window], "replicates": replicates},
        )
        return run_map(
            self.problem,
            window.drag_coefficient,
            window.force_std,
            stage=stage,
            replicates=replicates,
            details=details,
            store=store,
            progress=lambda done, total: self._say(stage, done, total),
        )

    def _refine(self, wanted: int) -> None:
        window = refined_window(self.coarse, self._steps, self.floor)
        for _ in range(MOST_RECENTRINGS):
            self.refined = self._map("refined", window, refined_replicates(window, wanted), "none")
            self.smoother = window_smoother(window, self._steps)
            self.optimum = self.smoother.optimum(self.refined.mean)
            self.surface = self.smoother.surface(self.refined.mean.ravel())
            moved = recentre(window, self.optimum, self.coarse, self._steps)
            if all(np.array_equal(a, b) for a, b in zip(moved, window, strict=True)):
                break
            window = moved
        self.window = window

    def _check_edges(self) -> None:
        for axis, value, name in (
            (self.coarse.drag_coefficient, self.optimum.drag_coefficient, "drag coefficient"),
            (self.coarse.force_std, self.optimum.force_std, "force_std"),
        ):
            spacing = np.diff(axis).min() if axis.size > 1 else 0.0
            for edge in {axis[0], axis[-1]}:
                if abs(value - edge) <= 0.5 * spacing:
                    self.warnings.append(
                        f"the optimum lies at the edge of the grid: {name} = {value:g} with the "
                        f"grid ending at {edge:g}; extend the grid, or question the model"
                    )

    def _bootstrap(self, count: int) -> None:
        assert self.refined is not None
        surface = build_surface(
            self.problem, self.refined, self.optimum, self._steps, margin=self.floor
        )
        axes = (surface.smoother.drag_coefficient, surface.smoother.force_std)
        fingerprint = {
            "optimum": list(self.optimum),
            "axes": [axis.tolist() for axis in axes],
            "count": count,
        }
        self.bootstrap = run_bootstrap(
            self.problem,
            self.optimum,
            surface,
            count=count,
            store=self._keep(f"bootstrap-{_window_id(self.window)}", fingerprint),
            progress=lambda done, total: self._say("bootstrap", done, total),
        )
        self.quality = quality_of_fit(self.bootstrap)
        self.floor = self.quality.floor
        self.region = confidence_region(
            self.smoother,
            self.surface,
            self.bootstrap,
            confidence=self.problem.study.calibration.confidence,
            stretch=self.quality.stretch,
        )
        self._check_window(*axes)
        if not self.quality.explained:
            self.warnings.append(
                f"the model does not explain the recording: D = {self.quality.distance:.3f} at the "
                f"optimum is {self.quality.distance / self.quality.floor:.1f} times the noise "
                f"floor {self.quality.floor:.3f}; the parameters are the best of bad fits"
            )

    def _check_window(self, drag: Any, force: Any) -> None:
        """Warn where what could be the truth goes on beyond the settings that were simulated.

        `drag` and `force` are the axes on which the bootstrap's recordings were estimated.
        """
        found, region = self.bootstrap, self.region
        assert found is not None
        assert region is not None
        for axis, values, window, limits, interval, name in (
            (
                drag,
                found.drag_coefficient,
                self.window.drag_coefficient,
                self.coarse.drag_coefficient,
                region.drag_coefficient_interval,
                "drag coefficient",
            ),
            (
                force,
                found.force_std,
                self.window.force_std,
                self.coarse.force_std,
                region.force_std_interval,
                "force_std",
            ),
        ):
            for side in (0, -1):
                crowded = np.mean(np.isclose(values, axis[side])) > WIDE_SHARE
                cut = np.isclose(interval[side], window[side])
                if (crowded or cut) and not np.isclose(window[side], limits[side]):
                    self.warnings.append(
                        f"the interval of the {name} reaches the end of the refined grid "
                        f"({window[side]:g}): it is wider than stated"
                    )


def _window_id(window: Window) -> str:
    """Name a grid by its ends and sizes, so that a moved window has a store of its own."""
    ends = [f"{axis[0]:.6g}-{axis[-1]:.6g}-{axis.size}" for axis in window]
    return "x".join(ends).replace(".", "p").replace("+", "")


def _halves(track: Track, problem: Problem, flow_of: FlowSource, say: Tell) -> Halves | None:
    """Calibrate on the first half, judge on the second; None where a half is too short."""
    if problem.study.calibration.refine == "none":
        return None
    say("validation", 0, 1)
    middle = 0.5 * (track.time[0] + track.time[-1])
    early = Track(*(values[track.time <= middle] for values in track))
    late = Track(*(values[track.time > middle] for values in track))
    try:
        flow = flow_of(early)
        first, second = (
            prepare_problem(
                half, problem.study, flow, camera=problem.camera, threads=problem.threads
            )
            for half in (early, late)
        )
    except InputError:
        return None
    search = problem.study.calibration
    steps = (search.refined_drag_coefficient_step, search.refined_force_std_step_N)
    halves = validate_on_halves(first, second, steps=steps)
    say("validation", 1, 1)
    return halves


def _finish(
    found: _Calibration, halves: Halves | None, recording: xr.Dataset, problem: Problem
) -> xr.Dataset:
    """Put the pieces into one dataset and state the answer in its attributes."""
    study = problem.study
    attrs: dict[str, Any] = answer_attrs(problem, found.optimum)
    attrs["ks_distance"] = found.optimum.distance
    attrs["noise_floor"] = found.floor
    if found.quality is not None:
        attrs["ks_distance"] = found.quality.distance
        attrs["ks_distance_standard_error"] = found.quality.standard_error
        attrs["noise_floor_upper"] = found.quality.floor_upper
        attrs["distance_to_floor_ratio"] = found.quality.distance / found.quality.floor
        attrs["far_above_floor"] = FAR_ABOVE_FLOOR
    attrs["coarse_drag_coefficient"], attrs["coarse_force_std_N"] = _coarse_cell(found.coarse)
    if halves is not None:
        attrs["first_half_drag_coefficient"] = halves.drag_coefficient
        attrs["first_half_force_std_N"] = halves.force_std
        attrs["second_half_ks_distance"] = halves.distance
        attrs["second_half_noise_floor"] = halves.floor
    attrs["recording_name"] = str(recording.attrs.get("source", ""))
    attrs["simulated_recording"] = str(recording.attrs.get("simulated", "no"))
    attrs["study"] = study.to_toml()
    # The lattice of the surface meets the refined settings at every FINENESS-th point.
    surface = None
    if found.surface is not None:
        surface = found.surface[::FINENESS, ::FINENESS]
    dataset = build_calibration(problem, found.coarse, found.refined, surface, attrs=attrs)
    if found.bootstrap is not None:
        assert found.quality is not None
        assert found.region is not None
        dataset = add_uncertainty(dataset, found.bootstrap, found.region)
        dataset.attrs["region_level"] = found.region.level
        dataset.attrs["interval_stretch"] = found.quality.stretch
        dataset.attrs["drag_coefficient_interval"] = list(found.region.drag_coefficient_interval)
        dataset.attrs["force_std_N_interval"] = list(found.region.force_std_interval)
        dataset.attrs["confidence"] = study.calibration.confidence
    dataset.attrs["warnings"] = as_json(found.warnings)
    return dataset


def _coarse_cell(coarse: Map) -> tuple[float, float]:
    row, column = coarse.cell_of_minimum()
    return float(coarse.drag_coefficient[row]), float(coarse.force_std[column])
