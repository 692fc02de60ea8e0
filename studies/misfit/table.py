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
from driftwalk.core.atomic import write_atomic
from driftwalk.core.provenance import manifest, write_manifest

PARAMETERS = {"drag_coefficient": "C_d", "force_std": "σ_F"}
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
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


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
    return f"{sum(one[f'{parameter}_covered'] for one in fitted)} of {len(fitted)}"


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
