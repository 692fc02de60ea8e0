"""Recordings of a motion model whose parameters are known, and their calibration."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np

from driftwalk.calibration.check import check_recording
from driftwalk.calibration.recover.calibrated import calibrated_parameters
from driftwalk.calibration.recover.study import EstimationMethod
from driftwalk.calibration.run import calibrate
from driftwalk.conditions.camera import study_as_seen
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.core.streams import RecoveryStream
from driftwalk.model import Study, apply_overrides
from driftwalk.motion import BlockModel, MotionModel, known_values, simulate_motion
from driftwalk.schema import body_track, build_trajectory

if TYPE_CHECKING:
    import xarray as xr

Noise = Literal["estimated", "known"]


@dataclass(frozen=True)
class ModelRecovery(EstimationMethod["xr.Dataset"]):
    """A motion model of known truth, and the calibration that estimates its parameters.

    Attributes
    ----------
    study : Study
        Tank, camera, [recover], and the search.
    model : MotionModel
        The model; its parameters are those that the study looks at.
    values : mapping of str to float
        Their true values.
    flow : xarray.Dataset or None
        The water's velocity.
    like : xarray.Dataset or None
        A recording that gives start, time stamps, gaps and camera.
    body : str or None
        Its body, where it has several.
    noise : {"estimated", "known"}
        Whether the calibrations know the noise of the camera.
    threads : int or None
        Threads of each calibration; None for as many as there are processors.
    within : callable or None
        Called with the recording, the stage, what is done and all of it.
    """

    model: MotionModel
    values: Mapping[str, float]
    flow: xr.Dataset | None = None
    like: xr.Dataset | None = None
    body: str | None = None
    noise: Noise = "estimated"
    threads: int | None = None
    within: Callable[[int, str, int, int], None] | None = None

    @property
    def seen(self) -> Study:
        """The study with the numbers of the camera, those of a recording where there is one."""
        if self.like is None:
            return self.study
        return study_as_seen(self.study, self.like, body_track(self.like, self.body))

    @property
    def position_noise(self) -> float:
        """Standard deviation of what the camera adds to a position [m]; "estimate" adds none."""
        noise = self.seen.observation.position_noise_m
        return 0.0 if isinstance(noise, str) else noise

    @property
    def times(self) -> Floats:
        """Time stamps of each recording [s]; of one that is like another without its gaps."""
        if self.like is not None:
            return body_track(self.like, self.body).time
        return self.clock(self.study.recover.durations_s[0])

    @property
    def missing_share(self) -> float:
        """Share of the samples that each recording lacks."""
        if self.like is None:
            return self.study.recover.missing_share
        return 1.0 - self.times.size / self.like.sizes["time"]

    def check(self) -> None:
        """Refuse what is refused for the first recording; later ones can fail by chance."""
        check_recording(self.recording(0), self.search_study(0), flow=self.flow, model=self.model)

    def simulate(self, setting: Mapping[str, Any]) -> xr.Dataset:
        """Return the recording of a setting."""
        return self.recording(int(setting["recording"]))

    def estimate(self, recording: xr.Dataset, setting: Mapping[str, Any]) -> dict[str, Any]:
        """Calibrate a recording."""
        number = int(setting["recording"])
        found = calibrate(
            recording,
            self.model,
            study=self.search_study(number),
            flow=self.flow,
            threads=self.threads,
            tell=None if self.within is None else partial(self.within, number),
        )
        return calibrated_parameters(found, self.model.parameters)

    def missing(self) -> dict[str, Any]:
        """Return the estimates of a recording without a calibration."""
        count = len(self.model.parameters)
        return {
            "estimate": np.full(count, np.nan),
            "interval": np.full((count, 2), np.nan),
            "range": np.full((count, 2), np.nan),
            "determined": np.zeros(count, dtype=bool),
            "half_width": np.full(count, np.nan),
        }

    def recording(self, number: int) -> xr.Dataset:
        """Return what the camera records of one world, a `trajectory`."""
        time = self.times
        settling = self.study.recover.settling_s if self.like is None else 0.0
        # A body starts at rest: the camera is switched on when its motion has settled.
        begun = np.concatenate([[0.0], settling + time]) if settling > 0.0 else time
        when: dict[str, Any] = (
            {"like": self.like, "body": self.body}
            if self.like is not None
            else {"sample_time": begun}
        )
        run = simulate_motion(
            self.model,
            self.values,
            self.study,
            flow=self.flow,
            replicates=1,
            seed=self.seed_of(number, RecoveryStream.WORLD),
            threads=1,
            **when,
        )
        x, y = (run[name].values[0, -time.size :, 0].astype(np.float64) for name in ("x", "y"))
        if self.like is None:
            lost = self.missed(number, time.size)[:, 0]
            x, y = np.where(lost, np.nan, x), np.where(lost, np.nan, y)
        quantum = self.seen.observation.position_quantum_m
        attrs: dict[str, Any] = {"arena": self.study.tank.to_arena_json(), "simulated": "yes"}
        if not isinstance(quantum, str) and quantum > 0.0:
            attrs["position_quantum_m"] = quantum
        return build_trajectory(time, x, y, attrs=attrs)

    def search_study(self, number: int) -> Study:
        """Return the study that a recording is calibrated with; it does not know the camera."""
        known = self.noise == "known"
        return apply_overrides(
            self.study,
            {
                "observation.position_noise_m": self.position_noise if known else "estimate",
                "observation.orientation_noise_rad": "estimate",
                "observation.position_quantum_m": "recording",
                # Two recordings shall not share the chance of the search.
                "calibration.seed": self.seed_of(number, RecoveryStream.SEARCH),
            },
        )


def model_recovery(
    model: MotionModel,
    truth: Mapping[str, float],
    study: Study,
    *,
    flow: xr.Dataset | None,
    like: xr.Dataset | None,
    body: str | None,
    noise: Noise = "estimated",
) -> ModelRecovery:
    """Return a truth that recordings can be made of."""
    if isinstance(model, BlockModel):
        raise InputError("the block has a recovery study of its own: see recovery_study")
    if not model.parameters:
        raise ConfigurationError(
            f"all parameters of the model {model.name} are known: leave one open"
        )
    values = known_values(model, truth)
    for one in model.parameters:
        value, unit = values[one.name], "" if one.unit == "1" else f" {one.unit}"
        if not one.low <= value <= one.high:
            raise ConfigurationError(
                f"{one.name} is {value:g}{unit}, and is searched from {one.low:g} to {one.high:g}: "
                "no calibration finds it; keep it known, or give a value within"
            )
    lengths = study.recover.durations_s
    if like is None and len(lengths) != 1:
        raise InputError(
            f"`recover.durations_s` holds {len(lengths)} lengths: a motion model is studied at one"
        )
    if noise not in get_args(Noise):
        raise ConfigurationError(f"`noise` is one of {', '.join(get_args(Noise))}, got {noise!r}")
    return ModelRecovery(study, model, values, flow, like, body, noise)
