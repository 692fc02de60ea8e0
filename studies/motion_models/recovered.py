"""Print the tables of recovered parameters: python recovered.py RECOVER.jsonl [SEARCHED.jsonl].

The first has a row for each model, the second for each parameter. An error is |ln(found / true)|,
of a turn rate the difference over its value. With the lines of searches alone, the second has the
median error of these, and of the summaries on the same recordings. The third counts the places of
the truths among the draws, in fifths: even where the draws are a posterior (simulation-based
calibration; Talts et al., arXiv:1804.06788).
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any, Final

import numpy as np
from recordings import read_lines
from table import rows_of

Line = dict[str, Any]
SIGNED: Final = ("turn_rate",)


def entries_of(lines: list[Line], model: str, name: str) -> list[tuple[float, bool, bool]]:
    """Return error, whether it is determined, and whether the interval holds the truth."""
    found = []
    for line in lines:
        if line["model"] != model or name not in line["truth"]:
            continue
        low, high = line["interval"][name]
        inside = low <= line["truth"][name] <= high
        found.append((error_of(line, name), bool(line["determined"][name]), inside))
    return found


def cells_of(entries: list[tuple[float, bool, bool]]) -> list[str]:
    """Return the cells of some estimates."""
    known = [one for one in entries if one[1]]
    inside = sum(one[2] for one in entries)
    median = f"{np.median([one[0] for one in known]):.1%}" if known else ""
    covered = f"{sum(one[2] for one in known)} of {len(known)}" if known else ""
    return [
        f"{len(known)} of {len(entries)}",
        median,
        covered,
        f"{inside} of {len(entries)}",
    ]


def error_of(line: Line, name: str) -> float:
    """Return the relative error of an estimate."""
    ratio = line["estimate"][name] / line["truth"][name]
    return abs(ratio - 1.0) if name in SIGNED else abs(float(np.log(ratio)))


def stage_cells(lines: list[Line], searches: list[Line], model: str, name: str) -> list[str]:
    """Return the median errors of both stages, on recordings that were searched alone."""
    alone = [one for one in searches if one["model"] == model]
    numbers = {one["recording"] for one in alone}
    both = [one for one in lines if one["model"] == model and one["recording"] in numbers]
    return [
        f"{np.median([error_of(one, name) for one in chosen]):.0%}" if chosen else ""
        for chosen in (alone, both)
    ]


def ranks_of(lines: list[Line], model: str | None) -> list[float]:
    """Return the share of draws below each truth, where the draws are the answer."""
    return [
        rank
        for line in lines
        if line["model"] == (model or line["model"]) and line["estimate_from"] == "summaries"
        for rank in line.get("rank", {}).values()
    ]


def rank_cells(ranks: list[float]) -> list[str]:
    """Return how many ranks are in each fifth, and the share in the outer tenth."""
    counts, _ = np.histogram(ranks, bins=5, range=(0.0, 1.0))
    outer = np.mean([min(rank, 1.0 - rank) < 0.05 for rank in ranks]) if ranks else np.nan
    return [*map(str, counts), f"{outer:.0%}"]


def main() -> None:
    """Print the tables."""
    lines = read_lines(Path(sys.argv[1]))
    searches = read_lines(Path(sys.argv[2])) if len(sys.argv) > 2 else []
    models = list(dict.fromkeys(line["model"] for line in lines))
    head = ["determined", "median error of these", "in the 90 % interval", "of all"]
    by_model = [["model", "recordings", "matched", "explained", *head, "processor time (s)"]]
    stages = ["search alone: median error", "summaries, same recordings"]
    by_parameter = [["model", "parameter", *head, *(stages if searches else [])]]
    every: list[tuple[float, bool, bool]] = []
    for model in models:
        own = [line for line in lines if line["model"] == model]
        entries: list[tuple[float, bool, bool]] = []
        for name in own[0]["truth"]:
            these = entries_of(own, model, name)
            both = stage_cells(lines, searches, model, name) if searches else []
            by_parameter.append([model, name, *cells_of(these), *both])
            entries += these
        matched = sum(line["estimate_from"] == "summaries" for line in own)
        explained = sum(line["explained"] for line in own)
        seconds = np.median([line["processor_seconds"] for line in own])
        counts = [str(len(own)), str(matched), str(explained)]
        by_model.append([model, *counts, *cells_of(entries), f"{seconds:.0f}"])
        every += entries
    by_model.append(["all", str(len(lines)), "", "", *cells_of(every), ""])
    fifths = [f"{part} to {part + 20} %" for part in range(0, 100, 20)]
    by_rank = [["model", *fifths, "outside the middle 90 %"]]
    by_rank += [[model, *rank_cells(ranks_of(lines, model))] for model in models]
    by_rank.append(["all", *rank_cells(ranks_of(lines, None))])
    print(*map(rows_of, (by_model, by_parameter, by_rank)), sep="\n\n")


if __name__ == "__main__":
    main()
