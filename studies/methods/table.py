"""The table of the results, as Markdown."""

from __future__ import annotations

from typing import Any

HEAD = (
    "recording", "method", "C_d", "σ_F", "block flow error", "D", "floor", "D / floor", "explained",
    "s",
)  # fmt: skip
WORDS = {
    "KS grid, own flow": "the paper's",
    "KS grid, fitted flow": "KS grid, fitted flow",
    "KS grid, true flow": "KS grid, true flow",
}


def markdown(lines: list[dict[str, Any]]) -> str:
    """Return a row for each result, recordings in the order in which they were made."""
    rows = ["| " + " | ".join(HEAD) + " |", "|" + "---|" * len(HEAD)]
    names = list(dict.fromkeys(line["recording"] for line in lines))
    rows += [row(line) for name in names for line in lines if line["recording"] == name]
    return "\n".join([*rows, "", "\\* outside the 90 % interval"])


def row(line: dict[str, Any]) -> str:
    """Return one row."""
    distance, floor = line["ks_distance"], line["ks_noise_floor"]
    cells = [
        f"{line['recording']} ({line['drag_coefficient_true']:.2f}, "
        f"{1e3 * line['force_std_N_true']:.2f} mN)",
        WORDS.get(line["method"], line["method"]),
        error(line, "drag_coefficient"),
        error(line, "force_std_N"),
        f"{line['flow_error']:.1%}",
        f"{distance:.3f}",
        f"{floor:.3f}",
        f"{distance / floor:.1f}",
        "yes" if line["explained"] else "no",
        f"{line['seconds']:.0f}",
    ]
    return "| " + " | ".join(cells) + " |"


def error(line: dict[str, Any], name: str) -> str:
    """Return an error, marked where the interval does not hold the truth."""
    return f"{line[f'{name}_error']:+.1%}" + ("" if line[f"{name}_covered"] else " \\*")
