"""The recovery study of a motion model: recordings of known truth, each calibrated."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, Literal, get_args

import numpy as np

from driftwalk.calibration.estimation.run import parameter_parts
from driftwalk.calibration.recovery_study import (
    BrokenSimulation,
    EstimationMethod,
    Tell,
    calibrated_parameters,
    relative_errors,
    summary_by_parameter,
)
from driftwalk.calibration.run import calibrate, check_recording
from driftwalk.conditions import study_in_arena
from driftwalk.conditions.camera import study_as_seen
from driftwalk.core.arrays import Floats
from driftwalk.core.calibration_stages import CALIBRATION_STAGES
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.core.progress import ignore_progress
from driftwalk.core.random_streams import RecoveryStream
from driftwalk.model import Study, apply_overrides
from driftwalk.motion import BlockModel, MotionModel, ParticleModel, known_values, simulate_motion
from driftwalk.schema import body_track, build_trajectory
from driftwalk.schema.answers.facts import texts
from driftwalk.schema.check import build_dataset
from driftwalk.sweep import Design, Store, grid, threads_of_unit

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
    truth : mapping of str to float
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
    truth: Mapping[str, float]
    flow: xr.Dataset | None = None
    like: xr.Dataset | None = None
    body: str | None = None
    noise: Noise = "estimated"
    threads: int | None = None
    within: Callable[[int, str, int, int], None] | None = None

    kind: ClassVar = "model_recovery"
    work: ClassVar = "recordings"
    parts: ClassVar = 100

    @property
    def values(self) -> dict[str, float]:
        """The true value of each parameter, all of them."""
        return known_values(self.model, self.truth)

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
        """Refuse true values that no calibration finds, and recordings that cannot be made."""
        if isinstance(self.model, BlockModel):
            raise InputError("the block has its own recovery study: see recovery_study")
        if not self.model.parameters:
            raise ConfigurationError(
                f"all parameters of the model {self.model.name} are known: leave one open"
            )
        values = self.values
        for one in self.model.parameters:
            value, unit = values[one.name], "" if one.unit == "1" else f" {one.unit}"
            if not one.low <= value <= one.high:
                raise ConfigurationError(
                    f"{one.name} is {value:g}{unit}, and is searched from {one.low:g} to "
                    f"{one.high:g}: no calibration finds it; keep it known, or give a value within"
                )
        lengths = self.study.recover.durations_s
        if self.like is None and len(lengths) != 1:
            raise InputError(
                f"`recover.durations_s` holds {len(lengths)} lengths: a motion model is studied at "
                "one"
            )
        if self.noise not in get_args(Noise):
            raise ConfigurationError(
                f"`noise` is one of {', '.join(get_args(Noise))}, got {self.noise!r}"
            )
        # What is refused for one recording is refused for all; later ones can fail by chance.
        check_recording(self.recording(0), self.search_study(0), flow=self.flow, model=self.model)

    def design(self) -> Design:
        """Return the recordings."""
        return grid(recording=np.arange(self.study.recover.recordings))

    def recover(
        self,
        *,
        store: Store | None = None,
        threads: int | None = None,
        executor: Executor | None = None,
        tell: Tell = ignore_progress,
    ) -> xr.Dataset:
        """Calibrate one recording after the other here, or several on other workers."""
        # Only work of this process can say how far it is within a recording.
        within = partial(_tell_stage, tell, self) if executor is None else None
        method = replace(self, threads=threads_of_unit(threads, executor), within=within)
        return method.sweep(store=store, executor=executor, progress=self.counted(tell))

    def result(self, found: Mapping[str, Any]) -> xr.Dataset:
        """Return the `model_recovery`."""
        parameters, study = self.model.parameters, self.study
        exact = self.values
        truth = np.array([exact[one.name] for one in parameters])
        scales = [one.scale for one in parameters]
        # Ends of the intervals in the measure of the errors, so that a figure shows them together.
        error, *ends = (
            relative_errors(values, truth, found["range"], scales)
            for values in (found["estimate"], *np.moveaxis(found["interval"], -1, 0))
        )
        confidence = study.calibration.confidence
        each = ("recording", "parameter")
        summary = summary_by_parameter(
            error, found["interval"], found["determined"], truth, confidence=confidence
        )
        named = parameter_parts(parameters)
        data: dict[str, Any] = {
            **named.data,
            "truth": ("parameter", truth),
            **{name: (each, found[name]) for name in ("estimate", "determined", "half_width")},
            **{name: ((*each, "bound"), found[name]) for name in ("interval", "range")},
            "error": (each, error),
            "error_interval": ((*each, "bound"), np.stack(ends, axis=-1)),
            "status": ("recording", found["status"].astype(np.int8)),
            "message": ("recording", texts([str(one) for one in found["message"]])),
            **{name: ("parameter", values) for name, values in summary.items()},
        }
        coords = {**named.coords, "recording": ("recording", np.arange(len(error)))}
        time = self.times
        attrs = {
            "model": self.model.name,
            "fixed": json.dumps(_fixed(self.model)),
            "duration_s": float(time[-1] - time[0]),
            "sample_rate_Hz": float(f"{1.0 / np.median(np.diff(time)):.6g}"),
            "missing_share": self.missing_share,
            "position_noise_m": self.position_noise,
            "noise": self.noise,
            "confidence": confidence,
            "seed": study.recover.seed,
            "arena": study.tank.to_arena_json(),
            "source": "" if self.like is None else str(self.like.attrs.get("source", "")),
            "study": study.to_toml(),
        }
        return build_dataset("model_recovery", data, coords, attrs)

    def simulate(self, setting: Mapping[str, Any]) -> xr.Dataset:
        """Return the recording of a setting."""
        try:
            return self.recording(int(setting["recording"]))
        except InputError as error:
            # `check` has made the first one, so that this one failed by chance.
            raise BrokenSimulation(str(error)) from error

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


def _tell_stage(
    tell: Tell, study: ModelRecovery, recording: int, stage: str, done: int, total: int
) -> None:
    """Say how far the calibration of a recording is."""
    known, count, parts = CALIBRATION_STAGES[stage], study.study.recover.recordings, study.parts
    percent = known.percent(done / total if total else 1.0)
    tell(
        parts * recording + round(0.01 * parts * percent),
        parts * count,
        f"recording {recording + 1} of {count}: {known.words}",
    )


def _fixed(model: MotionModel) -> dict[str, float]:
    """Return what the model knows; a clearance of 0 is none: calibrations look for theirs."""
    fixed: Mapping[str, float] = getattr(model, "fixed", {})
    clearance = model.clearance if isinstance(model, ParticleModel) else 0.0
    return {**fixed, **({"clearance": clearance} if clearance else {})}


def recover_model(
    model: MotionModel,
    truth: Mapping[str, float],
    study: Study | None = None,
    *,
    flow: xr.Dataset | None = None,
    like: xr.Dataset | None = None,
    body: str | None = None,
    noise: Noise = "estimated",
    threads: int | None = None,
    executor: Executor | None = None,
    store: Store | None = None,
    tell: Tell | None = None,
) -> xr.Dataset:
    """Simulate recordings of a motion model of known truth, calibrate them, and compare.

    Each recording is calibrated as `calibrate` does it for a recording of one's own: the parameters
    of the model are searched, and the noise of the camera is estimated unless it is known. A value
    that the model was made with is known to the simulation and to the calibration.

    Parameters
    ----------
    model : MotionModel
        The model, as `motion_model` returns it, with at least one parameter left open.
    truth : mapping of str to float
        The true value of each of its parameters, in its unit.
    study : Study, optional
        Tank, [observation] of the camera, and the search; ``[recover]`` has the number of
        recordings, their length (one), clock and gaps, and the seed. Default: the paper's, in the
        tank of `like`.
    flow : xarray.Dataset, optional
        The water's velocity, for a model that has a use for it. It is known to the calibration.
    like : xarray.Dataset, optional
        A `trajectory` that gives start, time stamps, gaps and camera in place of the study.
    body : str, optional
        Its body, where there are several.
    noise : {"estimated", "known"}
        Whether a calibration estimates the noise of the camera from its recording, or knows it.
    threads : int, optional
        Default: all processors. The result does not depend on it.
    executor : concurrent.futures.Executor, optional
        Calibrates recordings elsewhere, see `driftwalk.sweep.run_sweep`; each then has one thread
        if `threads` is left out. Workers of a Dask cluster need the same numpy and scipy.
    store : Store, optional
        Where finished recordings are kept; memory when left out.
    tell : callable, optional
        Called with the hundredths of recordings that are done, all of them, and the work under way.

    Returns
    -------
    xarray.Dataset
        A `model_recovery`: estimate, interval, and whether it is determined, by recording and
        parameter; median error, share determined and coverage by parameter.

    Raises
    ------
    ConfigurationError
        When a true value is missing, is none, or belongs to no parameter.
    InputError
        When the recordings would be too short or motionless, several lengths are given, or the
        model is the block.

    Examples
    --------
    >>> import driftwalk as dw
    >>> model = dw.motion_model("active", turn_rate=0.0)
    >>> truth = {"speed": 0.03, "rotational_diffusion": 0.5}
    >>> found = dw.calibration.recover_model(model, truth)  # doctest: +SKIP
    >>> found["median_error"].sel(parameter="speed").item()  # doctest: +SKIP
    0.01
    """
    if study is None:
        study = Study() if like is None else study_in_arena(Study(), like)
    return ModelRecovery(study, model, truth, flow, like, body, noise).recover(
        store=store, threads=threads, executor=executor, tell=tell or ignore_progress
    )
