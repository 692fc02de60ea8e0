"""The reference pages of the Python names, made from the docstrings.

`make site` writes them before it builds the site, as does
``python tests/architecture/api_pages.py``. They are not committed.
"""

from __future__ import annotations

import ast
import importlib
import inspect
import re
from functools import cached_property
from pathlib import Path
from types import ModuleType
from typing import Any, Final

from docstring_sections import as_markdown, sections_of
from signatures import bases_of, signature_of

import driftwalk

FOLDER: Final = Path(__file__).resolve().parents[2] / "docs" / "reference" / "python"
MADE: Final = "% Made from the docstrings by `python tests/architecture/api_pages.py`."
ALL: Final = "names.md"
# The calls of a notebook first, then the rooms in the order of the data.
ROOMS: Final = (
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
ERRORS: Final = "core.errors"
TABLE: Final = "| name | what |\n|---|---|\n"


def all_pages() -> dict[Path, str]:
    """Return the pages by their paths: of all names, of each room, of each function and class."""
    rooms = (*ROOMS, ERRORS)
    pages = {
        FOLDER / ALL: _page_of_all(),
        **{FOLDER / f"{_file(name)}.md": _room_page(name) for name in rooms},
        **{
            FOLDER / _file(name) / f"{public}.md": _name_page(name, public)
            for name in rooms
            for public in _names(name)
            if _is_documented(getattr(_room(name), public))
        },
    }
    return {path: _with_links(path, text) for path, text in pages.items()}


def _with_links(path: Path, text: str) -> str:
    """Return a page on which each other page that a docstring names is a link."""
    up = "../" * (len(path.relative_to(FOLDER).parts) + 1)
    return re.sub(r"`?\bdocs/([\w/-]+\.md)`?(?![\w)\]])", rf"[docs/\1]({up}\1)", text)


def _page_of_all() -> str:
    parts = [
        "# All names\n\n",
        f"{MADE}\n\n"
        "Each name leads to its arguments with units, results, errors and an example, as\n"
        "`help(driftwalk.fit)` shows them. Names in **bold** are also at the top, such as\n"
        "`driftwalk.load`.\n\n",
        *(f"- [{_title(name)}](#{_anchor(_title(name))})\n" for name in (*ROOMS, ERRORS)),
    ]
    for name in (*ROOMS, ERRORS):
        room = _room(name)
        parts.append(f"\n## {_title(name)}\n\n{_first_line(room)}\n\n{TABLE}")
        parts += [_row(name, room, public) for public in _names(name)]
    return "".join(parts)


def _row(name: str, room: ModuleType, public: str) -> str:
    found = getattr(room, public)
    call = f"{public}{_short_arguments(found)}"
    top = getattr(driftwalk, public, None) is found and public in driftwalk._MODULE_OF
    own = _is_documented(found)
    place = f"{_file(name)}/{public}.md" if own else f"{_file(name)}.md#{_anchor(public)}"
    shown = f"[`{call}`]({place})"
    return f"| {f'**{shown}**' if top else shown} | {_first_line(found)} |\n"


def _short_arguments(found: Any) -> str:
    """Return the names of the arguments; those with a default after a comma and three dots."""
    if not inspect.isfunction(found):
        return ""
    parameters = inspect.signature(found).parameters.values()
    needed = [one.name for one in parameters if one.default is one.empty and one.kind.value < 2]
    has_more = len(needed) < len(parameters)
    return f"({', '.join([*needed, *(['…'] if has_more else [])])})"


def _room_page(name: str) -> str:
    room = _room(name)
    names = _names(name)
    constants = [one for one in names if not _is_documented(getattr(room, one))]
    rows = [_row(name, room, public) for public in names if public not in constants]
    parts = [
        f"# {_title(name)}",
        f"{MADE}\n\n[All names]({ALL})",
        as_markdown(inspect.getdoc(room) or ""),
        TABLE + "".join(rows) if rows else "",
        *(_constant(room, public) for public in constants),
    ]
    return "\n\n".join(part.rstrip() for part in parts if part) + "\n"


def _constant(room: ModuleType, public: str) -> str:
    value = f"```text\n{public} = {_written_value(room, public)}\n```"
    return f"## {public}\n\n{_first_line(getattr(room, public))}\n\n{value}"


def _name_page(name: str, public: str) -> str:
    """Return the page of a function or a class; it is found by search, and not in the contents."""
    found = getattr(_room(name), public)
    top = getattr(driftwalk, public, None) is found and public in driftwalk._MODULE_OF
    parts = [
        "---\norphan: true\n---",
        f"# {'driftwalk' if top else _module(name)}.{public}",
        f"{MADE}\n\nIn [{_title(name)}](../{_file(name)}.md)",
        _code(public, found),
        as_markdown(inspect.getdoc(found) or ""),
    ]
    if inspect.isclass(found):
        parts += [_member(public, member, value) for member, value in _members(found)]
    return "\n\n".join(part.rstrip() for part in parts) + "\n"


def _code(name: str, found: Any) -> str:
    text = signature_of(name, found)
    if inspect.isclass(found):
        text = f"{bases_of(found)} {text or name}"
    return f"```python\n{text}\n```"


def _members(found: type) -> list[tuple[str, Any]]:
    """Return the public methods and properties that a class defines itself and describes."""
    members = []
    for name, value in vars(found).items():
        inner = value.__func__ if isinstance(value, (classmethod, staticmethod)) else value
        described = isinstance(inner, (property, cached_property)) or inspect.isfunction(inner)
        if described and not name.startswith("_") and inspect.getdoc(inner):
            members.append((name, inner))
    return members


def _member(owner: str, name: str, value: Any) -> str:
    heading = f"## {owner}.{name}"
    text = as_markdown(inspect.getdoc(value) or "")
    if not inspect.isfunction(value):
        return f"{heading}\n\n{text}"
    return f"{heading}\n\n```python\n{signature_of(name, value)}\n```\n\n{text}"


def _is_documented(found: Any) -> bool:
    return inspect.isroutine(found) or inspect.isclass(found) or hasattr(found, "__wrapped__")


def _written_value(room: ModuleType, public: str) -> str:
    """Return a constant or a type as the source writes it, where that is short.

    The value itself may be printed in another way by the next NumPy.
    """
    for path in sorted(Path(str(room.__file__)).parent.rglob("*.py")):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", 0)]
            if any(isinstance(one, ast.Name) and one.id == public for one in targets):
                text = ast.unparse(node.value)
                return text if len(text) <= 90 else "…"
    raise LookupError(f"{room.__name__} assigns no {public}")


def _first_line(found: Any) -> str:
    if not (_is_documented(found) or inspect.ismodule(found)):
        return "A type, for annotations." if callable(found) else "A constant."
    text = sections_of(inspect.getdoc(found) or "")[""]
    return " ".join(re.split(r"\n\s*\n", text, maxsplit=1)[0].split()).replace("|", "\\|")


def _room(name: str) -> ModuleType:
    return importlib.import_module(f"driftwalk.{name}")


def _names(name: str) -> list[str]:
    return list(
        driftwalk._NAMES["driftwalk.core.errors"] if name == ERRORS else _room(name).__all__
    )


def _title(name: str) -> str:
    return "Errors" if name == ERRORS else f"driftwalk.{name}"


def _module(name: str) -> str:
    return f"driftwalk.{name}"


def _file(name: str) -> str:
    return "errors" if name == ERRORS else name


def _anchor(heading: str) -> str:
    """Return the anchor of a heading, as code hosts make it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def write_pages() -> None:
    """Write every page that has changed, and remove those of rooms that are gone."""
    found = all_pages()
    for path in set(FOLDER.rglob("*.md")) - found.keys():
        path.unlink()
    for path, text in found.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        # Sphinx reads a page again when its file is newer.
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    write_pages()
