"""A playground: a simulated world that moves with the clock while its knobs are turned.

A subclass says what moves: the tank of blocks, or bodies of a motion model.
"""

from __future__ import annotations

import asyncio
import gc
import math
import threading
import time as clock
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import DriftwalkError, InputError
from driftwalk.core.text_files import json_value
from driftwalk.page import encode_array
from driftwalk.page.html import page_frame
from driftwalk.page.parts import section
from driftwalk.viewer.hub import Content, Publish, Source
from driftwalk.viewer.play.motion import MotionWindow, beside
from driftwalk.viewer.play.settings import Knob

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study

POSITION_DIGITS: Final = 5
"""Decimals of a position [m]: a hundredth of a millimetre, below a pixel of any screen."""
SETTLED_S: Final = 0.3
"""Time after the last change of a setting at which all browsers receive the values in force [s];
chosen by hand."""
LONGEST_ADVANCE_S: Final = 0.1
"""Longest time for which the tank is advanced at once [s]; on a slow machine it falls behind;
chosen by hand."""
ACTIONS: Final[dict[str, str]] = {
    "restart": "restart",
    "pause": "pause",
    "run": "pause",
    "clear": "clear",
}
"""Requests of a browser, and the pending request that each replaces."""


class Playground(Source):
    """A world that is advanced picture by picture, with knobs, next to the density of its steps.

    Parameters
    ----------
    study : Study
        Tank, start and observation.
    flow : xarray.Dataset or None
        The water's velocity, drawn as arrows.
    knobs : mapping of str to Knob
        The settings, among them the speed.
    recording : xarray.Dataset or None
        A `trajectory` whose steps those of the bodies are compared with.
    body : str or None
        Its body, where it has several.
    seed : int
        Of the first world; each restart takes the next.
    """

    view = "play"
    title = "Playground"
    controls_note: str
    density_note: str

    def __init__(
        self,
        study: Study,
        flow: xr.Dataset | None,
        knobs: Mapping[str, Knob],
        *,
        recording: xr.Dataset | None,
        body: str | None,
        seed: int,
    ) -> None:
        self._study, self.knobs = study, dict(knobs)
        self._arrows = None if flow is None else flow_arrows(flow)
        self.recording = None if recording is None else beside(recording, study, body=body)
        self.motion = MotionWindow(self.recording, seed=seed)
        self._seed, self._speed, self._paused = seed, 1.0, False
        self._settled = math.inf
        self._pace: deque[tuple[float, float]] = deque()
        self._wishes: dict[str, Callable[[], None]] = {}
        self._wishes_lock = threading.Lock()
        self._watched = threading.Event()
        self._over = threading.Event()
        self._picture: Content = {}

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        raise NotImplementedError

    def watched(self, browsers: int) -> None:
        """Let the world rest while no page is connected."""
        if browsers:
            self._watched.set()
        else:
            self._watched.clear()

    def greeting(self) -> Sequence[Content]:
        """Return the page, the tank and the density."""
        return [{"type": "page", "page": self._page()}, self._picture]

    async def run(self, publish: Publish) -> None:
        """Advance the tank in a separate thread, and compare its motion in another."""
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
        if name not in self.knobs:
            raise InputError(f"there is no setting '{name[:40]}'")
        wanted = self.knobs[name].read(value)
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

    def _act(self, name: str) -> None:
        if name in ("pause", "run"):
            self._paused = name == "pause"
            return
        if name == "restart":
            self._seed += 1
            self._restart()
        self.motion.clear()

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
            # A new client gets this one: only this thread can look at the tank between two steps.
            self._picture = self._tank_message()
            publish(self._picture)
            self._shown(began)
            # The page gets 60 pictures per second.
            self._over.wait(max(began + 1.0 / 60.0 - clock.perf_counter(), 0.0))

    def _compare(self, publish: Publish) -> None:
        """Compare the motion with the recording's now and then, until the server ends."""
        while self._watched.wait() and not self._over.wait(0.5):
            publish(self.motion.message())

    def _note_pace(self, now: float) -> None:
        self._pace.append((now, self.time))
        # The speed that is shown is that of the last second.
        while now - self._pace[0][0] > 1.0 or self._pace[0][1] > self.time:
            self._pace.popleft()

    def _pace_now(self) -> float | None:
        """Return the speed of the last second, simulated over real time; None where unknown."""
        first, last = (self._pace[0], self._pace[-1]) if self._pace else ((0.0, 0.0), (0.0, 0.0))
        elapsed = last[0] - first[0]
        return (last[1] - first[1]) / elapsed if elapsed > 0.0 else None

    def _change(self, name: str, value: Any) -> None:
        """Change a setting, between two pictures."""
        raise NotImplementedError

    def _restart(self) -> None:
        """Begin a new world, with the seed that is now in force."""
        raise NotImplementedError

    def _advance(self, duration: float, *, until: float) -> None:
        """Advance the world by a simulated time [s], at most to a time of the clock."""
        raise NotImplementedError

    def _shown(self, now: float) -> None:
        """Do what there is to do after a picture, at a time of the clock."""

    def _tank_message(self) -> dict[str, Any]:
        """Return the world as it is now, see `_tank_now`."""
        raise NotImplementedError

    def _tank_now(self, x: Floats, y: Floats, theta: Floats, **more: Any) -> dict[str, Any]:
        """Return the message on poses [m, m, rad]; `more` holds what else the page shows."""
        return {
            "type": "tank",
            "time_s": self.time,
            "speed": self._pace_now(),
            "paused": self._paused,
            "x": np.round(x, POSITION_DIGITS).tolist(),
            "y": np.round(y, POSITION_DIGITS).tolist(),
            "theta": json_value(np.round(theta, 4)),
            **more,
        }

    def _values(self) -> Mapping[str, Any]:
        """Return what every knob stands at."""
        raise NotImplementedError

    def _controls(self) -> dict[str, Any]:
        """Return the section with the knobs and what they stand at."""
        values = self._values()
        items = [knob.item(values[name]) for name, knob in self.knobs.items()]
        return section("controls", "controls", "Settings", self.controls_note, items=items)

    def _page(self) -> dict[str, Any]:
        arena, title = self._study.tank.to_arena(), "Step length and turning angle"
        recording = None if self.recording is None else self.recording.steps.name
        sections = [
            section("tank", "tank", "The tank", arena=arena, flow=self._arrows, **self._bodies()),
            self._controls(),
            section("density", "density", title, self.density_note, recording=recording),
        ]
        return page_frame(self.view, self.title, subtitle=self._subtitle(), sections=sections)

    def _subtitle(self) -> str:
        """Return what moves where."""
        raise NotImplementedError

    def _bodies(self) -> dict[str, Any]:
        """Return how many bodies of which size and look the section on the tank has."""
        raise NotImplementedError


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
        name: np.unique(np.linspace(0, flow.sizes[name] - 1, 25).round().astype(int))
        for name in ("x", "y")
    }
    part = flow.isel(thin)
    return {
        "x": part["x"].values.tolist(),
        "y": part["y"].values.tolist(),
        "u": encode_array(part["u"].values),
        "v": encode_array(part["v"].values),
    }
