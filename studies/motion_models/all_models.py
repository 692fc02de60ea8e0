"""Write the page of every model on every recording: python all_models.py COMPARE.jsonl PAGE.md.

COMPARE.jsonl is made by `compare.py`. Each recording gets a table of distances and one of facts
that were not fitted, with a row for each model and each walk.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any, Final

from recordings import read_lines
from table import rows_of

Line = dict[str, Any]

NAMES: Final = {
    "hexbug": "Hexbug",
    "rummynose": "Rummy-nose tetra",
    "tenebrio": "Tenebrio beetle",
    "mouse": "Mouse",
    "smarticle-1": "Smarticle 1",
    "smarticle-2": "Smarticle 2",
    "smarticle-3": "Smarticle 3",
    "termite": "Termite",
}
ASPECTS: Final = {
    "steps": "steps", "steps_3": "3 intervals", "steps_9": "9 intervals", "frame": "own frame",
    "wall": "near the wall", "memory": "memory of the speed",
}  # fmt: skip
DISPLACEMENTS: Final = tuple(f"displacement_{count}" for count in (1, 3, 10, 30, 100))
FACTS: Final = {
    **{name: f"moved in {name.rpartition('_')[2]} (mm)" for name in DISPLACEMENTS},
    "speed_time": "memory of the speed (s)",
    "wall_share": "near the wall (%)",
    "rest_share": "at rest (%)",
}
HEAD: Final = """\
# Every model on the eight real recordings

These are the numbers behind [the table of the closest
models](../validation.md#which-model-explains-a-recording). Models were searched on the even blocks
of time and judged on the odd ones. `studies/motion_models` makes this page:

```console
$ python studies/motion_models/compare.py $DATA run/compare.jsonl
$ python studies/motion_models/all_models.py run/compare.jsonl page.md
```

- **Settings** is the cost of a model: how many settings its search simulated, each over the whole
  recording.
- **Distance** is the mean of the six KS distances over the recording's own floors, with its error.
- The **six distances** D stand behind it. The first row has the distances of the recording's own
  parts from each other, below which no steady model can be expected.
- **Facts** were not fitted. A model's are the median of 20 simulated recordings, with the smallest
  and the largest in brackets. *Moved* is the root mean square displacement over so many step
  intervals, *memory of the speed* the time over which the speed lasts. *Near the wall* and *at
  rest* are shares of the time.
- The two walks (resampled steps, hidden Markov walk) repeat recorded steps, and are no models.
"""


def main() -> None:
    """Write the page."""
    lines = read_lines(Path(sys.argv[1]))
    Path(sys.argv[2]).write_text(page_of(lines), encoding="utf-8")


def page_of(lines: list[Line]) -> str:
    """Return the page."""
    return "\n".join([HEAD, *(section_of(line) for line in lines)])


def section_of(line: Line) -> str:
    """Return the part of the page on one recording."""
    minutes, halves = line["duration_s"] / 60.0, line["halves_ks_distance"]
    return "\n".join(
        [
            f"## {NAMES[line['recording']]}",
            "",
            f"{minutes:.1f} min, steps over {line['step_interval_s']:g} s. The halves of the "
            f"recording differ by D = {halves:.3f}.",
            "",
            distance_table(line),
            "",
            fact_table(line),
            "",
        ]
    )


def distance_table(line: Line) -> str:
    """Return the distances of all models from a recording."""
    own = distances_of(line["own_distance"])
    cells = [
        ["model", "numbers", "settings", "distance", *ASPECTS.values(), "explains"],
        ["the recording's own parts", "", "", "", *own, ""],
    ]
    for one in line["models"]:
        cells.append(
            [
                one["model"],
                str(one["numbers"]),
                f"{one['evaluations']:,}" if one["evaluations"] else "",
                f"{one['score']:.2f} ± {one['score_std']:.2f}",
                *distances_of(one["held_out_distance"]),
                "yes" if one["verdict"] == "explains" else "",
            ]
        )
    return rows_of(cells)


def distances_of(by_name: dict[str, float]) -> list[str]:
    """Return the distance in each aspect; a short recording has too few steps for some."""
    return [f"{by_name[name]:.3f}" if name in by_name else "none" for name in ASPECTS]


def fact_table(line: Line) -> str:
    """Return the facts that were not fitted, of the recording and of all models."""
    recorded = [number_of(name, line["checks"][name]["recorded"]) for name in FACTS]
    cells = [["", *FACTS.values()], ["the recording", *recorded]]
    for one in line["models"]:
        bands = []
        for name in FACTS:
            low, middle, high = (number_of(name, value) for value in one["checks"][name])
            bands.append(f"{middle} ({low} to {high})")
        cells.append([one["model"], *bands])
    return rows_of(cells)


def number_of(name: str, value: float) -> str:
    """Return a fact in the unit of its column."""
    if not math.isfinite(value):
        return "none"
    if name in DISPLACEMENTS:
        value = 1e3 * math.sqrt(value)
    elif name.endswith("_share"):
        value *= 100.0
    return f"{value:.3g}" if abs(value) < 1000.0 else f"{value:,.0f}"


if __name__ == "__main__":
    main()
