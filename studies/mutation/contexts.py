"""A pytest plugin: which tests run each line of the rooms of the study, and what each test costs.

Write it to the JSON file that the environment variable MAP names (see ``mutate.py``).
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from mutate import ROOMS, ROOT

_COVERAGE: Any = None
_COST: dict[str, float] = {}
_SLOW: list[str] = []
if "MAP" in os.environ:
    import coverage

    rooms = [str(ROOT / "src/driftwalk" / room) for room in ROOMS]
    _COVERAGE = coverage.Coverage(data_file=None, source=rooms)
    _COVERAGE.start()  # before the rooms are imported


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Note what a test runs, with the fixtures that are made for it, under its name."""
    _COVERAGE.switch_context(item.nodeid)
    begin = time.process_time()
    yield
    _COST[item.nodeid] = time.process_time() - begin
    if item.get_closest_marker("slow") is not None:
        _SLOW.append(item.nodeid)
    _COVERAGE.switch_context("")


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Write the map; a test that failed is no judge of mutants."""
    _COVERAGE.stop()
    data = _COVERAGE.get_data()
    tests = {
        str(Path(file).relative_to(ROOT)): data.contexts_by_lineno(file)
        for file in data.measured_files()
    }
    reporter = session.config.pluginmanager.get_plugin("terminalreporter")
    for report in reporter.stats.get("failed", []) if reporter is not None else []:
        _COST.pop(report.nodeid, None)
    with Path(os.environ["MAP"]).open("w", encoding="utf-8") as stream:
        json.dump({"tests": tests, "cost": _COST, "slow": _SLOW}, stream)
