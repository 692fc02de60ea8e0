"""The playground of a motion model: bodies that move, with a slider for each parameter."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.conditions import Conditions
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.core.random_streams import world_keys
from driftwalk.motion import MotionModel, ParticleModel, Worlds, known_values, model_start
from driftwalk.schema import Parameter
from driftwalk.simulation.backend import STATUS, Camera
from driftwalk.simulation.initial import Start
from driftwalk.simulation.series import continued_flow, flow_starts, velocity_at
from driftwalk.viewer.play.motion import INTERVAL_S
from driftwalk.viewer.play.playground_base import Playground
from driftwalk.viewer.play.settings import SPEED, Knob

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study

STRETCH_S: Final = 300.0
"""Time that is simulated at once [s]; chosen by hand."""


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


PARAMETER: Final = "parameter:"
"""In front of the name of a knob for a parameter, which may be called as another knob is."""


class ModelPlaySource(Playground):
    """Shows bodies of a motion model that move, with a knob for each of its parameters.

    Parameters
    ----------
    model : MotionModel
        The model.
    values : mapping of str to float
        Values of its parameters to begin with; the others begin in the middle of their range, on
        its scale.
    study : Study
        Tank, start and observation.
    flow : xarray.Dataset, optional
        The water's velocity, for a model that has a use for it.
    recording : xarray.Dataset, optional
        A `trajectory` whose steps those of the bodies are compared with.
    body : str, optional
        Its body, where it has several.
    seed : int
        Of the first worlds; each restart takes the next.

    Raises
    ------
    InputError
        When the model fails, the flow is missing, or the recording gives no steps.

    Examples
    --------
    >>> import driftwalk as dw
    >>> source = dw.viewer.ModelPlaySource(dw.motion_model("active"), {"speed": 0.02}, dw.Study())
    >>> [item["label"] for item in source.greeting()[0]["page"]["sections"][1]["items"]]
    ['speed', 'rotational diffusion', 'turn rate', 'bodies', 'speed of the clock']
    """

    controls_note = (
        "After a change the bodies go on from where they are. A bout of the motion, such as a "
        "rest, begins again then."
    )
    density_note = "Under the present settings."

    def __init__(
        self,
        model: MotionModel,
        values: Mapping[str, float],
        study: Study,
        *,
        flow: xr.Dataset | None = None,
        recording: xr.Dataset | None = None,
        body: str | None = None,
        seed: int = 1,
    ) -> None:
        self.model = model
        middle = {one.name: float(one.value_at(0.5)) for one in model.parameters}
        begin = known_values(model, {**middle, **values})
        knobs = {PARAMETER + one.name: _knob(one, begin[one.name]) for one in model.parameters}
        knobs["bodies"] = Knob("bodies", "bodies", "1", 1, 32, 1, whole=True)
        knobs["speed"] = Knob(**{**vars(SPEED), "label": "speed of the clock"})
        super().__init__(study, flow, knobs, recording=recording, body=body, seed=seed)
        interval = INTERVAL_S if self.recording is None else self.motion.interval
        self.bodies = MovingBodies(
            model, begin, study, flow, bodies=4, interval=interval, seed=seed
        )
        self._left = 0.0
        self._take()
        self._picture = self._tank_message()

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.bodies.time + self._left

    def _change(self, name: str, value: Any) -> None:
        if name == "bodies":
            self._begin(int(value))
        else:
            self.bodies.change(name.removeprefix(PARAMETER), float(value))
        self.motion.clear()

    def _restart(self) -> None:
        self._begin(self.bodies.count)

    def _begin(self, bodies: int) -> None:
        self.bodies.restart(bodies=bodies, seed=self._seed)
        self._left = 0.0

    def _advance(self, duration: float, *, until: float) -> None:
        """Go on sample by sample, and take the positions at every step's interval."""
        step = self.bodies.sample_s
        self._left += duration
        while self._left >= step and clock.perf_counter() < until:
            self.bodies.next()
            self._left -= step
            if self.bodies.sample % self.bodies.every == 0:
                self._take()
        # What could not be done in time is not caught up with.
        self._left %= step

    def _take(self) -> None:
        x, y, _ = self.bodies.place()
        self.motion.add(x, y, np.arange(x.size, dtype=np.int32))

    def _tank_message(self) -> dict[str, Any]:
        x, y, theta = self.bodies.place(self._left / self.bodies.sample_s)
        return self._tank_now(
            x,
            y,
            theta,
            assembly=list(range(x.size)),
            waiting=0,
            outcome=None,
            counts={},
            flow_scale=1.0,
        )

    def _values(self) -> Mapping[str, Any]:
        values = {PARAMETER + name: one for name, one in self.bodies.values.items()}
        return values | {"bodies": self.bodies.count, "speed": self._speed}

    def _subtitle(self) -> str:
        return f"{self.model.name} in a {self._study.tank.describe()}"

    def _bodies(self) -> dict[str, Any]:
        return {
            # A body is drawn as a fiftieth of the tank.
            "side": 0.02 * max(self._study.tank.extent_m),
            "blocks": self.bodies.count,
            "shape": "dot",
            "trail_s": 5.0,
        }


def _knob(one: Parameter, value: float) -> Knob:
    """Return the knob of a parameter, with a range that holds the value it begins with."""
    step = 0.0 if one.scale == "log" else (one.high - one.low) / 200
    knob = Knob(
        PARAMETER + one.name, one.label, one.unit, one.low, one.high, step, log=one.scale == "log"
    )
    return knob.reaching(value)
