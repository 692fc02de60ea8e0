"""The problem of a calibration: one recording, made ready once, and how its worlds are computed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.comparison import Statistic, StepDistance, StepReference, plan_steps
from driftwalk.conditions import (
    Conditions,
    Neighbours,
    neighbours_of,
    recorded_camera,
    recorded_conditions,
    require_travel,
)
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.core.progress import ignore_progress
from driftwalk.core.random_streams import trial_in, world_keys
from driftwalk.motion import BlockModel, Details, MotionModel, Parameter, Scores, score_worlds
from driftwalk.schema import Track, body_track
from driftwalk.simulation.backend import Camera
from driftwalk.sweep import Store

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study

Axes = tuple[Floats, ...]
"""One array per parameter, in its coordinate."""
FlowSource = Callable[[Track], "xr.Dataset | None"]
"""Gives the flow for a track."""
Tell = Callable[[str, int, int], None]
"""Hears of a stage, of what is done of it, and of all of it."""


Stores = Callable[[str, dict[str, Any]], Store | None]
"""Gives the store of a stage, by its name and fingerprint; None keeps results in memory."""


def in_memory(name: str, fingerprint: dict[str, Any]) -> Store | None:  # noqa: ARG001
    """Keep the results of a stage in memory."""
    return None


class Execution(NamedTuple):
    """How a calibration is computed; its result does not depend on it."""

    executor: Executor | None = None
    """Computes work units elsewhere, with one thread each."""
    stores: Stores = in_memory
    tell: Tell = ignore_progress


@dataclass(frozen=True, eq=False)
class Problem:
    """A recording with everything that a comparison with simulated worlds needs.

    Attributes
    ----------
    model : MotionModel
        What is simulated; its parameters come from the settings of a search.
    study : Study
        The search: replicates, refinement, bootstrap, seed.
    like : Conditions
        What the worlds take over from the recording.
    statistic : Statistic
        The distance of a world from the recording.
    reference : StepReference
        The recording's steps, and how a world forms its own.
    """

    model: MotionModel
    study: Study
    like: Conditions
    statistic: Statistic
    reference: StepReference

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters to search, in the order of the dimensions."""
        return self.model.parameters

    @property
    def refined_steps(self) -> tuple[float, ...]:
        """Steps of the refined grid along each parameter, in its coordinate."""
        return tuple(parameter.refined_step for parameter in self.parameters)

    @property
    def steps(self) -> Floats:
        """The recording's step lengths [m] and turning angles [rad], shape (pairs, 2)."""
        return self.reference.steps

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return float(self.like.sample_time[-1])


def require_samples(track: Track) -> None:
    """Refuse a track on which no step turns."""
    if track.time.size < 3:
        raise InputError(
            f"the recording has {track.time.size} samples of this body; at least 3 are needed"
        )


def prepare_problem(
    track: Track,
    study: Study,
    flow: xr.Dataset | None,
    *,
    camera: Camera,
    model: MotionModel | None = None,
    statistic: Statistic | None = None,
    neighbours: Neighbours | None = None,
    threads: int | None = None,
) -> Problem:
    """Make a recorded track ready for comparison."""
    require_samples(track)
    chosen = StepDistance() if statistic is None else statistic
    interval = study.steps.step_interval_s
    reference = chosen.prepare(track, step_interval=None if interval == "auto" else interval)
    like = recorded_conditions(
        track, study, camera=camera, flow=flow, neighbours=neighbours, threads=threads
    )
    # Without the recording's gaps the worlds have time stamps, and so a plan, of their own.
    if study.observation.gaps == "none":
        plan = plan_steps(like.sample_time, step_interval=reference.plan.step_interval)
        reference = replace(reference, plan=plan)
    return Problem(BlockModel(study) if model is None else model, study, like, chosen, reference)


def recorded_problem(
    recording: xr.Dataset,
    study: Study,
    flow_of: FlowSource,
    *,
    model: MotionModel,
    statistic: Statistic | None = None,
    body: str | None = None,
    threads: int | None = None,
) -> tuple[Track, Problem]:
    """Return the track of a body of a recording, and its problem; see `prepare_problem`."""
    track = body_track(recording, body)
    require_samples(track)
    require_travel(track, study, of_block=isinstance(model, BlockModel))
    quantum = float(recording.attrs.get("position_quantum_m", 0.0))
    problem = prepare_problem(
        track,
        study,
        flow_of(track),
        camera=recorded_camera(track, study, position_quantum=quantum),
        model=model,
        statistic=statistic,
        neighbours=neighbours_of(recording, body, study.tank),
        threads=threads,
    )
    return track, problem


def limits_of(problem: Problem) -> tuple[tuple[float, float], ...]:
    """Return the ends of the search along every parameter, in its coordinate."""
    return tuple(
        (float(parameter.coordinates[0]), float(parameter.coordinates[-1]))
        for parameter in problem.parameters
    )


def score_settings(
    problem: Problem,
    settings: Sequence[npt.ArrayLike],
    *,
    stage: str,
    numbers: npt.ArrayLike,
    replicates: range,
    details: Details = "none",
) -> Scores:
    """Simulate settings and compare each world with the recording."""
    columns = [np.atleast_1d(np.asarray(column, dtype=np.float64)) for column in settings]
    trial = trial_in(stage, np.asarray(numbers))
    seed = problem.study.calibration.seed
    keys = world_keys(seed, trial=trial[:, None], replicate=np.asarray(replicates)[None, :])
    values = {
        parameter.name: np.repeat(parameter.to_value(column), len(replicates))
        for parameter, column in zip(problem.parameters, columns, strict=True)
    }
    return score_worlds(
        problem.model,
        values,
        problem.like,
        keys,
        problem.reference,
        statistic=problem.statistic,
        details=details,
    )
