"""How long a live tank takes for a frame, and how much faster than the world it is.

    python benchmarks/bench_live.py [--seconds 60]

1 to 64 blocks of equal room, the case of `assembly_case.py`, advanced by 1/30 s and read, on one
thread. Checked, else the script fails: the blocks end where the batch kernel in double precision
puts them, and 64 blocks take less than 5 ms in the median.
"""

from __future__ import annotations

import argparse
import gc
import time

import numpy as np
from assembly_case import DRAG_COEFFICIENT, FORCE_STD_N, check, make_case
from timing import machine

import driftwalk as dw

SCALES = (1, 4, 16, 64)
LATCHINGS = ("collision", "connector", "none")
FRAME_S = 1 / 30
LIMIT_S = 5e-3


def frames(blocks: int, latching: str, *, count: int) -> list[float]:
    """Return the processor time of each frame [s]."""
    case = make_case(blocks, worlds=1)
    forces = {"forces.drag_coefficient": DRAG_COEFFICIENT, "forces.force_std_N": FORCE_STD_N}
    study = dw.apply_overrides(case.study, forces | {"assembly.latching": latching})
    tank = dw.LiveTank(study, case.flow)
    path = dw.assembly_path(
        study,
        case.flow,
        duration=count * FRAME_S,
        sample_interval=count * FRAME_S,
        backend="reference",
    )
    # Python's own full collections take longer than a frame; the tank leaves nothing to collect.
    gc.collect()
    gc.disable()
    times = []
    for _ in range(count):
        begin = time.process_time()
        tank.advance(FRAME_S)
        state = (tank.x, tank.y, tank.theta, tank.assembly, tank.outcome)
        times.append(time.process_time() - begin)
    gc.enable()
    ends = (path[name].values[0, -1] for name in ("x", "y", "theta"))
    same = all(np.array_equal(a.astype(np.float32), b) for a, b in zip(state, ends, strict=False))
    check(same, f"{blocks} blocks do not end where `assembly_path` puts them")
    return times


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=60.0, help="simulated, of each case")
    options = parser.parse_args()
    count = max(round(options.seconds), 1) * round(1 / FRAME_S)
    print(machine())
    print("Processor time of 1/30 s, and how many times faster than the clock")
    print(f"{'blocks':>6} {'latching':>10} {'median':>10} {'99 %':>10} {'longest':>10} {'x':>7}")
    for blocks in SCALES:
        for latching in LATCHINGS:
            times = np.array(frames(blocks, latching, count=count))
            middle, most = np.median(times), np.quantile(times, 0.99)
            columns = " ".join(f"{1e3 * t:>7.3f} ms" for t in (middle, most, times.max()))
            print(f"{blocks:>6} {latching:>10} {columns} {FRAME_S / times.mean():>7.0f}")
            check(middle < LIMIT_S, f"a frame of {blocks} blocks takes {1e3 * middle:.1f} ms")


if __name__ == "__main__":
    main()
