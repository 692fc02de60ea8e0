"""How far the numbers of the fits are off, and what their 90 % intervals hold.

    python studies/bodies/summary.py SET OUT.jsonl [--against OTHER OTHER.jsonl]
    python studies/bodies/summary.py PAIRS.jsonl

SET is a folder of recordings, OUT.jsonl what `studies/verdict/run.py` or `fits.py` wrote of it,
PAIRS.jsonl what `fits.py` wrote of pairs. `--against` compares the processor time of a fit, by the
minute of recording, with that of another set.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1] / "verdict"))

from run import read_lines
from table import interval, joined

NUMBERS = {"drag_coefficient": "drag_coefficient", "force_std_N": "force_std"}
"""Names in an answer and in a truth."""
GLUED = {
    "hidden_face_drag_share": ("hidden_share", 0.1),
    "stirring_correlation": ("correlation", 0.15),
}
"""Of glued blocks: the name in a truth, and how far off a number may be."""


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("set", type=Path)
    parser.add_argument("out", type=Path, nargs="?")
    parser.add_argument("--against", nargs=2, type=Path)
    options = parser.parse_args()
    if options.out is None:
        print(pairs(read_lines(options.set)))
        return
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


def pairs(lines: list[dict[str, Any]]) -> str:
    """Return the table of pairs in Markdown: of all, and by what is true of them."""
    told = [line for line in lines if line.get("dimer", {}).get("numbers")]
    text = [f"{len(told)} of {len(lines)} pairs have an answer", ""]
    text += [
        "| number | truth | median error | within | of | in the 90 % interval | 95 % interval |"
    ]
    text += ["| --- | --- | --- | --- | --- | --- | --- |"]
    for name, (own, most) in GLUED.items():
        for truth in [None, *sorted({line["truth"][own] for line in told})]:
            some = [line for line in told if truth in (None, line["truth"][own])]
            found = [(one["dimer"]["numbers"][name], one["truth"][own]) for one in some]
            error = np.array([abs(number["value"] - true) for number, true in found])
            held = sum(
                number["interval"][0] <= true <= number["interval"][1] for number, true in found
            )
            low, high = interval(held, len(found))
            text.append(
                f"| {own} | {'all' if truth is None else truth} | {np.median(error):.3f} "
                f"| {(error <= most).sum()} within {most} | {len(found)} "
                f"| {held} of {len(found)} | {low:.0%} to {high:.0%} |"
            )
    for part in ("block", "dimer"):
        found = [
            (one[part]["numbers"]["drag_coefficient"], one["truth"]["body"]["drag_coefficient"])
            for one in told
        ]
        text.append(f"\n{row(f'drag_coefficient of the {part}', found)}")
    return "\n".join(text)


def seconds(lines: list[dict[str, Any]]) -> float:
    """Return the processor time of a fit by the minute of recording [s], the median."""
    return float(np.median([line["seconds"] / line["truth"]["minutes"] for line in lines]))


if __name__ == "__main__":
    main()
