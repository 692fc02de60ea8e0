"""The page on the command line knows every command and every option."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from driftwalk.cli.main import COMMANDS, load_command, main
from driftwalk.cli.options.shared_types import PANEL
from driftwalk.cli.options.study import PANELS
from driftwalk.cli.terminal.help import MAIN_OPTIONS

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
    reading = page[READING] if "--y-axis" in options else set()
    assert page[name] | reading == options


def test_page_has_no_other_commands() -> None:
    assert sections().keys() - {READING} == {name for name, _ in commands()}


@pytest.mark.fast_cases(9)
@pytest.mark.parametrize("name", [name for name, _ in commands()])
def test_help_shows_the_main_options_and_help_all_shows_every_one(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    options = options_of(dict(commands())[name])
    assert main([*name.split(), "--help"]) == 0
    short = capsys.readouterr().out
    assert main([*name.split(), "--help-all"]) == 0
    assert options <= set(re.findall(r"(?<![\w-])--?[\w-]+", capsys.readouterr().out))
    # Below the first heading: the text above them may begin a line with an option.
    tables = re.split(r"^\w.*:$", short, maxsplit=1, flags=re.M)[1]
    rows = re.findall(r"^  --\S+", tables, flags=re.M)
    assert len(rows) <= 6
    assert len(rows) == len(options - {"-o"}) or f"driftwalk {name} --help-all" in short


def test_main_options_are_of_commands() -> None:
    assert MAIN_OPTIONS.keys() <= {name for name, _ in commands()}


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
