"""What a force law costs in simulation and self-assembly, beside the paper's.

    python benchmarks/bench_laws.py [--rounds 9] [--steps 1000]

The contact-heavy case of `cases.py` (one block) and that of `assembly_case.py` (four blocks), each
under every law, timed on one thread with the rounds interleaved. The times are of the processor;
the ratio is the median over the rounds. Checked, else the script fails: no law leaves the paper's
path unchanged, and the push of the water's acceleration costs at most 1.3 times the paper's law.
"""

from __future__ import annotations

import argparse
import statistics
from dataclasses import replace
from functools import partial
from typing import Any, Final

import numpy as np
from assembly_case import Case as Blocks, check, make_case
from cases import Case as Block, contact_heavy
from timing import interleaved, machine, spread

from driftwalk import _core
from driftwalk.model import apply_overrides
from driftwalk.simulation.backend import Camera, native_model

LAWS: Final[dict[str, dict[str, Any]]] = {
    "the paper's": {},
    "water's acceleration": {"forces.pressure_gradient": True},
    "floating body": {"forces.pressure_gradient": True, "forces.added_mass_share": 0.5},
    "with a linear part": {"forces.linear_drag_kg_s": 5e-3},
    "drag ∝ speed^1.5": {"forces.drag_power": 1.5},
    "force with memory": {"forces.force_memory_s": 0.1},
}
BOUNDED = "water's acceleration"
MOST_RATIO = 1.3
WORLDS_OF_BLOCKS = 32


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--steps", type=int, default=1000)
    options = parser.parse_args()
    print(machine())
    block, blocks = contact_heavy(), make_case(4, worlds=WORLDS_OF_BLOCKS)
    table = {
        "one block": {
            name: partial(_simulate, block, law, options.steps) for name, law in LAWS.items()
        },
        "four blocks": {
            name: partial(_assemble, blocks, law, options.steps) for name, law in LAWS.items()
        },
    }
    for case, ways in table.items():
        _check_paths(ways)
        times = interleaved(ways, rounds=options.rounds)
        paper = times["the paper's"].processor
        print(f"\n{case}, {options.steps} steps: time over that of the paper's law")
        for name, found in times.items():
            ratios = [one / own for one, own in zip(found.processor, paper, strict=True)]
            print(f"  {name:22s} {spread(ratios, digits=2)}")
            if name == BOUNDED:
                ratio = statistics.median(ratios)
                check(ratio <= MOST_RATIO, f"{name} costs {ratio:.2f} times the paper's law")


def _simulate(case: Block, law: dict[str, Any], steps: int) -> Any:
    model = replace(case, study=apply_overrides(case.study, law)).model(steps=steps)
    return _core.simulate(model, case.worlds, case.keys, threads=1, precision="single")[0]


def _assemble(case: Blocks, law: dict[str, Any], steps: int) -> Any:
    study = apply_overrides(case.study, law)
    model = native_model(study, case.flow, np.zeros(1), Camera())
    found = replace(case, study=study, model=model).run(steps=steps, sample_every=steps)
    return found["sample_pose"]


def _check_paths(ways: dict[str, Any]) -> None:
    paper = np.asarray(ways["the paper's"]())
    for name, way in ways.items():
        same = np.array_equal(np.asarray(way()), paper, equal_nan=True)
        check(same == (name == "the paper's"), f"{name}: the paths are those of the paper's law")


if __name__ == "__main__":
    main()
