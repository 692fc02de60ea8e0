"""The reference pages of the Python names say what the docstrings and signatures say."""

from __future__ import annotations

import enum
from typing import NamedTuple, Protocol

import pytest
from api_pages import ERRORS, FOLDER, ROOMS, all_pages
from docstring_sections import as_markdown, entries_of, sections_of
from signatures import signature_of

import driftwalk


@pytest.fixture(scope="module")
def pages() -> dict[str, str]:
    """Return the pages as they should be, by their paths under docs/reference."""
    return {path.relative_to(FOLDER).as_posix(): text for path, text in all_pages().items()}


@pytest.mark.slow
def test_the_pages_say_what_the_docstrings_say(pages: dict[str, str]) -> None:
    stored = [FOLDER / "python.md", *(FOLDER / "python").glob("*.md")]
    found = {
        path.relative_to(FOLDER).as_posix(): path.read_text(encoding="utf-8") for path in stored
    }
    other = sorted(name for name in found | pages if found.get(name) != pages.get(name))
    assert not other, "write them again: python tests/architecture/api_pages.py"


def test_every_room_is_on_a_page() -> None:
    assert set(ROOMS) == set(driftwalk._ROOMS)


def test_no_page_depends_on_the_machine(pages: dict[str, str]) -> None:
    for name, text in pages.items():
        assert " at 0x" not in text, name
        assert str(FOLDER.parents[1]) not in text, name


def test_a_page_has_every_part_of_a_docstring(pages: dict[str, str]) -> None:
    """By the docstring of `load`, read here and not by the generator."""
    text = pages["python/record.md"].partition("\n## load\n")[2].partition("\n## ")[0]
    for part in (
        "load(\n    path: str | PathLike[str] | pd.DataFrame | Mapping[str, Any] "
        "| npt.NDArray[Any] | Any,\n    *,\n    format: str | None = None,\n",
        ") -> xr.Dataset\n",
        "- `start, stop` : `float`, optional\\\n  First and last time to keep [s]",
        "**Returns**\n\n- `xarray.Dataset`\\\n  Dimensions (time, body)",
        "- `FormatError`\\\n  When the file cannot be read; with line and column.",
        '>>> load(str(recording), tank="circle:30cm", block="3cm").sizes["time"]\n18001\n```',
    ):
        assert part in text, part
    assert "| **[`load(path, …)`](python/record.md#load)** |" in pages["python.md"]


DOCSTRING = """Add ``a`` to a list.

It keeps the order:

    a, b

Parameters
----------
a, b : {"x", "y"}, optional
    One::

        x
first : array_like, shape (n, 2)
    Two lines
    of text.

Examples
--------
>>> 1 + 1
2

In words:

>>> 2 + 2

>>> 3
3
"""


def test_sections_and_entries() -> None:
    sections = sections_of(DOCSTRING)
    assert list(sections) == ["", "Parameters", "Examples"]
    assert entries_of(sections["Parameters"]) == [
        ('a, b : {"x", "y"}, optional', "One::\n\n    x"),
        ("first : array_like, shape (n, 2)", "Two lines\nof text."),
    ]


def test_a_docstring_becomes_markdown() -> None:
    expected = """Add `a` to a list.

It keeps the order:

    a, b

**Parameters**

- `a, b` : `{"x", "y"}`, optional\\
  One:

      x
- `first` : `array_like`, shape (n, 2)\\
  Two lines
  of text.

**Examples**

```pycon
>>> 1 + 1
2
```

In words:

```pycon
>>> 2 + 2

>>> 3
3
```"""
    assert as_markdown(DOCSTRING) == expected


class Level(enum.Enum):
    LOW = 1


class Pair(NamedTuple):
    x: float
    y: list[int] | None = None


class Mover(Protocol):
    def move(self) -> None: ...


def test_signatures_are_those_of_the_source() -> None:
    def short(a: int, /, b: float = 0.5, *, level: Level = Level.LOW, key=len) -> Pair | None: ...

    def open_(*values: str, **more: object): ...

    assert (
        signature_of("short", short)
        == "short(a: int, /, b: float = 0.5, *, level: Level = Level.LOW, key=len) -> Pair | None"
    )
    assert signature_of("open_", open_) == "open_(*values: str, **more: object)"
    assert signature_of("Pair", Pair) == "Pair(x: float, y: list[int] | None = None)"
    assert signature_of("Mover", Mover) == signature_of("Level", Level) == ""
    assert ERRORS not in ROOMS
