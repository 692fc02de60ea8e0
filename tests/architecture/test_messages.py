"""The library speaks of arguments, the command line of options."""

from __future__ import annotations

import re
from functools import cache
from types import ModuleType

from package_texts import Text, package_texts, texts_of

import driftwalk
from driftwalk.cli.terminal.argument_names import OPTIONS, WHOLE

# A place in a text that is filled in counts as a letter: f"--{name}" is an option too.
OPTION = re.compile(r"(?<![\w-])--[a-z{]")
COMMAND_WITH_OPTION = re.compile(r"`driftwalk [a-z]+[^`]* --[a-z]")
ARGUMENT = re.compile(r"`([a-z_]+(?:\.[A-Za-z_]+)?)(=[^`]*)?`")

NO_ARGUMENTS = {"complete"}
"""An outcome, in the name of a method."""


@cache
def texts() -> list[Text]:
    """Return every string of the library; the programs in an export have options of their own."""
    others = ("cli/", "export/simulators/files/")
    return [one for one in package_texts() if not one.path.startswith(others)]


def messages() -> list[tuple[str, str]]:
    return [(one.place, one.text) for one in texts() if not one.alone]


def test_the_walk_sees_every_kind_of_text() -> None:
    found = texts_of('x = f"a {b} c"\n"""Words."""\n', "a.py")
    assert [(*one,) for one in found] == [("a.py", 1, "a {} c", False), ("a.py", 2, "Words.", True)]
    assert OPTION.search("choose another one (--port)")
    assert OPTION.search("needs its {} (--{})")
    assert not OPTION.search("a -- b, ---, x--y, `port`")
    assert any("`tank` of `load`" in text for _, text in messages())
    assert any("give `{}`, which" in text for _, text in messages())


def test_no_message_of_the_library_names_an_option() -> None:
    assert [(place, text) for place, text in messages() if OPTION.search(text)] == []


def test_docstrings_name_an_option_with_its_command_only() -> None:
    found = [
        (one.place, line.strip())
        for one in texts()
        for line in one.text.splitlines()
        if one.alone and OPTION.search(line) and not COMMAND_WITH_OPTION.search(line)
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
