"""The library speaks of arguments, the command line of options."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import driftwalk
from driftwalk.cli.terminal.argument_names import OPTIONS, WHOLE

PACKAGE = Path(driftwalk.__file__).parent
# A place in a text that is filled in counts as a letter: f"--{name}" is an option too.
OPTION = re.compile(r"(?<![\w-])--[a-z{]")
COMMAND_WITH_OPTION = re.compile(r"`driftwalk [a-z]+[^`]* --[a-z]")
ARGUMENT = re.compile(r"`([a-z_]+(?:\.[A-Za-z_]+)?)(=[^`]*)?`")

NO_ARGUMENTS = {"complete"}
"""An outcome, in the name of a method."""


class Text(NamedTuple):
    """A string of the library."""

    place: str
    text: str
    alone: bool
    """Whether it is documentation: a statement of its own."""


@cache
def texts() -> list[Text]:
    """Return every string of the library; the programs in an export have options of their own."""
    others = (PACKAGE / "cli", PACKAGE / "export" / "simulators" / "files")
    files = [path for path in PACKAGE.rglob("*.py") if not any(map(path.is_relative_to, others))]
    return [text for path in sorted(files) for text in texts_of(path)]


def texts_of(path: Path) -> Iterator[Text]:
    nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    alone = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
    parts = {id(part) for node in nodes if isinstance(node, ast.JoinedStr) for part in node.values}
    for node in nodes:
        text = text_of(node)
        if isinstance(node, ast.expr) and text is not None and id(node) not in parts:
            place = f"{path.relative_to(PACKAGE)}:{node.lineno}"
            yield Text(place, text, id(node) in alone)


def text_of(node: ast.AST) -> str | None:
    if isinstance(node, ast.JoinedStr):
        values = [one.value if isinstance(one, ast.Constant) else "{}" for one in node.values]
        return "".join(map(str, values))
    is_text = isinstance(node, ast.Constant) and isinstance(node.value, str)
    return str(node.value) if is_text else None


def messages() -> list[tuple[str, str]]:
    return [(place, text) for place, text, alone in texts() if not alone]


def test_the_walk_sees_every_kind_of_text(tmp_path: Path) -> None:
    assert OPTION.search("choose another one (--port)")
    assert OPTION.search("needs its {} (--{})")
    assert not OPTION.search("a -- b, ---, x--y, `port`")
    assert any("`tank` of `load`" in text for _, text in messages())
    assert any("(`{}`)" in text for _, text in messages())


def test_no_message_of_the_library_names_an_option() -> None:
    assert [(place, text) for place, text in messages() if OPTION.search(text)] == []


def test_docstrings_name_an_option_with_its_command_only() -> None:
    found = [
        (place, line.strip())
        for place, text, alone in texts()
        for line in text.splitlines()
        if alone and OPTION.search(line) and not COMMAND_WITH_OPTION.search(line)
    ]
    assert found == []


def test_the_command_line_knows_the_arguments_that_messages_name() -> None:
    found = [names for _, text in messages() for names in ARGUMENT.findall(text)]
    assert set(WHOLE) <= {name + value for name, value in found}
    translated = {*OPTIONS, *(whole.partition("=")[0] for whole in WHOLE)}
    functions = {name for room in rooms() for name in room.__all__}
    assert {name for name, _ in found} - translated - functions == NO_ARGUMENTS


def rooms() -> list[ModuleType]:
    return [
        one for name in driftwalk.__all__ if isinstance(one := getattr(driftwalk, name), ModuleType)
    ]
