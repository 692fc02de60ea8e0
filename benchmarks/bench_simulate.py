"""How many block-steps a second one core simulates, beside two plain ways.

    python benchmarks/bench_simulate.py [--rounds 9] [--steps 2000]

The case is the contact-heavy one of `cases.py`. Timed on one thread in one run, rounds interleaved:

* the batch kernel on every instruction set that this processor has;
* "double": the same source on one number at a time in double precision (`backend="reference"`);
* "numpy": the NumPy twin of the model, a part of the worlds for a part of the time.

Rates are per second of processor time, which other programs on the machine disturb less than the
wall clock; the wall clock's rate stands beside them. Checked, else the script fails: all
instruction sets give the same bits; single and double precision agree after 1 s; the NumPy twin
agrees with double precision.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import statistics
import sys
import time
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
from cases import STEP_S, STEPS, Case, contact_heavy, share_near_wall
from timing import Times, interleaved, machine, spread
from twin.block import simulate_reference

from driftwalk import _core

Floats = npt.NDArray[np.float64]

INSTRUCTION_SET = "DRIFTWALK_INSTRUCTION_SET"
TARGETS = {"avx512": 35e6, "avx2": 26e6, "baseline": 14e6}
TWIN_WORLDS = 16
SECOND = round(1 / STEP_S)  # in steps
# A path is some 3 cm in 1 s; rounding moves a block by a fraction of a micrometre, and a bounce
# that comes a little earlier or later by more.
MEDIAN_LIMIT_M = 0.5e-6
LARGEST_LIMIT_M = 5e-6
TWIN_LIMIT_M = 1e-9


def simulate_on(instruction_set: str, model: Any, case: Case) -> Any:
    """Run the batch kernel, all worlds, on a given instruction set."""
    os.environ[INSTRUCTION_SET] = instruction_set
    try:
        return _core.simulate(model, case.worlds, case.keys, threads=1, precision="single")
    finally:
        os.environ.pop(INSTRUCTION_SET)


def simulate_double(model: Any, case: Case) -> Any:
    return _core.simulate(model, case.worlds, case.keys, threads=1, precision="double")


def simulate_numpy(case: Case, *, worlds: int, steps: int) -> Floats:
    x, y, theta, vx, vy, omega, drag_coefficient, force_std = case.worlds[:worlds].T
    return simulate_reference(
        case.twin(),
        drag_coefficient=drag_coefficient,
        force_std=force_std,
        key=case.keys[:worlds],
        pose=np.stack([x, y, theta]),
        motion=np.stack([vx, vy, omega]),
        steps=steps,
    )


def fingerprint(answer: Any) -> str:
    digest = hashlib.sha256()
    for part in answer:
        digest.update(np.ascontiguousarray(part).tobytes())
    return digest.hexdigest()[:16]


def check(holds: bool, sentence: str) -> None:
    if not holds:
        sys.exit(f"wrong answer: {sentence}")


def check_answers(case: Case, sets: list[str], steps: int) -> None:
    """Same bits on every instruction set; single, double and the twin agree after 1 s."""
    model = case.model(steps=steps)
    prints = {name: fingerprint(simulate_on(name, model, case)) for name in sets}
    check(len(set(prints.values())) == 1, f"instruction sets differ: {prints}")
    print(f"same bits on {', '.join(sets)}: sha256 {prints[sets[0]]}")

    second = case.model(steps=SECOND)
    single, double = simulate_on(sets[-1], second, case), simulate_double(second, case)
    apart = np.hypot(single[0][:, -1] - double[0][:, -1], single[1][:, -1] - double[1][:, -1])
    middle, largest = float(np.median(apart)), float(apart.max())
    print(
        f"single - double after 1 s: median {1e6 * middle:.2f} um, largest {1e6 * largest:.2f} um"
    )
    check(middle < MEDIAN_LIMIT_M and largest < LARGEST_LIMIT_M, "single and double disagree")

    path = simulate_numpy(case, worlds=TWIN_WORLDS, steps=SECOND)
    apart = np.hypot(
        path[-1, 0] - double[0][:TWIN_WORLDS, -1], path[-1, 1] - double[1][:TWIN_WORLDS, -1]
    )
    print(f"numpy - double after 1 s: largest {1e6 * apart.max():.2g} um")
    check(float(apart.max()) < TWIN_LIMIT_M, "the NumPy twin and double precision disagree")


def row(name: str, times: Times, work: float, plain: float) -> str:
    rates = [rate / 1e6 for rate in times.rates(work)]
    middle = 1e6 * statistics.median(rates)
    target = f"{TARGETS[name] / 1e6:>7.0f}" if name in TARGETS else f"{'':>7}"
    digits = 1 if middle > 1e6 else 3
    wall = times.wall_rate(work) / 1e6
    return (
        f"{name:<10} {spread(rates, digits=digits):>22} {wall:>10.{digits}f} {target} "
        f"{middle / plain:>12.2g}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--steps", type=int, default=STEPS)
    options = parser.parse_args()
    sets = list(_core.available_instruction_sets())
    case = contact_heavy()
    print(machine())
    case.model(steps=1)  # the libraries are loaded on first use
    begin = time.perf_counter()
    model = case.model(steps=options.steps)
    print(f"setup (flow table, sampling plan): {1e3 * (time.perf_counter() - begin):.1f} ms")
    print(f"steps near the wall: {share_near_wall(case, steps=options.steps):.0%}")
    check_answers(case, sets, options.steps)

    work = len(case.worlds) * options.steps
    ways = {name: partial(simulate_on, name, model, case) for name in reversed(sets)}
    times = interleaved(
        {**ways, "double": partial(simulate_double, model, case)}, rounds=options.rounds
    )
    numpy_times = interleaved(
        {"numpy": lambda: simulate_numpy(case, worlds=len(case.worlds), steps=20)}, rounds=3
    )["numpy"]
    plain = statistics.median(times["double"].rates(work))
    print("\nMillions of block-steps a second on one core")
    print(
        f"{'way':<10} {'processor time':>22} {'wall time':>10} {'target':>7} {'times double':>12}"
    )
    for name, found in times.items():
        print(row(name, found, work, plain))
    print(row("numpy", numpy_times, len(case.worlds) * 20, plain))


if __name__ == "__main__":
    main()
