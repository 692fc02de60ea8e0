"""The options that say how to read a recording, shared by every command that takes one.

A command has one parameter of type `RecordingOptions` and the decorator spreads it into options::

    @with_recording_options
    def info(recording: RecordingFile, how: RecordingOptions, json: Json = False) -> None:
        trajectory = how.load(recording)
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

import typer

from driftwalk.cli.options.flatten_options import Command, Part, spread
from driftwalk.cli.options.shared import quantity_parser
from driftwalk.core.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

PANEL = "How to read the recording"
RecordingFile = Annotated[
    Path, typer.Argument(metavar="RECORDING", help="Recording, in any readable format.")
]


def _option(name: str, help: str, *, metavar: str = "", unit: str = "") -> Any:
    return typer.Option(
        name,
        help=help,
        metavar=metavar or (f"<{unit}>" if unit else None),
        parser=quantity_parser(unit) if unit else None,
        rich_help_panel=PANEL,
        show_default=False,
    )


@dataclass(frozen=True)
class RecordingOptions:
    """How to read a recording; the fields are the options, with the words of `driftwalk.load`."""

    format: Annotated[
        str | None, _option("--format", "Format of the file (default: recognised by content).")
    ] = None
    body: Annotated[str | None, _option("--body", "Body to keep, or all.", metavar="NAME|all")] = (
        None
    )
    start: Annotated[float | None, _option("--from", "First time to keep.", unit="s")] = None
    stop: Annotated[float | None, _option("--to", "Last time to keep.", unit="s")] = None
    arena: Annotated[
        str | None,
        _option(
            "--arena",
            "Arena; @X,Y after a size gives its centre in metres.",
            metavar="circle:D|rect:WxH|polygon:FILE|fit",
        ),
    ] = None
    frame_rate: Annotated[
        float | None,
        _option("--frame-rate", "Frames per second, for files that count frames.", unit="Hz"),
    ] = None
    metres_per_pixel: Annotated[
        float | None, _option("--metres-per-pixel", "Scale of positions in pixels.", unit="m")
    ] = None
    length_unit: Annotated[
        str | None,
        _option(
            "--length-unit", "Unit of positions, if the file names none.", metavar="m|cm|mm|um|px"
        ),
    ] = None
    y_axis: Annotated[
        str | None,
        _option("--y-axis", "Direction of y and of angles in the file.", metavar="up|down"),
    ] = None
    max_speed: Annotated[
        float | None,
        _option(
            "--max-speed",
            "Fastest plausible speed; the fewest samples without which it is kept become gaps.",
            unit="m/s",
        ),
    ] = None
    sort: Annotated[
        bool, _option("--sort", "Sort times that go backwards (default: refuse them).")
    ] = False
    columns: Annotated[
        list[str] | None,
        _option(
            "--columns",
            "Columns of a plain table by name or number from 1, with an optional "
            ":unit. Repeatable.",
            metavar="t=NAME,x=NAME,y=NAME",
        ),
    ] = None
    delimiter: Annotated[
        str | None,
        _option("--delimiter", "Character between fields, or tab or space (default: recognised)."),
    ] = None
    up: Annotated[
        str | None,
        _option(
            "--up",
            "Axis of a file in space that points up (default: as its format has it).",
            metavar="x|y|z|-x|-y|-z",
        ),
    ] = None
    topic: Annotated[
        str | None,
        _option("--topic", "Topic of a ROS bag, or several with commas.", metavar="NAME[,NAME]"),
    ] = None
    header_line: Annotated[
        int | None,
        typer.Option(
            "--header-line",
            min=1,
            help="Line of a plain table, from 1, that names its columns.",
            rich_help_panel=PANEL,
            show_default=False,
        ),
    ] = None
    sheet: Annotated[
        str | None,
        _option(
            "--sheet",
            "Sheet of a workbook, by name or number from 1, or variable of a MATLAB file.",
            metavar="NAME",
        ),
    ] = None
    x: Annotated[
        Path | None, _option("--x", "Matrix of x: a row per frame, a column per body.")
    ] = None
    y: Annotated[Path | None, _option("--y", "Matrix of y.", metavar="FILE")] = None
    theta: Annotated[Path | None, _option("--theta", "Matrix of angles.", metavar="FILE")] = None
    keypoint: Annotated[
        str | None, _option("--keypoint", "Keypoint of a pose file that is the body.")
    ] = None
    heading: Annotated[
        str | None,
        _option(
            "--heading",
            "Two keypoints, or bodies that are markers of one: the angle from one to the other.",
            metavar="FROM,TO",
        ),
    ] = None
    min_confidence: Annotated[
        float | None,
        typer.Option(
            "--min-confidence",
            min=0.0,
            help="Keypoints seen with less confidence are missing (default: that of the format).",
            rich_help_panel=PANEL,
            show_default=False,
        ),
    ] = None
    replicate: Annotated[
        int | None,
        typer.Option(
            "--replicate",
            min=0,
            help="Replicate of a simulation, counted from 0 (default: the first).",
            rich_help_panel=PANEL,
            show_default=False,
        ),
    ] = None

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of `driftwalk.load` that are given."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        # The start may be 0 s; an option that is not given is None, or False for a flag.
        given = {name: one for name, one in values.items() if one is not None and one is not False}
        if self.sort:
            given["sort"] = "sort"
        if self.columns:
            given["columns"] = parse_columns(self.columns)
        if self.heading:
            given["heading"] = self.heading.split(",")
        if self.arena:
            given["tank"] = given.pop("arena")
        return given

    def words(self) -> list[str]:
        """Return the options that are given, as a user types them."""
        hints = get_type_hints(RecordingOptions, include_extras=True)
        words: list[str] = []
        for field in fields(self):
            value, option = getattr(self, field.name), hints[field.name].__metadata__[0]
            # In an annotation, the name of an option is where a default would be elsewhere.
            name = str(option.default)
            for one in value if isinstance(value, list) else [value]:
                if one is True:
                    words.append(name)
                elif one is not None and one is not False:
                    text = f"{one:.12g}" if isinstance(one, float) else str(one)
                    words += [name, text]
        return words

    def load(
        self, path: Path, *, tank_diameter: float | None = None, side: float | None = None
    ) -> xr.Dataset:
        """Load the recording.

        Parameters
        ----------
        path : Path
            The recording.
        tank_diameter : float, optional
            Diameter of a round tank [m], as ``--arena circle:D``.
        side : float, optional
            Side of the block [m], for ``--arena fit``.

        Raises
        ------
        InputError
            As `driftwalk.load`, and it says what a file is that is no recording; when no row holds
            a position; when ``--arena`` and ``--tank-diameter`` are both given.
        """
        from driftwalk.cli.inputs.other_files import explained
        from driftwalk.conditions import require_positions
        from driftwalk.record import load

        values = self.arguments()
        if tank_diameter is not None:
            if self.arena is not None:
                raise InputError("give --arena or --tank-diameter, not both")
            values["tank"] = f"circle:{tank_diameter!r}"
        with explained():
            recording = load(path, block=side if values.get("tank") == "fit" else None, **values)
        require_positions(recording, where=path)
        return recording


def parse_columns(texts: list[str]) -> dict[str, str]:
    """Read ``t=Time:ms,x=3`` into a mapping.

    Examples
    --------
    >>> parse_columns(["t=Time:ms,x=3", "y=4"])
    {'t': 'Time:ms', 'x': '3', 'y': '4'}
    """
    return parse_pairs(texts, "--columns")


def parse_pairs(texts: list[str], option: str) -> dict[str, str]:
    """Read ``QUANTITY=NAME`` with commas between, as the value of an option.

    Examples
    --------
    >>> parse_pairs(["u=water_u,v=water_v"], "--flow-variables")
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


def with_recording_options(function: Command) -> Command:
    """Spread a command's parameter of type `RecordingOptions` into one option per field."""
    hints = get_type_hints(RecordingOptions, include_extras=True)
    parts = {
        field.name: Part(hints[field.name], field.default) for field in fields(RecordingOptions)
    }
    return spread(function, RecordingOptions, parts, lambda given: RecordingOptions(**given))
