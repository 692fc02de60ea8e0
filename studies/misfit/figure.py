"""A figure of a study of misfits: errors of C_d of every case, before and after.

    python studies/misfit/figure.py OUT FILE.png [--before FILE]

Reads `results.jsonl` in OUT; `--before` is such a file of another version of the fit, whose errors
stand as open circles.
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from typing import Any

import numpy as np
from cases import CASES
from matplotlib.figure import Figure
from run import current, read_lines

from driftwalk.plot.parts.style import DOUBLE_COLUMN_MM, new_figure, print_style

LEAST = 0.1
"""Smallest error on the axis [%]; the axis says that smaller ones are there."""
WANTED = 5.0
"""Error that a fit should not exceed [%]."""


def main() -> None:
    """Draw the figure."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("file", type=Path)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--before", type=Path, default=None)
    options = parser.parse_args()
    after = current(options.out / "results.jsonl", options.minutes)
    before = [] if options.before is None else read_lines(options.before)
    with print_style():
        figure = drawn(after, before)
        figure.savefig(options.file)


def drawn(after: list[dict[str, Any]], before: list[dict[str, Any]]) -> Figure:
    """Return the figure: a row for every case that has results."""
    names = [name for name in CASES if sizes(after, name).size]
    figure = new_figure(width_mm=DOUBLE_COLUMN_MM, height_mm=18.0 + 6.0 * len(names))
    ax = figure.add_subplot()
    place = np.arange(len(names))[::-1]
    for row, name in zip(place, names, strict=True):
        old, new = sizes(before, name), sizes(after, name)
        ax.plot(new, np.full(new.size, row), ".", color="C0", alpha=0.4, markersize=4)
        if old.size:
            ax.plot(np.median(old), row, "o", color="C1", fillstyle="none")
        ax.plot(np.median(new), row, "o", color="C0")
    ax.plot([], [], "o", color="C1", fillstyle="none", label="before, median")
    ax.plot([], [], "o", color="C0", label="now, median")
    ax.plot([], [], ".", color="C0", alpha=0.4, label="now, each world")
    ax.axvline(WANTED, color="0.6", linewidth=0.8, label=f"{WANTED:g} %")
    ax.set_xscale("log")
    ax.set_xticks([0.1, 1.0, 10.0, 100.0], ["≤ 0.1", "1", "10", "100"])
    ax.set_xlim(0.9 * LEAST, 200.0)
    ax.set_yticks(place, [re.sub(r"\^([\d.]+)", r"$^{\1}$", name) for name in names])
    ax.set_xlabel("size of the error of $C_d$ (%)")
    figure.legend(loc="outside upper center", ncols=4)
    return figure


def sizes(lines: list[dict[str, Any]], name: str) -> np.ndarray:
    """Return the sizes of a case's errors of C_d [%]."""
    found = [one for one in lines if one["case"] == name and "drag_coefficient_error" in one]
    return np.maximum([100.0 * abs(one["drag_coefficient_error"]) for one in found], LEAST)


if __name__ == "__main__":
    main()
