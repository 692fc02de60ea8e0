"""Print the tables of docs/validation.md from the lines of `run.py`: python table.py OUT.jsonl.

The first table has, for each recording, the model that comes closest on the even blocks, and how
far it is on the odd ones: the distance of the steps over that of the recording's own two halves.
The worst aspect is that of six with the largest such ratio. The second table has the ratio of the
steps for every model. The score is the mean of all six distances over the recording's own floors.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from recordings import read_lines

Line = dict[str, Any]


def ratio(line: Line) -> float:
    """Return the held-out distance of the steps over that of the recording's own halves."""
    return float(line["held_out"]["steps"] / line["own"]["steps"])


def worst_aspect(line: Line) -> str:
    """Return the aspect that is farthest from the odd blocks, over the own distance."""
    apart = {name: far / line["own"][name] for name, far in line["held_out"].items()}
    worst = max(apart, key=apart.__getitem__)
    return f"{worst.replace('_', ' ')}, {apart[worst]:.1f}"


def rows_of(cells: list[list[str]]) -> str:
    """Return a table, its head first."""
    return "\n".join(
        f"| {' | '.join(row)} |" for row in [cells[0], ["---"] * len(cells[0]), *cells[1:]]
    )


def chosen_table(by_recording: dict[str, list[Line]]) -> str:
    """Return the model that was chosen for each recording."""
    cells = [
        [
            "recording", "chosen on the even blocks", "parameters", "D there", "D on the odd",
            "the recording's own", "ratio", "score", "worst aspect", "seconds",
        ]
    ]  # fmt: skip
    for name, lines in by_recording.items():
        best = min(lines, key=lambda line: line["score"])
        cells.append(
            [
                name,
                best["model"].replace("_", " "),
                str(best["parameters"]),
                f"{best['trained']['steps']:.3f}",
                f"{best['held_out']['steps']:.3f}",
                f"{best['own']['steps']:.3f}",
                f"{ratio(best):.2f}",
                f"{best['held_out_score']:.2f}",
                worst_aspect(best),
                f"{best['seconds']:.0f}",
            ]
        )
    return rows_of(cells)


def all_table(by_recording: dict[str, list[Line]]) -> str:
    """Return the ratio of every model, and its score on the odd blocks."""
    models = list(dict.fromkeys(line["model"] for lines in by_recording.values() for line in lines))
    cells = [["recording", *(model.replace("_", " ") for model in models)]]
    for name, lines in by_recording.items():
        found = {line["model"]: line for line in lines}
        cells.append(
            [
                name,
                *(
                    f"{ratio(found[model]):.2f} ({found[model]['held_out_score']:.2f})"
                    if model in found
                    else "–"
                    for model in models
                ),
            ]
        )
    return rows_of(cells)


def main(path: Path) -> None:
    """Print both tables."""
    by_recording: dict[str, list[Line]] = {}
    for line in read_lines(path):
        by_recording.setdefault(line["recording"], []).append(line)
    print(chosen_table(by_recording))
    print()
    print(all_table(by_recording))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
