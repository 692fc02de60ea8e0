"""The playground of a motion model: bodies that move, with a slider for each parameter."""

from __future__ import annotations

import time as clock
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.motion import MotionModel, known_values
from driftwalk.schema import Parameter
from driftwalk.viewer.play.bodies import MovingBodies
from driftwalk.viewer.play.motion import INTERVAL_S
from driftwalk.viewer.play.playground_base import Playground
from driftwalk.viewer.play.settings import SPEED, Knob

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study

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
