"""One simulated recording of known truth (or some, fitted together): simulated, fitted, scored."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError
from driftwalk.core.random_streams import RecoveryStream
from driftwalk.core.seeds import world_keys
from driftwalk.flow import random_tank_flow
from driftwalk.likelihood.fit import fit_motion
from driftwalk.likelihood.recover.score import SCORED, score_fit
from driftwalk.model import Study, apply_overrides
from driftwalk.model.recover import true_time_step_s
from driftwalk.schema import build_trajectory
from driftwalk.schema.kinds.recovery import RECORDING_STATUS
from driftwalk.simulation import simulate

if TYPE_CHECKING:
    import xarray as xr

Floats = npt.NDArray[np.float64]

STATUS: Final = RECORDING_STATUS
"""Status of a recording. Not fitted means that the fit refused it, with a message."""
MESSAGE: Final = 400
"""Letters of a message that are kept."""
PARTS: Final = ("", "_low", "_high", "_sd", "_error", "_z", "_covered")
"""Suffixes of a score's variables for each parameter, after its name."""
FLOW_PARTS: Final = ("flow_error", "flow_point_error", "flow_z_rms", "flow_cells")
FACTS: Final = ("wall_share", "samples_used", "iterations", "converged", "fit_time")


@dataclass(frozen=True)
class Truth:
    """Parameters that simulate the recordings of a recovery study.

    Attributes
    ----------
    study : Study
        Block, tank, water, forces, observation and the section [recover].
    flow : xarray.Dataset or None
        The true flow; None draws another one for every recording.
    """

    study: Study
    flow: xr.Dataset | None

    @property
    def tracking_noise(self) -> float:
        """Standard deviation of what the camera adds to a position [m], rounding included."""
        seen = self.study.observation
        quantum = 0.0 if isinstance(seen.position_quantum_m, str) else seen.position_quantum_m
        return math.hypot(float(seen.position_noise_m), quantum / math.sqrt(12.0))

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

    def seed_of(self, recording: int, stream: RecoveryStream) -> int:
        """Return the seed of a stream of random numbers of a recording."""
        seed = self.study.recover.seed
        return int(world_keys(seed, trial=recording, replicate=stream)[0] >> np.uint64(1))


def recover_one(truth: Truth, *, recording: int, duration: float, angle: str) -> dict[str, Any]:
    """Simulate, fit and score one setting of a recovery study.

    A longer recording begins with the shorter one of the same number.
    """
    nothing = dict.fromkeys(
        [*(f"{name}{part}" for name in SCORED for part in PARTS), *FLOW_PARTS, *FACTS], math.nan
    )
    flow = truth.flow_of(recording)
    tracks = simulated_recordings(truth, flow, recording=recording, duration=duration)
    if tracks is None:
        return {**nothing, "status": STATUS["not_simulated"], "message": "the simulation broke"}
    study = apply_overrides(truth.study, {"fit.angle": angle})
    began = time.perf_counter()
    try:
        fit = fit_motion(tracks, study)
    except InputError as error:
        message = str(error)[:MESSAGE]
        return {**nothing, "status": STATUS["not_fitted"], "message": message}
    took = time.perf_counter() - began
    forces = truth.study.forces
    score = score_fit(
        fit,
        drag_coefficient=forces.drag_coefficient,
        force_std=forces.force_std_N,
        tracking_noise=truth.tracking_noise,
        flow=flow,
        recordings=tracks,
    )
    facts = {
        **{name: fit[name].item() for name in ("wall_share", "samples_used", "iterations")},
        "converged": bool(fit["converged"]),
        "fit_time": took,
    }
    retained = {key: float(value) for key, value in {**score, **facts}.items() if key in nothing}
    return {**retained, "status": STATUS["fitted"], "message": ""}


def simulated_recordings(
    truth: Truth, flow: xr.Dataset, *, recording: int, duration: float
) -> list[xr.Dataset] | None:
    """Return what the camera records of one world, or of several that are fitted together."""
    settings = truth.study.recover
    samples = math.floor(duration / settings.sample_interval_s + 1e-6) + 1
    clock = np.asarray(np.arange(samples) * settings.sample_interval_s, np.float64)
    run = simulate(
        _simulated_study(truth.study),
        flow,
        sample_time=settings.settling_s + clock,
        replicates=settings.recordings_per_fit,
        seed=truth.seed_of(recording, RecoveryStream.WORLD),
        backend="reference",
        threads=1,
    )
    if np.any(run["status"].values):
        return None
    generator = np.random.default_rng(truth.seed_of(recording, RecoveryStream.GAPS))
    # By columns, so that a longer recording misses the same samples at first.
    lost = generator.random((samples, settings.recordings_per_fit)) < settings.missing_share
    poses = {name: run[name].values[:, :, 0].astype(np.float64) for name in ("x", "y", "theta")}
    return [
        _recording(clock, {name: values[one] for name, values in poses.items()}, lost[:, one])
        for one in range(settings.recordings_per_fit)
    ]


def _recording(
    clock: Floats, poses: Mapping[str, Floats], lost: npt.NDArray[np.bool_]
) -> xr.Dataset:
    x, y, theta = (np.where(lost, np.nan, poses[name]) for name in ("x", "y", "theta"))
    return build_trajectory(clock, x, y, theta, attrs={"source": "simulated"})


def _simulated_study(study: Study) -> Study:
    """Return the study with a step fine enough for a truth, and a camera that has numbers."""
    step = true_time_step_s(
        study.simulation.time_step_s, force_interval_s=study.forces.force_interval_s
    )
    changes: dict[str, Any] = {"simulation.time_step_s": step}
    if isinstance(study.observation.orientation_noise_rad, str):
        changes["observation.orientation_noise_rad"] = 0.0
    return apply_overrides(study, changes)
