"""The options that say how to track, shared by the commands that do."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from driftwalk.cli.options.shared import quantity_parser

SourceName = Annotated[
    str, typer.Argument(metavar="VIDEO|FOLDER|camera:N", help="Video, folder of images, or camera.")
]
_FINDING: Final = "How objects are found"
_MOTION: Final = "How they move"
_LIVE: Final = "Live output"


def _option(panel: str, *names: str, help: str, metavar: str = "", unit: str = "") -> Any:
    return typer.Option(
        *names,
        help=help,
        metavar=metavar or (f"<{unit}>" if unit else None),
        parser=quantity_parser(unit) if unit else None,
        rich_help_panel=panel,
        show_default=False,
    )


Markers = Annotated[
    str,
    _option(
        _FINDING,
        "--markers",
        metavar="FILE|aruco:DICT|blob",
        help="Two-colour markers, coded tags, or single dark or bright objects.",
    ),
]
CameraFile = Annotated[
    Path | None,
    _option(
        _FINDING,
        "--camera",
        metavar="FILE.toml",
        help="Lens and scale (from driftwalk camera calibrate).",
    ),
]
Diameter = Annotated[
    float | None,
    _option(
        _FINDING,
        "--tank-diameter",
        unit="m",
        help="Inner diameter of the tank, whose rim gives the scale.",
    ),
]
PxPerM = Annotated[
    float | None,
    _option(
        _FINDING,
        "--px-per-m",
        metavar="<number>",
        help="Scale in pixels per metre, if no rim is visible.",
    ),
]
Polarity = Annotated[
    str | None,
    _option(
        _FINDING,
        "--polarity",
        metavar="dark|bright|both",
        help="Objects for --markers blob (default: detected).",
    ),
]
LeastArea = Annotated[
    float | None,
    _option(_FINDING, "--least-area-px", metavar="<px2>", help="Smallest area for --markers blob."),
]
MostArea = Annotated[
    float | None,
    _option(_FINDING, "--most-area-px", metavar="<px2>", help="Largest area for --markers blob."),
]
ImageRate = Annotated[
    float | None,
    _option(
        _FINDING, "--image-rate", unit="Hz", help="Images per second of a folder without times.csv."
    ),
]
Bodies = Annotated[
    int | None, _option(_MOTION, "--bodies", metavar="<number>", help="Largest number of bodies.")
]
MaxSpeed = Annotated[
    float | None,
    _option(
        _MOTION,
        "--max-speed",
        unit="m/s",
        help="Fastest plausible speed; a faster jump starts a new track (default: "
        "tank width in 1 s).",
    ),
]
LostAfter = Annotated[
    float | None,
    _option(
        _MOTION,
        "--lost-after",
        unit="s",
        help="End a track after this long without a detection (default: 1s).",
    ),
]
BlockSide = Annotated[
    float | None,
    _option(
        _MOTION,
        "--side",
        unit="m",
        help="Side of a block, to report which blocks are joined (needs --bodies).",
    ),
]
TaughtSide = Annotated[
    float | None,
    _option(_FINDING, "--side", unit="m", help="Side of a block, to write into the file."),
]
Live = Annotated[
    int | None,
    _option(_LIVE, "--live", metavar="PORT", help="Port that sends JSON lines to TCP clients."),
]
LiveNmea = Annotated[
    int | None,
    _option(
        _LIVE,
        "--live-nmea",
        metavar="PORT",
        help="Port that sends SwisTrack's NMEA to TCP clients.",
    ),
]
LiveHost = Annotated[
    str,
    _option(
        _LIVE, "--live-host", metavar="ADDRESS", help="Address to listen on (default: loopback)."
    ),
]
Overlay = Annotated[
    Path | None,
    typer.Option(
        "--overlay",
        metavar="OUT.mp4",
        help="Video to write, with the bodies drawn in.",
        show_default=False,
    ),
]


@dataclass(frozen=True)
class TrackingOptions:
    """How to track; see the options of the same names."""

    source: str
    markers: str
    camera: Path | None = None
    tank_diameter: float | None = None
    px_per_m: float | None = None
    polarity: str | None = None
    least_area_px: float | None = None
    most_area_px: float | None = None
    image_rate: float | None = None
    bodies: int | None = None
    max_speed: float | None = None
    lost_after: float | None = None
    side: float | None = None
    live: int | None = None
    live_nmea: int | None = None
    live_host: str = "127.0.0.1"
    overlay: Path | None = None

    @property
    def is_camera(self) -> bool:
        """Whether the source is a camera."""
        return self.source.startswith("camera:")
