"""The table of a study of misfits: errors, coverage and verdict of every case.

    python studies/misfit/table.py OUT [--before FILE] [--store FOLDER]

Reads `results.jsonl` in OUT and prints a table in Markdown; `--before` is such a file of another
version of the fit, whose errors stand beside. `--store` writes the table and the results, with
their manifest.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from cases import CASES
from run import FIRST_SEED, current, read_lines

import driftwalk as dw
from driftwalk.core.files.atomic import write_atomic
from driftwalk.core.provenance import manifest, write_manifest

PARAMETERS = {"drag_coefficient": "C_d", "force_std": "σ_F"}
ADDED_MASS_UNKNOWN = ("added mass 0.5 m in the inertia alone",)
"""Cases that a recording cannot tell from the model: their intervals are those for a block that may
carry the usual added mass."""
JUDGED = (
    "control",
    "floating body, added mass 0.5 m",
    "the water's acceleration alone",
    "added mass 0.5 m in the inertia alone",
    "the same, stated as 0.5 ± 0.1",
    "drag ∝ speed",
    "drag ∝ speed^1.5",
    "flow grows by 20 %",
    "flow falls by 20 %",
    "flow pulses by 20 % in 10 s",
    "force remembers 0.1 s",
    "force remembers 0.5 s",
    "5 % of the positions off by 5 mm",
    "5 % dropped, constant rate assumed",
    "orientation + 5°",
    "marker 3 mm off",
)
"""Cases that the fit is to bear, for the coverage over all of them."""
Lines = list[dict[str, Any]]


def main() -> None:
    """Print the table, and store it when asked to."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--before", type=Path, default=None)
    parser.add_argument("--store", type=Path, default=None)
    options = parser.parse_args()
    lines = current(options.out / "results.jsonl", options.minutes)
    before = None if options.before is None else read_lines(options.before)
    text = markdown(lines, before)
    print(text)
    if options.store is not None:
        store(options.store, text, lines)


def markdown(lines: Lines, before: Lines | None) -> str:
    """Return the table: a row for every case that has results."""
    names = [f"{label} {word}" for label in PARAMETERS.values() for word in ("error", "covered")]
    then = [f"{label} before" for label in PARAMETERS.values()] if before is not None else []
    head = ["not as the model says", "worlds", "explained", *names, *then]
    rows = [head, ["---"] * len(head)]
    for name in CASES:
        found = of_case(lines, name)
        if not found:
            continue
        row = [name, str(len(found)), verdicts(found)]
        for parameter in PARAMETERS:
            row += [errors(found, parameter), covered(found, parameter)]
        if before is not None:
            row += [errors(of_case(before, name), parameter) for parameter in PARAMETERS]
        rows.append(row)
    table = "\n".join(f"| {' | '.join(row)} |" for row in rows)
    return f"{table}\n\n{coverage(lines)}"


def coverage(lines: Lines) -> str:
    """Return how often the intervals hold the truth in the cases that the fit is to bear."""
    judged = [one for one in lines if one["case"] in JUDGED and "error" not in one]
    shares = [
        f"{label} in {np.mean([held(one, parameter) for one in judged]):.1%}"
        for parameter, label in PARAMETERS.items()
    ]
    return f"Of {len(judged)} recordings of {len(JUDGED)} cases the intervals hold " + (
        f"{' and '.join(shares)}: {', '.join(JUDGED)}."
    )


def of_case(lines: Lines, name: str) -> Lines:
    """Return the results of one case, in the order of the worlds."""
    return sorted((one for one in lines if one["case"] == name), key=lambda one: one["world"])


def verdicts(lines: Lines) -> str:
    """Return in how many worlds the model explains the recording."""
    explained = sum(one.get("explained") is True for one in lines)
    failed = sum("error" in one for one in lines)
    return f"{explained} of {len(lines)}" + (f", {failed} refused" if failed else "")


def errors(lines: Lines, parameter: str) -> str:
    """Return the median of the errors' size, and the smallest and the largest error."""
    found = np.array([one[f"{parameter}_error"] for one in lines if "error" not in one])
    if not found.size:
        return "–"
    return f"{np.median(np.abs(found)):.1%} ({found.min():+.1%} to {found.max():+.1%})"


def covered(lines: Lines, parameter: str) -> str:
    """Return in how many worlds the 90 % interval holds the truth."""
    fitted = [one for one in lines if "error" not in one]
    return f"{sum(held(one, parameter) for one in fitted)} of {len(fitted)}"


def held(line: dict[str, Any], parameter: str) -> bool:
    """Return whether the 90 % interval of a recording holds the truth."""
    what = "any_covered" if line["case"] in ADDED_MASS_UNKNOWN else "covered"
    return bool(line[f"{parameter}_{what}"])


def store(folder: Path, text: str, lines: Lines) -> None:
    """Write the table, the results in the order of the cases, and the manifest."""
    folder.mkdir(parents=True, exist_ok=True)
    write_atomic(folder / "table.md", f"{text}\n".encode())
    results = folder / "results.jsonl"
    ordered = [one for name in CASES for one in of_case(lines, name)]
    words = "".join(json.dumps(one, ensure_ascii=False) + "\n" for one in ordered)
    write_atomic(results, words.encode())
    facts = manifest(
        command=["python", *sys.argv],
        study=dw.Study().to_dict(),
        seeds={"first_world": FIRST_SEED},
        inputs={"results": results},
    )
    write_manifest(folder / "manifest.json", facts)


if __name__ == "__main__":
    main()
