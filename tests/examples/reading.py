"""The examples of a page: its fenced blocks in order, and the commands of a console."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
LANGUAGES = ("console", "python", "toml", "")
"""Languages of examples. A block without one shows what the last command printed."""
SHOWN = ("text",)
"""Languages of blocks that only show what something looks like."""
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


class Block(NamedTuple):
    """A fenced block of a page."""

    page: str
    line: int
    language: str
    text: str

    def __str__(self) -> str:
        return f"{self.page}:{self.line}"


class Command(NamedTuple):
    """A command of a console, with the lines that the page shows below it."""

    text: str
    words: list[str]
    into: str | None
    shown: list[str]


def pages() -> list[str]:
    """Return the pages with examples, relative to the root of the project.

    Those that the site makes repeat others: docstrings, whose examples `make doctest` runs, and the
    page on the command line.
    """
    found = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
    names = sorted(page.relative_to(ROOT).as_posix() for page in found)
    made = ("docs/reference/python/", "docs/reference/commands/", "docs/gallery/")
    return [name for name in names if not name.startswith(made) and blocks_of(name)]


def blocks_of(page: str) -> list[Block]:
    """Return the examples of a page; `line` is that of the fence."""
    return read_blocks(page, (ROOT / page).read_text(encoding="utf-8"))


def read_blocks(page: str, text: str) -> list[Block]:
    """Return the examples in the text of a page."""
    return [
        Block(page, text.count("\n", 0, match.start()) + 1, match[1], match[2])
        for match in FENCE.finditer(text)
        if match[1] not in SHOWN
    ]


def commands_of(text: str) -> list[Command]:
    r"""Return the commands of a console block: after ``$ ``, up to the end or ``\`` and a line."""
    found: list[Command] = []
    for line in re.sub(r"\\\n\s*", "", text).splitlines():
        if line.startswith("$ "):
            words = shlex.split(line[2:], comments=True)
            into = words[-1] if ">" in words[-2:] else None
            typed = re.sub(r"\s+# .*$", "", line[2:]).strip()
            found.append(Command(typed, words[:-2] if into else words, into, []))
        elif found:
            found[-1].shown.append(line)
        else:
            raise ValueError(f"output before the first command: {line!r}")
    return found
