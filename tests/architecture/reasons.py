"""The reasons that stand beside numbers and in long functions of the package.

A reason of a constant is the text below it, or a comment above it or on its lines.
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator, Sequence
from functools import cache
from textwrap import dedent
from typing import NamedTuple

from code_size import PACKAGE, size_of

# Comments that speak to a tool, not to a reader.
TO_TOOLS = ("# noqa", "# type:", "# fmt:", "# pragma:")
ON_ITS_OWN = re.compile(r"\s*# (?!noqa|type:|fmt:|pragma:)")


class Constant(NamedTuple):
    """A number, or several, at module level."""

    path: str
    line: int
    name: str
    value: str
    reason: str


class Function(NamedTuple):
    """A function, and how many lines of code it has."""

    path: str
    line: int
    name: str
    code: int


@cache
def numeric_constants() -> list[Constant]:
    return [one for path, text in _modules() for one in constants_of(text, path)]


def silent_functions(code: int) -> list[Function]:
    """Return the functions of more lines of code than this that have no comment."""
    return [one for path, text in _modules() for one in silent_in(text, path, code)]


def constants_of(source: str, path: str) -> Iterator[Constant]:
    """Give the numeric constants of a module with their reasons."""
    body, lines = ast.parse(source).body, source.splitlines()
    for node, after in zip(body, [*body[1:], None], strict=True):
        if not isinstance(node, ast.Assign | ast.AnnAssign) or not _holds_number(node.value):
            continue
        target = node.targets[0] if isinstance(node, ast.Assign) else node.target
        begin, end = node.lineno - 1, node.end_lineno or node.lineno
        while begin and lines[begin - 1].startswith("#"):
            begin -= 1
        found = list(_comments(lines[begin:end]))
        if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant):
            found.append(str(after.value.value))
        reason = " ".join(" ".join(found).split())
        value = " ".join(ast.unparse(node.value).split()) if node.value else ""
        yield Constant(path, node.lineno, ast.unparse(target), value, reason)


def silent_in(source: str, path: str, code: int) -> Iterator[Function]:
    """Give the functions of a module, methods and inner ones too, that are long and silent."""
    lines = source.splitlines()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            own = lines[node.lineno - 1 : node.end_lineno]
            # To take a text to pieces is slow, so lines are looked at first.
            speaks = any(ON_ITS_OWN.match(line) for line in own)
            if len(own) > code and not speaks and not any(_comments(own)):
                count = size_of(dedent("\n".join(own))).code
                if count > code:
                    yield Function(path, node.lineno, node.name, count)


def _modules() -> Iterator[tuple[str, str]]:
    for path in sorted(PACKAGE.rglob("*.py")):
        yield path.relative_to(PACKAGE).as_posix(), path.read_text(encoding="utf-8")


def _comments(lines: Sequence[str]) -> Iterator[str]:
    """Give the comments for a reader."""
    text = dedent("\n".join([*lines, ""]))
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT and not token.string.startswith(TO_TOOLS):
            yield token.string.lstrip("# ")


def _holds_number(value: ast.expr | None) -> bool:
    """Return whether a number is written in a value; in a type, `Annotated[...]`, none counts."""
    if value is None or isinstance(value, ast.Lambda | ast.Subscript):
        return False
    return any(
        isinstance(part, ast.Constant)
        and isinstance(part.value, int | float)
        and not isinstance(part.value, bool)
        for part in ast.walk(value)
    )
