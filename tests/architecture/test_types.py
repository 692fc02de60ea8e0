"""A type checker sees real types: `make lint` checks a user's script that holds mistakes."""

from __future__ import annotations

import re
import tomllib
from importlib.resources import files
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = "tests/architecture/users_script.py"


def test_mypy_checks_the_script_of_a_user_and_asks_for_its_mistakes() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["mypy"]
    assert SCRIPT in settings["files"]
    assert settings["strict"]  # a comment that ignores nothing is an error
    assert settings.get("warn_unused_ignores", True)
    text = (ROOT / SCRIPT).read_text(encoding="utf-8")
    asked = re.findall(r"type: ignore\[(.+)\]", text)
    assert set(asked) == {"arg-type", "call-arg", "attr-defined"}


def test_the_package_says_that_it_has_types() -> None:
    assert (files("driftwalk") / "py.typed").is_file()
