"""The options that choose a motion model, its known values and its ranges, or all its values."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, NamedTuple

from driftwalk.cli.options.shared_types import option
from driftwalk.core.errors import ConfigurationError, InputError, did_you_mean

if TYPE_CHECKING:
    from driftwalk.motion import MotionModel
    from driftwalk.runs import FoundRun

GIVE_VALUES: Final = "give the directory of a finished calibration"

ModelName = Annotated[
    str | None,
    option(
        "--model MODEL",
        "Motion model: a name of driftwalk models, mine.py:NAME, or command:PROGRAM. Default: "
        "the block in stirred water.",
    ),
]
ParameterValues = Annotated[
    list[str] | None,
    option(
        "--parameter NAME=VALUE",
        "Value of a parameter of --model, in its SI unit; repeat for others.",
    ),
]


class KnownModel(NamedTuple):
    """A motion model with a value for its parameters."""

    model: MotionModel
    values: dict[str, float]
    warnings: list[str]

    def made_with(self, name: str | None, options: dict[str, Any]) -> MotionModel:
        """Return the model made again, with values or ranges for parameters that it then has."""
        from driftwalk.motion import is_family_name, motion_model

        name = name or self.model.name
        clearance = getattr(self.model, "clearance", 0.0)
        kept = {"clearance": clearance} if clearance and is_family_name(name) else {}
        return motion_model(name, **{**kept, **options})


def known_model(name: str | None, choices: Sequence[str] | None, place: Path | None) -> KnownModel:
    """Return a motion model and the values of its parameters: those of a run, others over them.

    Without a name it is the model that the run is about. Only a model of the family is made of what
    a run says of itself: a file or a program is executed if the user names it.

    Raises
    ------
    ConfigurationError
        When there is no such model or parameter, or a choice is no number.
    InputError
        When the run holds no values of this model, or is about a model of the user's that is not
        named.
    """
    from driftwalk.motion import is_family_name, motion_model
    from driftwalk.runs import read_found

    given = {one: _value(one, choice) for one, choice in parameter_choices(choices).items()}
    found = None if place is None else read_found(place, give=GIVE_VALUES)
    if name is None and found is not None:
        name = _family_name(found)
    if name is None:
        raise ConfigurationError("name a motion model (--model)")
    options: dict[str, Any] = {}
    if is_family_name(name):
        # No parameter of the motion: how far the recorded point stays from the wall.
        known = {} if found is None else found.known(name)
        options["clearance"] = given.pop("clearance", known.get("clearance"))
    model = motion_model(name, **options)
    if found is None:
        return KnownModel(model, given, [])
    warnings = found.faults
    if found.is_outdated(model):
        warnings.append(f"the source of {name} has changed since the values of {place} were found")
    return KnownModel(model, {**found.values(model), **given}, warnings)


def _family_name(found: FoundRun) -> str:
    """Return the name of the run's model, which has to be one of driftwalk's own."""
    from driftwalk.motion import is_family_name, motion_model

    name, is_own = found.model, "model_source_sha256" not in found.found.attrs
    try:
        if is_own and is_family_name(name):
            motion_model(name)
            return name
    except ConfigurationError:
        pass
    raise InputError(
        f"{found.name} is about the model {name}, which is none of driftwalk's own: name its file "
        "or program again (--model)"
    )


def playable_model(
    name: str | None, choices: Sequence[str] | None, place: Path | None
) -> KnownModel:
    """Return a motion model with values or ranges for some of its parameters.

    As `known_model`; a choice may also be a range, which the model then has.
    """
    ranges = [text for text in choices or () if "," in text]
    values = [text for text in choices or () if "," not in text]
    known = known_model(name, values, place)
    if not ranges:
        return known
    return known._replace(model=known.made_with(name, parameter_choices(ranges)))


def partly_known_model(
    name: str | None, choices: Sequence[str] | None, place: Path | None, known: Sequence[str] | None
) -> KnownModel:
    """Return a motion model that knows some of its parameters, with the values of the others.

    As `known_model`; the parameters of `known` get their values for good.

    Raises
    ------
    ConfigurationError
        As `known_model`, and when a known parameter is none of the model's or has no value.
    """
    from driftwalk.motion import known_values

    found = known_model(name, choices, place)
    if not known:
        return found
    values = known_values(found.model, found.values)
    unknown = [one for one in known if one not in values]
    if unknown:
        raise ConfigurationError(
            f"--known {unknown[0]}: the model {found.model.name} has "
            f"{', '.join(values)}{did_you_mean(unknown[0], values)}"
        )
    model = found.made_with(name, {one: values[one] for one in known})
    left = {one: value for one, value in values.items() if one not in known}
    return KnownModel(model, left, found.warnings)


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
    given: dict[str, Any] = parameter_choices(choices)
    return motion_model(name, **given)


def parameter_choices(texts: Sequence[str] | None) -> dict[str, float | tuple[float, float]]:
    """Return the value, or the range, of each parameter that is named.

    Raises
    ------
    ConfigurationError
        When a choice is no number and no range, or a parameter is named twice.
    """
    given = dict(_choice(text) for text in texts or ())
    if len(given) < len(texts or ()):
        raise ConfigurationError("--parameter names a parameter twice")
    return given


def _value(name: str, choice: float | tuple[float, float]) -> float:
    if isinstance(choice, tuple):
        low, high = choice
        raise ConfigurationError(
            f"--parameter {name}={low:g},{high:g} is a range: give the value to simulate, "
            f"{name}=VALUE"
        )
    return choice


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
