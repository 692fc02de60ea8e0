"""The rows of the table of verdicts, each with its 95 % interval (Clopper and Pearson).

    python studies/verdict/table.py SET OUT.jsonl [--by-kind] [--list]

SET is the folder with the truths, OUT.jsonl the answers that `run.py` wrote. A number is *wrong*
where it is more than 10 % off, or where its 90 % interval misses the truth by more than half the
interval's width; a number whose truth is 0 is judged by its interval alone.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final, NamedTuple

from run import VERDICTS, read_lines
from scipy.stats import beta

EXPLAINS, DOES_NOT, CANNOT = VERDICTS
MOST_OFF: Final = 0.1
MOST_MISSED: Final = 0.5
"""Widths of the interval."""
ADVICE: Final = ("negate", "mirrored", "marker is", "stamps jitter", "measured from another")
"""Words of advice to change what is right in all recordings of this study."""
UNITS: Final = ("_m_s", "_rad2_s", "_rad_s", "_rad", "_s", "_m")

Line = dict[str, Any]


class Row(NamedTuple):
    """One share: how many of how many."""

    words: str
    hits: int
    of: int

    def __str__(self) -> str:
        """Return the row in Markdown."""
        if not self.of:
            return f"| {self.words} | 0 of 0 | | |"
        low, high = interval(self.hits, self.of)
        share = f"{self.hits / self.of:.1%} | {low:.1%} to {high:.1%}"
        return f"| {self.words} | {self.hits} of {self.of} | {share} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("set", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--by-kind", action="store_true", help="count the verdicts of each kind")
    parser.add_argument("--list", action="store_true", help="name the recordings of each row")
    options = parser.parse_args()
    lines = joined(options.set, options.out)
    print("| | recordings | share | 95 % interval |\n| --- | --- | --- | --- |")
    for row in rows(lines):
        print(row)
    if options.by_kind:
        print(f"\n{by_kind(lines)}")
    if options.list:
        print(f"\n{listed(lines)}")


def joined(folder: Path, answers: Path) -> list[Line]:
    """Return the answers, each with its truth."""
    found = []
    for line in read_lines(answers):
        truth = json.loads((folder / f"{line['name']}.json").read_text("utf-8"))
        found.append({**line, "truth": truth})
    return found


def interval(hits: int, of: int, confidence: float = 0.95) -> tuple[float, float]:
    """Return the interval of a share by Clopper and Pearson."""
    tail = 0.5 * (1.0 - confidence)
    low = float(beta.ppf(tail, hits, of - hits + 1)) if hits else 0.0
    high = float(beta.ppf(1.0 - tail, hits + 1, of - hits)) if hits < of else 1.0
    return low, high


def rows(lines: list[Line]) -> list[Row]:
    """Return the rows of the table."""
    inside = [line for line in lines if line["truth"]["in_family"]]
    outside = [line for line in lines if not line["truth"]["in_family"]]
    explained = [line for line in inside if line["verdict"] == EXPLAINS]
    blocks = [line for line in explained if is_block(line)]
    able = [line for line in inside if line["truth"]["judgeable"]]
    right = [line for line in able if is_right(line)]
    calibrations = [
        line["calibration"] | {"truth": line["truth"]} for line in inside if "calibration" in line
    ]
    measured = [one for one in calibrations if one.get("verdict") == EXPLAINS]
    held = [one for line in blocks for one in main_intervals(line)]
    opened = [one for line in blocks for one in other_intervals(line)]
    told = [one for line in measured for one in determined(line)]
    return [
        row("explains, with a wrong number or a wrong model", explained, falsely_reassured),
        row("judgeable, right model and numbers: does not explain", right, is_rejected),
        row("judgeable: cannot tell", able, lambda line: line["verdict"] == CANNOT),
        row("judgeable: refused", able, lambda line: line["verdict"] == "refused"),
        row("explains: 90 % intervals of C_d and sigma_F that hold the truth", held, bool),
        row("explains: 90 % intervals of other numbers that hold the truth", opened, bool),
        row("calibrations that explain, with a wrong determined number", measured, has_wrong),
        row("determined numbers of walkers that 90 % intervals hold", told, lambda one: one.held),
        row("false advice", lines, gives_false_advice),
        row("laws outside the family: explains", outside, lambda line: line["verdict"] == EXPLAINS),
        row("all: explains", lines, lambda line: line["verdict"] == EXPLAINS),
        row("all: does not explain", lines, lambda line: line["verdict"] == DOES_NOT),
        row("all: cannot tell", lines, lambda line: line["verdict"] == CANNOT),
    ]


def row(words: str, of: Iterable[Any], hit: Any) -> Row:
    """Count."""
    some = list(of)
    return Row(words, sum(bool(hit(one)) for one in some), len(some))


class Judged(NamedTuple):
    """One number of an answer next to its truth."""

    name: str
    value: float
    low: float
    high: float
    true: float
    strict: bool
    """Whether being 10 % off makes it wrong."""

    @property
    def held(self) -> bool:
        """Whether the interval holds the truth."""
        return self.low <= self.true <= self.high

    @property
    def wrong(self) -> bool:
        """Whether it is far off, or missed by far."""
        missed = max(self.low - self.true, self.true - self.high, 0.0)
        far = missed > MOST_MISSED * (self.high - self.low)
        off = self.strict and self.true and abs(self.value / self.true - 1.0) > MOST_OFF
        return bool(far or off)


def is_block(line: Line) -> bool:
    """Return whether a recording is of a block."""
    return bool(line["truth"]["command"] == "fit")


def block_numbers(line: Line) -> list[Judged]:
    """Return the numbers of a fit next to their truths."""
    body, found = line["truth"]["body"], []
    seconds = 60.0 * line["truth"]["minutes"]
    true = {
        "drag_coefficient": body["drag_coefficient"],
        "force_std_N": body["force_std"],
        "drag_power": body["drag_power"],
        "force_memory_s": body["force_memory"],
        "flow_strength_change": body["growth"] * seconds / (1.0 + 0.5 * body["growth"] * seconds),
        "pulse_amplitude": body["pulse"],
    }
    for name, one in line.get("numbers", {}).items():
        if not one["interval"]:
            continue
        low, high = (
            end if end is not None else side * float("inf")
            for end, side in zip(one["interval"], (-1.0, 1.0), strict=True)
        )
        strict = name in ("drag_coefficient", "force_std_N", "drag_power")
        found.append(Judged(name, one["value"], low, high, true.get(name, 0.0), strict))
    return found


def determined(calibration: Line) -> list[Judged]:
    """Return the determined numbers of a calibration next to their truths."""
    found, true = [], calibration["truth"]["numbers"]
    for key, one in calibration.get("numbers", {}).items():
        name = bare(key)
        if one["determined"] and name in true:
            found.append(Judged(name, one["value"], *one["interval"], true[name], True))
    return found


def bare(key: str) -> str:
    """Return a number's name without its unit: speed of speed_m_s."""
    return next((key.removesuffix(unit) for unit in UNITS if key.endswith(unit)), key)


def main_intervals(line: Line) -> list[bool]:
    """Return whether the intervals of C_d and sigma_F hold the truth."""
    return [one.held for one in block_numbers(line) if one.name in line_names()]


def other_intervals(line: Line) -> list[bool]:
    """Return whether the intervals of the numbers that the fit opened hold the truth."""
    return [one.held for one in block_numbers(line) if one.name not in line_names()]


def line_names() -> tuple[str, str]:
    """Return the numbers that each fit has."""
    return "drag_coefficient", "force_std_N"


def falsely_reassured(line: Line) -> bool:
    """Return whether an answer that explains is wrong."""
    if is_block(line):
        return has_wrong_number(line)
    return member(line["named"]) != line["truth"]["model"]


def has_wrong_number(line: Line) -> bool:
    """Return whether a number of a fit is wrong."""
    return any(one.wrong for one in block_numbers(line))


def has_wrong(calibration: Line) -> bool:
    """Return whether a determined number of a calibration is wrong."""
    return any(one.wrong for one in determined(calibration))


def is_right(line: Line) -> bool:
    """Return whether model and numbers are right, whatever the verdict."""
    if line["verdict"] == "refused":
        return False
    if is_block(line):
        return not has_wrong_number(line)
    return bool(truths_words(line))


def is_rejected(line: Line) -> bool:
    """Return whether the right answer is said not to explain the recording."""
    if is_block(line):
        return bool(line["verdict"] == DOES_NOT)
    return all(word == DOES_NOT for word in truths_words(line))


def truths_words(line: Line) -> list[str]:
    """Return the verdicts on the models of a comparison that have the true law."""
    return [
        word
        for name, word in line.get("models", {}).items()
        if member(name) == line["truth"]["model"]
    ]


def member(name: str) -> str:
    """Return a model without its parts."""
    return name.split("+", maxsplit=1)[0]


def gives_false_advice(line: Line) -> bool:
    """Return whether an answer advises to change what is right.

    What says that the change was tried and is no better is no advice.
    """
    texts = map(str, [*line.get("warnings", []), *line.get("reasons", [])])
    return any(word in text for text in texts for word in ADVICE if "no better" not in text)


def by_kind(lines: list[Line]) -> str:
    """Return how often each verdict falls on each kind."""
    words = (*VERDICTS, "refused")
    table = ["| kind | recordings | judgeable | " + " | ".join(words) + " | wrong numbers |"]
    table.append("| --- " * (len(words) + 4) + "|")
    for kind in dict.fromkeys(line["truth"]["kind"] for line in lines):
        some = [line for line in lines if line["truth"]["kind"] == kind]
        counts = [sum(line["verdict"] == word for line in some) for word in words]
        able = sum(line["truth"]["judgeable"] for line in some)
        wrong = sum(has_wrong_number(line) for line in some if is_block(line))
        table.append(
            f"| {kind} | {len(some)} | {able} | {' | '.join(map(str, counts))} | {wrong} |"
        )
    return "\n".join(table)


def listed(lines: list[Line]) -> str:
    """Return one line for each recording, with its numbers over their truths."""
    texts = []
    for line in sorted(lines, key=lambda line: line["name"]):
        words = [line["name"], line["kind"], line["verdict"]]
        if is_block(line):
            words += [
                f"{one.name} {one.value / one.true - 1:+.1%}" + ("" if one.held else " missed")
                if one.true
                else f"{one.name} {one.value:.3g} for 0"
                for one in block_numbers(line)
            ]
        else:
            words += [f"named {line.get('named')}"]
        words += ["judgeable"] if line["truth"]["judgeable"] else []
        texts.append(", ".join(words))
    return "\n".join(texts)


if __name__ == "__main__":
    main()
