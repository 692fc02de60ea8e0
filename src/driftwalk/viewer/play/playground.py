"""The playground: a tank that moves in real time or faster while its parameters are changed."""

from __future__ import annotations

import asyncio
import gc
import math
import threading
import time as clock
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, Protocol

import numpy as np
import numpy.typing as npt

from driftwalk.assembly import LiveTank
from driftwalk.core.errors import DriftwalkError, InputError
from driftwalk.page import encode_array
from driftwalk.viewer.hub import Content, Publish, Source
from driftwalk.viewer.play.motion import MotionWindow, beside
from driftwalk.viewer.play.settings import controls_section, knobs_for, most_blocks_in, values_of
from driftwalk.viewer.play.stream import frame_line
from driftwalk.viewer.shell import page_frame

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.assembly.live_world import LiveEvent
    from driftwalk.model import Study

Floats = npt.NDArray[np.float64]

FRAME_S: Final = 1.0 / 60.0
"""Time between two pictures of the tank [s]."""
STREAM_FRAME_S: Final = 1.0 / 30.0
"""Time between two lines of the stream [s]."""
DENSITY_S: Final = 0.5
SETTLED_S: Final = 0.3
"""Time after the last change of a setting at which all browsers receive the values in force [s]."""
LONGEST_ADVANCE_S: Final = 0.1
"""Longest time for which the tank is advanced at once [s]; on a slow machine it falls behind."""
SPEED_OVER_S: Final = 1.0
"""The speed that is shown is that of the last second."""
ROUNDING: Final = 1e-6
"""Share of a time step within which an instant is that of the step's end."""
FLOW_ARROWS: Final = 25
POSITION_DIGITS: Final = 5
ANGLE_DIGITS: Final = 4
ACTIONS: Final[dict[str, str]] = {
    "restart": "restart",
    "pause": "pause",
    "run": "pause",
    "clear": "clear",
}
"""Requests of a browser, and the pending request that each replaces."""


class Stream(Protocol):
    """Receiver of the lines of a tracker's stream; `driftwalk.track.LiveServer` is one."""

    def publish(self, content: Any) -> None:
        """Send a line to whoever is connected."""


class PlaySource(Source):
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

    view = "play"
    title = "Playground"

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
        self._motion = MotionWindow(self._recording, seed=seed)
        self._knobs = knobs_for(self.tank, most_blocks=most_blocks_in(self.tank))
        self._seed, self._speed, self._paused = seed, 1.0, False
        self._stream: Stream | None = None
        self._frames = 0
        self._next_line = 0.0
        self._events: list[LiveEvent] = []
        self._next_sample = 0.0
        self._left = 0.0
        self._settled = math.inf
        self._pace: deque[tuple[float, float]] = deque()
        self._wishes: dict[str, Callable[[], None]] = {}
        self._wishes_lock = threading.Lock()
        self._watched = threading.Event()
        self._over = threading.Event()
        self._picture = self._tank_message()

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
        if browsers or self._stream is not None:
            self._watched.set()
        else:
            self._watched.clear()

    def greeting(self) -> Sequence[Content]:
        """Return the page, the tank and the density."""
        return [{"type": "page", "page": self._page()}, self._picture]

    async def run(self, publish: Publish) -> None:
        """Advance the tank in a thread of its own, and compare its motion in another."""
        loop = asyncio.get_running_loop()
        # What has been loaded up to now stays: looking through it again would stop the tank for
        # three pictures each time.
        gc.collect()
        gc.freeze()

        def publish_from_thread(content: Content) -> None:
            if not self._over.is_set():
                loop.call_soon_threadsafe(publish, content)

        works = (self._move, self._compare)
        try:
            await asyncio.gather(*(asyncio.to_thread(work, publish_from_thread) for work in works))
        finally:
            self._over.set()
            self._watched.set()
            # What is frozen would stay when the program ends, and the native core would complain.
            gc.unfreeze()

    async def receive(self, content: Content, reply: Publish) -> None:
        """Change a setting, or do what was asked, at the next picture."""
        kind, name = content.get("type"), content.get("name")
        if kind == "set":
            try:
                self._set(str(name), content.get("value"))
            except DriftwalkError as error:
                reply({"type": "note", "words": str(error)})
            self._settled = clock.perf_counter() + SETTLED_S
        elif kind == "action" and isinstance(name, str) and name in ACTIONS:
            self._wish(ACTIONS[name], lambda: self._act(name))

    def _set(self, name: str, value: Any) -> None:
        if name not in self._knobs:
            raise InputError(f"there is no setting '{name[:40]}'")
        wanted = self._knobs[name].read(value)
        if name == "speed":
            self._speed = wanted
        else:
            self._wish(name, lambda: self._change(name, wanted))

    def _wish(self, name: str, do: Callable[[], None]) -> None:
        """Have something done before the next picture, in place of the last wish of this name."""
        with self._wishes_lock:
            self._wishes[name] = do

    def _fulfil(self, publish: Publish) -> None:
        """Do what has been wished for since the last picture."""
        with self._wishes_lock:
            wishes, self._wishes = self._wishes, {}
        for do in wishes.values():
            try:
                do()
            except InputError as error:
                publish({"type": "note", "words": str(error)})

    def _change(self, name: str, value: Any) -> None:
        # Without latching nothing would hold together: whoever turns it off wants to see that.
        self.tank.set(**{name: value}, part=name == "latching" and value == "none")
        self._motion.clear()

    def _act(self, name: str) -> None:
        if name in ("pause", "run"):
            self._paused = name == "pause"
        elif name == "clear":
            self._motion.clear()
        else:
            self._seed += 1
            self.tank.restart(seed=self._seed)
            self._next_sample = 0.0
            self._motion.clear()

    def _move(self, publish: Publish) -> None:
        """Advance the tank with the clock, picture by picture, until the server ends."""
        last = -math.inf
        while self._watched.wait() and not self._over.is_set():
            began = clock.perf_counter()
            wall, last = min(began - last, LONGEST_ADVANCE_S), began
            self._fulfil(publish)
            try:
                if not self._paused:
                    self._advance(wall * self._speed, until=began + LONGEST_ADVANCE_S)
            except InputError as error:
                # The numbers are lost: it cannot go on, and says so once.
                self._paused = True
                publish({"type": "note", "words": str(error)})
            self._note_pace(began)
            if began >= self._settled:
                # Not while a knob is turned: it would be turned back under the user's hand.
                self._settled = math.inf
                publish({"type": "section", "section": self._controls()})
            # Whoever comes gets this one: only this thread can look at the tank between two steps.
            self._picture = self._tank_message()
            publish(self._picture)
            self._publish_line(began)
            self._over.wait(max(began + FRAME_S - clock.perf_counter(), 0.0))

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

    def _compare(self, publish: Publish) -> None:
        """Compare the motion with the recording's now and then, until the server ends."""
        while self._watched.wait() and not self._over.wait(DENSITY_S):
            publish(self._motion.message())

    def _note_pace(self, now: float) -> None:
        self._pace.append((now, self.tank.time))
        while now - self._pace[0][0] > SPEED_OVER_S or self._pace[0][1] > self.tank.time:
            self._pace.popleft()

    def _publish_line(self, now: float) -> None:
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
        first, last = (self._pace[0], self._pace[-1]) if self._pace else ((0.0, 0.0), (0.0, 0.0))
        elapsed = last[0] - first[0]
        return {
            "type": "tank",
            "time_s": tank.time,
            "speed": (last[1] - first[1]) / elapsed if elapsed > 0.0 else None,
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
