"""Candidates of a comparison: what each model is given, and what of it is searched.

Among them are resampling baselines without an arena: they know the recorded steps and no more.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.calibration.estimation.identifiability import DETERMINED
from driftwalk.calibration.held_out.hidden_markov import HiddenMarkovModel, fit_hidden_markov_model
from driftwalk.calibration.held_out.recorded import RecordedMotion, recorded_ranges
from driftwalk.comparison.aspects import Aspect, block_of, interleaved
from driftwalk.conditions import Conditions, unstated_warning
from driftwalk.conditions.recorded import flow_from_track
from driftwalk.core.arrays import Floats, Integers
from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.motion import BlockModel, MotionModel, ParticleModel, Worlds, motion_model
from driftwalk.motion.protocol import WorldRandom
from driftwalk.schema import Parameter, Track

if TYPE_CHECKING:
    from driftwalk.core.arrays import Keys
    from driftwalk.motion.protocol import Values


class Baseline:
    """A walk of whole steps in an open plane, seen at the recording's time stamps.

    Recorded steps hold the noise of the camera, so none is added.
    """

    parameters: tuple[Parameter, ...] = ()
    needs_flow = False
    name: str
    interval: float

    def steps(self, random: WorldRandom, count: int) -> tuple[Floats, Floats]:
        """Return step lengths [m] and turning angles [rad], shape (worlds, count)."""
        raise NotImplementedError

    def simulate(self, values: Values, like: Conditions, keys: Keys) -> Worlds:  # noqa: ARG002
        """Return one world per key; see `MotionModel.simulate`."""
        random = WorldRandom(keys)
        count = int(np.ceil(like.sample_time[-1] / self.interval)) + 1
        first = 2.0 * np.pi * random.uniform(1)
        length, turn = self.steps(random, count)
        heading = first + np.cumsum(turn, axis=1)
        corner = self.interval * np.arange(count + 1)
        x, y = (
            np.array(
                [
                    np.interp(like.sample_time, corner, np.concatenate([[begin], begin + row]))
                    for row in np.cumsum(length * along, axis=1)
                ]
            )
            for begin, along in ((like.start.x, np.cos(heading)), (like.start.y, np.sin(heading)))
        )
        return Worlds(x, y, np.full(x.shape, np.nan), np.zeros(keys.size, dtype=np.uint32))

    def describe(self) -> dict[str, Any]:
        """Return its name."""
        return {"name": self.name}

    def facts(self, estimate: Mapping[str, float]) -> dict[str, Any]:  # noqa: ARG002
        """Return its name."""
        return {"model": self.name}


@dataclass(eq=False)
class ResampledSteps(Baseline):
    """Recorded steps, drawn independently of each other.

    Attributes
    ----------
    recorded : ndarray, shape (n, 2)
        Step lengths [m] and turning angles [rad].
    interval : float
        Step interval [s].
    """

    recorded: Floats
    interval: float
    name = "resampled steps"

    def steps(self, random: WorldRandom, count: int) -> tuple[Floats, Floats]:
        """Return step lengths and turning angles; see `Baseline.steps`."""
        drawn = self.recorded[(random.uniform(count) * len(self.recorded)).astype(np.int64)]
        return drawn[..., 0], drawn[..., 1]


@dataclass(eq=False)
class HiddenMarkovWalk(Baseline):
    """Steps of a hidden Markov walk.

    Attributes
    ----------
    walk : HiddenWalk
        The fitted walk.
    interval : float
        Step interval [s].
    """

    walk: HiddenMarkovModel
    interval: float
    name = "hidden Markov walk"

    def steps(self, random: WorldRandom, count: int) -> tuple[Floats, Floats]:
        """Return step lengths and turning angles; see `Baseline.steps`."""
        walk = self.walk
        begin, moves = np.cumsum(walk.begin), np.cumsum(walk.transition, axis=1)
        chance = random.uniform(count)
        state = np.empty(chance.shape, dtype=np.int64)
        state[:, 0] = _chosen(begin[None], chance[:, 0])
        for k in range(1, count):
            state[:, k] = _chosen(moves[state[:, k - 1]], chance[:, k])
        length, turn = np.empty(state.shape), np.empty(state.shape)
        for world, (one, row) in enumerate(zip(random.generators, state, strict=True)):
            length[world] = one.gamma(walk.shape[row], walk.scale[row])
            turn[world] = one.vonmises(walk.direction[row], walk.concentration[row])
        return length, turn


def runs_of(steps: Aspect, interval: float) -> list[Floats]:
    """Return the steps as runs in which each follows the one before."""
    # A step is missing between two whose times are more than 1.5 intervals apart.
    breaks = np.flatnonzero(np.diff(steps.time) > 1.5 * interval) + 1
    return [run for run in np.split(steps.points, breaks) if len(run)]


def _chosen(cumulative: Floats, chance: Floats) -> Integers:
    """Return in which part of cumulative probabilities each number falls."""
    found = (chance[:, None] >= cumulative).sum(axis=1)
    return np.asarray(np.minimum(found, cumulative.shape[-1] - 1), dtype=np.int64)


BLOCK: Final = "block"

Chosen = str | MotionModel


class Candidate(NamedTuple):
    """A model that takes part in a comparison."""

    model: MotionModel
    like: Conditions
    ranges: tuple[Parameter, ...]
    """Of the search; none for a walk that was fitted by other means."""
    numbers: int
    """That are fitted."""
    baseline: bool

    def at_range_end(self, point: Floats) -> str | None:
        """Return a warning where a point of the unit cube is at the end of a range."""
        ended = [
            one.name
            for one, share in zip(self.ranges, point, strict=True)
            if min(share, 1.0 - share) < DETERMINED.range_end
        ]
        if not ended:
            return None
        return f"at the end of its range: {', '.join(ended)}; extend the range, or doubt the model"


def made_models(models: Sequence[Chosen], motion: RecordedMotion) -> list[MotionModel]:
    """Return the models, made of their names."""
    found = [
        BlockModel(motion.study)
        if one == BLOCK
        else with_contact_clearance(motion_model(one) if isinstance(one, str) else one, motion)
        for one in models
    ]
    names = [model.name for model in found]
    if not names:
        raise ConfigurationError("no motion model is given to compare")
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise ConfigurationError(f"a motion model is given twice: {twice[0]}")
    return found


def prepare_candidates(
    models: Sequence[MotionModel], motion: RecordedMotion
) -> tuple[list[Candidate], list[str]]:
    """Return the models with their conditions and ranges, and warnings of the recording.

    Where the flow is not known, models that need one get that of the even blocks of time. Where
    none can be extracted they are left out, with a warning, and so is a model that feels other
    bodies where there are none.
    """
    found: list[Candidate] = []
    warnings: list[str] = []
    for model in models:
        try:
            found.append(_prepare_candidate(model, motion))
        except InputError as error:
            if len(models) == 1:
                raise
            what = "the block" if model.name == BLOCK else model.name
            warnings.append(f"{what} is left out: {error}")
    if not found:
        raise InputError("; ".join(warnings))
    unstated = unstated_warning(
        motion.study, about="block" if any(one.name == BLOCK for one in models) else "tank"
    )
    said = [] if unstated is None else [unstated]
    return found, [*said, *warnings, *motion.warnings]


def resampling_baselines(motion: RecordedMotion) -> list[Candidate]:
    """Return walks of the steps in the even blocks."""
    (steps,), _ = interleaved([motion.steps], duration=motion.duration)
    interval = motion.plan.short.step_interval
    hidden = fit_hidden_markov_model(runs_of(steps, interval))
    walk = HiddenMarkovWalk(hidden, interval)
    return [
        Candidate(ResampledSteps(steps.points, interval), motion.like, (), 0, baseline=True),
        Candidate(walk, motion.like, (), hidden.parameters, baseline=True),
    ]


def _within_reach(parameter: Parameter, motion: RecordedMotion) -> Parameter:
    """Return the range of a neighbour's push without what is too short to be felt.

    Below a quarter of the usual distance e^-4 is left of a push, 2 %, so all settings are alike
    there, and a search gets lost.
    """
    low = motion.usual_distance / 4.0
    if parameter.name != "neighbour_range" or not parameter.low < low < parameter.high:
        return parameter
    return replace(parameter, low=low, step=0.0)


def _prepare_candidate(model: MotionModel, motion: RecordedMotion) -> Candidate:
    ranges = model.parameters
    if isinstance(model, ParticleModel):
        model.require_others(motion.like)
        ranges = recorded_ranges(ranges, motion.scales)
        if model.feels_others:
            ranges = tuple(_within_reach(one, motion) for one in ranges)
    like = motion.like
    if model.needs_flow and like.flow is None:
        even = block_of(motion.track.time, motion.duration) % 2 == 0
        track = Track(*(part[even] for part in motion.track))
        like = replace(like, flow=flow_from_track(track, motion.study))
    return Candidate(model, like, ranges, len(ranges), baseline=False)


def with_contact_clearance(model: MotionModel, motion: RecordedMotion) -> MotionModel:
    """Return the model with the recording's distance from the wall at contact, if it has no own.

    Raises
    ------
    InputError
        When the model's own is larger than any recorded distance from the wall.
    """
    # Only the family leaves its distance from the wall to the recording.
    if not isinstance(model, ParticleModel):
        return model
    if not model.states_clearance:
        return model.with_clearance(motion.clearance.distance)
    if model.clearance >= motion.depth:
        raise InputError(
            f"a clearance of {1e3 * model.clearance:.4g} mm: the body was recorded no further than "
            f"{1e3 * motion.depth:.4g} mm from the wall; state its distance from the wall at "
            "contact, in metres or with a unit"
        )
    return model


def takes_recorded_clearance(model: MotionModel, motion: RecordedMotion) -> bool:
    """Return whether a model has its distance from the wall at contact from the recording."""
    return isinstance(model, ParticleModel) and model.clearance == motion.clearance.distance
