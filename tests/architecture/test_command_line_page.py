"""The page on the command line knows every command and every option."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from driftwalk.cli.main import COMMANDS, load_command
from driftwalk.cli.options.shared import PANEL
from driftwalk.cli.options.study import PANELS

PAGE = Path(__file__).resolve().parents[2] / "docs" / "reference" / "command-line.md"
READING = "Reading a recording"


def sections() -> dict[str, set[str]]:
    """Return the options that stand under each heading of the page."""
    parts = re.split(r"^## (.+)$", PAGE.read_text(encoding="utf-8"), flags=re.M)
    options = [set(re.findall(r"`(--?[\w-]+)`", text)) for text in parts[2::2]]
    return dict(zip(parts[1::2], options, strict=True))


def commands() -> Iterator[tuple[str, Any]]:
    for name in COMMANDS:
        command = load_command(name)
        for inner, function in getattr(command, "commands", {"": command}).items():
            yield f"{name} {inner}".strip(), function


def options_of(command: Any) -> set[str]:
    return {
        word
        for parameter in command.params
        for word in parameter.opts
        if word.startswith("-") and word not in {"--help", "-h"}
    }


@pytest.mark.fast_cases(8)
@pytest.mark.parametrize("name", [name for name, _ in commands()])
def test_command_is_on_the_page(name: str) -> None:
    page, options = sections(), options_of(dict(commands())[name])
    reading = page[READING] if "--metres-per-pixel" in options else set()
    assert page[name] | reading == options


def test_page_has_no_other_commands() -> None:
    assert sections().keys() - {READING} == {name for name, _ in commands()}


@pytest.mark.fast_cases(9)
@pytest.mark.parametrize("name", [name for name, _ in commands()])
def test_no_help_is_taken_for_a_style(name: str) -> None:
    """Rich drops an unescaped ``[recover]`` from the text that it prints."""
    command = dict(commands())[name]
    for text in (command.help, *(getattr(one, "help", "") for one in command.params)):
        assert not re.search(r"(?<!\\)\[[a-z/]", text or ""), text


def test_page_says_of_a_key_of_the_study_what_the_study_declares() -> None:
    rows = {name: "" for name, _ in commands()}
    for name, text in re.findall(r"^## (.+)$\n((?:(?!^## ).*\n)*)", PAGE.read_text(), flags=re.M):
        rows[name] = text
    panels = {PANEL, *PANELS.values()}
    for name, command in commands():
        for option in command.params:
            if getattr(option, "rich_help_panel", None) in panels and option.opts != ["--vary"]:
                row = re.search(rf"^\| `{option.opts[0]}` \|.*$", rows[name], flags=re.M)
                assert row is not None
                assert row[0].endswith(f"| {option.help} |"), (name, row[0])
