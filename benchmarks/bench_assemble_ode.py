"""How many block-steps a second several blocks make, beside the Open Dynamics Engine (ODE).

    python benchmarks/bench_assemble_ode.py [--rounds 3] [--worlds 64] [--steps 2000]

The case is that of `assembly_case.py` with wall friction 0.2: 4 hard blocks that do not latch, with
contacts among them. The peer is `ode/ode_peer.cpp`: the blocks of a world are boxes in one world of
ODE, which collides them; the wall is a hand-written impulse ("ODE, impulse") or 64 boxes ("ODE,
boxes"). Worlds run one after another. All on one core, rounds interleaved, rates per second of
processor time.

Checked, else the script fails: mean step length at 10 Hz of each against driftwalk's.

Skipped with a reason where the headers of ODE (Debian: libode-dev) or a C++ compiler are missing.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from assembly_case import (
    BLOCKS,
    DRAG_COEFFICIENT,
    FORCE_STD_N,
    STEP_S,
    Case,
    Floats,
    Found,
    check,
    make_case,
)
from peer import WALLS, PeerMissing, build_peer, run_peer, write_case
from timing import Times, machine, spread

from driftwalk import _core

SKIPPED = 77
WALL_FRICTION = 0.2
STEPS_PER_SAMPLE = 10
TOLERANCE = 0.03


def step_length(path: Floats) -> float:
    """Mean step length at 10 Hz [m] of poses (world, sample, block, 3)."""
    step = np.diff(path[..., :2].astype(np.float64), axis=1)
    return float(np.hypot(step[..., 0], step[..., 1]).mean())


def peer_worlds(case: Case) -> Floats:
    """What the peer reads of every block: pose, rest, parameters; shape (worlds, blocks, 8)."""
    rest = np.zeros_like(case.start)
    shape = (*case.start.shape[:2], 1)
    parameters = [np.full(shape, value) for value in (DRAG_COEFFICIENT, FORCE_STD_N)]
    return np.concatenate([case.start, rest, *parameters], axis=-1)


@dataclass(frozen=True)
class Measured:
    """Times and mean step length [m] of each way; driftwalk is the first."""

    times: dict[str, Times]
    length: dict[str, float]
    met: float  # share of the worlds in which blocks met


def run_ours(case: Case, steps: int, times: Times) -> Found:
    wall, processor = time.perf_counter(), time.process_time()
    found = case.run(steps=steps, latching="none", sample_every=STEPS_PER_SAMPLE)
    times.processor.append(time.process_time() - processor)
    times.wall.append(time.perf_counter() - wall)
    return found


def measure(program: Path, case: Case, file: Path, *, steps: int, rounds: int) -> Measured:
    flow = {name: case.flow[name].values for name in "xuv"}
    write_case(
        file,
        case.study,
        axis=flow["x"],
        u=flow["u"],
        v=flow["v"],
        worlds=peer_worlds(case),
        steps_per_sample=STEPS_PER_SAMPLE,
    )
    ours = f"driftwalk, {_core.instruction_set()}"
    times = {name: Times() for name in (ours, *WALLS)}
    length = {}
    for _ in range(rounds):
        found = run_ours(case, steps, times[ours])
        length[ours] = step_length(found["sample_pose"])
        for name in WALLS:
            answer = run_peer(program, file, name, steps=steps)
            times[name].wall.append(answer["run_s"])
            times[name].processor.append(answer["processor_s"])
            length[name] = answer["mean_step_length_m"]
    return Measured(times, length, float((found["first_contact_step"] >= 0).mean()))


def print_table(measured: Measured, work: float) -> None:
    ours = next(iter(measured.times))
    fastest = statistics.median(measured.times[ours].rates(work))
    print("Millions of block-steps a second on one core")
    print(f"{'way':<20} {'processor time':>24} {'ours/way':>9} {'mean S [mm]':>12}")
    for name, times in measured.times.items():
        rates = [rate / 1e6 for rate in times.rates(work)]
        label = name if name == ours else f"ODE, {name}"
        ratio = fastest / statistics.median(times.rates(work))
        shown = f"{ratio:>9.1f} {1e3 * measured.length[name]:>12.4f}"
        print(f"{label:<20} {spread(rates, digits=3):>24} {shown}")
    for name in WALLS:
        difference = measured.length[name] / measured.length[ours] - 1
        check(
            abs(difference) < TOLERANCE,
            f"mean step length of ODE, {name} is {difference:+.1%} off ours",
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--worlds", type=int, default=64)
    parser.add_argument("--steps", type=int, default=2000)
    options = parser.parse_args()
    print(machine())
    with tempfile.TemporaryDirectory() as folder:
        try:
            program = build_peer(Path(folder))
        except PeerMissing as reason:
            print(f"skipped: {reason}")
            sys.exit(SKIPPED)
        case = make_case(BLOCKS, worlds=options.worlds, wall_friction=WALL_FRICTION)
        file = Path(folder) / "case.txt"
        measured = measure(program, case, file, steps=options.steps, rounds=options.rounds)
    print(
        f"\n{options.worlds} worlds of {BLOCKS} hard blocks, {options.steps * STEP_S:g} s; blocks "
        f"meet in {measured.met:.0%} of them"
    )
    print_table(measured, options.worlds * BLOCKS * options.steps)


if __name__ == "__main__":
    main()
