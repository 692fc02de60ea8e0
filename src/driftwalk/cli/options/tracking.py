"""The options that say how to track, shared by the commands that do."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Final

from driftwalk.cli.options.shared_types import argument, option, scale_option
from driftwalk.core.errors import InputError

_FINDING: Final = "How objects are found"
_MOTION: Final = "How they move"
_LIVE: Final = "Live output"


_found = partial(option, panel=_FINDING)
_moving = partial(option, panel=_MOTION)
_sent = partial(option, panel=_LIVE)


@dataclass(frozen=True)
class TrackingOptions:
    """How to track; the fields are the arguments and options of the commands that do."""

    source: Annotated[str, argument("VIDEO|FOLDER|camera:N", "Video, folder of images, or camera.")]
    markers: Annotated[
        str,
        _found(
            "--markers FILE|aruco:DICT|blob",
            "Two-colour markers, coded tags, or single dark or bright objects.",
        ),
    ]
    camera: Annotated[
        Path | None,
        _found("--camera FILE.toml", "Lens and scale (from driftwalk camera calibrate)."),
    ] = None
    tank: Annotated[
        float | None,
        _found("--tank", "Inner diameter of the tank, whose rim gives the scale.", unit="m"),
    ] = None
    scale: Annotated[float | None, scale_option(_FINDING)] = None
    polarity: Annotated[
        str | None,
        _found("--polarity dark|bright|both", "Objects for --markers blob (default: detected)."),
    ] = None
    min_area_px: Annotated[
        float | None, _found("--min-area-px <px2>", "Smallest area for --markers blob.")
    ] = None
    max_area_px: Annotated[
        float | None, _found("--max-area-px <px2>", "Largest area for --markers blob.")
    ] = None
    fps: Annotated[
        float | None, _found("--fps", "Frames per second of a folder without times.csv.", unit="Hz")
    ] = None
    bodies: Annotated[int | None, _moving("--bodies N", "Largest number of bodies.")] = None
    max_speed: Annotated[
        float | None,
        _moving(
            "--max-speed",
            "Fastest plausible speed; a faster jump starts a new track (default: tank width "
            "in 1 s).",
            unit="m/s",
        ),
    ] = None
    lost_after: Annotated[
        float | None,
        _moving(
            "--lost-after",
            "End a track after this long without a detection (default: 1s).",
            unit="s",
        ),
    ] = None
    side: Annotated[
        float | None,
        _moving("--side", "Side of a block, to report which blocks are joined.", unit="m"),
    ] = None
    live: Annotated[
        int | None, _sent("--live PORT", "Port that sends JSON lines to TCP clients.")
    ] = None
    live_nmea: Annotated[
        int | None, _sent("--live-nmea PORT", "Port that sends SwisTrack's NMEA to TCP clients.")
    ] = None
    live_host: Annotated[
        str,
        _sent(
            "--live-host ADDRESS", "Address to listen on (default: loopback).", show_default=False
        ),
    ] = "127.0.0.1"
    overlay: Annotated[
        Path | None, option("--overlay OUT.mp4", "Video to write, with the bodies drawn in.")
    ] = None

    @property
    def px_per_m(self) -> float | None:
        """Scale [px/m]; refuses one that is not above zero."""
        if self.scale is not None and not self.scale > 0.0:
            raise InputError(f"--scale must be above zero, got {self.scale:g}")
        return None if self.scale is None else 1.0 / self.scale

    @property
    def is_camera(self) -> bool:
        """Whether the source is a camera."""
        return self.source.startswith("camera:")
