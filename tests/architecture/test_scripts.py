"""Benchmarks and studies start: a benchmark at its smallest size, a study, which takes hours, with
``--help``, and what they and the gallery use of driftwalk exists."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ALIASES = {"dw": "driftwalk", "_core": "driftwalk._core"}
FOLDERS = ("benchmarks", "studies", "docs/site/gallery")
SCRIPTS = [path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py")]


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


SMALLEST = {
    "assemble": ["--quick", "--rounds", "1", "--runs", "8"],
    "assemble_ode": ["--rounds", "1"],
    "calibrate": ["--quick", "--threads", "1"],
    "cluster": ["--quick", "--rounds", "1", "--length", "20"],
    "fit": ["--rates", "10", "--minutes", "8"],
    "import": ["--rounds", "1"],
    "ks": ["--rounds", "1", "--sizes", "1000"],
    "laws": ["--rounds", "1", "--steps", "20"],
    "live": ["--seconds", "0.2"],
    "ode": ["--rounds", "1"],
    "particles": ["--rounds", "1", "--minutes", "0.05"],
    "read": ["--rows", "1000"],
    "simulate": ["--rounds", "1", "--steps", "100"],
    "track": ["--quick", "--rounds", "1", "--frames", "1"],
}
"""Options of each benchmark with which it takes the least."""
LACKING = 77
"""Exit code of a benchmark that lacks a requirement, such as a peer."""
LATE = re.compile(r"a frame of \d+ blocks takes|costs [\d.]+ times the paper's law")
"""Ends of a benchmark that a busy machine explains."""
STUDIES = sorted({path.parent for path in SCRIPTS if "studies" in path.parts})
# Where a script has a parser it runs up to its --help, else only its definitions run. Studies have
# files of the same names, so each leaves nothing to the next.
START = """
import pathlib, runpy, sys
path, modules = sys.path[:], set(sys.modules)
folders = [pathlib.Path(word) for word in sys.argv[1:]]
for folder in folders:
    sys.path[:] = [str(folder), *path]
    for script in sorted(folder.glob("*.py")):
        asked = "argparse" in script.read_text(encoding="utf-8")
        sys.argv = [str(script), "--help"]
        print("starting", script, flush=True)
        try:
            runpy.run_path(str(script), run_name="__main__" if asked else "started")
        except SystemExit as end:
            assert asked and not end.code, end
    for name in set(sys.modules) - modules:
        if pathlib.Path(getattr(sys.modules[name], "__file__", None) or "/").parent in folders:
            del sys.modules[name]
"""


def started(*words: str | Path) -> subprocess.CompletedProcess[str]:
    """Run Python in the root of the project as a user does, on one thread."""
    return subprocess.run(
        [sys.executable, *words], cwd=ROOT, capture_output=True, text=True, check=False,
        env={**os.environ, "OMP_NUM_THREADS": "1", "MPLBACKEND": "Agg"},
    )  # fmt: skip


def test_every_benchmark_has_its_smallest_size() -> None:
    files = (ROOT / "benchmarks").glob("bench_*.py")
    assert {path.stem.removeprefix("bench_") for path in files} == set(SMALLEST)


@pytest.mark.parametrize("name", SMALLEST)
def test_the_page_of_performance_names_every_benchmark(name: str) -> None:
    page = (ROOT / "docs" / "explanation" / "performance.md").read_text(encoding="utf-8")
    assert f"bench_{name}.py" in page


@pytest.mark.study
@pytest.mark.parametrize("name", SMALLEST)
def test_a_benchmark_runs_at_its_smallest_size(name: str) -> None:
    done = started(ROOT / "benchmarks" / f"bench_{name}.py", *SMALLEST[name])
    said = f"{done.stdout}\n{done.stderr}"
    assert done.returncode in (0, LACKING) or LATE.search(done.stderr), said


@pytest.mark.slow
def test_every_script_of_a_study_starts() -> None:
    """Its modules are found, its definitions run, and so does its parser."""
    done = started("-c", START, *STUDIES)
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"
    assert all(f"starting {path}\n" in done.stdout for path in SCRIPTS if path.parent in STUDIES)


SOURCES_OF_STUDIES = (
    "src/driftwalk/likelihood/*.py",
    "src/driftwalk/calibration/*.py",
    "src/driftwalk/likelihood/**/*.py",
    "src/driftwalk/track/**/*.py",
)


@pytest.mark.slow
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
