"""The tables of the results, as Markdown: a row for each recording, a column for each method."""

from __future__ import annotations

from collections.abc import Callable
from statistics import median
from typing import Any

Line = dict[str, Any]

METHODS = {
    "fit, angle state": "fit",
    "fit, angle given": "fit, orientation as input",
    "fit, angle none": "fit, no orientation",
    "KS grid, own flow": "the paper's",
    "KS grid, fitted flow": "KS grid, fitted flow",
    "KS grid, true flow": "KS grid, true flow",
}


def markdown(lines: list[Line]) -> str:
    """Return the four tables, and the time of each method."""
    parts = [
        table(lines, "C_d (truth)", drag_truth, lambda line: error(line, "drag_coefficient")),
        table(lines, "σ_F (truth, mN)", force_truth, lambda line: error(line, "force_std_N")),
        table(lines, "block flow error", no_truth, lambda line: f"{line['flow_error']:.1%}"),
        table(lines, "D (floor)", no_truth, distance),
    ]
    return "\n\n".join([*parts, seconds(lines)]).replace("%", " %")


def table(
    lines: list[Line], head: str, truth: Callable[[Line], str], cell: Callable[[Line], str]
) -> str:
    """Return one table; a method that has no result for a recording leaves its cell empty."""
    rows = [f"| {head} | " + " | ".join(METHODS.values()) + " |", "|---" * 7 + "|"]
    for name in dict.fromkeys(line["recording"] for line in lines):
        found = {line["method"]: line for line in lines if line["recording"] == name}
        cells = [cell(found[method]) if method in found else "" for method in METHODS]
        first = f"{name}{truth(next(iter(found.values())))}"
        rows.append("| " + " | ".join([first, *cells]) + " |")
    return "\n".join(rows)


def drag_truth(line: Line) -> str:
    """Return the true C_d."""
    return f" ({line['drag_coefficient_true']:.2f})"


def force_truth(line: Line) -> str:
    """Return the true sigma_F."""
    return f" ({1e3 * line['force_std_N_true']:.2f})"


def no_truth(_: Line) -> str:
    """Return nothing."""
    return ""


def error(line: Line, name: str) -> str:
    """Return an error, marked where the interval does not hold the truth."""
    mark = "" if line[f"{name}_covered"] else " \\*"
    words = f"{round(line[f'{name}_error'], 3) + 0.0:+.1%}"
    return words.replace("+0.0%", "0.0%").replace("-", "−") + mark


def distance(line: Line) -> str:
    """Return D and its floor, bold where the model is said not to explain the recording."""
    words = f"{line['ks_distance']:.3f} ({line['ks_noise_floor']:.3f})"
    return words if line["explained"] else f"**{words}**"


def seconds(lines: list[Line]) -> str:
    """Return the median time of each method."""
    words = []
    for method, name in METHODS.items():
        times = [line["seconds"] for line in lines if line["method"] == method]
        if times:
            words.append(f"{name} {median(times):.0f}")
    return "Seconds, median: " + ", ".join(words) + "."
