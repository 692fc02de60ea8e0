"""The types that public docstrings name exist."""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from api_pages import ERRORS, ROOMS
from docstring_sections import entries_of, sections_of

import driftwalk

PACKAGE = Path(__file__).resolve().parents[2] / "src" / "driftwalk"
SECTIONS = ("Parameters", "Attributes", "Returns", "Yields")
# A class, or a dotted name of another package; texts and choices are not looked at.
TYPE = re.compile(r"(?<![\w.`'(])([A-Z]\w+|[a-z]\w*(?:\.\w+)*\.[A-Z]\w+)")
OWN = re.compile(r"^(?:class (\w+)|(\w{2,})(?:: [^=\n]+)? = )", re.MULTILINE)
OF_OTHERS = {"None", "Path", "DataFrame"}


@cache
def own_names() -> set[str]:
    """Return the classes of the package, and the names that its modules assign."""
    sources = (path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py"))
    return {name for source in sources for names in OWN.findall(source) for name in names if name}


def exists(name: str) -> bool:
    """Return whether there is such a type; True for one of a package that is not installed."""
    module, _, attribute = name.rpartition(".")
    if not module:
        return name in own_names() | OF_OTHERS
    try:
        return hasattr(importlib.import_module(module), attribute)
    except ModuleNotFoundError:
        return not module.startswith("driftwalk")


def types_named(docstring: str) -> set[str]:
    """Return the types that stand behind names in a docstring's sections, or before results."""
    named: set[str] = set()
    sections = sections_of(docstring)
    for section in SECTIONS:
        for head, _ in entries_of(sections.get(section, "")):
            _, colon, kind = head.partition(" : ")
            kind = kind if colon else head if section in ("Returns", "Yields") else ""
            named |= set(TYPE.findall(re.sub(r'"[^"]*"|\{[^}]*\}', "", kind)))
    return named


def documented(room: str) -> Iterator[tuple[str, str]]:
    """Yield the public functions, classes and methods of a room, with their docstrings."""
    module = importlib.import_module(f"driftwalk.{room}")
    names = driftwalk._NAMES["driftwalk.core.errors"] if room == ERRORS else module.__all__
    for name in names:
        found: Any = getattr(module, name)
        if not (inspect.isclass(found) or inspect.isroutine(found)):
            continue
        yield name, inspect.getdoc(found) or ""
        if inspect.isclass(found):
            for member, value in vars(found).items():
                if not member.startswith("_"):
                    inner = getattr(value, "__func__", value)
                    if inspect.isfunction(inner):
                        yield f"{name}.{member}", inspect.getdoc(inner) or ""


@pytest.mark.slow
@pytest.mark.parametrize("room", [*ROOMS, ERRORS])
def test_types_in_docstrings_exist(room: str) -> None:
    wrong = {
        name: sorted(missing)
        for name, docstring in documented(room)
        if (missing := {one for one in types_named(docstring) if not exists(one)})
    }
    assert not wrong


def test_a_type_that_does_not_exist_is_noticed() -> None:
    docstring = """Do it.

    Parameters
    ----------
    work : RecoveringWork, optional
        A Thing.
    study, other : Study or {"Auto", "None"}
        `Nothing`.
    axes : matplotlib.axes.Axis2
        Where.

    Returns
    -------
    Dataset
        Of xarray.
    """
    named = types_named(inspect.cleandoc(docstring))
    assert named == {"RecoveringWork", "Study", "matplotlib.axes.Axis2", "Dataset"}
    assert {one for one in named if not exists(one)} == named - {"Study"}
