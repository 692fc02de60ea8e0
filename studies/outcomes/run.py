"""Coverage of the regions from outcomes alone, at random truths off the nodes of one emulator.

    python studies/outcomes/run.py FOLDER        (some ten minutes on two cores; goes on if killed)

C_d 0.36 to 0.54 and sigma_F 0.3 to 1.0 mN in the bundled flow, 4 blocks, 300 s. The emulator has
128 nodes of 300 runs. 400 truths are drawn evenly from the ranges: each half of them chooses the
power of the likelihood of each kind of data, as the self-check does, with which the other half
measures the coverage. Every data set is 100 runs. A further 80 truths at C_d 0.8 to 1.2 say how
often sigma_F is determined there.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import qmc

import driftwalk as dw
from driftwalk.assembly.outcome_posterior.emulator import Emulator, log_likelihoods
from driftwalk.assembly.outcome_posterior.problem import Nodes
from driftwalk.assembly.outcome_posterior.records import KINDS, Categories, Record
from driftwalk.assembly.outcome_posterior.region import CREDIBLE_REGION, covered, self_check
from driftwalk.model import apply_overrides
from driftwalk.sweep import ShardStore

NAMES = ("drag_coefficient", "force_std")
NODES, NODE_RUNS, TRUTHS, DATA_RUNS, POINTS = 128, 300, 200, 100, 8192
MAPS = {"near 0.45": ((0.36, 0.54), TRUTHS), "from 0.8 on": ((0.8, 1.2), 40)}
FORCE = (0.3e-3, 1.0e-3)


def simulated(
    folder: Path, drag: tuple[float, float], point: np.ndarray, runs: int, trial: int
) -> list[list[Record]]:
    """Return the records of runs at points of the unit square."""
    low, high = np.array([drag, FORCE]).T
    study = apply_overrides(dw.Study(), {"sensitivity.runs": runs})
    nodes = Nodes(study, dw.tank30_flow(), NAMES, low + point * (high - low), trial)
    return nodes.simulate(store=ShardStore(folder, fingerprint={"drag": drag, "runs": runs}))


def row_of(
    kind: str,
    node: np.ndarray,
    known: list[list[Record]],
    truth: np.ndarray,
    sets: list[list[Record]],
) -> dict[str, Any]:
    """Return powers, coverage and widths of a kind of data; each half chooses the other's power."""
    categories = Categories.of(kind, known)
    emulator = Emulator.fitted(node, categories.table(known))
    point = qmc.Sobol(len(NAMES), seed=7).random(POINTS)
    both = log_likelihoods(*emulator.predict(np.vstack([point, truth])), categories.table(sets))
    level, own = both[:, :POINTS], both[np.arange(len(truth)), POINTS + np.arange(len(truth))]
    halves = [slice(None, len(truth) // 2), slice(len(truth) // 2, None)]
    chosen = [self_check(point, truth[one], level[one], own[one]).power for one in halves]
    row: dict[str, Any] = {"kind": kind, "powers": chosen}
    for label, powers in (("", chosen[::-1]), ("_at_power_1", [1.0, 1.0])):
        powers = np.nan_to_num(powers, nan=CREDIBLE_REGION.powers[-1])
        joint, marginal, width = (
            np.concatenate(part)
            for part in zip(
                *(
                    covered(point, truth[one], level[one], own[one], power=power)
                    for one, power in zip(halves, powers, strict=True)
                ),
                strict=True,
            )
        )
        row[f"coverage{label}"] = float(joint.mean())
        row[f"interval_coverage{label}"] = marginal.mean(axis=0).tolist()
        part = width / CREDIBLE_REGION.confidence
        row[f"width{label}"] = np.median(part, axis=0).round(3).tolist()
        row[f"not_determined{label}"] = (part >= CREDIBLE_REGION.prior_like).mean(axis=0).tolist()
    return row


def main(folder: Path) -> None:
    """Simulate, and write the table."""
    tables = {}
    for number, (name, (drag, truths)) in enumerate(MAPS.items()):
        node = qmc.Sobol(len(NAMES), seed=1).random(NODES if truths == TRUTHS else NODES // 4)
        truth = np.random.default_rng(5 + number).random((2 * truths, len(NAMES)))
        trial = (6 + 2 * number) << 32
        place = folder / str(number)
        known = simulated(place / "nodes", drag, node, NODE_RUNS, trial)
        sets = simulated(place / "truths", drag, truth, DATA_RUNS, trial + (1 << 32))
        tables[name] = [row_of(kind, node, known, truth, sets) for kind in KINDS]
        for row in tables[name]:
            print(name, row, flush=True)
    text = json.dumps(tables, indent=1) + "\n"
    (folder / "table.json").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
