"""The strings of the package: several tests read them, and the source is parsed once for all."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

PACKAGE = Path(__file__).resolve().parents[2] / "src" / "driftwalk"


class Text(NamedTuple):
    """A string of the package; an f-string is one, with `{}` for what it fills in."""

    path: str
    line: int
    text: str
    alone: bool
    """Whether it is documentation: a statement of its own."""

    @property
    def place(self) -> str:
        return f"{self.path}:{self.line}"


@cache
def package_texts() -> list[Text]:
    return [
        text
        for path in sorted(PACKAGE.rglob("*.py"))
        for text in texts_of(path.read_text(encoding="utf-8"), path.relative_to(PACKAGE).as_posix())
    ]


def texts_of(source: str, path: str) -> Iterator[Text]:
    """Give the strings of a module, docstrings too."""
    alone: set[int] = set()
    parts: set[int] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Expr):
            alone.add(id(node.value))
        elif isinstance(node, ast.JoinedStr):
            parts |= {id(part) for part in node.values}
            values = (one.value if isinstance(one, ast.Constant) else "{}" for one in node.values)
            yield Text(path, node.lineno, "".join(map(str, values)), id(node) in alone)
        elif (
            isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in parts
        ):
            yield Text(path, node.lineno, node.value, id(node) in alone)
