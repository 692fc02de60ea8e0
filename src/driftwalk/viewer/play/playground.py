"""The playground of blocks: a tank that moves while its parameters are changed."""

from __future__ import annotations

import math
import time as clock
from collections import Counter
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final, Protocol

import numpy as np
import numpy.typing as npt

from driftwalk.assembly import LiveTank
from driftwalk.page import encode_array
from driftwalk.page.html import page_frame
from driftwalk.viewer.play.motion import MotionWindow, beside
from driftwalk.viewer.play.playground_base import Playground
from driftwalk.viewer.play.settings import controls_section, knobs_for, most_blocks_in, values_of
from driftwalk.viewer.play.stream import frame_line

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.assembly.live_world import LiveEvent
    from driftwalk.model import Study

Floats = npt.NDArray[np.float64]

STREAM_FRAME_S: Final = 1.0 / 30.0
"""Time between two lines of the stream [s]."""
ROUNDING: Final = 1e-6
"""Share of a time step within which an instant is that of the step's end."""
FLOW_ARROWS: Final = 25
POSITION_DIGITS: Final = 5
ANGLE_DIGITS: Final = 4


class Stream(Protocol):
    """Receiver of the lines of a tracker's stream; `driftwalk.track.LiveServer` is one."""

    def publish(self, content: Any) -> None:
        """Send a line to whoever is connected."""


class PlaySource(Playground):
    """Shows a tank of blocks that moves, with knobs for its parameters.

    Parameters
    ----------
    study : Study
        Block, tank, water, forces and assembly, to begin with.
    flow : xarray.Dataset
        The water's velocity.
    blocks : int, optional
        Over the study's value.
    recording : xarray.Dataset, optional
        A `trajectory` whose steps the blocks' are compared with.
    body : str, optional
        Its body, where it has several.
    seed : int
        Of the first tank; each restart takes the next.

    Raises
    ------
    InputError
        When the blocks do not fit, the flow does not cover the tank, or the recording gives no
        steps.

    Examples
    --------
    >>> import driftwalk as dw
    >>> source = dw.viewer.PlaySource(dw.Study(), dw.uniform_flow(0.0, 0.0), blocks=3)
    >>> [section["kind"] for section in source.greeting()[0]["page"]["sections"]]
    ['tank', 'controls', 'density']
    """

    def __init__(
        self,
        study: Study,
        flow: xr.Dataset,
        *,
        blocks: int | None = None,
        recording: xr.Dataset | None = None,
        body: str | None = None,
        seed: int = 1,
    ) -> None:
        self.tank = LiveTank(study, flow, blocks=blocks, seed=seed)
        self._arrows = flow_arrows(flow)
        self._recording = None if recording is None else beside(recording, study, body=body)
        knobs = knobs_for(self.tank, most_blocks=most_blocks_in(self.tank))
        super().__init__(MotionWindow(self._recording, seed=seed), knobs, seed=seed)
        self._stream: Stream | None = None
        self._frames = 0
        self._next_line = 0.0
        self._events: list[LiveEvent] = []
        self._next_sample = 0.0
        self._left = 0.0
        self._picture = self._tank_message()

    @property
    def time(self) -> float:
        """Simulated time of the tank [s]."""
        return self.tank.time

    def stream_to(self, stream: Stream) -> None:
        """Publish the tank in the form of a tracker's stream too.

        Parameters
        ----------
        stream : Stream
            A `driftwalk.track.LiveServer` that greets with `hello_line`.
        """
        self._stream = stream
        self._watched.set()

    def watched(self, browsers: int) -> None:
        """Let the tank rest while nobody sees it."""
        super().watched(1 if self._stream is not None else browsers)

    def _change(self, name: str, value: Any) -> None:
        # Without latching nothing would hold together: whoever turns it off wants to see that.
        self.tank.set(**{name: value}, part=name == "latching" and value == "none")
        self._motion.clear()

    def _restart(self) -> None:
        self.tank.restart(seed=self._seed)
        self._next_sample = 0.0

    def _advance(self, duration: float, *, until: float) -> None:
        """Advance the tank by whole time steps, and take the blocks' positions on the way."""
        step = self.tank.study.time_step_s
        self._left += duration
        while self._left >= step and clock.perf_counter() < until:
            at = self._next_sample / step
            ahead = math.floor(at + ROUNDING) - round(self.tank.time / step)
            share = max(at - math.floor(at + ROUNDING), 0.0)
            steps = min(ahead, math.floor(self._left / step + ROUNDING))
            if steps > 0:
                self._go(steps)
            elif share < ROUNDING:
                self._take(self.tank.x, self.tank.y)
            else:
                # The camera looks within the next step.
                before = self.tank.x, self.tank.y
                self._go(1)
                self._take(
                    *(
                        (1.0 - share) * old + share * new if old.size == new.size else new
                        for old, new in zip(before, (self.tank.x, self.tank.y), strict=True)
                    )
                )
        # What could not be done in time is not caught up with.
        self._left %= step

    def _go(self, steps: int) -> None:
        self.tank.advance(steps * self.tank.study.time_step_s)
        self._left -= steps * self.tank.study.time_step_s

    def _take(self, x: Floats, y: Floats) -> None:
        self._motion.add(x, y, self.tank.assembly)
        self._next_sample += self._motion.interval

    def _shown(self, now: float) -> None:
        if self._stream is None:
            return
        self._events += self.tank.events()
        if now >= self._next_line:
            self._stream.publish(frame_line(self.tank, self._frames, self._events))
            self._frames, self._events = self._frames + 1, []
            self._next_line = now + STREAM_FRAME_S

    def _tank_message(self) -> dict[str, Any]:
        tank = self.tank
        outcome = tank.outcome
        return {
            "type": "tank",
            "time_s": tank.time,
            "speed": self._pace_now(),
            "paused": self._paused,
            "x": np.round(tank.x, POSITION_DIGITS).tolist(),
            "y": np.round(tank.y, POSITION_DIGITS).tolist(),
            "theta": np.round(tank.theta, ANGLE_DIGITS).tolist(),
            "assembly": tank.assembly.tolist(),
            "waiting": tank.waiting,
            "outcome": outcome,
            "counts": Counter(outcome.split("+")),
            "flow_scale": tank.flow_scale,
        }

    def _controls(self) -> dict[str, Any]:
        return controls_section(self._knobs, values_of(self.tank, speed=self._speed))

    def _page(self) -> dict[str, Any]:
        study = self.tank.study
        recording = self._recording
        tank = {
            "id": "tank",
            "kind": "tank",
            "title": "The tank",
            "note": None,
            "arena": study.tank.to_arena(),
            "side": study.block.side_m,
            "blocks": study.assembly.blocks,
            "flow": self._arrows,
        }
        density = {
            "id": "density",
            "kind": "density",
            "title": "Step length and turning angle",
            "note": "For single blocks, under the present settings.",
            "recording": None if recording is None else recording.steps.name,
        }
        return page_frame(
            self.view,
            self.title,
            subtitle=f"{study.tank.describe()}, blocks of {100.0 * study.block.side_m:g} cm",
            sections=[tank, self._controls(), density],
        )


def flow_arrows(flow: xr.Dataset) -> dict[str, Any] | None:
    """Return a flow as arrows for the tank, thinned to 25 x 25; None for one that changes in time.

    Parameters
    ----------
    flow : xarray.Dataset
        A `flow_field`.

    Examples
    --------
    >>> from driftwalk.flow import uniform_flow
    >>> len(flow_arrows(uniform_flow(0.1, 0.0))["x"])
    25
    """
    if flow["u"].dims != ("y", "x"):
        return None
    thin: Mapping[str, Any] = {
        name: np.unique(np.linspace(0, flow.sizes[name] - 1, FLOW_ARROWS).round().astype(int))
        for name in ("x", "y")
    }
    part = flow.isel(thin)
    return {
        "x": part["x"].values.tolist(),
        "y": part["y"].values.tolist(),
        "u": encode_array(part["u"].values),
        "v": encode_array(part["v"].values),
    }
