"""Whether a command printed what its page shows.

Every line shown has to be printed, in the same order; the page may leave lines out. Blanks count
once, and a remark at the end of a shown line (``# … and more``) is not part of it. `Numbers` says
how numbers compare.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from enum import Enum

NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
LAST_DIGITS = 2
"""Units of the last shown digit by which close numbers differ at most."""
MEDIAN = 0.05
"""Relative scatter of what is no share, such as the median time of so many runs; also 4 sigma."""
RUNS = 1000
"""Runs of an assembly that a page shows."""
SHARE_SIGMAS = 4.0
"""Of the scatter of two shares of so many runs: right numbers fail once in 16,000."""
ROUNDING = 1e-6
"""Share of a tolerance: two units of a last digit are a little more, or less, in binary."""
SPAN = re.compile(r"#(?: (?:h|min|s))(?: # (?:min|s))?(?![\w/])")
LIST = re.compile(r"(<span>|#)(?:, \1)+")


class Numbers(Enum):
    """How the numbers of a printed line compare with those of the shown one."""

    SAME = "same"
    """The command ran as shown on the files of the page."""
    CLOSE = "close"
    """So it did, but on an earlier result, whose last bits depend on the machine: the last shown
    digits may differ."""
    RUNS = "runs"
    """So it did, and the runs are chaotic: other last bits make them other runs of the same law."""
    ANY = "any"
    """It ran on less, so that only the words and the places of numbers are compared."""


def not_printed(
    shown: list[str], printed: str, numbers: Numbers, by_chance: Mapping[str, float] | None = None
) -> list[str]:
    """Return the shown lines that were not printed, or not in this order.

    `by_chance` gives lines, by how they begin, in which numbers may differ by so much.
    """
    missing = []
    rest = [_plain(line) for line in printed.splitlines()]
    for line in map(_plain, shown):
        if line in ("", "...", "…"):
            continue
        chance = max(
            (by for begin, by in (by_chance or {}).items() if line.startswith(begin)), default=0.0
        )
        at = next((k for k, one in enumerate(rest) if _agree(line, one, numbers, chance)), None)
        if at is None:
            missing.append(line)
        else:
            rest = rest[at + 1 :]
    return missing


def _plain(line: str) -> str:
    return " ".join(re.sub(r"(^|\s\s)\s*# .*$", "", line).split())


def _agree(shown: str, printed: str, numbers: Numbers, chance: float) -> bool:
    if numbers is Numbers.ANY:
        return _form(shown) == _form(printed)
    if shown == printed or (numbers is Numbers.SAME and not chance):
        return shown == printed
    if NUMBER.sub("#", shown) != NUMBER.sub("#", printed):
        return False
    pairs = zip(NUMBER.findall(shown), NUMBER.findall(printed), strict=True)
    return all(
        abs(float(a) - float(b)) <= (1 + ROUNDING) * max(chance, _tolerance(a, numbers))
        for a, b in pairs
    )


def _tolerance(shown: str, numbers: Numbers) -> float:
    """Return by how much a printed number may differ from the shown one."""
    value = float(shown)
    match numbers:
        case Numbers.CLOSE:
            digits, _, power = shown.partition("e")
            return LAST_DIGITS * 10.0 ** (int(power or 0) - len(digits.partition(".")[2]))
        case Numbers.RUNS if 0.0 <= value <= 1.0:
            return SHARE_SIGMAS * math.sqrt(2.0 * value * (1.0 - value) / RUNS)
        case Numbers.RUNS:
            return MEDIAN * abs(value)
        case _:
            return 0.0


def _form(line: str) -> str:
    """Return a line with every number, length of time and list of them as one mark."""
    return LIST.sub(r"\1", SPAN.sub("<span>", NUMBER.sub("#", line)))
