"""Options that several commands share, each declared once, and the study that they make.

A command takes the annotated types it needs::

    def simulate(study: StudyFile = None, force_std: ForceStd = None, json: Json = False) -> None:
        parameters = resolve_study(study, study_overrides(force_std=force_std))

An option that is not given is None and leaves the study file's value as it is.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from driftwalk.core.errors import ConfigurationError
from driftwalk.core.study_keys import (
    CALIBRATION_KEYS,
    STUDY_KEYS,
)
from driftwalk.core.units import parse_quantity

if TYPE_CHECKING:
    from driftwalk.model import Study

PANEL: Final = "Parameters"


def quantity_parser(unit: str, *words: str) -> Callable[[str], Any]:
    """Return a function that reads a quantity such as ``0.55mN``, or one of the words.

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
            return parse_quantity(text, unit)
        except ConfigurationError as error:
            or_words = f" (or {', '.join(words)})" if words else ""
            raise typer.BadParameter(f"{error}{or_words}") from error

    return parse


def quantity_option(name: str, unit: str, help: str, *words: str, metavar: str = "") -> Any:
    """Return the declaration of an option that takes a quantity."""
    choices = "|".join((*words, unit if unit != "1" else "number"))
    return typer.Option(
        name,
        parser=quantity_parser(unit, *words),
        metavar=metavar or f"<{choices}>",
        help=help,
        rich_help_panel=PANEL,
        show_default=False,
    )


StudyFile = Annotated[
    Path | None,
    typer.Option(
        "--study",
        metavar="FILE",
        help="Study file with the parameters (see: driftwalk study new).",
        show_default=False,
    ),
]
FlowFile = Annotated[
    Path | None,
    typer.Option("--flow", metavar="FILE", help="Flow field to use.", show_default=False),
]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON on stdout.")]

TankDiameter = Annotated[
    float | None, quantity_option("--tank-diameter", "m", "Diameter of a circular tank.")
]
Side = Annotated[float | None, quantity_option("--side", "m", "Side of the block.")]
Mass = Annotated[float | None, quantity_option("--mass", "kg", "Mass of the block.")]
Depth = Annotated[
    Any, quantity_option("--depth", "m", "Wetted depth of a side face.", "immersed", "archimedes")
]
DragCoefficient = Annotated[
    float | None, quantity_option("--drag-coefficient", "1", "Drag coefficient C_d.")
]
ForceStd = Annotated[
    float | None,
    quantity_option("--force-std", "N", "Standard deviation of the stochastic force."),
]
ForceInterval = Annotated[
    float | None,
    quantity_option("--force-interval", "s", "Interval at which the stochastic force is redrawn."),
]
WallFriction = Annotated[
    float | None, quantity_option("--wall-friction", "1", "Coulomb friction of the wall.")
]
WallRestitution = Annotated[
    float | None, quantity_option("--wall-restitution", "1", "Restitution of the wall, 0 to 1.")
]
TimeStep = Annotated[
    Any, quantity_option("--time-step", "s", "Time step; divides the force interval.", "auto")
]
Duration = Annotated[
    float | None, quantity_option("--duration", "s", "Length of a simulated trajectory.")
]
SampleRate = Annotated[
    float | None, quantity_option("--sample-rate", "Hz", "Samples per second of a simulation.")
]
StepInterval = Annotated[
    Any, quantity_option("--step-interval", "s", "Time between the positions of a step.", "auto")
]
PositionNoise = Annotated[
    Any, quantity_option("--position-noise", "m", "Position noise of the tracker.", "estimate")
]
OrientationNoise = Annotated[
    Any,
    quantity_option("--orientation-noise", "rad", "Orientation noise of the tracker.", "estimate"),
]
Seed = Annotated[
    int | None,
    typer.Option(
        "--seed",
        min=0,
        help="Seed of the random numbers.",
        rich_help_panel=PANEL,
        show_default=False,
    ),
]
Replicates = Annotated[
    int | None,
    typer.Option(
        "--replicates",
        min=1,
        help="Simulations with the same parameters.",
        rich_help_panel=PANEL,
        show_default=False,
    ),
]

Blocks = Annotated[
    int | None,
    typer.Option(
        "--blocks",
        min=1,
        help="Blocks in the tank.",
        rich_help_panel=PANEL,
        show_default=False,
    ),
]
Runs = Annotated[
    int | None,
    typer.Option(
        "--runs", min=1, help="Simulated runs.", rich_help_panel=PANEL, show_default=False
    ),
]
RunDuration = Annotated[float | None, quantity_option("--duration", "s", "Length of a run.")]
BlockLatching = Annotated[
    str | None,
    typer.Option(
        "--latching",
        metavar="collision|connector|none",
        help="Rule by which two blocks latch.",
        rich_help_panel=PANEL,
        show_default=False,
    ),
]
ConnectorDistance = Annotated[
    float | None,
    quantity_option("--connector-distance", "m", "Distance at which two connectors latch."),
]
ConnectorAxis = Annotated[
    float | None,
    quantity_option("--connector-axis", "rad", "Angle at which two connectors latch."),
]
HiddenFaces = Annotated[
    str | None,
    typer.Option(
        "--hidden-face-drag",
        metavar="none|full",
        help="Drag on faces that are joined.",
        rich_help_panel=PANEL,
        show_default=False,
    ),
]
MirrorImages = Annotated[
    str | None,
    typer.Option(
        "--chirality",
        metavar="merged|distinct",
        help="Mirror images as one class or two.",
        rich_help_panel=PANEL,
        show_default=False,
    ),
]
BlockRestitution = Annotated[
    float | None,
    quantity_option("--block-restitution", "1", "Restitution between blocks, 0 to 1."),
]
BlockFriction = Annotated[
    float | None, quantity_option("--block-friction", "1", "Coulomb friction between blocks.")
]
Confidence = Annotated[
    float | None,
    quantity_option("--confidence", "1", "Simultaneous confidence of the intervals."),
]

Realisations = Annotated[
    int | None,
    typer.Option(
        "--realisations",
        min=2,
        help="Realisations of the reference, each with the same number of runs.",
        rich_help_panel=PANEL,
        show_default=False,
    ),
]
Vary = Annotated[
    list[str] | None,
    typer.Option(
        "--vary",
        metavar="NAME=VALUES",
        help="Values to compare: blocks=2,3,4 or drag-coefficient=0:1.5:0.05. Repeatable.",
        rich_help_panel=PANEL,
        show_default=False,
    ),
]


def resolve_study(
    study_path: Path | None,
    overrides: Mapping[str, Any],
    *,
    keys: Mapping[str, str] = STUDY_KEYS,
) -> Study:
    """Return the study of a file, or the default one, with the options of the command line over it.

    Parameters
    ----------
    study_path : Path or None
        A study file.
    overrides : mapping
        From ``"section.key"`` to the value, as `study_overrides` makes it.
    keys : mapping
        That of `study_overrides`: an error names the options.

    Raises
    ------
    ConfigurationError
        When the file is wrong, or an option contradicts it; the message names both.

    Examples
    --------
    >>> resolve_study(None, {"forces.force_std_N": 1e-3}).forces.force_std_N
    0.001
    """
    from driftwalk.model import Study, load_study

    study = load_study(study_path) if study_path is not None else Study()
    base = f"{study_path}" if study_path is not None else "the default study"
    return override_study(study, overrides, base=base, keys=keys)


def override_study(
    study: Study, overrides: Mapping[str, Any], *, base: str, keys: Mapping[str, str] = STUDY_KEYS
) -> Study:
    """Return a study with the options of the command line over it.

    Parameters
    ----------
    study : Study
        The study.
    overrides, keys
        As in `resolve_study`.
    base : str
        Where the study is from, for an error.

    Raises
    ------
    ConfigurationError
        When an option contradicts the study; the message names both.
    """
    from driftwalk.model import apply_overrides

    try:
        return apply_overrides(study, overrides)
    except ConfigurationError as error:
        given = [option_name(key, keys=keys) for key in overrides]
        raise ConfigurationError(f"{', '.join(given)} over {base}: {error}") from error


def option_name(key: str, *, keys: Mapping[str, str] = STUDY_KEYS) -> str:
    """Return the option that sets a key of the study, the key itself where there is none."""
    key = "block.depth" if key == "block.depth_m" else key
    declared = (*keys.items(), *STUDY_KEYS.items(), *CALIBRATION_KEYS.items())
    names = [name for name, known in declared if known == key]
    return f"--{names[0].replace('_', '-')}" if names else key
