"""Fixtures shared by all tests, and how Hypothesis searches in them."""

from __future__ import annotations

import gc
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, settings
from made_once import SHARED

# Tests run side by side, one a core: threads of the linear algebra would only wait for each other.
# This is read when NumPy is loaded, and passed on to the commands that tests start.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

# FFmpeg keeps the level that it finds when a process opens its first video. Here that may be a
# test's own; later ones look at what a command prints.
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")

# The same examples in every run, and no bar on their time: whether a test passes tells about the
# code, not about the machine or the day.
settings.register_profile(
    "repeatable",
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow],
)
# `make test-fresh`: other examples in every run. They follow from the seed alone, not from a
# database of earlier failures.
settings.register_profile(
    "fresh",
    settings.get_profile("repeatable"),
    derandomize=False,
    database=None,
    print_blob=True,
)
MORE_EXAMPLES = 5

_text = os.environ.get("DRIFTWALK_TEST_SEED", "")
BASE_SEED = int(_text) if _text else None
settings.load_profile("repeatable" if BASE_SEED is None else "fresh")

_RESULTS = pytest.StashKey[str]()

SHARED_DATA = Path(__file__).resolve().parents[2] / "shared" / "data"


@pytest.fixture(scope="session")
def shared_data() -> Callable[[str], Path]:
    """Return a function that gives the folder of a reference recording, or skips the test."""

    def folder(name: str) -> Path:
        path = SHARED_DATA / name
        if not path.is_dir():
            pytest.skip(f"reference recording '{name}' is not on this machine ({path})")
        return path

    return folder


@pytest.fixture(scope="session")
def fresh_seed() -> Callable[[int], int]:
    """Return a function that gives a test its seed: the given one, or one derived from the run's.

    `make test` passes the given seed through. `make test-fresh` derives another one from it and
    DRIFTWALK_TEST_SEED: equal seeds stay equal, different ones stay different. A test that uses
    this states with `@pytest.mark.false_alarm(rate)` how often a new seed makes it fail although
    the code is right; 0 where no seed may.
    """

    def seed(given: int) -> int:
        if BASE_SEED is None:
            return given
        return int(np.random.SeedSequence([BASE_SEED, given]).generate_state(1)[0] >> 1)

    return seed


def pytest_configure(config: pytest.Config) -> None:
    """Give the session a folder of finished results, which its workers inherit."""
    if SHARED not in os.environ:
        os.environ[SHARED] = config.stash[_RESULTS] = tempfile.mkdtemp(prefix="driftwalk-tests-")


def pytest_unconfigure(config: pytest.Config) -> None:
    # The interpreter's last collection passes over what is frozen, and nanobind calls that a leak.
    gc.unfreeze()
    if _RESULTS in config.stash:
        shutil.rmtree(config.stash[_RESULTS], ignore_errors=True)
        os.environ.pop(SHARED, None)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    """Leave the tests and the libraries, which stay until the end, out of collecting garbage.

    Every full collection during a test would go through all of them.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
        gc.freeze()
        gc.set_threshold(20_000)  # the suite spends half as long in collecting as with 700


def _false_alarm(item: pytest.Item) -> float | None:
    mark = item.get_closest_marker("false_alarm")
    if mark is None:
        return None
    (rate,) = mark.args
    return float(rate)


def _leave_cases_to_the_slow_set(items: list[pytest.Item]) -> None:
    """Mark as slow all but some cases, spread evenly, of the tests with `fast_cases(number)`."""
    cases: dict[str, list[pytest.Item]] = {}
    for item in items:
        if item.get_closest_marker("fast_cases") and not item.get_closest_marker("slow"):
            cases.setdefault(item.nodeid.partition("[")[0], []).append(item)
    for some in cases.values():
        mark = some[0].get_closest_marker("fast_cases")
        assert mark is not None
        (number,) = mark.args
        kept = {index * len(some) // number for index in range(number)}
        for index, item in enumerate(some):
            if index not in kept:
                item.add_marker(pytest.mark.slow)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Hold tests with new seeds to their marker, and give Hypothesis more examples to try."""
    _leave_cases_to_the_slow_set(items)
    enlarged = set()
    for item in items:
        rate = _false_alarm(item)
        if (rate is None) == ("fresh_seed" in getattr(item, "fixturenames", ())):
            raise pytest.UsageError(
                f"{item.nodeid}: `fresh_seed` and `@pytest.mark.false_alarm(rate)` go together"
            )
        if BASE_SEED is None:
            continue
        if rate is not None:
            item.user_properties.append(("false_alarm", rate))
        # Parametrized tests share one function, and methods keep it to themselves.
        function = getattr(item, "obj", None)
        function = getattr(function, "__func__", function)
        if getattr(function, "is_hypothesis_test", False) and function not in enlarged:
            enlarged.add(function)
            # A test's own number of examples comes before the profile's, and Hypothesis has no
            # public way to scale it.
            own = function._hypothesis_internal_use_settings
            function._hypothesis_internal_use_settings = settings(
                own, max_examples=MORE_EXAMPLES * own.max_examples
            )


def pytest_report_header() -> list[str]:
    if BASE_SEED is None:
        return []
    return [f"new seeds; this run again: make test-fresh SEED={BASE_SEED}"]


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Say how many failures chance alone makes, beside those that there were."""
    if BASE_SEED is None:
        return
    rates = [
        float(rate)
        for outcome in ("passed", "failed")
        for report in terminalreporter.stats.get(outcome, [])
        if report.when == "call"
        for name, rate in report.user_properties
        if name == "false_alarm"
    ]
    terminalreporter.write_sep("-", f"new seeds, SEED={BASE_SEED}")
    terminalreporter.write_line(
        f"{len(rates)} tests took seeds of this run: right code fails {sum(rates):.2g} of them by "
        "chance. A test that fails under a second seed too is a finding."
    )
