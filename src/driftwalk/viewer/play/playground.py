"""The playground of blocks: a tank that moves while its parameters are changed.

It is published in the form of a tracker's stream too, so that one page can watch both.
"""

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
from driftwalk.viewer.play.settings import knobs_for, values_of

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.assembly.live_world import LiveEvent
    from driftwalk.model import Study


def hello_line(tank: LiveTank) -> dict[str, Any]:
    """Return the first line of a tank's stream, with everything needed to draw the tank.

    Parameters
    ----------
    tank : LiveTank
        The tank; ``image`` is null, since there is no camera.

    Examples
    --------
    >>> import driftwalk as dw
    >>> hello_line(dw.LiveTank(dw.Study(), dw.uniform_flow(0.0, 0.0)))["block_side_m"]
    0.03
    """
    study = tank.study
    return {
        "type": "hello",
        "format": "driftwalk live",
        "version": 1,
        "source": "playground",
        "markers": "simulated",
        "tank": study.tank.to_arena(),
        "block_side_m": study.block.side_m,
        "block_width_m": study.block.width_m,
        "body_count": None,
        "observed": True,
        "image": None,
    }


def frame_line(tank: LiveTank, number: int, events: Sequence[LiveEvent]) -> dict[str, Any]:
    """Return the line of a moment.

    Parameters
    ----------
    tank : LiveTank
        The tank.
    number : int
        Number of the frame.
    events : sequence of LiveEvent
        Joinings and partings since the last frame.
    """
    x, y, theta, assembly = tank.x, tank.y, shown_angles(tank), tank.assembly
    columns = (x, y, theta, tank.vx, tank.vy, tank.omega)
    bodies = [
        {
            "id": str(block),
            "seen": True,
            "x_m": values[0],
            "y_m": values[1],
            "theta_rad": values[2] if math.isfinite(values[2]) else None,
            "column_px": None,
            "row_px": None,
            "vx_m_s": values[3],
            "vy_m_s": values[4],
            "omega_rad_s": values[5],
            "ambiguous": 0.0,
        }
        for block, values in enumerate(zip(*(c.tolist() for c in columns), strict=True))
    ]
    outcome = tank.outcome
    side = tank.study.block.side_m
    joined = joined_faces(x, y, theta, assembly, side=side) if tank.has_lattice else None
    return {
        "type": "frame",
        "frame": number,
        "time_s": tank.time,
        "bodies": bodies,
        "joined": joined and [[str(a), face, str(b), other] for a, face, b, other in joined],
        "outcome": outcome,
        "possible": [outcome],
        "hidden": [],
        "events": [_event(event, joined or []) for event in events],
        "dropped_frames": 0,
        "latency_s": 0.0,
    }


def shown_angles(tank: LiveTank) -> Floats:
    """Return the orientations of the blocks [rad]; NaN of discs, which have none and no faces."""
    return np.full(tank.blocks, np.nan) if tank.study.block.is_round else tank.theta


def joined_faces(
    x: Floats, y: Floats, theta: Floats, assembly: npt.NDArray[np.int32], *, side: float
) -> list[tuple[int, int, int, int]]:
    """Return the faces that lie on one another within assemblies.

    Parameters
    ----------
    x, y, theta : ndarray, shape (blocks,)
        Poses [m, m, rad].
    assembly : ndarray of int, shape (blocks,)
        Equal numbers are joined.
    side : float
        Side of a block [m].

    Returns
    -------
    list of tuple
        Block, its face, other block, its face; face 0 is a block's +x side, 1 +y, 2 -x, 3 -y.

    Examples
    --------
    >>> still = np.zeros(2)
    >>> joined_faces(np.array([0.0, 0.03]), still, still, np.zeros(2, np.int32), side=0.03)
    [(0, 0, 1, 2)]
    """
    first, second = np.nonzero(np.triu(assembly[:, None] == assembly[None, :], 1))
    east, north = x[second] - x[first], y[second] - y[first]
    # Joined faces lie on one another but for rounding.
    near = np.abs(np.hypot(east, north) - side) < 0.01 * side
    first, second, toward = first[near], second[near], np.arctan2(north, east)[near]
    faces = _face(toward - theta[first]), _face(toward + np.pi - theta[second])
    rows = zip(first.tolist(), faces[0].tolist(), second.tolist(), faces[1].tolist(), strict=True)
    return list(rows)


def _face(angle: Floats) -> npt.NDArray[np.int64]:
    """Return the face that looks into a direction of a block's own frame [rad]."""
    return np.rint(angle / (0.5 * np.pi)).astype(np.int64) % 4


def _event(event: LiveEvent, joined: Sequence[tuple[int, int, int, int]]) -> dict[str, Any]:
    pairs = {(a, b): [face, other] for a, face, b, other in joined}
    first, second = event.blocks
    # Blocks that have been taken out since then have no faces any more.
    faces = pairs.get((first, second)) or pairs.get((second, first), [])[::-1]
    return {
        "time_s": event.time,
        "kind": "split" if event.is_parting else "join",
        "bodies": [str(block) for block in event.blocks],
        "faces": faces,
        "outcome": event.outcome,
    }


ROUNDING: Final = 1e-6
"""Share of a time step within which an instant is that of the step's end; chosen by hand."""


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
        """Send a line to all connected pages."""


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
        knobs = knobs_for(self.tank)
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
        """Let the tank rest while no page is connected."""
        super().watched(1 if self._stream is not None else browsers)

    def _change(self, name: str, value: Any) -> None:
        # Without latching nothing would hold together: a user who turns it off wants to see that.
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
