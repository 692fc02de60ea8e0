"""Recordings in random dialects of headed text: read right, or refused; never silently other."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest
from dialects import draw, verdict


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


def test_two_hundred_dialects(tmp_path: Path) -> None:
    check(range(200), tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("part", range(4))
def test_ten_thousand_dialects(part: int, tmp_path: Path) -> None:
    check(range(2_500 * part, 2_500 * (part + 1)), tmp_path)
