"""The site has a page for each command, with every option that the command line declares."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from types import ModuleType

import pytest
from test_command_line_page import commands, options_of
from test_docs_links import broken_links

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def made() -> ModuleType:
    """Return `docs/site/command_pages.py`."""
    spec = importlib.util.spec_from_file_location(
        "command_pages", ROOT / "docs" / "site" / "command_pages.py"
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_each_command_has_a_page_with_all_its_options(made: ModuleType) -> None:
    pages = {path.stem: text for path, text in made.all_pages().items()}
    for name, command in commands():
        page = pages[made.anchor(name)]
        rows = set(re.findall(r"`(--?[\w-]+)`", "\n".join(re.findall(r"^\| `.*$", page, re.M))))
        assert options_of(command) <= rows, name
        assert f"]({made.anchor(name)}.md)" in pages["index"], name


def test_commands_on_the_front_page_are_known() -> None:
    front = (ROOT / "docs" / "site" / "theme" / "front.html").read_text(encoding="utf-8")
    known = dict(commands())
    typed = re.findall(r"^ *(?:<pre><code>)?driftwalk ((?:.*\\\n)*.*)$", front, flags=re.M)
    assert len(typed) >= 8
    for line in typed:
        words = re.sub(r"</code>.*", "", line).split()
        name = next(n for n in (" ".join(words[:2]), words[0]) if n in known)
        options = {word for word in words if word.startswith("-")}
        assert options <= options_of(known[name]), line


def test_links_of_the_pages_lead_somewhere(made: ModuleType) -> None:
    pages = made.all_pages()
    for path, text in pages.items():
        broken = [link for link in broken_links(path, text) if (path.parent / link) not in pages]
        assert not broken, path
