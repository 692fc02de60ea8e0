"""The options that say how to track, shared by the commands that do."""

from __future__ import annotations

from dataclasses import MISSING, dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

from driftwalk.cli.options.flatten_options import option_field
from driftwalk.cli.options.shared_types import SCALE, argument, parse_scale
from driftwalk.core.errors import InputError

_found = partial(option_field, panel="How objects are found")
_moving = partial(option_field, panel="How they move")
_sent = partial(option_field, panel="Live output")


@dataclass(frozen=True)
class TrackingOptions:
    """How to track; the fields are the arguments and options of the commands that do."""

    source: Annotated[str, argument("VIDEO|FOLDER|camera:N", "Video, folder of images, or camera.")]
    markers: str = _found(
        "--markers FILE|aruco:DICT|blob",
        "Two-colour markers, coded tags, or single dark or bright objects.",
        default=MISSING,
    )
    camera: Path | None = _found(
        "--camera FILE.toml", "Lens and scale (from driftwalk camera calibrate)."
    )
    tank: float | None = _found(
        "--tank", "Inner diameter of the tank, whose rim gives the scale.", unit="m"
    )
    scale: float | None = _found("--scale m", SCALE, parser=parse_scale)
    polarity: str | None = _found(
        "--polarity dark|bright|both", "Objects for --markers blob (default: detected)."
    )
    min_area_px: float | None = _found("--min-area-px px2", "Smallest area for --markers blob.")
    max_area_px: float | None = _found("--max-area-px px2", "Largest area for --markers blob.")
    fps: float | None = _found(
        "--fps", "Frames per second of a folder without times.csv.", unit="Hz"
    )
    bodies: int | None = _moving("--bodies N", "Largest number of bodies.")
    max_speed: float | None = _moving(
        "--max-speed",
        "Fastest plausible speed; a faster jump starts a new track (default: tank width in 1 s).",
        unit="m/s",
    )
    lost_after: float | None = _moving(
        "--lost-after", "End a track after this long without a detection (default: 1s).", unit="s"
    )
    side: float | None = _moving(
        "--side", "Side of a block, to report which blocks are joined.", unit="m"
    )
    live: int | None = _sent("--live PORT", "Port that sends JSON lines to TCP clients.")
    live_nmea: int | None = _sent(
        "--live-nmea PORT", "Port that sends SwisTrack's NMEA to TCP clients."
    )
    live_host: str = _sent(
        "--live-host ADDRESS",
        "Address to listen on (default: loopback).",
        show_default=False,
        default="127.0.0.1",
    )
    overlay: Path | None = option_field(
        "--overlay OUT.mp4", "Video to write, with the bodies drawn in."
    )

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
