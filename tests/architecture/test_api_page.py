"""The reference pages of the Python names say what the docstrings and signatures say."""

from __future__ import annotations

import enum
import posixpath
from pathlib import Path
from typing import NamedTuple, Protocol

import api_pages
import pytest
from api_pages import ALL, ERRORS, FOLDER, ROOMS, all_pages, write_pages
from docstring_sections import as_markdown, entries_of, sections_of
from signatures import signature_of
from test_docs_links import anchors_of, links_of

import driftwalk


@pytest.fixture(scope="module")
def pages() -> dict[str, str]:
    """Return the pages as they are made, by their names."""
    return {path.relative_to(FOLDER).as_posix(): text for path, text in all_pages().items()}


@pytest.mark.slow
def test_pages_are_written_and_those_of_rooms_that_are_gone_are_removed(
    pages: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "python"
    folder.mkdir()
    (folder / "gone.md").write_text("A room that is gone.")
    monkeypatch.setattr(api_pages, "FOLDER", folder)
    write_pages()
    written = {path.relative_to(folder).as_posix(): path for path in folder.rglob("*.md")}
    assert {name: path.read_text(encoding="utf-8") for name, path in written.items()} == pages


def test_links_between_the_pages_lead_somewhere(pages: dict[str, str]) -> None:
    anchors = {name: anchors_of(text) for name, text in pages.items()}
    for name, text in pages.items():
        for link in links_of(text):
            page, _, anchor = link.partition("#")
            page = (
                posixpath.normpath(posixpath.join(posixpath.dirname(name), page)) if page else name
            )
            if page.startswith("../"):
                assert Path(posixpath.normpath(FOLDER / page)).is_file(), f"{name}: {link}"
                continue
            assert page in pages, f"{name}: {link}"
            assert not anchor or anchor in anchors[page], f"{name}: {link}"


def test_the_page_in_the_repository_names_every_room() -> None:
    text = FOLDER.with_suffix(".md").read_text(encoding="utf-8")
    assert not [room for room in ROOMS if f"`driftwalk.{room}`" not in text]


def test_every_room_is_on_a_page() -> None:
    assert set(ROOMS) == set(driftwalk._ROOMS)


def test_no_page_depends_on_the_machine(pages: dict[str, str]) -> None:
    for name, text in pages.items():
        assert " at 0x" not in text, name
        assert str(FOLDER.parents[2]) not in text, name


def test_a_page_has_every_part_of_a_docstring(pages: dict[str, str]) -> None:
    """By the docstring of `load`, read here and not by the generator."""
    text = pages["record/load.md"]
    for part in (
        "load(\n    path: str | PathLike[str] | pd.DataFrame | Mapping[str, Any] "
        "| npt.NDArray[Any] | Any,\n    *,\n    format: str | None = None,\n",
        ") -> xr.Dataset\n",
        "- **`start, stop`** : `float`, optional\\\n  First and last time to keep [s]",
        "**Returns**\n\n- `xarray.Dataset`\\\n  Dimensions (time, body)",
        "- `FormatError`\\\n  When the file cannot be read; with line and column.",
        '>>> load(str(recording), tank="circle:30cm", block="3cm").sizes["time"]\n18001\n```',
    ):
        assert part in text, part
    assert "| **[`load(path, …)`](record/load.md)** |" in pages[ALL]


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
```

**Parameters**

- **`a, b`** : `{"x", "y"}`, optional\\
  One:

      x
- **`first`** : `array_like`, shape (n, 2)\\
  Two lines
  of text."""
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
