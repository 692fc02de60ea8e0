"""The options that choose a motion model, its known values and its ranges."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from driftwalk.core.errors import ConfigurationError

if TYPE_CHECKING:
    from driftwalk.motion import MotionModel

ModelName = Annotated[
    str | None,
    typer.Option(
        "--model",
        metavar="MODEL",
        help="Motion model: a name of driftwalk models, mine.py:NAME, or command:PROGRAM. Default: "
        "the block in stirred water.",
        show_default=False,
    ),
]
ParameterChoices = Annotated[
    list[str] | None,
    typer.Option(
        "--parameter",
        metavar="NAME=VALUE|LOW,HIGH",
        help="Known value, or range of the search, of a parameter of --model; repeat for others.",
        show_default=False,
    ),
]


def chosen_model(name: str | None, choices: Sequence[str] | None) -> MotionModel | None:
    """Return the chosen motion model; None for the block.

    Raises
    ------
    ConfigurationError
        When there is no such model or parameter, a choice is no number and no range, or there are
        choices without a model.
    """
    from driftwalk.motion import motion_model

    if name is None:
        if choices:
            raise ConfigurationError("--parameter belongs to a --model; the block has options")
        return None
    given: dict[str, Any] = dict(_choice(text) for text in choices or ())
    if len(given) < len(choices or ()):
        raise ConfigurationError("--parameter names a parameter twice")
    return motion_model(name, **given)


def _choice(text: str) -> tuple[str, float | tuple[float, float]]:
    name, equals, value = text.partition("=")
    try:
        numbers = [float(part) for part in value.split(",")]
    except ValueError:
        numbers = []
    if not name or not equals or len(numbers) not in (1, 2):
        raise ConfigurationError(
            f"--parameter {text}: expected NAME=VALUE or NAME=LOW,HIGH, numbers in SI units"
        )
    return name.strip(), numbers[0] if len(numbers) == 1 else (numbers[0], numbers[1])
