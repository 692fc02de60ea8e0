"""Benchmarks and studies take hours, so no test runs them: what they use has to exist at least."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ALIASES = {"dw": "driftwalk", "_core": "driftwalk._core"}
SCRIPTS = [path for folder in ("benchmarks", "studies") for path in (ROOT / folder).rglob("*.py")]


def used_names(path: Path) -> Iterator[tuple[str, str]]:
    """Yield the modules of driftwalk and of the twins that a script names, and names in them."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module and not node.level:
            if node.module.split(".")[0] in {"driftwalk", "twin"}:
                yield from ((node.module, alias.name) for alias in node.names)
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
            yield from ((name, "__name__") for name in names if name.startswith("driftwalk"))
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            module = ALIASES.get(node.value.id)
            yield from [(module, node.attr)] if module else []


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_what_a_script_uses_exists(path: Path) -> None:
    for module, name in used_names(path):
        if not hasattr(import_module(module), name):
            import_module(f"{module}.{name}")  # a module of a package


SOURCES_OF_STUDIES = (
    "src/driftwalk/likelihood/*.py",
    "src/driftwalk/calibration/*.py",
    "src/driftwalk/likelihood/**/*.py",
    "src/driftwalk/track/**/*.py",
)


def test_results_are_named_after_sources_that_exist() -> None:
    """Results carry a number of the sources that made them; made of no file it says nothing."""
    patterns = {
        node.value
        for path in SCRIPTS
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
        if node.value.startswith("src/driftwalk/") and node.value.endswith(".py")
    }
    assert patterns == set(SOURCES_OF_STUDIES)
    for pattern in patterns:
        assert len(list(ROOT.glob(pattern))) > 5, pattern


def test_names_that_scripts_use_are_found() -> None:
    found = set(used_names(ROOT / "benchmarks" / "bench_simulate.py"))
    assert {("driftwalk", "_core"), ("twin.block", "simulate_reference")} <= found
    assert ("driftwalk._core", "simulate") in found
