"""Whether a command printed what its page shows.

Every line shown has to be printed, in the same order; the page may leave lines out. Blanks count
once, and a remark at the end of a shown line (``# … and more``) is not part of it. `Numbers` says
how numbers compare.
"""

from __future__ import annotations

import math
import re
from enum import Enum

NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
CLOSE = 0.05
"""Largest relative difference of numbers that are close."""
SMALL = 0.01
"""Largest difference of close numbers next to 0."""
RUNS = 1000
"""Runs of an assembly that a page shows."""
SHARE_SIGMAS = 4.0
"""Of the scatter of two shares of so many runs: right numbers fail once in 16,000."""
SPAN = re.compile(r"#(?: (?:h|min|s))(?: # (?:min|s))?(?![\w/])")
LIST = re.compile(r"(<span>|#)(?:, \1)+")


class Numbers(Enum):
    """How the numbers of a printed line compare with those of the shown one."""

    SAME = "same"
    """The command ran as shown on the files of the page."""
    CLOSE = "close"
    """So it did, but on an earlier result, whose last bits depend on the machine."""
    RUNS = "runs"
    """So it did, and the runs are chaotic: other last bits make them other runs of the same law."""
    ANY = "any"
    """It ran on less, so that only the words and the places of numbers are compared."""


def not_printed(shown: list[str], printed: str, numbers: Numbers) -> list[str]:
    """Return the shown lines that were not printed, or not in this order."""
    missing = []
    rest = [_plain(line) for line in printed.splitlines()]
    for line in map(_plain, shown):
        if line in ("", "...", "…"):
            continue
        at = next((k for k, one in enumerate(rest) if _agree(line, one, numbers)), None)
        if at is None:
            missing.append(line)
        else:
            rest = rest[at + 1 :]
    return missing


def _plain(line: str) -> str:
    return " ".join(re.sub(r"(^|\s\s)\s*# .*$", "", line).split())


def _agree(shown: str, printed: str, numbers: Numbers) -> bool:
    if numbers is Numbers.SAME:
        return shown == printed
    if numbers is Numbers.ANY:
        return _form(shown) == _form(printed)
    if NUMBER.sub("#", shown) != NUMBER.sub("#", printed):
        return False
    pairs = zip(NUMBER.findall(shown), NUMBER.findall(printed), strict=True)
    return all(abs(float(a) - float(b)) <= _tolerance(float(a), numbers) for a, b in pairs)


def _tolerance(shown: float, numbers: Numbers) -> float:
    """Return by how much a printed number may differ from the shown one."""
    close = max(CLOSE * abs(shown), SMALL)
    if numbers is not Numbers.RUNS or not 0.0 <= shown <= 1.0:
        return close
    return max(close, SHARE_SIGMAS * math.sqrt(2.0 * shown * (1.0 - shown) / RUNS))


def _form(line: str) -> str:
    """Return a line with every number, length of time and list of them as one mark."""
    return LIST.sub(r"\1", SPAN.sub("<span>", NUMBER.sub("#", line)))
