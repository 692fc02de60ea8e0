"""Bodies of a motion model that go on from where they are, whatever becomes of their parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

import numpy as np

from driftwalk.conditions import Conditions
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.core.random_streams import world_keys
from driftwalk.motion import MotionModel, ParticleModel, Worlds, model_start
from driftwalk.simulation.backend import STATUS, Camera
from driftwalk.simulation.initial import Start
from driftwalk.simulation.series import continued_flow, flow_starts, velocity_at

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


STRETCH_S: Final = 300.0
"""Time that is simulated at once [s]."""


class MovingBodies:
    """Some bodies of a motion model, simulated a stretch at a time.

    A stretch is long, because a model remembers nothing beyond it but pose and velocity: a rest or
    a slow change of the speed begins again with each stretch, and wherever a parameter changes.

    Parameters
    ----------
    model : MotionModel
        The model.
    values : mapping of str to float
        The value of each of its parameters.
    study : Study
        Tank and start.
    flow : xarray.Dataset or None
        The water's velocity, for a model that has a use for it.
    bodies : int
        How many, each in a world of its own.
    interval : float
        Time between the positions of a step [s], a whole multiple of that between samples.
    seed : int
        Of the first stretch.
    """

    def __init__(
        self,
        model: MotionModel,
        values: Mapping[str, float],
        study: Study,
        flow: xr.Dataset | None,
        *,
        bodies: int,
        interval: float,
        seed: int,
    ) -> None:
        self.model, self.study = model, study
        self.flow = None if flow is None else continued_flow(flow, study, duration=math.inf)
        self.values = dict(values)
        # Bodies move straight between two samples: for 0.05 s at most.
        self.every = max(math.ceil(interval / 0.05 - 1e-9), 1)
        """Samples in the interval of a step."""
        self.sample_s = interval / self.every
        samples = min(math.ceil(STRETCH_S / self.sample_s), 20_000)
        count = max(samples, 2 * self.every) + 1
        self._times: Floats = np.arange(count, dtype=np.float64) * self.sample_s
        self.restart(bodies=bodies, seed=seed)

    def restart(self, *, bodies: int, seed: int) -> None:
        """Begin again at the start of the study, with random numbers of another seed."""
        self._seed, self._stretch, self.sample = seed, 0, 0
        keys = world_keys(seed, trial=0, replicate=np.arange(bodies))
        self._begun = flow_starts(self.flow, self.study, keys, duration=math.inf)
        begin = model_start(self.model, self.study, self.flow, keys, self._begun)
        self._run(begin, bodies)

    def change(self, name: str, value: float) -> None:
        """Change a parameter; the bodies go on with it from where they are.

        Raises
        ------
        InputError
            When the model fails with it; the former value stays in force.
        """
        before = self.values[name]
        self.values[name] = value
        try:
            self._go_on()
        except InputError:
            self.values[name] = before
            raise

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.sample * self.sample_s

    @property
    def count(self) -> int:
        """How many bodies there are."""
        return int(self._worlds.x.shape[0])

    def next(self) -> None:
        """Go on to the next sample.

        Raises
        ------
        InputError
            When the model fails, or a body loses its numbers.
        """
        if self._at + 1 >= self._times.size:
            self._go_on()
        self._at += 1
        self.sample += 1

    def place(self, share: float = 0.0) -> tuple[Floats, Floats, Floats]:
        """Return x, y [m] and theta [rad], a share of the way from this sample to the next."""
        at, to = self._at, min(self._at + 1, self._times.size - 1)
        x, y = (
            (1.0 - share) * row[:, at] + share * row[:, to]
            for row in (self._worlds.x, self._worlds.y)
        )
        return x, y, np.asarray(self._worlds.theta[:, at], dtype=np.float64)

    def _go_on(self) -> None:
        """Simulate the next stretch, from the pose and velocity of now."""
        worlds, at = self._worlds, self._at
        x, y, theta = self.place()
        before, after = (at - 1, at) if at > 0 else (at, at + 1)
        vx, vy = (
            (row[:, after].astype(np.float64) - row[:, before]) / self.sample_s
            for row in (worlds.x, worlds.y)
        )
        start = Start(x, y, theta, vx, vy)
        if isinstance(self.model, ParticleModel) and self.model.member.kind == "switching":
            start = _along_heading(start, self.flow, self._moment(self.count))
        self._stretch += 1
        self._run(start, self.count)

    def _moment(self, bodies: int) -> Floats | None:
        """Return the time on the clock of a flow that changes, of each body [s]."""
        return None if self._begun is None else self._begun[:bodies] + self.time

    def _run(self, start: Start, bodies: int) -> None:
        like = Conditions(
            sample_time=self._times,
            start=start,
            camera=Camera(),
            tank=self.study.tank,
            view=None,
            flow=self.flow,
            threads=1,
            flow_start=self._moment(bodies),
        )
        keys = world_keys(self._seed, trial=self._stretch, replicate=np.arange(bodies))
        columns = {name: np.full(bodies, value) for name, value in self.values.items()}
        worlds: Worlds = self.model.simulate(columns, like, keys)
        if (worlds.status & STATUS["non_finite"]).any():
            raise InputError(
                f"a body of the model {self.model.name} has a position that is no finite number"
            )
        self._worlds, self._at = worlds, 0


def _along_heading(start: Start, flow: xr.Dataset | None, moment: Floats | None) -> Start:
    """Return a start in which bodies swim along their heading, which a difference only comes near.

    In the water's frame: the flow carries them besides.
    """
    u: Floats | float = 0.0
    v: Floats | float = 0.0
    if flow is not None:
        u, v = velocity_at(flow, start.x, start.y, 0.0 if moment is None else moment)
    speed = np.hypot(np.asarray(start.vx) - u, np.asarray(start.vy) - v)
    theta = np.asarray(start.theta)
    return start._replace(vx=u + speed * np.cos(theta), vy=v + speed * np.sin(theta))
