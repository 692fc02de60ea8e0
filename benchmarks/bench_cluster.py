"""What it costs to have units computed by other processes, and what many cores would make of it.

    python benchmarks/bench_cluster.py [--rounds 3] [--length 300] [--quick]

Workers are two processes of this machine (`--cluster local:2`), so that they are compared with two
threads on the same processors, rounds interleaved:

* processor time and bytes of a unit that does nothing, and how many are handed out in a second;
* bytes of a real unit, and of what travels once to each worker, by the counters of the kernel;
* self-assembly on two workers beside two threads, and what the cut into units costs two threads;
* on paper: the units of the paper's sensitivity study and of a calibration of six parameters, with
  their measured times, dealt to 1, 100 and 10,000 cores at the measured rate. A unit begins when a
  core is free and the scheduler has come to it. What a calibration does between its units is
  counted; the figures, which are drawn at the end of either, are not.

Checked, else the script fails: workers give the same bytes as threads; a unit takes no more bytes
than a hundredth of what travels once.
"""

from __future__ import annotations

import argparse
import heapq
import os
import socket
import statistics
import struct
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any, NamedTuple
from unittest import mock

import numpy as np
from timing import machine, spread

import driftwalk as dw
from driftwalk.assembly.runs.run import RUNS_TOGETHER
from driftwalk.sweep import WorkUnit, grid, run_sweep, settings_per_unit
from driftwalk.sweep.workers import packed

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

SKIPPED = 77
TELLING_UNITS = 20
CORES = (1, 100, 10_000)
BLOCKS, STEP_S, DURATION_S = 4, 0.01, 300.0
MAP_RUNS = 1000
COUNTERS = slice(120, 136)
"""Bytes sent and received, in the kernel's record of a TCP connection."""


class Work(NamedTuple):
    """A study as a scheduler sees it."""

    name: str
    stages: list[list[float]]
    """Core-seconds of the units of each stage; a stage begins when the last one has ended."""
    alone: float
    """Core-seconds that are in no unit."""


def nothing(unit: WorkUnit) -> dict[str, Any]:
    return {"nothing": np.zeros(unit.size)}


def processor_seconds(client: Any) -> float:
    """Return what this process and the workers have used."""
    return time.process_time() + sum(client.run(time.process_time).values())


def tcp_bytes() -> tuple[int, int]:
    """Return bytes sent and received on the open TCP connections of this process."""
    total = np.zeros(2, dtype=np.int64)
    for opened in Path("/proc/self/fd").iterdir():
        try:
            if not str(opened.readlink()).startswith("socket:"):
                continue
            with socket.socket(fileno=os.dup(int(opened.name))) as one:
                if one.family in (socket.AF_INET, socket.AF_INET6):
                    found = one.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, 192)
                    total += struct.unpack("<2Q", found[COUNTERS])
        except OSError:
            continue
    return int(total[0]), int(total[1])


def received(client: Any) -> dict[str, int]:
    """Return the bytes that have come to each worker."""
    return {name: both[1] for name, both in client.run(tcp_bytes).items()}


def handing_out(cluster: Any, count: int) -> float:
    """Print what an empty unit costs; return how many are handed out in a second."""
    client, units = cluster.executor.client, grid(unit=np.arange(count)).units(1)
    run_sweep(nothing, units[:50], executor=cluster.executor)
    used, sent, came = processor_seconds(client), tcp_bytes(), received(client)
    began = time.perf_counter()
    run_sweep(nothing, units, executor=cluster.executor)
    wall = time.perf_counter() - began
    used, after = processor_seconds(client) - used, tcp_bytes()
    arrived = sum(received(client).values()) - sum(came.values())
    print(f"\n{count} units that do nothing, two workers: {count / wall:.0f} a second")
    print(f"  processor time of a unit, here and there: {1e3 * used / count:.1f} ms")
    print(
        f"  bytes of a unit, by TCP: {(after[0] - sent[0]) / count:.0f} out of this process, "
        f"{(after[1] - sent[1]) / count:.0f} into it, {arrived / count:.0f} into the workers"
    )
    return count / wall


def assembled(runs: int, executor: Executor | None = None, **options: Any) -> Any:
    return dw.assembly.assemble(
        dw.Study(assembly={"runs": runs}), dw.tank30_flow(), executor=executor, **options
    )


def real_units(cluster: Any, runs: int) -> None:
    """Print the bytes of real units, beside those that travel once."""
    client = cluster.executor.client
    kept: list[int] = []
    send = cluster.executor.sent

    def sent(function: Any) -> Any:
        kept.append(len(packed(function).content))
        return send(function)

    size = settings_per_unit(runs, BLOCKS * DURATION_S / STEP_S, multiple=RUNS_TOGETHER)
    units = -(-runs // size)
    before = received(client)
    with mock.patch.object(cluster.executor, "sent", sent):
        assembled(runs, cluster.executor)
    first = {name: count - before[name] for name, count in received(client).items()}
    before = received(client)
    assembled(runs, cluster.executor)
    again = {name: count - before[name] for name, count in received(client).items()}
    each = sum(again.values()) / units
    once = statistics.mean(first[name] - again[name] for name in first)
    print(f"\n{runs} runs of assemble in {units} units, flow and starts of {kept[0]} bytes")
    print(f"  into the workers: {each:.0f} bytes a unit, and {once:.0f} once to each worker")
    # Of few units one worker may do all in the first round: the second then sends it to the other.
    if units >= TELLING_UNITS and each > 0.01 * kept[0] + 20_000:
        sys.exit("what is large travels with every unit")


def beside_threads(cluster: Any, runs: int, rounds: int) -> None:
    """Time two workers beside two threads, and the cut beside a single unit."""
    client = cluster.executor.client

    def threads() -> float:
        before = time.process_time()
        assembled(runs, threads=2)
        return time.process_time() - before

    def whole() -> float:
        with mock.patch("driftwalk.assembly.runs.run.runs_per_unit", return_value=runs):
            return threads()

    def workers() -> float:
        before = processor_seconds(client)
        assembled(runs, cluster.executor)
        return processor_seconds(client) - before

    bytes_of = [assembled(runs, threads=2), assembled(runs, cluster.executor)]
    names = [name for name in bytes_of[0].variables if bytes_of[0][name].dtype != object]
    if any(bytes_of[0][n].values.tobytes() != bytes_of[1][n].values.tobytes() for n in names):
        sys.exit("workers give other bytes than threads")
    ways: Mapping[str, Callable[[], float]] = {
        "two threads, one unit": whole, "two threads, as cut": threads, "two workers": workers,
    }  # fmt: skip
    used: dict[str, list[float]] = {name: [] for name in ways}
    wall: dict[str, list[float]] = {name: [] for name in ways}
    for _ in range(rounds):
        for name, way in ways.items():
            began = time.perf_counter()
            used[name].append(way())
            wall[name].append(time.perf_counter() - began)
    print(f"\n{runs} runs of assemble, the same bytes")
    print(f"{'way':<24} {'processor time [s]':>22} {'wall time [s]':>22} {'of two threads':>15}")
    best = min(used["two threads, as cut"])
    for name in ways:
        print(
            f"{name:<24} {spread(used[name], digits=2):>22} {spread(wall[name], digits=2):>22} "
            f"{best / min(used[name]):>14.0%}"
        )


def sensitivity_study(runs: int) -> Work:
    """The paper's study: 31 x 31 settings of 1000 runs, timed by fewer runs of each."""
    study = dw.Study()
    axes = [study.sensitivity.axes[name] for name in ("drag_coefficient", "force_std")]
    drag, force = (one.ravel() for one in np.meshgrid(*map(np.asarray, axes), indexing="ij"))
    before = time.process_time()
    found = dw.assembly.assemble(
        study,
        dw.tank30_flow(),
        runs=runs * drag.size,
        drag_coefficient=np.repeat(drag, runs),
        force_std=np.repeat(force, runs),
    )
    used = time.process_time() - before
    took = found["end_time"].values.reshape(drag.size, runs).mean(axis=1)
    cost = took / took.sum() * used * MAP_RUNS / runs
    size = settings_per_unit(drag.size, MAP_RUNS * BLOCKS * DURATION_S / STEP_S)
    units = [float(cost[at : at + size].sum()) for at in range(0, cost.size, size)]
    reference = [float(cost.mean())] * study.sensitivity.reference_realisations
    return Work(f"sensitivity, {size} settings a unit", [reference, units], alone=0.0)


class Traced(Executor):
    """Computes units at once, and notes how long they take."""

    def __init__(self) -> None:
        self.stages: list[list[float]] = []
        self._function: Any = None

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        if fn is not self._function:
            self._function = fn
            self.stages.append([])
        future: Future[Any] = Future()
        began = time.process_time()
        future.set_result(fn(*args, **kwargs))
        self.stages[-1].append(time.process_time() - began)
        return future


def six_parameters(length: float, *, quick: bool) -> Work:
    """The calibration of a self-propelled body with six parameters."""
    from self_propelled import moving

    truth = {
        "speed": 0.03, "speed_cv": 0.2, "run_time": 2.0, "turn_std": 1.0,
        "rotational_diffusion": 0.1, "turn_rate": 0.2,
    }  # fmt: skip
    model = dw.motion_model("run_tumble", clearance=0.015)
    recording = moving(model, truth, length, seed=2, noise=3e-4)
    few = {"bootstrap": 4} if quick else {}
    study = dw.Study(observation={"position_noise_m": 3e-4}, calibration=few)
    traced, before = Traced(), time.process_time()
    dw.calibration.calibrate(recording, model, study=study, executor=traced)
    units = sum(map(sum, traced.stages))
    alone = time.process_time() - before - units
    name = f"{len(truth)} parameters, {length:g} s recorded"
    return Work(name, traced.stages, alone)


def time_on(work: Work, cores: int, rate: float) -> float:
    """Return how long a study takes on so many cores, at so many units handed out a second."""
    now = work.alone
    for units in work.stages:
        free = [now] * min(cores, len(units))
        for number, seconds in enumerate(units):
            begin = max(heapq.heappop(free), now + number / rate)
            heapq.heappush(free, begin + seconds)
        now = max(free)
    return now


def halved(work: Work, parts: int) -> Work:
    """Return the study with every unit of its largest stage cut into parts."""
    stages = [[seconds / parts for seconds in units for _ in range(parts)] for units in work.stages]
    return Work(f"the same, units cut in {parts}", stages, work.alone)


def on_paper(works: Sequence[Work], rate: float) -> None:
    print(f"\nOn paper, {rate:.0f} units handed out a second")
    head = "".join(f"{f'{cores:,} cores':>22}" for cores in CORES)
    print(f"{'study':<38} {'units':>6} {'largest':>8} {'alone':>7}{head}")
    for work in works:
        first = time_on(work, 1, rate)
        cells = ""
        for cores in CORES:
            seconds = time_on(work, cores, rate)
            cells += f"{f'{seconds:.1f} s, {first / seconds:.0f} x':>22}"
        count = sum(map(len, work.stages))
        largest = max(max(units) for units in work.stages)
        print(f"{work.name:<38} {count:>6} {largest:>6.2f} s {work.alone:>5.1f} s{cells}")
    for cores in CORES[1:]:
        print(f"to keep {cores:,} cores busy a unit takes {cores / rate:.1f} s or more")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--length", type=float, default=300.0, help="of the recording [s]")
    parser.add_argument("--quick", action="store_true", help="little work, to try the script")
    options = parser.parse_args()
    try:
        import distributed  # noqa: F401
    except ImportError:
        print("driftwalk[cluster] is not installed")
        sys.exit(SKIPPED)
    from driftwalk.cluster import connect, parse_address

    print(machine())
    quick = options.quick
    with connect(parse_address("local:2")) as cluster:
        rate = handing_out(cluster, 200 if quick else 2000)
        real_units(cluster, 100 if quick else 2000)
        for runs in (100,) if quick else (1000, 8000):
            beside_threads(cluster, runs, 1 if quick else options.rounds)
    paper = sensitivity_study(1 if quick else 20)
    six = six_parameters(options.length, quick=quick)
    on_paper([paper, halved(paper, 3), six], rate)


if __name__ == "__main__":
    main()
