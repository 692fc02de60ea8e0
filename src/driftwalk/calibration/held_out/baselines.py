"""Resampling baselines without an arena: they know the recorded steps and no more."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.calibration.held_out.hidden_markov import HiddenMarkovModel
from driftwalk.comparison.aspects import Aspect
from driftwalk.core.arrays import Floats, Integers
from driftwalk.motion import Worlds
from driftwalk.motion.protocol import WorldRandom

if TYPE_CHECKING:
    from driftwalk.conditions import Conditions
    from driftwalk.core.arrays import Keys
    from driftwalk.motion.protocol import Values
    from driftwalk.schema import Parameter


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
        rows = zip(random.generators, state, strict=True)
        drawn = [
            (
                one.gamma(walk.shape[row], walk.scale[row]),
                one.vonmises(walk.direction[row], walk.concentration[row]),
            )
            for one, row in rows
        ]
        return np.array([length for length, _ in drawn]), np.array([turn for _, turn in drawn])


def runs_of(steps: Aspect, interval: float) -> list[Floats]:
    """Return the steps as runs in which each follows the one before."""
    # A step is missing between two whose times are more than 1.5 intervals apart.
    breaks = np.flatnonzero(np.diff(steps.time) > 1.5 * interval) + 1
    return [run for run in np.split(steps.points, breaks) if len(run)]


def _chosen(cumulative: Floats, chance: Floats) -> Integers:
    """Return in which part of cumulative probabilities each number falls."""
    found = (chance[:, None] >= cumulative).sum(axis=1)
    return np.asarray(np.minimum(found, cumulative.shape[-1] - 1), dtype=np.int64)
