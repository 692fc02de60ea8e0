"""How long a live tank takes for a frame, and a world of a batch of tanks for 300 s.

    python benchmarks/bench_live.py [--seconds 60] [--worlds 384]

1 to 64 blocks of equal room, the case of `assembly_case.py`, advanced by 1/30 s and read, on one
thread. Then worlds of 4 blocks for 300 s in a batch, with a change among 12 modes of the flow and
the force every 5 s, by the class of each world, against one live tank after another: processor time
on one thread, and time by the clock on all processors. Checked, else the script fails: the blocks
end where the batch kernel in double precision puts them, 64 blocks take less than 5 ms in the
median, the batch in double precision ends where a live tank with the same changes does and is 5
times as fast as live tanks on one thread, and the one in single precision 10 times.
"""

from __future__ import annotations

import argparse
import gc
import time
from typing import Any

import numpy as np
from assembly_case import DRAG_COEFFICIENT, FORCE_STD_N, check, make_case
from timing import interleaved, machine

import driftwalk as dw

SCALES = (1, 4, 16, 64)
LATCHINGS = ("collision", "connector", "none")
FRAME_S = 1 / 30
LIMIT_S = 5e-3
PERIOD_S, PERIODS = 5.0, 60
ON_ALL = "on all processors, by the clock"
FLOW_SCALES, FORCES_N = (0.5, 1.0, 1.5), (0.2e-3, 0.55e-3, 0.9e-3, 1.2e-3)


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


def modes(outcome: list[str], period: int) -> tuple[list[float], list[float]]:
    """Return a factor on the flow and a force for each world, by its class and the time."""
    mode = [(len(name) + period) % 12 for name in outcome]
    return [FLOW_SCALES[k % 3] for k in mode], [FORCES_N[k // 3] for k in mode]


def run_batch(batch: dw.TankBatch) -> dw.TankBatch:
    for period in range(PERIODS):
        scale, force = modes(batch.outcome.tolist(), period)
        batch.set(flow_scale=scale, force_std=force)
        batch.advance(PERIOD_S)
    return batch


def run_live(tank: dw.LiveTank) -> dw.LiveTank:
    for period in range(PERIODS):
        scale, force = modes([tank.outcome], period)
        tank.set(flow_scale=scale[0], force_std=force[0])
        tank.advance(PERIOD_S)
    return tank


def time_batches(worlds: int) -> None:
    case = make_case(4, worlds=1)
    forces = {"forces.drag_coefficient": DRAG_COEFFICIENT, "forces.force_std_N": FORCE_STD_N}
    study = dw.apply_overrides(case.study, forces)

    def batch(count: int, workers: int | None = 1, **options: Any) -> dw.TankBatch:
        return run_batch(dw.TankBatch(study, case.flow, worlds=count, workers=workers, **options))

    def live() -> dw.LiveTank:
        return run_live(dw.LiveTank(study, case.flow))

    tank, reference = live(), batch(8, backend="reference")
    same = np.array_equal(reference.state()["pose"][0, :, 0], tank.x)
    check(same and tank.outcome == reference.outcome[0], "a batch does not end as a live tank does")
    ways = {
        "live tank": live,
        "batch, double precision": lambda: batch(worlds, backend="reference"),
        ON_ALL: lambda: batch(worlds, None, backend="reference"),
        "the same, complete worlds rest": lambda: batch(
            worlds, backend="reference", complete="rests"
        ),
        "batch": lambda: batch(worlds),
        "batch, complete worlds rest": lambda: batch(worlds, complete="rests"),
    }
    counts = {name: 1 if name == "live tank" else worlds for name in ways}
    times = interleaved(ways, rounds=5)
    print(f"Processor time of a world of {PERIODS * PERIOD_S:g} s, a decision every {PERIOD_S:g} s")
    taken = {name: np.array(times[name].processor) / count for name, count in counts.items()}
    clock = {name: np.array(times[name].wall) / count for name, count in counts.items()}
    taken[ON_ALL] = clock[ON_ALL]
    for name, seconds in taken.items():
        ratio = ratio_of(clock if name == ON_ALL else taken, name)
        least, middle = 1e3 * seconds.min(), 1e3 * np.median(seconds)
        print(f"{name:>30} {middle:>7.2f} ms, {least:>6.2f} ms at least {ratio:>6.1f} x")
    for name, least in (("batch", 10), ("batch, double precision", 5)):
        check(ratio_of(taken, name) >= least, f"{name} is not {least} times as fast as live tanks")


def ratio_of(taken: dict[str, Any], name: str) -> float:
    """Return how many times faster than live tanks a way is, the median of the rounds."""
    return float(np.median(taken["live tank"] / taken[name]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=60.0, help="simulated, of each case")
    parser.add_argument("--worlds", type=int, default=384, help="of the batch")
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
    time_batches(options.worlds)


if __name__ == "__main__":
    main()
