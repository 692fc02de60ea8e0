"""Recordings in random dialects of headed text: read right, or refused; never silently other."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest
from dialects import draw, part_of_today, verdict


def check(seeds: range, folder: Path) -> None:
    found: Counter[str] = Counter()
    other = []
    for seed in seeds:
        dialect = draw(seed)
        said = verdict(dialect, folder)
        found[said.partition(":")[0]] += 1
        if said != "right" and not said.startswith("refused"):
            other.append((seed, said, dialect.said))
    assert not other, other
    # What is refused has a unit, a clock or a body that nothing names.
    assert found["right"] > 0.75 * len(seeds)


@pytest.mark.slow
def test_two_hundred_dialects(tmp_path: Path) -> None:
    check(range(200), tmp_path)


@pytest.mark.slow
def test_ten_thousand_dialects(tmp_path: Path) -> None:
    """A fiftieth of them a day; all at once with `make fuzz-dialects`, once a week in CI."""
    check(part_of_today(10_000), tmp_path)
