"""Every name of driftwalk in the examples of the pages exists, and every example parses."""

from __future__ import annotations

import ast
import importlib
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "studies").rglob("*.md")]
BLOCK = re.compile(r"```python\n(.*?)```", re.S)
EXAMPLES = [
    pytest.param(text, id=f"{page.relative_to(ROOT)}:{number}")
    for page in sorted(PAGES)
    if "reference/python/" not in page.as_posix()  # made of the docstrings, signatures among them
    for number, text in enumerate(BLOCK.findall(page.read_text(encoding="utf-8")), start=1)
]


def names_used(text: str) -> set[str]:
    """Return the names of driftwalk that an example uses, with the package's name in front."""
    found = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("driftwalk"):
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.Attribute):
            dotted = ast.unparse(node)
            if re.fullmatch(r"(dw|driftwalk)(\.\w+)+", dotted):
                found.add("driftwalk." + dotted.partition(".")[2])
    return found


def exists(name: str) -> bool:
    """Return whether a dotted name is a module, or can be reached from one."""
    parts = name.split(".")
    for length in range(len(parts), 0, -1):
        try:
            found = importlib.import_module(".".join(parts[:length]))
        except ModuleNotFoundError:
            continue
        for part in parts[length:]:
            if not hasattr(found, part):
                return False
            found = getattr(found, part)
        return True
    return False


def test_a_wrong_name_is_noticed() -> None:
    text = "import driftwalk as dw\ndw.track.Tracker(dw.lode('x'))\nfrom driftwalk.flow import jet"
    assert {name for name in names_used(text) if not exists(name)} == {
        "driftwalk.lode",
        "driftwalk.flow.jet",
    }


@pytest.mark.parametrize("text", EXAMPLES)
def test_names_in_examples_exist(text: str) -> None:
    assert sorted(name for name in names_used(text) if not exists(name)) == []
