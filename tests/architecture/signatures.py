"""Signatures as the source writes them, the same under every version of Python."""

from __future__ import annotations

import enum
import inspect
import typing
from typing import Any, Final

import pydantic

LINE: Final = 100
"""Longest line of a signature; a longer one has a line for each argument."""
_LONG: Final = 60
_KINDS: Final = inspect.Parameter


def signature_of(name: str, found: Any) -> str:
    """Return the call of a function or class; empty where there is nothing to call."""
    if not callable(found) or _is_made_otherwise(found):
        return ""
    signature = inspect.signature(found)
    # A section of a study says types, units and ranges on the page of the study file.
    typed = not (inspect.isclass(found) and issubclass(found, pydantic.BaseModel))
    words = _arguments(list(signature.parameters.values()), typed=typed)
    gives = "" if inspect.isclass(found) else _annotation(signature.return_annotation, " -> ")
    line = f"{name}({', '.join(words)}){gives}"
    if len(line) <= LINE:
        return line
    return f"{name}(\n" + "".join(f"    {word},\n" for word in words) + f"){gives}"


def bases_of(found: type) -> str:
    """Return what kind of class it is, for those that one does not call."""
    if getattr(found, "_is_protocol", False):
        return "protocol"
    if issubclass(found, enum.Enum):
        return "enumeration"
    if issubclass(found, Warning):
        return "warning"
    return "exception" if issubclass(found, Exception) else "class"


def _is_made_otherwise(found: Any) -> bool:
    """Return whether it is a protocol, an enumeration or a dictionary with named keys."""
    if not inspect.isclass(found):
        return False
    own_init = "__init__" in vars(found)
    return (
        getattr(found, "_is_protocol", False)
        or issubclass(found, enum.Enum)
        or typing.is_typeddict(found)
        or (issubclass(found, BaseException) and not own_init)
    )


def _arguments(parameters: list[inspect.Parameter], *, typed: bool) -> list[str]:
    words = []
    starred = False
    for number, one in enumerate(parameters):
        if one.name == "self":
            continue
        if one.kind is _KINDS.KEYWORD_ONLY and not starred:
            words.append("*")
        starred = starred or one.kind in (_KINDS.KEYWORD_ONLY, _KINDS.VAR_POSITIONAL)
        words.append(_argument(one, typed=typed))
        last = number + 1 == len(parameters) or parameters[number + 1].kind != one.kind
        if one.kind is _KINDS.POSITIONAL_ONLY and last:
            words.append("/")
    return words


def _argument(one: inspect.Parameter, *, typed: bool) -> str:
    mark = {_KINDS.VAR_POSITIONAL: "*", _KINDS.VAR_KEYWORD: "**"}.get(one.kind, "")
    kind = _annotation(one.annotation, ": ") if typed else ""
    if one.default is one.empty:
        return f"{mark}{one.name}{kind}"
    return f"{mark}{one.name}{kind}{' = ' if kind else '='}{_value(one.default)}"


def _annotation(found: Any, before: str) -> str:
    if found is inspect.Parameter.empty:
        return ""
    if isinstance(found, typing.ForwardRef):
        found = found.__forward_arg__
    if not isinstance(found, str):
        found = inspect.formatannotation(found)
    # A string inside a string: names that are only there for type checkers.
    return before + found.strip("'\"")


def _value(default: Any) -> str:
    """Return a default as it is written; dots where it is made by code or long."""
    if isinstance(default, enum.Enum):
        return f"{type(default).__name__}.{default.name}"
    if callable(default):
        return getattr(default, "__name__", "...").replace("<lambda>", "...")
    text = repr(default)
    return "..." if text.startswith("<") or " at 0x" in text or len(text) > _LONG else text
