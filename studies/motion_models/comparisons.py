"""Print the tables of comparisons: python comparisons.py TRUTH.jsonl COMPARE.jsonl.

The first is of recordings of known truth (`truth.py`), the second of real ones (`compare.py`).
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from recordings import read_lines
from table import rows_of

Line = dict[str, Any]


def truth_table(lines: list[Line]) -> str:
    """Return where the true model came, and which models explain the recording."""
    cells = [
        [
            "conditions of", "true model", "place", "behind the first", "first", "explained",
            "named by summaries",
        ]
    ]  # fmt: skip
    for line in lines:
        names = [name for name in line["ranking"] if " " not in name]
        at = names.index(line["model"])
        behind = f"{line['behind']:.2f} ± {line['behind_std']:.2f}" if at else ""
        asked = line.get("summaries", {})
        named = [name for name, one in asked.items() if one["named"]]
        cells.append(
            [
                line["recording"],
                line["model"],
                str(at + 1),
                behind,
                names[0] if at else "",
                ", ".join(line["explained"]) or "none",
                "".join(named) or ("none" if asked else "not asked"),
            ]
        )
    return rows_of(cells)


def compared_table(lines: list[Line]) -> str:
    """Return the closest model of each recording, the closest walk, and the verdict."""
    cells = [
        [
            "recording", "closest model", "distance", "closest walk", "its distance", "D of steps",
            "the recording's own", "explained by", "seconds",
        ]
    ]  # fmt: skip
    for line in lines:
        models = [one for one in line["models"] if not one["baseline"]]
        walks = [one for one in line["models"] if one["baseline"]]
        best, walk = models[0], walks[0]
        cells.append(
            [
                line["recording"],
                best["model"],
                f"{best['score']:.2f} ± {best['score_std']:.2f}",
                walk["model"],
                f"{walk['score']:.2f} ± {walk['score_std']:.2f}",
                f"{best['held_out_distance']['steps']:.3f}",
                f"{line['own_distance']['steps']:.3f}",
                ", ".join(one["model"] for one in models if one["verdict"] == "explains") or "none",
                f"{line['seconds']:.0f}",
            ]
        )
    return rows_of(cells)


def main() -> None:
    """Print both tables."""
    truth, compared = (read_lines(Path(name)) for name in sys.argv[1:3])
    print(truth_table(truth), compared_table(compared), sep="\n\n")


if __name__ == "__main__":
    main()
