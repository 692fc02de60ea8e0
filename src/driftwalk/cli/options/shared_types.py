"""Options that several commands share, each declared once, and options that take a quantity."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from driftwalk.core.errors import ConfigurationError, InputError
from driftwalk.core.units import Uncertain, parse_quantity, split_uncertain

PANEL: Final = "Parameters"
READING: Final = "How to read the recording"
"""The panels of the help that several commands have."""
SCALE: Final = "Size of a pixel, such as 0.5mm or 2000px/m."
"""Help of the option for the scale of an image."""


def quantity_parser(unit: str, *words: str) -> Callable[[str], Any]:
    """Return a function that reads a quantity such as ``0.55mN``, or one of the words.

    One with a standard deviation, ``11.6±0.2 g``, becomes an `Uncertain`.

    Parameters
    ----------
    unit : str
        Unit of the result.
    *words : str
        Words that may replace a number.
    """

    def parse(text: Any) -> Any:
        # Typer may hand a value back that is parsed already.
        if not isinstance(text, str) or text in words:
            return text
        try:
            both = split_uncertain(text)
            if both is not None:
                return Uncertain(*(parse_quantity(str(part), unit) for part in both))
            return parse_quantity(text, unit)
        except ConfigurationError as error:
            or_words = f" (or {', '.join(words)})" if words else ""
            raise typer.BadParameter(f"{error}{or_words}") from error

    return parse


def option(names: str, help: str, *, panel: str | None = None, unit: str = "", **more: Any) -> Any:
    """Return the declaration of an option; with a unit, of one that takes a quantity.

    The names stand with the placeholder of the value as in the help: ``"--out -o FILE"``.
    """
    if unit:
        more["parser"] = quantity_parser(unit)
    words = names.split()
    placeholders = [word for word in words if not word.startswith("-")]
    return typer.Option(
        *(word for word in words if word.startswith("-")),
        help=help,
        metavar=unit or "".join(placeholders) or None,
        rich_help_panel=panel,
        **more,
    )


def optional(names: str, help: str, *, default: Any = None, **more: Any) -> Any:
    """Return the declaration of an option that may be left out, as the default of a parameter."""
    declared = option(names, help, **more)
    # In an annotation, the name of an option is where the default is here.
    declared.param_decls = (declared.default, *declared.param_decls)
    declared.default = default
    return declared


def flag(name: str, help: str) -> Any:
    """Return the declaration of an option without a value, as the default of a parameter."""
    return optional(name, help, default=False)


def argument(placeholder: str, help: str) -> Any:
    """Return the declaration of an argument."""
    return typer.Argument(metavar=placeholder, help=help)


def parse_scale(text: Any) -> Any:
    """Return the metres that a pixel spans, from ``0.5mm`` or ``2000px/m``."""
    if isinstance(text, str) and text.endswith("px/m"):
        pixels = quantity_parser("1")(text.removesuffix("px/m"))
        if not pixels > 0.0:
            raise typer.BadParameter(f"a scale is above zero, got {text}")
        return 1.0 / pixels
    return quantity_parser("m")(text)


def flow_of_run(path: Path | None) -> Path | None:
    """Return the flow field in a run directory; any other path as it is."""
    if path is None or not path.is_dir():
        return path
    from driftwalk.core.files.run_layout import run_file

    stored = run_file(path, "flow.nc")
    if stored is None:
        raise InputError(
            f"{path} holds no flow field (flow.nc): name the file of one, or the run "
            "directory of a fit or of a calibration"
        )
    return stored


Run = Annotated[
    Path | None,
    argument(
        "RUN",
        "Run directory of a finished fit, calibration or comparison of models, or its dataset.",
    ),
]
StudyFile = Annotated[
    Path | None,
    option("--study FILE", "Study file with the parameters (see: driftwalk study new)."),
]
FlowFile = Annotated[
    Path | None,
    option(
        "--flow FILE",
        "Flow field to use, or the run directory that holds it.",
        callback=flow_of_run,
    ),
]
FrameInterval = Annotated[
    float | None,
    option(
        "--frame-interval",
        "Time between the two images of a pair, for a flow field of shifts in pixels.",
        unit="s",
        panel=READING,
    ),
]
FlowVariables = Annotated[
    str | None,
    option(
        "--flow-variables u=NAME,v=NAME",
        "Variables of a flow field in NetCDF: u, v, x, y, time, mask.",
        panel=READING,
    ),
]
Json = Annotated[bool, option("--json", "Print the result as JSON on stdout.")]
Threads = Annotated[
    int | None, option("--threads N", "Worker threads (default: all cores).", min=1)
]
BodyOfLike = Annotated[str | None, option("--body NAME", "Body of --like.")]
Overwrite = Annotated[bool, option("--overwrite", "Move a finished run aside and start a new one.")]
Replace = Annotated[bool, option("--overwrite", "Replace a file that exists.")]
