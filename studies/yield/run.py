"""How often the best of 12 settings is found, and which ones cannot be distinguished from it.

    python studies/yield/run.py POOL.npz results.json     (about five minutes on two cores)

A pool of 4000 runs of each setting is simulated once, with shared random numbers, and kept in
POOL.npz. Each repetition draws runs of it with replacement, the same ones in every setting, so that
the shares of the pool are the truth. A setting is (factor on the bundled flow, sigma_F in mN), C_d
0.45, 4 blocks, 300 s, latching by collision, hidden faces free. "O, thinned" drops successes of the
second best setting at random, so that the two are .015 apart. "correlations" are those of "T at 120
s" in runs on the same random numbers at (1, 0.55 mN) and at a setting that differs.
"""

from __future__ import annotations

import json
import sys
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

import driftwalk as dw
from driftwalk.assembly.yields.selection import HALVING, Tally, halving, tell_apart

SETTINGS = list(product((0.0, 0.5, 1.0, 1.5), (0.2, 0.55, 1.2)))
TASKS = (("T", 300.0), ("T", 120.0), ("O", 300.0))
POOL, BUDGET, REPETITIONS = 4000, 6000, 400
INDIFFERENCE, CONFIDENCE = 0.02, 0.9


def runs_of(scale: float, force: float, *, runs: int = POOL) -> Any:
    """Return the runs of a setting, on the random numbers that all settings share."""
    flow = dw.tank30_flow().copy()
    for name in ("u", "v"):
        flow[name] = scale * flow[name]
    return dw.assembly.assemble(
        dw.Study(assembly={"latching": "collision", "hidden_face_drag": "none"}), flow,
        blocks=4, runs=runs, duration=300.0, drag_coefficient=0.45, force_std=1e-3 * force,
        seed=1, trial=7,
    )  # fmt: skip


def correlations() -> dict[str, float]:
    """Return how runs of neighbouring settings go together."""
    others = {
        "force +0.2 %": (1.0, 1.002 * 0.55), "force +2 %": (1.0, 1.02 * 0.55),
        "flow +2 %": (1.02, 0.55), "flow x 0.5": (0.5, 0.55),
    }  # fmt: skip

    def reached(scale: float, force: float) -> Any:
        runs = runs_of(scale, force, runs=2000)
        return runs["class"].values[dw.assembly.class_at(runs, 120.0)] == "T"

    first = reached(1.0, 0.55)
    return {
        name: round(float(np.corrcoef(first, reached(*other))[0, 1]), 3)
        for name, other in others.items()
    }


def thinned(reached: Any, apart: float) -> Any:
    """Return runs in which the second best setting has its share so far below the best."""
    share = reached.mean(axis=1)
    first, second = np.argsort(-share)[:2]
    kept = np.random.default_rng(1).random(POOL) < (share[first] - apart) / share[second]
    found = reached.copy()
    found[second] &= kept
    return found


def pool() -> dict[str, Any]:
    """Return whether each run reached each target in time, shape (setting, run)."""
    reached: dict[str, list[Any]] = {f"{target}_{by:g}": [] for target, by in TASKS}
    for scale, force in SETTINGS:
        runs = runs_of(scale, force)
        names = runs["class"].values
        for target, by in TASKS:
            reached[f"{target}_{by:g}"].append(names[dw.assembly.class_at(runs, by)] == target)
        print(f"simulated flow x {scale:g}, {force:g} mN", flush=True)
    return {name: np.array(rows) for name, rows in reached.items()}


def repeated(reached: Any) -> dict[str, Any]:
    """Return what the repetitions of a task gave."""
    truth = reached.mean(axis=1)
    order = np.argsort(-truth)
    rows = []
    for repetition in range(REPETITIONS):
        random = np.random.default_rng([1, repetition])
        drawn = random.integers(POOL, size=BUDGET * (1 + HALVING.most))
        tally = Tally(lambda arms, runs, d=drawn: reached[list(arms)][:, d[runs.start : runs.stop]])
        stayed = halving(tally, range(len(SETTINGS)), BUDGET)
        winner = max(stayed, key=lambda arm: stayed[arm])
        found = tell_apart(
            tally, range(len(SETTINGS)), indifference=INDIFFERENCE, confidence=CONFIDENCE,
            budget=HALVING.most * BUDGET,
        )  # fmt: skip
        kept = [found.best, *found.alike]
        rows.append(
            {
                "halving_best": winner == order[0],
                "halving_loss": truth[order[0]] - truth[winner],
                "best": found.best == order[0],
                "loss": truth[order[0]] - truth[found.best],
                "holds_best": order[0] in kept,
                "within_holds": truth[order[0]] - truth[found.best] <= found.within,
                "kept": len(kept),
                "kept_worse_by_4": sum(truth[order[0]] - truth[arm] > 0.04 for arm in kept),
                "settled": found.within <= INDIFFERENCE,
                "runs": tally.runs,
            }
        )
    mean = {f"mean_{key}": round(float(np.mean([r[key] for r in rows])), 4) for key in rows[0]}
    return {
        "truth": [round(float(truth[at]), 4) for at in order[:4]],
        "settings": [list(SETTINGS[at]) for at in order[:4]],
        **mean,
        "most_loss": round(float(max(r["loss"] for r in rows)), 4),
    }


def main() -> None:
    """Simulate the pool where there is none, repeat the selection, and write what was found."""
    kept, out = map(Path, sys.argv[1:3])
    if not kept.exists():
        np.savez_compressed(kept, **pool())
    with np.load(kept) as reached:
        table = {name: repeated(reached[name]) for name in reached.files}
        table["O_300, thinned"] = repeated(thinned(reached["O_300"], 0.015))
    table["correlations"] = correlations()
    out.write_text(json.dumps(table, indent=1) + "\n")


if __name__ == "__main__":
    main()
