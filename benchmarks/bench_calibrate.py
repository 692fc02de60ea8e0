"""How long the whole calibration of the bundled recording takes, stage by stage, and its memory.

    python benchmarks/bench_calibrate.py [--quick] [--threads N]

The default study of `driftwalk demo`: 1,681 settings of 30 minutes, with four replicates where the
optimum could be, then the refined map, the bootstrap, and the validation on halves with the figures
at the same time. Nothing is stored on the way. One run. The plain baseline beside it is the same
map by the double reference, timed on a few worlds and extrapolated, marked "~".

Checked, else the script fails: the answer is within a tenth of the parameters with which the
recording was made. `--quick` tries the script: the small search of `driftwalk demo --quick`, on the
first five minutes.
"""

from __future__ import annotations

import argparse
import resource
import sys
import tempfile
import time
from typing import Any

import numpy as np
from timing import machine

from driftwalk import _core
from driftwalk.calibration import calibrate
from driftwalk.calibration.problem import prepare_problem
from driftwalk.cli.demo import demo_study
from driftwalk.conditions import recorded_camera
from driftwalk.core.processors import default_threads
from driftwalk.core.random_streams import world_keys
from driftwalk.datasets import tank30_flow, tank30_recording, tank30_truth
from driftwalk.figures import calibration_figures, write_figures
from driftwalk.motion import BlockModel
from driftwalk.schema import body_track
from driftwalk.schema.answers.facts import facts_of
from driftwalk.simulation.initial import world_table

TARGET_ALL_S = 30.0
TARGET_MEMORY_GB = 2.0
# How far the answer may be from the truth, as a share of it.
TOLERANCE = 0.1
BASELINE_WORLDS = 2
WORDS = {"coarse": "map", "refined": "refined map", "validation": "halves and figures"}


class Stages:
    """Wall and processor time of each stage, from what `calibrate` tells."""

    def __init__(self) -> None:
        self.times: dict[str, list[float]] = {}
        self._name = "setup"
        self._since = self._now()

    def tell(self, stage: str, done: int, total: int) -> None:  # noqa: ARG002
        if stage != self._name:
            self.begin(stage)

    def begin(self, stage: str) -> None:
        now = self._now()
        spent = self.times.setdefault(self._name, [0.0, 0.0])
        for k in range(2):
            spent[k] += now[k] - self._since[k]
        self._name, self._since = stage, now

    @staticmethod
    def _now() -> tuple[float, float]:
        return time.perf_counter(), time.process_time()


def peak_memory_gb() -> float:
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1e9 if sys.platform == "darwin" else 1e6 / 1.024)


def baseline_seconds(recording: Any, flow: Any, study: Any, threads: int, worlds: int) -> float:
    """Processor time of the coarse map's worlds by the double reference, from a few of them."""
    track = body_track(recording)
    quantum = float(recording.attrs.get("position_quantum_m", 0.0))
    camera = recorded_camera(track, study, position_quantum=quantum)
    problem = prepare_problem(track, study, flow, camera=camera, threads=threads)
    forces = study.forces
    keys = world_keys(study.calibration.seed, trial=0, replicate=np.arange(BASELINE_WORLDS))
    table = world_table(
        problem.like.start,
        keys,
        drag_coefficient=forces.drag_coefficient,
        force_std=forces.force_std_N,
    )
    model = BlockModel(study).native(problem.like)
    begin = time.process_time()
    _core.simulate(model, table, keys, threads=1, precision="double")
    return worlds * (time.process_time() - begin) / BASELINE_WORLDS


def check_answer(found: Any) -> None:
    truth = tank30_truth()
    for key in ("drag_coefficient", "force_std_N"):
        ratio = found[key] / truth[key]
        if not abs(ratio - 1) < TOLERANCE:
            sys.exit(f"wrong answer: {key} = {found[key]:.3g}, the truth is {truth[key]:.3g}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--threads", type=int, default=default_threads())
    options = parser.parse_args()
    print(f"{machine()}; {options.threads} threads, {_core.instruction_set()}")
    stages = Stages()
    recording, flow, study = tank30_recording(), tank30_flow(), demo_study(quick=options.quick)
    if options.quick:
        recording = recording.sel(time=slice(0, 300))
    with tempfile.TemporaryDirectory() as folder:
        found = calibrate(
            recording,
            study,
            flow=flow,
            threads=options.threads,
            tell=stages.tell,
            meanwhile=lambda early: write_figures(
                calibration_figures(early, recording, flow), folder
            ),
        )
    stages.begin("end")
    memory = peak_memory_gb()

    worlds = int(found["replicate_count"].sum())
    minutes = (float(recording["time"][-1]) - float(recording["time"][0])) / 60
    print(f"{found['replicate_count'].size} settings, {worlds} worlds of {minutes:.0f} min")
    plain = baseline_seconds(recording, flow, study, options.threads, worlds)
    print(f"\n{'stage':<20} {'wall [s]':>9} {'processor [s]':>14} {'target [s]':>11}")
    for name, (wall, processor) in stages.times.items():
        print(f"{WORDS.get(name, name):<20} {wall:>9.1f} {processor:>14.1f}")
    wall, processor = np.sum(list(stages.times.values()), axis=0)
    target = "" if options.quick else f"{TARGET_ALL_S:>11.0f}"
    print(f"{'all':<20} {wall:>9.1f} {processor:>14.1f} {target}")
    print(f"{'map, plain (double)':<20} {'':>9} {'~' + format(plain, '.0f'):>14}")
    print(f"peak memory {memory:.2f} GB (target {TARGET_MEMORY_GB:.0f} GB)")
    truth, facts = tank30_truth(), facts_of(found)
    for key in ("drag_coefficient", "force_std_N"):
        low, high = facts[f"{key}_interval"]
        print(
            f"{key} = {facts[key]:.3g}, 90 % interval {low:.3g} to {high:.3g}; "
            f"the truth is {truth[key]:.3g}"
        )
    check_answer(facts)


if __name__ == "__main__":
    main()
