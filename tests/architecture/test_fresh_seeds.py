"""What conftest.py decides: seeds and examples of `make test-fresh`, and which cases are fast."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).resolve().parents[1]
STATED = """
import pytest
from hypothesis import given, settings, strategies as st

@pytest.mark.false_alarm(0.25)
def test_seed(fresh_seed):
    print("SEEDS", fresh_seed(1), fresh_seed(1), fresh_seed(2))

@pytest.mark.parametrize("either", [0, 1])
@settings(max_examples=4)
@given(x=st.floats())
def test_example(either, x):
    print("EXAMPLE", x)
"""
UNSTATED = """
def test_seed(fresh_seed):
    pass
"""


CASES = """
import pytest

@pytest.mark.fast_cases(2)
@pytest.mark.parametrize("case", range(5))
def test_case(case):
    print("CASE", case)
"""


def run(folder: Path, text: str, seed: int | None, *more: str) -> subprocess.CompletedProcess[str]:
    """Run tests of this text under the project's own conftest."""
    (folder / "conftest.py").write_text((TESTS / "conftest.py").read_text())
    markers = "false_alarm(rate): as here\n  slow: as here\n  fast_cases(number): as here"
    (folder / "pytest.ini").write_text(
        f"[pytest]\npythonpath = {TESTS / 'helpers'}\nmarkers =\n  {markers}\n"
    )
    (folder / "test_it.py").write_text(text)
    environment = {k: v for k, v in os.environ.items() if k != "DRIFTWALK_TEST_SEED"}
    options = ["-s", "-p", "no:xdist", "-p", "no:cacheprovider", *more]
    if seed is not None:
        environment["DRIFTWALK_TEST_SEED"] = str(seed)
        options.append(f"--hypothesis-seed={seed}")
    return subprocess.run(
        [sys.executable, "-m", "pytest", *options, "test_it.py"],
        cwd=folder, env=environment, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip


def seeds_and_examples(output: str) -> tuple[list[int], list[str]]:
    (seeds,) = re.findall(r"SEEDS (\d+) (\d+) (\d+)", output)
    return [int(seed) for seed in seeds], re.findall(r"EXAMPLE (.+)", output)


@pytest.mark.slow
def test_a_base_seed_decides_seeds_and_examples(tmp_path: Path) -> None:
    said = [run(tmp_path, STATED, seed).stdout for seed in (None, 1, 1, 2)]
    assert "make test-fresh SEED=1" in said[1].split("collected")[0]
    assert "1 tests took seeds of this run: right code fails 0.25 of them by chance" in said[1]
    fixed, one, again, other = (seeds_and_examples(text) for text in said)
    assert fixed[0] == [1, 1, 2]
    assert len(fixed[1]) <= 2 * 4
    assert one == again
    assert one[0][0] == one[0][1] != one[0][2]
    assert len({fixed[0][0], one[0][0], other[0][0]}) == 3
    assert 2 * 4 < len(one[1]) <= 2 * 5 * 4
    assert one[1] != other[1]


@pytest.mark.slow
def test_a_test_with_new_seeds_states_its_rate(tmp_path: Path) -> None:
    found = run(tmp_path, UNSTATED, None)
    assert found.returncode == pytest.ExitCode.USAGE_ERROR
    assert "test_it.py::test_seed: `fresh_seed` and `@pytest.mark.false_alarm(rate)`" in (
        found.stdout + found.stderr
    )


@pytest.mark.slow
@pytest.mark.parametrize(("chosen", "cases"), [("not slow", "02"), ("slow", "134")])
def test_cases_of_a_costly_test_are_fast_or_slow(tmp_path: Path, chosen: str, cases: str) -> None:
    done = run(tmp_path, CASES, None, "-m", chosen)
    assert re.findall(r"CASE (\d)", done.stdout) == list(cases), done.stdout
