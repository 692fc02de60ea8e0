"""Timing that the benchmarks share: several rounds, ways interleaved, wall and processor time."""

from __future__ import annotations

import os
import platform
import re
import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path


@dataclass
class Times:
    """Times of one way to do a job, one entry per round [s]."""

    wall: list[float] = field(default_factory=list)
    processor: list[float] = field(default_factory=list)

    def rates(self, work: float) -> list[float]:
        """Work per second of processor time, round by round."""
        return [work / seconds for seconds in self.processor]

    def wall_rate(self, work: float) -> float:
        return work / statistics.median(self.wall)


def interleaved(ways: Mapping[str, Callable[[], object]], *, rounds: int) -> dict[str, Times]:
    """Time every way once a round, after one untimed call each.

    A slow spell of the machine then meets all ways alike, and ratios hold.
    """
    for call in ways.values():
        call()
    times = {name: Times() for name in ways}
    for _ in range(rounds):
        for name, call in ways.items():
            wall, processor = time.perf_counter(), time.process_time()
            call()
            times[name].processor.append(time.process_time() - processor)
            times[name].wall.append(time.perf_counter() - wall)
    return times


def spread(values: list[float], *, digits: int = 1) -> str:
    """Median and, in brackets, smallest and largest."""
    middle, least, most = statistics.median(values), min(values), max(values)
    return f"{middle:.{digits}f} ({least:.{digits}f}-{most:.{digits}f})"


def machine() -> str:
    """The processor, its cores, and how busy they are: a line for the head of every table."""
    name = platform.processor() or platform.machine()
    facts = Path("/proc/cpuinfo")
    if facts.exists():
        text = facts.read_text(encoding="utf-8")
        keys = {"model name": "", "cpu family": "family ", "model": "model "}
        known = {
            words: re.search(rf"^{key}\s*:\s*(.+)$", text, re.MULTILINE)
            for key, words in keys.items()
        }
        name = ", ".join(words + found[1] for words, found in known.items() if found) or name
    load = f", load average {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    return f"{name}; {os.cpu_count()} cores{load}"
