"""Options in the place of one parameter: a command takes an object, the user types its parts."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Mapping
from dataclasses import MISSING, field, fields
from typing import Annotated, Any, Final, NamedTuple, get_type_hints

from driftwalk.cli.options.shared_types import option

Command = Callable[..., Any]
OPTION: Final = "option"
"""Key of a field's metadata under which its option is declared."""


class Part(NamedTuple):
    """One option: its annotated type, and its value where it is not given."""

    annotation: Any
    default: Any


def spread(
    function: Command, kind: type, parts: Mapping[str, Part], make: Callable[[dict[str, Any]], Any]
) -> Command:
    """Return a command with options in the place of its parameter of a type.

    Parameters
    ----------
    function : callable
        A command, or what this function returned for one.
    kind : type
        The type of the parameter.
    parts : mapping
        The options by the names of their values.
    make : callable
        Makes the object from the values.

    Examples
    --------
    >>> class Size(dict): ...
    >>> def area(size: Size) -> float:
    ...     return size["width"] * size["height"]
    >>> parts = {"width": Part(float, 1.0), "height": Part(float, 1.0)}
    >>> spread(area, Size, parts, Size)(width=2.0, height=3.0)
    6.0
    """
    hints = get_type_hints(function, include_extras=True)
    signature = inspect.signature(function)
    name = next(key for key, hint in hints.items() if hint is kind)
    parameters = []
    for key, parameter in signature.parameters.items():
        own = {key: Part(hints.get(key, Any), parameter.default)}
        parameters += [
            inspect.Parameter(
                part, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation
            )
            for part, (annotation, default) in (parts if key == name else own).items()
        ]
    # An option that is required stands first in the help, as it does in a signature.
    required = {part for part, (_, default) in parts.items() if default is inspect.Parameter.empty}
    parameters.sort(key=lambda one: one.name not in required)

    @functools.wraps(function)
    def command(**values: Any) -> Any:
        made = make({part: values.pop(part) for part in parts})
        return function(**values, **{name: made})

    command.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {item.name: item.annotation for item in parameters}
    return command


def option_field(names: str, help: str, *, default: Any = None, **more: Any) -> Any:
    """Return a field of a dataclass that is an option; see `option`."""
    return field(default=default, metadata={OPTION: option(names, help, **more)})


def with_options(kind: Any, *names: str) -> Callable[[Command], Command]:
    """Spread a command's parameter of a dataclass into an option per field, or per named field.

    A field is declared by `option_field`, or annotated with its option; the default is the field's.
    """
    hints = get_type_hints(kind, include_extras=True)
    required = inspect.Parameter.empty
    parts, absent = dict[str, Part](), dict[str, None]()
    for one in fields(kind):
        default = required if one.default is MISSING else one.default
        hint = hints[one.name]
        if names and one.name not in names:
            absent |= {one.name: None} if default is required else {}
        elif OPTION in one.metadata:
            parts[one.name] = Part(Annotated[hint, one.metadata[OPTION]], default)
        else:
            parts[one.name] = Part(hint, default)
    return lambda function: spread(function, kind, parts, lambda given: kind(**absent, **given))
