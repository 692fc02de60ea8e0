"""A page for each command: its usage and options as the command line declares them.

The prose is that of `docs/reference/command-line.md`, which readers of the repository see as one
page. The site has an index in its place.
"""

from __future__ import annotations

import re
from collections import defaultdict
from pathlib import Path
from typing import Any, Final

from driftwalk.cli.main import COMMANDS, load_command
from driftwalk.cli.terminal.help import MAIN_OPTIONS

REFERENCE: Final = Path(__file__).resolve().parents[2] / "docs" / "reference"
FOLDER: Final = REFERENCE / "commands"
_MAIN: Final = "Main options"
_OTHERS: Final = "More options"


def all_pages() -> dict[Path, str]:
    """Return the pages of the commands by their paths."""
    parts = re.split(r"^## (.+)\n", (REFERENCE / "command-line.md").read_text("utf-8"), flags=re.M)
    prose = dict(zip(parts[1::2], parts[2::2], strict=True))
    found = {name: _page(name, command, prose.pop(name, "")) for name, command in _commands()}
    # What is left is about several commands.
    shared = {heading: f"# {heading}\n\n{_links(text)}" for heading, text in prose.items()}
    intro = parts[0].partition("\n")[2]
    index = "\n".join(["# Commands\n", _links(intro), _index()])
    pages = {FOLDER / f"{anchor(name)}.md": text for name, text in {**found, **shared}.items()}
    return {FOLDER / "index.md": index, **pages}


def move_links(_app: Any, _name: str, source: list[str]) -> None:
    """Lead the links into the one page to the pages here (the event `source-read` of Sphinx)."""
    text = source[0]
    text = re.sub(r"reference/command-line\.md#([\w-]+)", r"reference/commands/\1.md", text)
    text = re.sub(r"\]\(command-line\.md#([\w-]+)\)", r"](commands/\1.md)", text)
    source[0] = re.sub(r"\b(reference/|\]\()command-line\.md", r"\1commands/index.md", text)


def anchor(heading: str) -> str:
    """Return the anchor of a heading, which is the name of its page too."""
    return heading.lower().replace(" ", "-")


def _commands() -> list[tuple[str, Any]]:
    found = []
    for name in COMMANDS:
        command = load_command(name)
        for inner, function in getattr(command, "commands", {"": command}).items():
            found.append((f"{name} {inner}".strip(), function))
    return found


def _index() -> str:
    groups: dict[str, list[str]] = defaultdict(list)
    for name, command in _commands():
        first = (command.help or "").strip().partition("\n\n")[0]
        row = f"| [`driftwalk {name}`]({anchor(name)}.md) | {_cell(first)} |"
        groups[COMMANDS[name.split()[0]].heading].append(row)
    return "\n".join(
        f"## {heading}\n\n| command | what it does |\n|---|---|\n" + "\n".join(rows) + "\n"
        for heading, rows in groups.items()
    )


def _page(name: str, command: Any, prose: str) -> str:
    said = prose.partition("\n| option |")[0].strip() or (command.help or "").strip()
    options = [one for one in command.params if any(word.startswith("-") for word in one.opts)]
    main = MAIN_OPTIONS.get(name, "").split()
    groups: dict[str, list[str]] = defaultdict(list)
    for one in options:
        own = [word.lstrip("-") for word in one.opts]
        shown = _MAIN if not main or any(word in main for word in own) else _OTHERS
        group = getattr(one, "rich_help_panel", None) or ""
        groups[shown if shown == _MAIN or not group else str(group)].append(_row(one))
    order = sorted(groups, key=lambda group: (group != _MAIN, group != _OTHERS))
    tables = [
        f"## {group}\n\n| option | value | meaning |\n|---|---|---|\n" + "\n".join(groups[group])
        for group in order
    ]
    return "\n\n".join([f"# driftwalk {name}", _links(said), *tables]) + "\n"


def _row(option: Any) -> str:
    words = ", ".join(f"`{word}`" for word in option.opts)
    return f"| {words} | {_cell(option.metavar or '')} | {_cell(option.help or '')} |"


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;").replace("[", "\\[")


def _links(text: str) -> str:
    """Return prose of the one page with its links as seen from where it stands now."""

    def moved(link: re.Match[str]) -> str:
        target = link[2]
        new = f"{target[1:]}.md" if target.startswith("#") else f"../{target}"
        return f"]({link[1]}{new})"

    return re.sub(r"\]\((\s*)([^)\s]+)\)", moved, text)


def write_pages() -> None:
    """Write every page that has changed, and remove those of commands that are gone."""
    found = all_pages()
    FOLDER.mkdir(exist_ok=True)
    for path in set(FOLDER.glob("*.md")) - found.keys():
        path.unlink()
    for path, text in found.items():
        # Sphinx reads a page again when its file is newer.
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
