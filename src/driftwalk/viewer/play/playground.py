"""The playground of blocks: a tank that moves while its parameters are changed."""

from __future__ import annotations

import math
import time as clock
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, Protocol

import numpy as np
import numpy.typing as npt

from driftwalk.assembly import LiveTank
from driftwalk.core.arrays import Floats
from driftwalk.schema.shapes import MOST_NAMED
from driftwalk.viewer.play.playground_base import Playground
from driftwalk.viewer.play.settings import knobs_for, most_blocks_in, values_of
from driftwalk.viewer.play.stream import frame_line, shown_angles

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.assembly.live_world import LiveEvent
    from driftwalk.model import Study

ROUNDING: Final = 1e-6
"""Share of a time step within which an instant is that of the step's end."""


def shape_counts(outcome: str, assembly: npt.NDArray[np.int32]) -> Counter[str]:
    """Return how many assemblies of each shape there are; of many blocks, of each size.

    Examples
    --------
    >>> shape_counts("2+1+1", np.array([0, 0, 2, 3], np.int32))
    Counter({'1': 2, '2': 1})
    """
    if assembly.size <= MOST_NAMED:
        return Counter(outcome.split("+"))
    sizes = np.unique(assembly, return_counts=True)[1].tolist()
    return Counter(str(size) if size <= 2 else f"{size} blocks" for size in sizes)


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
    run : str
        Name of the run that the values were taken from, for the page.
    warnings : sequence of str
        Warnings of that run.

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

    controls_note = (
        "A change takes effect at the next draw of the stochastic force. Without latching, joined "
        "blocks separate too."
    )
    density_note = "For single blocks, under the present settings."

    def __init__(
        self,
        study: Study,
        flow: xr.Dataset,
        *,
        blocks: int | None = None,
        recording: xr.Dataset | None = None,
        body: str | None = None,
        seed: int = 1,
        run: str = "",
        warnings: Sequence[str] = (),
    ) -> None:
        self._warnings = warnings
        if run:
            self.title = f"{self.title}: {run}"
        if recording is not None:
            self.density_note += " The recording is of one block: compare it with one in the tank."
        self.tank, self.water = LiveTank(study, flow, blocks=blocks, seed=seed), flow
        knobs = knobs_for(self.tank, most_blocks=most_blocks_in(self.tank))
        super().__init__(study, flow, knobs, recording=recording, body=body, seed=seed)
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
        self.motion.clear()

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
        self.motion.add(x, y, self.tank.assembly)
        self._next_sample += self.motion.interval

    def _shown(self, now: float) -> None:
        if self._stream is None:
            return
        self._events += self.tank.events()
        if now >= self._next_line:
            self._stream.publish(frame_line(self.tank, self._frames, self._events))
            self._frames, self._events = self._frames + 1, []
            # The stream has 30 lines per second.
            self._next_line = now + 1.0 / 30.0

    def _tank_message(self) -> dict[str, Any]:
        tank, outcome = self.tank, self.tank.outcome
        return self._tank_now(
            tank.x,
            tank.y,
            shown_angles(tank),
            assembly=tank.assembly.tolist(),
            poles=tank.poles.tolist(),
            waiting=tank.waiting,
            outcome=outcome,
            counts=shape_counts(outcome, tank.assembly),
            flow_scale=tank.flow_scale,
        )

    def _values(self) -> Mapping[str, Any]:
        return values_of(self.tank, speed=self._speed)

    def _subtitle(self) -> str:
        study = self.tank.study
        tank = f"{study.tank.describe()}, {study.block.described.replace(' of ', 's of ', 1)}"
        return ". ".join([tank, *(f"Warning {text}" for text in self._warnings)])

    def _bodies(self) -> dict[str, Any]:
        block = self.tank.study.block
        size = {"side": block.side_m, "width": block.width_m}
        return {**size, "blocks": self.tank.study.assembly.blocks}
