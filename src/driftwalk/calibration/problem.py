"""What a calibration compares: one recording, made ready once, and the worlds that answer it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk import _core
from driftwalk.comparison import StepPlan, apply_steps, plan_steps
from driftwalk.core.errors import InputError
from driftwalk.core.processors import default_threads
from driftwalk.core.seeds import world_keys
from driftwalk.simulation.backend import Camera, native_model, world_table
from driftwalk.simulation.initial import Start, recorded_start, world_orientations
from driftwalk.simulation.run import without_gaps

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study
    from driftwalk.schema import Track

Floats = npt.NDArray[np.float64]

DENSITY_BINS: Final = 32
EXCERPT_S: Final = 30.0
FEWEST_PAIRS: Final = 30

STAGES: Final[dict[str, int]] = {
    "coarse": 1,
    "refined": 2,
    "surface": 3,
    "bootstrap": 4,
    "floor": 5,
    "first_half": 6,
    "first_half_refined": 7,
    "second_half": 8,
    "coverage": 9,
}
"""Each stage of a calibration has random streams of its own; a number is never used twice."""


@dataclass(frozen=True, eq=False)
class Problem:
    """A recording with everything that a comparison with simulated worlds needs.

    Attributes
    ----------
    study : Study
        The model; drag coefficient and force_std come from the settings, not from it.
    flow : xarray.Dataset
        The water's velocity.
    sample_time : ndarray, shape (n,)
        Time stamps of a world [s]: the recording's, from its first sample on.
    plan : StepPlan
        Which samples of a world form steps: those of the recording, unless the study leaves out
        its gaps.
    steps : ndarray, shape (pairs, 2)
        The recording's step lengths [m] and turning angles [rad].
    start : Start
        Pose and motion at the first sample.
    camera : Camera
        Noise and resolution of the samples.
    length_limit, angle_limit : float
        The density's bins cover [0, length_limit] m and [-angle_limit, angle_limit] rad.
    threads : int
        Threads of the native core; results do not depend on it.
    """

    study: Study
    flow: xr.Dataset
    sample_time: Floats
    plan: StepPlan
    steps: Floats
    start: Start
    camera: Camera
    length_limit: float
    angle_limit: float
    threads: int

    @property
    def excerpt(self) -> int:
        """Samples in the first 30 seconds."""
        return int(np.searchsorted(self.sample_time, EXCERPT_S, side="right"))

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return float(self.sample_time[-1])

    def model(self) -> _core.Model:
        """Return the native core's form of the model."""
        return native_model(self.study, self.flow, self.sample_time, self.camera)


def prepare_problem(
    track: Track,
    study: Study,
    flow: xr.Dataset,
    *,
    camera: Camera,
    threads: int | None = None,
) -> Problem:
    """Make a recorded track ready for comparison.

    Parameters
    ----------
    track : Track
        The present samples of one body.
    study : Study
        The model and the step interval.
    flow : xarray.Dataset
        A `flow_field`.
    camera : Camera
        See `recorded_camera`.
    threads : int, optional
        Default: all processors.

    Raises
    ------
    InputError
        When the track is too short to form steps, or never moves.
    """
    if track.time.size < 3:
        raise InputError(
            f"the recording has {track.time.size} samples of this body; at least 3 are needed"
        )
    time = track.time - track.time[0]
    interval = study.steps.step_interval_s
    plan = plan_steps(time, step_interval=None if interval == "auto" else interval)
    found = apply_steps(plan, track.x, track.y)
    steps = np.ascontiguousarray(np.column_stack([found.step_length, found.turning_angle]))
    if len(steps) < FEWEST_PAIRS:
        raise InputError(
            f"the recording gives {len(steps)} pairs of steps, at least {FEWEST_PAIRS} are needed: "
            "it hardly moves, is too short, or its clock does not suit the step interval "
            "(--step-interval)"
        )
    # Without the recording's gaps the worlds have time stamps, and so a plan, of their own.
    if study.observation.gaps == "none":
        time = without_gaps(time)
        plan = plan_steps(time, step_interval=plan.step_interval)
    return Problem(
        study=study,
        flow=flow,
        sample_time=time,
        plan=plan,
        steps=steps,
        start=recorded_start(track, window=study.flow.smoothing_window_s),
        camera=camera,
        length_limit=1.5 * float(np.quantile(steps[:, 0], 0.999)),
        angle_limit=min(np.pi, 2.5 * float(np.quantile(np.abs(steps[:, 1]), 0.98))) or np.pi,
        threads=threads or default_threads(),
    )


def worlds_of(
    problem: Problem,
    drag_coefficient: npt.ArrayLike,
    force_std: npt.ArrayLike,
    *,
    stage: str,
    first: int,
    replicates: int,
) -> tuple[Floats, npt.NDArray[np.uint64]]:
    """Return the worlds of consecutive settings, replicates fastest, and their random keys.

    `first` is the index of the first setting within its stage: it is part of the address.
    """
    settings = np.atleast_1d(np.asarray(drag_coefficient, dtype=np.float64)).size
    trial = (np.uint64(STAGES[stage]) << np.uint64(40)) + np.arange(
        first, first + settings, dtype=np.uint64
    )
    keys = world_keys(
        problem.study.calibration.seed,
        trial=trial[:, None],
        replicate=np.arange(replicates)[None, :],
    )
    start = problem.start
    table = world_table(
        x=start.x,
        y=start.y,
        theta=world_orientations(start.theta, keys),
        vx=start.vx,
        vy=start.vy,
        omega=start.omega,
        drag_coefficient=np.repeat(np.asarray(drag_coefficient, dtype=np.float64), replicates),
        force_std=np.repeat(np.asarray(force_std, dtype=np.float64), replicates),
    )
    return table, keys


def score_worlds(
    problem: Problem,
    model: _core.Model,
    worlds: tuple[Floats, npt.NDArray[np.uint64]],
    *,
    details: str = "none",
    keep_steps: str = "no",
) -> dict[str, npt.NDArray[Any]]:
    """Simulate worlds and compare each with the recording as it finishes.

    Parameters
    ----------
    problem, model, worlds
        As of `prepare_problem`, `Problem.model`, `worlds_of`.
    details : {"none", "all"}
        Whether to keep the step density and the excerpt of every world.
    keep_steps : {"no", "yes"}
        Whether to return the steps themselves.

    Returns
    -------
    dict of ndarray
        One entry per world each: `ks_distance`, its place, `status`, `pairs`, and what was asked.
    """
    table, keys = worlds
    full = details == "all"
    return dict(
        _core.score(
            model,
            table,
            keys,
            left=problem.plan.left,
            weight=problem.plan.weight,
            triple=problem.plan.triple,
            reference=problem.steps,
            bins=DENSITY_BINS if full else 0,
            length_limit=problem.length_limit,
            angle_limit=problem.angle_limit,
            excerpt=problem.excerpt if full else 0,
            keep_steps=keep_steps == "yes",
            threads=problem.threads,
        )
    )
