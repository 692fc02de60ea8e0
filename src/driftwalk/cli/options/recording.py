"""The options that say how to read a recording, shared by every command that takes one.

A command has one parameter of type `RecordingOptions` and the decorator spreads it into options::

    @with_recording_options
    def info(recording: RecordingFile, how: RecordingOptions, json: Json = False) -> None:
        trajectory = how.load(recording)
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from driftwalk.cli.options.flatten_options import OPTION, option_field, with_options
from driftwalk.cli.options.shared_types import READING, SCALE, argument, parse_scale
from driftwalk.core.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

_ARGUMENTS = {"fps": "frame_rate", "scale": "metres_per_pixel"}
"""Fields that have another name in `driftwalk.load`."""
_option = partial(option_field, panel=READING)
RecordingFile = Annotated[Path, argument("RECORDING", "Recording, in any readable format.")]


@dataclass(frozen=True)
class RecordingOptions:
    """How to read a recording; the fields are the options."""

    format: str | None = _option("--format", "Format of the file (default: recognised by content).")
    body: str | None = _option("--body NAME|all", "Body to keep, or all.")
    start: float | None = _option("--from", "First time to keep.", unit="s")
    stop: float | None = _option("--to", "Last time to keep.", unit="s")
    tank: str | None = _option(
        "--tank D|WxH|polygon:FILE|fit",
        "Tank: the diameter (40cm), two sides (60cmx40cm), or fit; @X,Y after a size "
        "gives its centre in metres.",
    )
    fps: float | None = _option("--fps", "Frames per second, if the file counts frames.", unit="Hz")
    scale: float | None = _option("--scale m", SCALE, parser=parse_scale)
    length_unit: str | None = _option(
        "--length-unit m|cm|mm|um|ft|in|px", "Unit of positions, if the file names none."
    )
    y_axis: str | None = _option("--y-axis up|down", "Direction of y and of angles in the file.")
    max_speed: float | None = _option(
        "--max-speed",
        "Fastest plausible speed; samples that need a faster one become gaps.",
        unit="m/s",
    )
    sort: bool = _option(
        "--sort", "Sort times that go backwards (default: refuse them).", default=False
    )
    columns: list[str] | None = _option(
        "--columns t=NAME,x=NAME,y=NAME",
        "Columns of a plain table by name or number from 1, with an optional :unit. Repeatable.",
    )
    delimiter: str | None = _option(
        "--delimiter CHARACTER", "Character between fields, or tab or space (default: recognised)."
    )
    up: str | None = _option(
        "--up x|y|z|-x|-y|-z",
        "Axis that points up, if the file has three axes (default: the format's).",
    )
    topic: str | None = _option(
        "--topic NAME[,NAME]", "Topic of a ROS bag, or several, separated by commas."
    )
    header_line: int | None = _option(
        "--header-line N", "Line of a plain table, from 1, that names its columns.", min=1
    )
    sheet: str | None = _option(
        "--sheet NAME",
        "Sheet of a workbook, by name or number from 1, or variable of a MATLAB file.",
    )
    x: Path | None = _option("--x FILE", "Matrix of x: a row per frame, a column per body.")
    y: Path | None = _option("--y FILE", "Matrix of y.")
    theta: Path | None = _option("--theta FILE", "Matrix of angles.")
    keypoint: str | None = _option("--keypoint NAME", "Keypoint of a pose file to use as the body.")
    heading: str | None = _option(
        "--heading FROM,TO",
        "Two keypoints, or two bodies that are markers of one; the orientation is the "
        "angle from the first to the second.",
    )
    min_confidence: float | None = _option(
        "--min-confidence SHARE",
        "Smallest confidence of a keypoint or row; others are missing (default: the format's).",
        min=0.0,
    )
    box: str | None = _option(
        "--box xyxy|xywh|cxcywh[@WxH]|none",
        "Columns of a box: two corners, corner or centre with its size, or no box; "
        "of shares of an image also its size (cxcywh@1920x1080).",
    )
    missing: list[str] | None = _option(
        "--missing X,Y|NUMBER|held",
        "Position that marks a body that was not seen; held: the last position repeated. "
        "Repeatable.",
    )
    replicate: int | None = _option(
        "--replicate N", "Replicate of a simulation, counted from 0 (default: the first).", min=0
    )

    @property
    def _given(self) -> dict[str, Any]:
        """The options that are given, by their fields."""
        # The start may be 0 s; an option that is not given is None, or False for a flag.
        return {
            name: one for name, one in vars(self).items() if one is not None and one is not False
        }

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of `driftwalk.load` that are given."""
        given = self._given
        if self.sort:
            given["sort"] = "sort"
        if self.columns:
            given["columns"] = parse_columns(self.columns)
        if self.heading:
            given["heading"] = self.heading.split(",")
        if self.tank:
            given["tank"] = tank_text(self.tank)
        return {_ARGUMENTS.get(name, name): value for name, value in given.items()}

    def words(self) -> list[str]:
        """Return the options that are given, as a user types them."""
        words: list[str] = []
        for field, value in self._given.items():
            name = _NAMES[field]
            if value is True:
                words.append(name)
                continue
            for one in value if isinstance(value, list) else [value]:
                words += [name, f"{one:.12g}" if isinstance(one, float) else str(one)]
        return words

    def refuse_given(self, what: str) -> None:
        """Refuse options that have no meaning for a run directory or a simulation."""
        if self._given:
            names = ", ".join(_NAMES[field] for field in self._given)
            raise InputError(f"{names}: for a recording; {what}")

    def load(self, path: Path, *, side: float | None = None) -> xr.Dataset:
        """Load the recording; a block's side [m] is for a tank that is fitted.

        Raises
        ------
        InputError
            As `driftwalk.load`, and it says what a file is that is no recording; when no row holds
            a position.
        """
        from driftwalk.cli.inputs.other_files import explained
        from driftwalk.conditions import require_positions
        from driftwalk.record import load

        values = self.arguments()
        with explained():
            recording = load(path, block=side if values.get("tank") == "fit" else None, **values)
        require_positions(recording, where=path)
        return recording


# In an annotation, the name of an option is where a default would be elsewhere.
_NAMES = {one.name: str(one.metadata[OPTION].default) for one in fields(RecordingOptions)}
"""The options by their fields."""


def tank_text(text: str) -> str:
    """Return a tank as `driftwalk.load` takes it; a bare size is that of a circle or a rectangle.

    Examples
    --------
    >>> tank_text("40cm"), tank_text("60cmx40cm@0,0"), tank_text("fit")
    ('circle:40cm', 'rect:60cmx40cm@0,0', 'fit')
    """
    if text == "fit" or ":" in text:
        return text
    return f"rect:{text}" if "x" in text.partition("@")[0] else f"circle:{text}"


def parse_columns(texts: list[str], option: str = "--columns") -> dict[str, str]:
    """Read ``QUANTITY=NAME`` with commas between, as the value of an option.

    Examples
    --------
    >>> parse_columns(["t=Time:ms,x=3", "y=4"])
    {'t': 'Time:ms', 'x': '3', 'y': '4'}
    >>> parse_columns(["u=water_u,v=water_v"], "--flow-variables")
    {'u': 'water_u', 'v': 'water_v'}
    """
    pairs: dict[str, str] = {}
    for part in (part for text in texts for part in text.split(",")):
        quantity, equals, name = part.partition("=")
        if not equals or not name:
            example = "t=Time,x=2" if option == "--columns" else "u=NAME,v=NAME"
            raise InputError(f"{option} takes QUANTITY=NAME such as {example}; got '{part}'")
        pairs[quantity.strip()] = name.strip()
    return pairs


with_recording_options = with_options(RecordingOptions)
"""Spreads a command's parameter of type `RecordingOptions` into one option per field."""
