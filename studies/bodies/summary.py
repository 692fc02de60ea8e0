"""How far C_d and sigma_F of the fits are off, and what their 90 % intervals hold.

    python studies/bodies/summary.py SET OUT.jsonl [--against OTHER OTHER.jsonl]

SET is a folder of recordings, OUT.jsonl what `studies/verdict/run.py` wrote of it. `--against`
compares the processor time of a fit, by the minute of recording, with that of another set.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1] / "verdict"))

from table import interval, joined

NUMBERS = {"drag_coefficient": "drag_coefficient", "force_std_N": "force_std"}
"""Names in an answer and in a truth."""


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("set", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--against", nargs=2, type=Path)
    options = parser.parse_args()
    lines = joined(options.set, options.out)
    answered = [line for line in lines if line.get("numbers")]
    words = [line["verdict"] for line in lines]
    print(", ".join(f"{words.count(word)} x {word}" for word in sorted(set(words))))
    print("| number | median error | largest | bias | in the 90 % interval | 95 % interval of it |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name, own in NUMBERS.items():
        print(row(name, [(line["numbers"][name], line["truth"]["body"][own]) for line in answered]))
    print(f"\nprocessor time: {seconds(lines):.2f} s a minute of recording (median)")
    if options.against:
        other = joined(*options.against)
        print(
            f"of the other set: {seconds(other):.2f} s; ratio {seconds(lines) / seconds(other):.2f}"
        )


def row(name: str, found: list[tuple[dict[str, Any], float]]) -> str:
    """Return the row of a number in Markdown."""
    error = np.array([number["value"] / true - 1.0 for number, true in found])
    held = sum(number["interval"][0] <= true <= number["interval"][1] for number, true in found)
    low, high = interval(held, len(found))
    return (
        f"| {name} | {np.median(np.abs(error)):.1%} | {np.abs(error).max():.1%} "
        f"| {error.mean():+.1%} | {held} of {len(found)} | {low:.0%} to {high:.0%} |"
    )


def seconds(lines: list[dict[str, Any]]) -> float:
    """Return the processor time of a fit by the minute of recording [s], the median."""
    return float(np.median([line["seconds"] / line["truth"]["minutes"] for line in lines]))


if __name__ == "__main__":
    main()
