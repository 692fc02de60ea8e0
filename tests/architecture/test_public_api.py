"""Every public name can be found, stands in one place, and says what it does."""

from __future__ import annotations

import importlib
import inspect
import re
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from api_pages import ROOMS

import driftwalk

STAGES = ROOMS


def stage(name: str) -> ModuleType:
    return importlib.import_module(f"driftwalk.{name}")


PUBLIC = [(name, public) for name in STAGES for public in stage(name).__all__]
FUNCTIONS = [
    (name, public) for name, public in PUBLIC if inspect.isfunction(getattr(stage(name), public))
]


def missing_from(function: Any) -> list[str]:
    """Return what the docstring of a function lacks."""
    text = inspect.getdoc(function) or ""
    signature = inspect.signature(function)
    parameters = [p for p in signature.parameters.values() if not p.name.startswith("_")]
    wrong = [] if text else ["a docstring"]
    if parameters and not section(text, "Parameters"):
        wrong.append("Parameters")
    described = section(text, "Parameters")
    wrong += [
        f"parameter {p.name}"
        for p in parameters
        if described and not re.search(rf"^(\*\*?)?(\w+, )*(\*\*?)?{p.name}\b", described, re.M)
    ]
    returns_nothing = signature.return_annotation in (None, "None", inspect.Signature.empty)
    # "Return every readable format and its description." says it in one line.
    if not (returns_nothing or text.startswith("Return ") or section(text, "Returns")):
        wrong.append("Returns")
    if not section(text, "Examples"):
        wrong.append("Examples")
    return wrong


def section(text: str, name: str) -> str:
    """Return a section of a numpydoc docstring; empty when it is not there."""
    found = re.search(rf"^{name}\n-+\n(.*?)(?=^\w[\w ]*\n-+\n|\Z)", text, re.M | re.S)
    return found.group(1) if found else ""


@pytest.mark.parametrize("name", STAGES)
def test_all_resolves(name: str) -> None:
    module = stage(name)
    assert [public for public in module.__all__ if not hasattr(module, public)] == []
    assert len(set(module.__all__)) == len(module.__all__)


# The functions of the notebook stand over those of the rooms, and are the ones at the top; a
# function of plot is called what it draws: plot.steps(steps(recording)).
NAMED_AFTER_OTHERS = ("notebook", "plot")


def test_no_name_is_public_twice() -> None:
    places: dict[str, list[str]] = {}
    for name, public in PUBLIC:
        if name in NAMED_AFTER_OTHERS:
            continue
        places.setdefault(public, []).append(name)
    assert {public: names for public, names in places.items() if len(names) > 1} == {}


def test_no_name_is_a_function_and_a_module() -> None:
    """Which of the two `room.name` is would hang on what had been imported before."""
    both = []
    for name in STAGES:
        room = Path(str(stage(name).__file__)).parent
        modules = {path.stem for path in room.iterdir()} - {"__init__"}
        both += [f"{name}.{public}" for public in stage(name).__all__ if public in modules]
    assert not both


def test_package_has_no_other_names() -> None:
    with pytest.raises(AttributeError, match="no_such_name"):
        driftwalk.no_such_name  # noqa: B018


@pytest.mark.parametrize(("name", "public"), FUNCTIONS, ids=lambda item: item)
def test_function_has_a_numpydoc_docstring(name: str, public: str) -> None:
    assert missing_from(getattr(stage(name), public)) == []


def test_a_poor_docstring_is_noticed() -> None:
    def poor(first: float, second: float) -> float:
        """Add.

        Parameters
        ----------
        first : float
            One.
        """
        return first + second

    assert missing_from(poor) == ["parameter second", "Returns", "Examples"]
