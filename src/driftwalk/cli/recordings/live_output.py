"""Live output of a tracking run: lines of JSON and NMEA sentences.

Every key is described in docs/reference/live-stream.md; a change that old readers cannot take
raises `VERSION`.
"""

from __future__ import annotations

import contextlib
import time as clock
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from driftwalk.cli.options.tracking import TrackingOptions
from driftwalk.cli.terminal.output import print_note
from driftwalk.core.text_files import text_of_name

if TYPE_CHECKING:
    from driftwalk.cli.recordings.tracking_parts import TrackingParts
    from driftwalk.track import AssemblySeen, Frame, LiveServer, TrackState

VERSION: Final = 1
"""Version of the lines of JSON; a reader refuses another one."""


class LiveOutputs:
    """The servers that are open.

    Parameters
    ----------
    options : TrackingOptions
        Which ports, and on what address.
    parts : TrackingParts
        The parts that the first line describes.
    source : str
        Name of the source.
    open_things : contextlib.ExitStack
        Closes the servers.
    """

    def __init__(
        self,
        options: TrackingOptions,
        parts: TrackingParts,
        source: str,
        open_things: contextlib.ExitStack,
    ) -> None:
        from driftwalk.track import LiveServer, nmea_frame

        host = options.live_host
        self._json: LiveServer | None = None
        self._nmea: LiveServer | None = None
        self._numbers: dict[str, int] = {}
        if options.live is not None:
            self._json = open_things.enter_context(
                LiveServer(options.live, host=host, hello=hello(options, parts, source))
            )
            print_note(f"JSON lines on {host}, port {self._json.port}")
        if options.live_nmea is not None:
            self._nmea = open_things.enter_context(
                LiveServer(options.live_nmea, host=host, encode=lambda c: nmea_frame(*c))
            )
            print_note(f"NMEA sentences on {host}, port {self._nmea.port}")

    def publish(
        self,
        frame: Frame,
        states: Sequence[TrackState],
        observed: AssemblySeen | None,
        *,
        dropped: int,
        arrived: float,
    ) -> None:
        """Send a frame's result.

        Parameters
        ----------
        frame : Frame
            The frame.
        states : sequence of TrackState
            The bodies.
        observed : AssemblySeen or None
            Who is joined.
        dropped : int
            Frames that were lost up to now.
        arrived : float
            When the frame came, on `time.perf_counter` [s].
        """
        if self._json is not None:
            message = {
                "type": "frame",
                "frame": frame.index,
                "time_s": frame.time,
                "bodies": [_body(state) for state in states],
                **_assembly(observed),
                "dropped_frames": dropped,
                "latency_s": clock.perf_counter() - arrived,
            }
            self._json.publish(message, frame.image)
        if self._nmea is not None:
            self._nmea.publish((frame.index, self._particles(states)))

    def end(self, interrupted: str | None) -> None:
        """Say that no further frame will come, and why if the source ended early."""
        if self._json is not None:
            self._json.publish({"type": "end", "interrupted": interrupted})

    def _particles(self, states: Sequence[TrackState]) -> list[Any]:
        from driftwalk.track import Particle

        found = []
        for state in states:
            number = self._numbers.setdefault(state.id, len(self._numbers))
            one = state.measured
            if one is not None and one.x is not None and one.y is not None:
                found.append(Particle(number, one.column, one.row, one.theta, one.x, one.y))
        return found


def hello(options: TrackingOptions, parts: TrackingParts, source: str) -> dict[str, Any]:
    """Return the first line that each client gets: what it takes to draw the tank."""
    tank = None
    if parts.diameter is not None:
        tank = {"shape": "circle", "diameter_m": parts.diameter, "center_m": [0.0, 0.0]}
    return {
        "type": "hello",
        "format": "driftwalk live",
        "version": VERSION,
        "source": source,
        "markers": text_of_name(Path(options.markers).name),
        "tank": tank,
        "block_side_m": parts.block_side,
        "body_count": options.bodies,
        "observed": parts.observer is not None,
        # The size of the images, and how their pixels become metres.
        "image": parts.camera.model_dump(
            include={"width_px", "height_px", "homography_px_to_m", "lens"}
        ),
    }


def _body(state: TrackState) -> dict[str, Any]:
    seen = state.measured
    return {
        "id": state.id,
        "seen": seen is not None,
        "x_m": state.x if seen is None else seen.x,
        "y_m": state.y if seen is None else seen.y,
        "theta_rad": state.theta if seen is None else seen.theta,
        "column_px": None if seen is None else seen.column,
        "row_px": None if seen is None else seen.row,
        "vx_m_s": state.vx,
        "vy_m_s": state.vy,
        "omega_rad_s": state.omega,
        "ambiguous": state.ambiguous,
    }


def _assembly(observed: AssemblySeen | None) -> dict[str, Any]:
    """Return who is joined; null for all of it where that is not looked at."""
    if observed is None:
        return dict.fromkeys(("joined", "outcome", "possible", "hidden", "events"))
    return {
        "joined": [list(faces) for faces in observed.joined],
        "outcome": observed.outcome or None,
        "possible": sorted(observed.possible) or None,
        "hidden": observed.hidden,
        "events": [
            {"time_s": time, "kind": kind, "bodies": bodies, "faces": faces, "outcome": outcome}
            for time, kind, bodies, faces, outcome in observed.events
        ],
    }
