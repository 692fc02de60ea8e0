"""How many block-steps a second driftwalk makes, beside the Open Dynamics Engine (ODE).

    python benchmarks/bench_ode.py [--rounds 5] [--worlds 128]

The peer is `ode/ode_peer.cpp`: the same block, strips, flow, noise and time step on ODE, one world
after another, as a simulator built on a physics engine does it. Its wall is a hand-written impulse
("ODE, impulse": ODE only integrates) or 64 boxes that ODE collides with ("ODE, boxes"). The case is
the contact-heavy one of `cases.py`; all on one core, rounds interleaved, rates per second of
processor time.

Checked, else the script fails: mean step length at 10 Hz of each against driftwalk's. Random
numbers, integrator and contact model differ, so they agree to per cents, not to bits.

Skipped with a reason where the headers of ODE (Debian: libode-dev) or a C++ compiler are missing.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from cases import SAMPLE_RATE_HZ, STEP_S, STEPS, Case, contact_heavy
from peer import WALLS, PeerMissing, build_peer, run_peer, write_case
from timing import Times, machine, spread

from driftwalk import _core

SKIPPED = 77
TOLERANCE = {"impulse": 0.02, "boxes": 0.03}


def run_ours(model: _core.Model, case: Case) -> tuple[float, float, float]:
    """Wall time, processor time [s] and mean step length [m]."""
    wall, processor = time.perf_counter(), time.process_time()
    x, y, _, _ = _core.simulate(model, case.worlds, case.keys, threads=1, precision="single")
    processor, wall = time.process_time() - processor, time.perf_counter() - wall
    return wall, processor, float(np.hypot(np.diff(x), np.diff(y)).mean())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--worlds", type=int, default=128)
    options = parser.parse_args()
    print(machine())
    with tempfile.TemporaryDirectory() as folder:
        try:
            program = build_peer(Path(folder))
        except PeerMissing as reason:
            print(f"skipped: {reason}")
            sys.exit(SKIPPED)
        begin = time.perf_counter()
        case = contact_heavy(worlds=options.worlds)
        model = case.model()
        path = Path(folder) / "case.txt"
        write_case(
            path,
            case.study,
            axis=case.axis,
            u=case.u,
            v=case.v,
            worlds=case.worlds[:, None],
            steps_per_sample=round(1 / (SAMPLE_RATE_HZ * STEP_S)),
        )
        print(f"setup: {time.perf_counter() - begin:.2f} s")
        ours = f"driftwalk, {_core.instruction_set()}"
        times = {name: Times() for name in (ours, *WALLS)}
        length = {}
        for _ in range(options.rounds):
            wall, processor, length[ours] = run_ours(model, case)
            times[ours].wall.append(wall)
            times[ours].processor.append(processor)
            for name in WALLS:
                answer = run_peer(program, path, name, steps=STEPS)
                times[name].wall.append(answer["run_s"])
                times[name].processor.append(answer["processor_s"])
                length[name] = answer["mean_step_length_m"]
    work = options.worlds * STEPS
    fastest = statistics.median(times[ours].rates(work))
    print("\nMillions of block-steps a second on one core")
    print(
        f"{'way':<20} {'processor time':>24} {'wall time':>10} {'ours/way':>9} {'mean S [mm]':>12}"
    )
    for name, found in times.items():
        rates = [rate / 1e6 for rate in found.rates(work)]
        label = name if name == ours else f"ODE, {name}"
        ratio = fastest / statistics.median(found.rates(work))
        print(
            f"{label:<20} {spread(rates, digits=3):>24} {found.wall_rate(work) / 1e6:>10.3f} "
            f"{ratio:>9.1f} {1e3 * length[name]:>12.4f}"
        )
    for name, tolerance in TOLERANCE.items():
        difference = length[name] / length[ours] - 1
        if abs(difference) > tolerance:
            sys.exit(f"wrong answer: mean step length of ODE, {name} is {difference:+.1%} off ours")


if __name__ == "__main__":
    main()
