"""The reference page of the Python names says what the docstrings say.

python tests/architecture/test_api_page.py      # writes the page again
"""

from __future__ import annotations

import importlib
import inspect
import re
from pathlib import Path
from types import ModuleType
from typing import Any

import driftwalk

PAGE = Path(__file__).resolve().parents[2] / "docs" / "reference" / "python.md"
HEAD = """\
# The Python names

Made from the docstrings by `python tests/architecture/test_api_page.py`. `help(driftwalk.fit)`
shows a whole docstring: arguments with units, results, errors, an example. Names in **bold** are
also at the top, such as `driftwalk.load`.
"""
TABLE = "| name | what |\n|---|---|\n"
# The calls of a notebook first, then the rooms in the order of the data.
ROOMS = (
    "notebook",
    "record",
    "flow",
    "model",
    "conditions",
    "simulation",
    "motion",
    "comparison",
    "sweep",
    "calibration",
    "likelihood",
    "assembly",
    "track",
    "datasets",
    "runs",
    "plot",
    "figures",
    "page",
    "viewer",
)


def api_page() -> str:
    """Return the page."""
    parts = [HEAD]
    for name in ROOMS:
        room = importlib.import_module(f"driftwalk.{name}")
        parts.append(
            f"\n## driftwalk.{name}\n\n{_first_line(room)}\n\n| name | what |\n|---|---|\n"
        )
        parts += [_row(room, public) for public in room.__all__]
    parts.append(f"\n## Errors\n\n{TABLE}")
    errors = importlib.import_module("driftwalk.core.errors")
    parts += [_row(errors, public) for public in driftwalk._NAMES["driftwalk.core.errors"]]
    return "".join(parts)


def _row(room: ModuleType, public: str) -> str:
    found = getattr(room, public)
    top = getattr(driftwalk, public, None) is found and public in driftwalk._MODULE_OF
    call = f"{public}{_arguments(found)}"
    shown = f"**`{call}`**" if top else f"`{call}`"
    return f"| {shown} | {_first_line(found)} |\n"


def _arguments(found: Any) -> str:
    """Return the names of the arguments; those with a default after a comma and three dots."""
    if not inspect.isfunction(found):
        return ""
    parameters = inspect.signature(found).parameters.values()
    needed = [one.name for one in parameters if one.default is one.empty and one.kind.value < 2]
    has_more = len(needed) < len(parameters)
    return f"({', '.join([*needed, *(['…'] if has_more else [])])})"


def _first_line(found: Any) -> str:
    if not (inspect.isroutine(found) or inspect.isclass(found) or inspect.ismodule(found)):
        return "A type, for annotations." if callable(found) else "A constant."
    text = inspect.getdoc(found) or ""
    first = re.split(r"\n\s*\n", text.strip(), maxsplit=1)[0]
    return " ".join(first.split()).replace("|", "\\|")


def test_the_page_says_what_the_docstrings_say() -> None:
    assert PAGE.read_text(encoding="utf-8") == api_page()


def test_every_room_is_on_the_page() -> None:
    assert set(ROOMS) == set(driftwalk._ROOMS)


if __name__ == "__main__":
    PAGE.write_text(api_page(), encoding="utf-8")
