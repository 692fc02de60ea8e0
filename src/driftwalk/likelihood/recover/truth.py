"""Recordings of a block whose truth is known, one or some together, and their likelihood fit."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.calibration.recover.study import EstimationMethod
from driftwalk.core.errors import InputError
from driftwalk.core.processors import one_blas_thread
from driftwalk.core.streams import RecoveryStream
from driftwalk.flow import random_tank_flow
from driftwalk.likelihood.fit import fit_motion
from driftwalk.likelihood.recover.check import require_flow, require_length, require_truth
from driftwalk.likelihood.recover.score import SCORED, score_fit
from driftwalk.model import Study, apply_overrides
from driftwalk.model.recover import true_time_step_s
from driftwalk.schema import build_trajectory
from driftwalk.simulation import simulate

if TYPE_CHECKING:
    import xarray as xr

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
        flow = self.flow_of(recording)
        clock = self.clock(float(setting["duration"]))
        run = simulate(
            _simulated_study(self.study),
            flow,
            sample_time=settings.settling_s + clock,
            replicates=settings.recordings_per_fit,
            seed=self.seed_of(recording, RecoveryStream.WORLD),
            backend="reference",
            threads=1,
        )
        if np.any(run["status"].values):
            raise InputError("the simulation broke")
        missed = self.missed(recording, clock.size, settings.recordings_per_fit)
        tracks = [
            build_trajectory(
                clock,
                *(
                    np.where(lost, np.nan, run[name].values[number, :, 0].astype(np.float64))
                    for name in ("x", "y", "theta")
                ),
                attrs={"source": "simulated"},
            )
            for number, lost in enumerate(missed.T)
        ]
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


def _simulated_study(study: Study) -> Study:
    """Return the study with a step fine enough for a truth, and a camera that has numbers."""
    step = true_time_step_s(
        study.simulation.time_step_s, force_interval_s=study.forces.force_interval_s
    )
    changes: dict[str, Any] = {"simulation.time_step_s": step}
    if isinstance(study.observation.orientation_noise_rad, str):
        changes["observation.orientation_noise_rad"] = 0.0
    return apply_overrides(study, changes)
