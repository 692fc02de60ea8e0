"""Outcomes with and without drag on hidden faces, beside those of another engine.

    python studies/hidden_faces/compare.py [--runs 10000] [--runs-varied 4000]

Prints the two tables of docs/validation.md: the same case on both engines, and how our numbers
change when one convention at a time is another. Five minutes on two cores.
"""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from model import CALIBRATED, SMALL_DRAG, simulate, starts_within

if TYPE_CHECKING:
    import xarray as xr

# Shares of 1000 runs of a program on the Open Dynamics Engine, in the flow of another tank of the
# same kind. Where its classes are not all known, "rest" is the sum of the missing ones.
OTHER_ENGINE: dict[tuple[tuple[float, float], str], dict[str, float]] = {
    (CALIBRATED, "full"): {
        "I": 0.033, "O": 0.005, "T": 0.023, "S": 0.018, "L": 0.066, "I3+1": 0.203, "L3+1": 0.130,
        "2+2": 0.222, "2+1+1": 0.284, "1+1+1+1": 0.016, "complete": 0.145,
    },
    (CALIBRATED, "none"): {
        "I": 0.021, "O": 0.031, "T": 0.572, "S": 0.082, "L": 0.257, "complete": 0.963,
    },
    (SMALL_DRAG, "full"): {"complete": 0.564},
}  # fmt: skip
VARIATIONS: dict[str, dict[str, Any]] = {
    "as above": {},
    "time step 16 ms": {"simulation.time_step_s": 0.016},
    "friction between blocks 1": {"assembly.block_friction": 1.0},
    "restitution between blocks 0": {"assembly.block_restitution": 0.0},
    "wall friction 0": {"tank.wall_friction": 0.0},
    "connector distance 5 mm": {"assembly.connector_distance_m": 0.005},
    "connector angle 0.1 rad": {"assembly.connector_axis_rad": 0.1},
    "connector angle 0.4 rad": {"assembly.connector_axis_rad": 0.4},
    "latching upon collision": {"assembly.latching": "collision"},
    "600 s": {"assembly.duration_s": 600.0},
}
START_DIAMETER_M = 0.16
FLOW_FACTORS = (0.8, 1.25)


def shares(distribution: xr.Dataset) -> dict[str, float]:
    """Return the share of every class and of complete runs."""
    names = [str(name) for name in distribution["class"].values]
    found = dict(zip(names, distribution["proportion"].values.tolist(), strict=True))
    return {**found, "complete": distribution.attrs["complete"]}


def print_row(*cells: str) -> None:
    """Print a row of a Markdown table."""
    print("| " + " | ".join(cells) + " |", flush=True)


def cells_of(found: dict[str, float], names: list[str]) -> list[str]:
    """Return shares by name, empty where there is none."""
    return [f"{found[name]:.3f}" if name in found else "" for name in names]


def print_comparison(runs: int) -> None:
    """Print both engines side by side, a column for every case."""
    ours = {case: shares(simulate(case[1], runs=runs, parameters=case[0])) for case in OTHER_ENGINE}
    names = list(ours[CALIBRATED, "full"])
    heads = [
        f"({drag}, {1e3 * force:g} mN), {faces}: {engine}"
        for (drag, force), faces in OTHER_ENGINE
        for engine in ("driftwalk", "ODE")
    ]
    print_row("class", *heads)
    print("|" + "---|" * (len(heads) + 1))
    for name in names:
        both = [cells_of(found[case], [name])[0] for case in ours for found in (ours, OTHER_ENGINE)]
        print_row(name, *both)


def print_variations(runs: int) -> None:
    """Print our shares with one convention changed at a time."""
    names = list(shares(simulate("full", runs=2)))
    print_row("changed", "hidden faces", *names)
    print("|" + "---|" * (len(names) + 2))
    rows: list[tuple[str, dict[str, Any]]] = [
        (words, {"changes": changes}) for words, changes in VARIATIONS.items()
    ]
    middle = f"start within {100 * START_DIAMETER_M / 2:g} cm of the middle"
    rows.append((middle, {"start": starts_within(START_DIAMETER_M, runs=runs)}))
    rows += [(f"flow times {factor:g}", {"flow_factor": factor}) for factor in FLOW_FACTORS]
    for words, options in rows:
        for faces in ("full", "none"):
            found = shares(simulate(faces, runs=runs, **options))
            print_row(words, faces, *cells_of(found, names))


def main() -> None:
    """Simulate and print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=10_000)
    parser.add_argument("--runs-varied", type=int, default=4000)
    options = parser.parse_args()
    print_comparison(options.runs)
    print()
    print_variations(options.runs_varied)


if __name__ == "__main__":
    main()
