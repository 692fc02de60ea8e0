"""The recovery study of a fit: recordings of a block whose truth is known, each fitted."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Final, NamedTuple

import numpy as np

from driftwalk.calibration.recovery_study import (
    COVERAGE_CONFIDENCE,
    BrokenSimulation,
    EstimationMethod,
    Tell,
)
from driftwalk.core.errors import InputError
from driftwalk.core.processors import one_blas_thread
from driftwalk.core.progress import ignore_progress
from driftwalk.core.random_streams import RecoveryStream
from driftwalk.core.units import in_percent
from driftwalk.flow import random_tank_flow
from driftwalk.likelihood.fit import fit_motion
from driftwalk.likelihood.refuse import LIMIT
from driftwalk.likelihood.score import NEEDED_CONFIDENCE, SCORED, add_summary, score_fit
from driftwalk.model import Study, apply_overrides
from driftwalk.model.recover import RANDOM, true_time_step_s
from driftwalk.schema import build_trajectory, check_flow_field
from driftwalk.schema.check import described
from driftwalk.schema.kinds import KINDS
from driftwalk.schema.kinds.recovery import ESTIMATED, RECOVERED
from driftwalk.simulation import simulate
from driftwalk.simulation.backend import require_cover
from driftwalk.sweep import Design, Store, grid
from driftwalk.sweep.workers import single_threaded_processes

if TYPE_CHECKING:
    import xarray as xr


def require_truth(study: Study, angles: tuple[str, ...]) -> None:
    """Refuse a truth that lacks a number."""
    seen, forces = study.observation, study.forces
    positive: dict[str, Any] = {
        "[forces] drag_coefficient": forces.drag_coefficient,
        "[forces] force_std_N": forces.force_std_N,
        "[observation] position_noise_m": seen.position_noise_m,
    }
    for key, value in positive.items():
        if isinstance(value, str) or not value > 0.0:
            raise InputError(
                f"the truth lacks {key}: a number above 0 is needed for the "
                f"simulation and the comparison with the fit, got {value!r}"
            )
    if isinstance(seen.orientation_noise_rad, str) and set(angles) != {"none"}:
        raise InputError(
            "the truth lacks [observation] orientation_noise_rad: a number is needed where the "
            f"fit uses the orientation, got {seen.orientation_noise_rad!r}"
        )


def require_length(study: Study) -> None:
    """Refuse recordings that are shorter than the fit needs."""
    settings = study.recover
    shortest = min(settings.durations_s)
    samples = math.floor(shortest / settings.sample_interval_s + 1e-6) + 1
    # Five standard deviations: chance shall not stop a study half-way.
    retained = 1.0 - settings.missing_share
    expected = samples * retained - 5.0 * math.sqrt(samples * retained * settings.missing_share)
    if expected < LIMIT.fewest_samples:
        raise InputError(
            f"[recover] durations_s: {shortest:g} s at a sample every "
            f"{settings.sample_interval_s:g} s, {in_percent(settings.missing_share)} of them "
            f"missing, are about {samples * retained:.0f} positions; the fit needs "
            f"{LIMIT.fewest_samples} at least, and some minutes to be of use"
        )


def require_flow(study: Study, flow: xr.Dataset | None) -> None:
    """Refuse a flow that is missing, has frames, or does not cover the tank."""
    if flow is None:
        named = study.recover.flow
        if named == RANDOM:
            return
        raise InputError(
            "the flow of the water is missing: name the file of a flow field "
            '([recover] flow), or flow = "random"'
            if named is None
            else f"the flow {named} ([recover] flow) has to be loaded and passed as an argument"
        )
    check_flow_field(flow)
    if "time" in flow.dims:
        raise InputError("the true flow has frames: a recovery study needs a steady one")
    require_cover(flow, study.tank)


PARTS: Final = ("", "_low", "_high", "_sd", "_error", "_z", "_covered")
"""Suffixes of a score's variables for each parameter, after its name."""
FLOW_PARTS: Final = ("flow_error", "flow_point_error", "flow_z_rms", "flow_cells")
FACTS: Final = ("wall_share", "samples_used", "iterations", "converged", "fit_time")


@dataclass(frozen=True)
class FitRecovery(EstimationMethod["SimulatedTracks"]):
    """A block of known truth, and the likelihood fit that estimates its parameters.

    Attributes
    ----------
    study : Study
        Block, tank, water, forces, observation and the section [recover].
    flow : xarray.Dataset or None
        The true flow; None draws another one for every recording.
    """

    flow: xr.Dataset | None = None

    kind: ClassVar = "recovery"
    work: ClassVar = "fits"

    @property
    def angles(self) -> tuple[str, ...]:
        """Uses of the orientation that the study compares."""
        return self.study.recover.angle or (self.study.fit.angle,)

    @property
    def tracking_noise(self) -> float:
        """Standard deviation of what the camera adds to a position [m], rounding included."""
        seen = self.study.observation
        quantum = 0.0 if isinstance(seen.position_quantum_m, str) else seen.position_quantum_m
        return math.hypot(float(seen.position_noise_m), quantum / math.sqrt(12.0))

    def check(self) -> None:
        """Refuse a truth that is not whole or cannot be fitted; takes almost no time."""
        require_truth(self.study, self.angles)
        require_length(self.study)
        require_flow(self.study, self.flow)

    def design(self) -> Design:
        """Return the recordings, their lengths, and the uses of the angle."""
        # Recordings vary slowest, so that finished work predicts the remaining time.
        return grid(
            recording=np.arange(self.study.recover.recordings),
            duration=np.array(self.study.recover.durations_s),
            angle=np.arange(len(self.angles)),
        )

    def recover(
        self,
        *,
        store: Store | None = None,
        threads: int | None = None,
        executor: Executor | None = None,
        tell: Tell = ignore_progress,
    ) -> xr.Dataset:
        """Fit recordings in processes of this machine, or on other workers."""
        if executor or threads is None:
            return self.sweep(store=store, executor=executor, progress=self.counted(tell))
        with single_threaded_processes(threads) as workers:
            return self.sweep(store=store, executor=workers, progress=self.counted(tell))

    def result(self, found: Mapping[str, Any]) -> xr.Dataset:
        """Return the `recovery`."""
        import xarray as xr

        study = self.study
        dims = ("duration", "angle", "recording")
        tables = {key: np.moveaxis(values, 0, -1) for key, values in found.items()}
        fitted = tables["status"] == ESTIMATED
        used = fitted & (np.where(fitted, tables["wall_share"], 1.0) <= LIMIT.most_wall_share)
        columns = {
            f"{name}{part}": f"{one.key}{part}" for name, one in RECOVERED.items() for part in PARTS
        }
        columns |= {key: key for key in (*FLOW_PARTS, *FACTS, "status")}
        data = {name: tables[key] for name, key in columns.items()}
        data |= {"message": tables["message"].astype(object), "used": used.astype(np.int8)}
        coords = {
            "duration": ("duration", np.array(study.recover.durations_s)),
            "angle": ("angle", np.array(self.angles, dtype=object)),
            "recording": ("recording", np.arange(study.recover.recordings)),
        }
        facts = {"kind": "recovery", "schema_version": KINDS["recovery"].version, **self._attrs()}
        dataset = xr.Dataset({key: (dims, one) for key, one in data.items()}, coords, facts)
        return described(add_summary(dataset))

    def _attrs(self) -> dict[str, Any]:
        study = self.study
        settings, forces = study.recover, study.forces
        asked = settings.drag_coefficient_precision
        if self.flow is None:
            flow = f"random, {settings.flow_family}"
        elif settings.flow in (None, RANDOM):
            flow = str(self.flow.attrs.get("source", "given"))
        else:
            flow = str(settings.flow)
        return {
            "drag_coefficient": forces.drag_coefficient,
            "force_std_N": forces.force_std_N,
            "force_interval_s": forces.force_interval_s,
            "tracking_noise_m": self.tracking_noise,
            "flow": flow,
            "sample_interval_s": settings.sample_interval_s,
            "recordings_per_fit": settings.recordings_per_fit,
            "missing_share": settings.missing_share,
            "seed": settings.seed,
            "confidence": study.fit.confidence,
            "coverage_confidence": COVERAGE_CONFIDENCE,
            "needed_confidence": NEEDED_CONFIDENCE,
            "most_wall_share": LIMIT.most_wall_share,
            "drag_coefficient_precision": np.nan if asked is None else asked,
            "study": study.to_toml(),
        }

    def flow_of(self, recording: int) -> xr.Dataset:
        """Return the flow in which a recording is made."""
        if self.flow is not None:
            return self.flow
        settings = self.study.recover
        return random_tank_flow(
            self.seed_of(recording, RecoveryStream.FLOW),
            family=settings.flow_family,
            arena=self.study.tank.to_arena(),
            speed=settings.flow_speed_m_s,
        )

    @one_blas_thread()
    def simulate(self, setting: Mapping[str, Any]) -> SimulatedTracks:
        """Return what the camera records of one world, or of several that are fitted together.

        A longer recording begins with the shorter one of the same number.
        """
        settings, recording = self.study.recover, int(setting["recording"])
        # A step fine enough for a truth, and a camera that has numbers.
        step = true_time_step_s(
            self.study.simulation.time_step_s, force_interval_s=self.study.forces.force_interval_s
        )
        changes: dict[str, Any] = {"simulation.time_step_s": step}
        if isinstance(self.study.observation.orientation_noise_rad, str):
            changes["observation.orientation_noise_rad"] = 0.0
        study = apply_overrides(self.study, changes)
        flow = self.flow_of(recording)
        clock = self.clock(float(setting["duration"]))
        run = simulate(
            study,
            flow,
            sample_time=settings.settling_s + clock,
            replicates=settings.recordings_per_fit,
            seed=self.seed_of(recording, RecoveryStream.WORLD),
            backend="reference",
            threads=1,
        )
        if np.any(run["status"].values):
            raise BrokenSimulation("the simulation broke")
        missed = self.missed(recording, clock.size, settings.recordings_per_fit)
        tracks = []
        for number, lost in enumerate(missed.T):
            values = (run[name].values[number, :, 0] for name in ("x", "y", "theta"))
            pose = (np.where(lost, np.nan, one.astype(np.float64)) for one in values)
            tracks.append(build_trajectory(clock, *pose, attrs={"source": "simulated"}))
        return SimulatedTracks(tracks, flow)

    @one_blas_thread()
    def estimate(self, recording: SimulatedTracks, setting: Mapping[str, Any]) -> dict[str, Any]:
        """Fit the tracks, and compare the fit with the truth."""
        study = apply_overrides(self.study, {"fit.angle": self.angles[int(setting["angle"])]})
        began = time.perf_counter()
        fit = fit_motion(recording.tracks, study)
        took = time.perf_counter() - began
        forces = self.study.forces
        score = score_fit(
            fit,
            drag_coefficient=forces.drag_coefficient,
            force_std=forces.force_std_N,
            tracking_noise=self.tracking_noise,
            flow=recording.flow,
            recordings=recording.tracks,
        )
        facts = {name: fit[name].item() for name in ("wall_share", "samples_used", "iterations")}
        found = {**score, **facts, "converged": bool(fit["converged"]), "fit_time": took}
        return {name: float(found[name]) for name in self.missing()}

    def missing(self) -> dict[str, Any]:
        """Return the estimates of a recording without a fit."""
        names = [f"{name}{part}" for name in SCORED for part in PARTS]
        return dict.fromkeys([*names, *FLOW_PARTS, *FACTS], math.nan)


class SimulatedTracks(NamedTuple):
    """Tracks of the camera, all in one flow."""

    tracks: list[xr.Dataset]
    flow: xr.Dataset


def recovery_study(
    study: Study,
    flow: xr.Dataset | None = None,
    *,
    store: Store | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    tell: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Simulate recordings of known truth, fit them, and measure how well the fits recover it.

    Parameters
    ----------
    study : Study
        The truth ([forces], [observation], block, tank), how it is recorded ([recover]) and how it
        is fitted ([fit]).
    flow : xarray.Dataset, optional
        The true `flow_field`, steady. It may be left out where ``[recover] flow`` is "random".
    store : Store, optional
        Where finished recordings are kept; memory when left out.
    threads : int, optional
        Processes that fit recordings at the same time; one after the other in this one when left
        out. The numbers are the same to the rounding of the linear algebra library, and the same
        bits for any number of processes.
    executor : concurrent.futures.Executor, optional
        Fits recordings elsewhere, see `driftwalk.sweep.run_sweep`, in place of processes of this
        machine. Workers of a Dask cluster need the same numpy and scipy, and linear algebra of one
        thread.
    tell : callable, optional
        Called with the number of finished fits and the total.

    Returns
    -------
    xarray.Dataset
        Kind "recovery". On (duration, angle, recording): estimates, their intervals and errors,
        flow error, wall share and what became of the recording; on (parameter, duration, angle)
        their summary over the recordings that were fitted with at most 30 % of the intervals at the
        wall (``used``); on (angle) how the error of C_d falls with the length of a recording, and
        the length that the asked precision needs.

    Raises
    ------
    InputError
        When a true value is missing, a recording is shorter than the fit needs, or the flow does
        not cover the tank.

    Examples
    --------
    >>> import driftwalk as dw
    >>> noise = {"position_noise_m": "0.3mm", "orientation_noise_rad": "0.5deg"}
    >>> study = dw.Study(observation=noise)
    >>> found = dw.recovery_study(study, dw.tank30_flow())  # doctest: +SKIP
    >>> float(found["rms_error"].sel(parameter="drag_coefficient").squeeze())  # doctest: +SKIP
    0.04
    """

    def told(done: int, total: int, _: str) -> None:
        if tell is not None:
            tell(done, total)

    return FitRecovery(study, flow).recover(
        store=store, threads=threads, executor=executor, tell=told
    )
