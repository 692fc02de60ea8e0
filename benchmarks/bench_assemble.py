"""How many block-steps a second one core makes of self-assembly, and how that scales.

    python benchmarks/bench_assemble.py [--rounds 5] [--runs 256] [--plot FILE.png] [--quick]

The case is that of `assembly_case.py`, 4 blocks, latching upon collision, 300 s or until all blocks
are one. In one run, rounds interleaved:

* the batch kernel on every instruction set that this processor has, and the same source in double
  precision (`backend="reference"`); rates count the steps that were simulated, on one thread;
* 1 to 2000 blocks of equal room, for 60 s, with latching and without;
* the reference distribution, 10 x 1000 runs, on all cores.

Rates are per second of processor time. Checked, else the script fails: all instruction sets give
the same bits; a run gives the same bits alone; single and double precision agree after 1 s and in
their outcomes.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import statistics
import time
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from assembly_case import (
    BLOCKS,
    DRAG_COEFFICIENT,
    FORCE_STD_N,
    STEP_S,
    Case,
    Found,
    check,
    make_case,
)
from timing import interleaved, machine, spread

import driftwalk as dw
from driftwalk import _core

RUN_STEPS = 30_000
SECOND = round(1 / STEP_S)  # in steps
SCALES = (1, 2, 4, 8, 16, 32, 64, 128, 256, 500, 1000, 2000)
SCALE_STEPS = 6000
SCALE_BLOCKS = 2048
REALISATIONS = 10
REFERENCE_RUNS = 1000
# Single and double precision, one second from rest, blocks that have not met.
MEDIAN_LIMIT_M = 0.5e-6


def fingerprint(found: Found) -> str:
    digest = hashlib.sha256()
    for name, values in sorted(found.items()):
        digest.update(name.encode() + np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()[:16]


def distribution(case: Case, found: Found) -> Any:
    """The outcomes of all runs, from what the native core returned."""
    events = dw.assembly.replay_events(
        *(found[f"event_{name}"] for name in ("count", "block", "face")),
        **{name: found[name] for name in ("cell", "quarter", "assembly")},
        chirality=case.study.assembly.chirality,
    )
    names, counts = np.unique(np.array(events.classes)[events.outcome], return_counts=True)
    return dw.outcome_distribution(dict(zip(names.tolist(), counts.tolist(), strict=True)))


def check_answers(case: Case, sets: list[str], steps: int) -> None:
    """Same bits on every instruction set and alone; single and double precision agree."""
    found = {name: case.run(steps=steps, instruction_set=name) for name in sets}
    prints = {name: fingerprint(answer) for name, answer in found.items()}
    check(len(set(prints.values())) == 1, f"instruction sets differ: {prints}")
    print(f"same bits on {', '.join(sets)}: sha256 {prints[sets[0]]}")
    alone = case.run(steps=steps, rows=slice(7, 8))
    same = all(
        np.array_equal(alone[name], values[7:8])
        for name, values in found[sets[0]].items()
        if isinstance(values, np.ndarray)
    )
    check(same, "a run gives other bits alone")

    single, double = (case.run(steps=SECOND, precision=way) for way in ("single", "double"))
    clear = (single["first_contact_step"] < 0) & (double["first_contact_step"] < 0)
    apart = np.hypot(*np.moveaxis(single["pose"] - double["pose"], -1, 0)[:2])[clear]
    middle = float(np.median(apart))
    print(f"single - double after 1 s, blocks that have not met: median {1e6 * middle:.2f} um")
    check(middle < MEDIAN_LIMIT_M, "single and double precision disagree")
    ends = [
        distribution(case, answer)
        for answer in (found[sets[0]], case.run(steps=steps, precision="double"))
    ]
    distance = dw.l1_distance(*ends)
    runs = case.keys.size
    floor = dw.l1_noise_floor(ends[0], runs, runs, quantile=0.999)
    print(
        f"outcomes, single - double: l1 distance {distance:.3f}; independent runs "
        f"{floor.mean:.3f} (99.9 %: {floor.quantile:.3f})"
    )
    check(distance < floor.quantile, "outcomes in single and double precision disagree")


def print_rates(case: Case, sets: list[str], *, steps: int, rounds: int) -> None:
    work = int(case.run(steps=steps)["block_steps"])
    full = case.keys.size * BLOCKS * steps
    print(f"\n{case.keys.size} runs; {work / full:.0%} of the steps, the others are over earlier")
    ways = {name: partial(case.run, steps=steps, instruction_set=name) for name in reversed(sets)}
    double = partial(case.run, steps=steps, precision="double")
    times = interleaved({**ways, "double": double}, rounds=rounds)
    plain = statistics.median(times["double"].rates(work))
    print("Millions of block-steps a second on one core")
    print(f"{'way':<10} {'processor time':>22} {'wall time':>10} {'times double':>13}")
    for name, found in times.items():
        rates = [rate / 1e6 for rate in found.rates(work)]
        ratio = 1e6 * statistics.median(rates) / plain
        print(
            f"{name:<10} {spread(rates, digits=2):>22} {found.wall_rate(work) / 1e6:>10.2f} "
            f"{ratio:>13.2g}"
        )


def print_scaling(*, steps: int, rounds: int, plot: Path | None) -> None:
    """Rates over the number of blocks, with latching and without."""
    cases = {blocks: make_case(blocks, worlds=SCALE_BLOCKS // blocks) for blocks in SCALES}
    latchings = ("collision", "none")
    work = {
        (blocks, latching): int(case.run(steps=steps, latching=latching)["block_steps"])
        for blocks, case in cases.items()
        for latching in latchings
    }
    times = interleaved(
        {
            f"{blocks} {latching}": partial(cases[blocks].run, steps=steps, latching=latching)
            for blocks, latching in work
        },
        rounds=rounds,
    )
    rates = {
        key: [rate / 1e6 for rate in times[f"{key[0]} {key[1]}"].rates(done)]
        for key, done in work.items()
    }
    print(f"\n{steps * STEP_S:g} s, {SCALE_BLOCKS} blocks in all")
    print("Millions of block-steps a second on one core")
    print(f"{'blocks':>6} {'tank [m]':>9} {'latching':>22} {'hard blocks':>22}")
    for blocks, case in cases.items():
        cells = " ".join(f"{spread(rates[blocks, way], digits=2):>22}" for way in latchings)
        print(f"{blocks:>6} {case.study.tank.diameter_m:>9.2f} {cells}")
    if plot is not None:
        draw_scaling(plot, {way: [rates[k, way] for k in SCALES] for way in latchings})


def draw_scaling(file: Path, rates: dict[str, list[list[float]]]) -> None:
    from driftwalk.plot.parts.style import BLUE, ORANGE, new_figure, print_style

    labels = {"collision": "latching upon collision", "none": "hard blocks"}
    with print_style():
        figure = new_figure(width_mm=90.0, height_mm=65.0)
        ax = figure.add_subplot()
        for (way, found), color in zip(rates.items(), (BLUE, ORANGE), strict=True):
            middle = [statistics.median(values) for values in found]
            reach = [
                [m - min(v) for m, v in zip(middle, found, strict=True)],
                [max(v) - m for m, v in zip(middle, found, strict=True)],
            ]
            ax.errorbar(SCALES, middle, reach, fmt="o-", ms=3.0, color=color, label=labels[way])
        ax.set_xscale("log", base=2)
        ax.set_xticks(SCALES, [str(blocks) for blocks in SCALES])
        ax.set_ylim(bottom=0.0)
        ax.set(xlabel="blocks in the tank", ylabel="million block-steps a second")
        ax.spines[["top", "right"]].set_visible(False)
        ax.set_title("bars: least and most of the rounds", loc="left")
        ax.legend()
        figure.savefig(file, dpi=160, metadata={"Software": None})
    print(f"wrote {file}")


def print_reference(realisations: int, runs: int) -> None:
    """Time the reference distribution as a user gets it."""
    study, flow = make_case(BLOCKS, worlds=1).study, dw.tank30_flow()
    wall, processor = time.perf_counter(), time.process_time()
    found = [
        dw.outcome_distribution(
            dw.assembly.assemble(
                study,
                flow,
                runs=runs,
                trial=trial,
                drag_coefficient=DRAG_COEFFICIENT,
                force_std=FORCE_STD_N,
            )
        )
        for trial in range(realisations)
    ]
    wall, processor = time.perf_counter() - wall, time.process_time() - processor
    print(
        f"\n{realisations} x {runs} runs of {study.assembly.duration_s:g} s on "
        f"{os.cpu_count()} cores: {wall:.1f} s, {processor:.1f} s of processor time"
    )
    print(f"mean l1 distance of two realisations {dw.assembly.pairwise_l1(found).mean:.3f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--runs", type=int, default=256)
    parser.add_argument("--plot", type=Path, help="write the figure of the scaling")
    parser.add_argument("--quick", action="store_true", help="short runs, to try the script")
    options = parser.parse_args()
    less = 30 if options.quick else 1
    steps = RUN_STEPS // less
    sets = list(_core.available_instruction_sets())
    print(machine())
    begin = time.perf_counter()
    case = make_case(BLOCKS, worlds=options.runs)
    print(f"setup (flow table, starts): {time.perf_counter() - begin:.2f} s")
    check_answers(case, sets, steps)
    print_rates(case, sets, steps=steps, rounds=options.rounds)
    print_scaling(steps=SCALE_STEPS // less, rounds=1 if options.quick else 3, plot=options.plot)
    print_reference(2 if options.quick else REALISATIONS, REFERENCE_RUNS // less)


if __name__ == "__main__":
    main()
