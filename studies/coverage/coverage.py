"""How often the 90 % region and intervals of a calibration hold the truth, on synthetic recordings.

Recordings are simulated by driftwalk itself at stated parameters, in the true flow of the bundled
recording, with its length, sampling and camera noise. Each is calibrated by the functions that
`driftwalk calibrate` runs from the refined map on; what the coarse map finds is the first window,
which is given here, from half to one and a half times the true values. Results go to
``coverage.jsonl``, one line a recording; run again, it continues. ``coverage_before.jsonl`` has
those of the search before 24 November 2026, which took nothing off the distance.

    python studies/coverage/coverage.py --recordings 26 --bootstrap 60
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np

import driftwalk as dw
from driftwalk.calibration.goodness_of_fit import goodness_of_fit, within_chance
from driftwalk.calibration.grid.bootstrap_region import (
    build_surface,
    confidence_region,
    region_contains,
    run_bootstrap,
)
from driftwalk.calibration.grid.grid_map import MapSimulator
from driftwalk.calibration.grid.grid_refinement import RefinedMap, locate_minimum, refine
from driftwalk.calibration.problem import Problem, limits_of, prepare_problem
from driftwalk.conditions import recorded_camera
from driftwalk.core.random_streams import world_keys
from driftwalk.schema import Track, body_track

TRUTHS = ((0.45, 0.55e-3), (0.80, 0.90e-3))
SEED = 60_000
RESULTS = Path(__file__).with_name("coverage.jsonl")


def main() -> None:
    """Calibrate what is not in the results yet, then print the coverage."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=int, default=26, help="per truth")
    parser.add_argument("--bootstrap", type=int, default=60)
    parser.add_argument("--threads", type=int, default=None)
    wanted = parser.parse_args()
    track = body_track(dw.tank30_recording())
    study = dw.Study()
    camera = recorded_camera(track, study, position_quantum=0.0)
    problem = prepare_problem(track, study, dw.tank30_flow(), camera=camera, threads=wanted.threads)
    done = {(line["truth"], line["recording"]) for line in read(RESULTS)}
    for k in range(wanted.recordings):
        for index, truth in enumerate(TRUTHS):
            if (index, k) in done:
                continue
            own = simulated_recording(problem, index, truth, k)
            line = answer_of(own, refined_map(own, truth), truth, wanted.bootstrap)
            write(RESULTS, {"truth": index, "recording": k, **line})
    report()


def simulated_recording(
    problem: Problem, index: int, truth: tuple[float, float], number: int
) -> Problem:
    """Simulate a recording at a truth and make it ready for comparison."""
    names = [one.name for one in problem.parameters]
    values = {name: np.array([value]) for name, value in zip(names, truth, strict=True)}
    keys = world_keys(SEED, trial=np.array([index]), replicate=number)
    seen = problem.model.simulate(values, problem.like, keys)
    track = Track(problem.like.sample_time, seen.x[0], seen.y[0], seen.theta[0])
    study = dw.apply_overrides(dw.Study(), {"calibration.seed": 100 + 1000 * index + number})
    camera = recorded_camera(track, study, position_quantum=0.0)
    threads = problem.like.threads
    return prepare_problem(track, study, dw.tank30_flow(), camera=camera, threads=threads)


def refined_map(problem: Problem, truth: tuple[float, float]) -> RefinedMap:
    """Return the refined map of a recording, from a window about the truth on."""
    limits = limits_of(problem)
    first = tuple((0.5 * value, 1.5 * value) for value in truth)
    maps = MapSimulator(problem, "refined")
    replicates = problem.study.calibration.refined_replicates
    return refine(
        maps, locate_minimum(maps, first, limits), limits, problem.refined_steps, replicates
    )


def answer_of(
    problem: Problem, found: RefinedMap, truth: tuple[float, float], bootstrap: int
) -> dict[str, Any]:
    """Return what a calibration says from its refined map, and what holds the truth."""
    energy_score = found.energy_score
    stored = build_surface(problem, found)
    simulated = run_bootstrap(problem, energy_score, stored, count=bootstrap)
    quality = goodness_of_fit(simulated)
    surface = within_chance(energy_score, simulated, quality.stretch)
    region = confidence_region(
        energy_score.smoother,
        surface,
        simulated,
        confidence=0.9,
        stretch=quality.stretch,
    )
    drag, force = region.intervals
    return {
        "drag_coefficient": energy_score.optimum.point[0],
        "force_std_N": energy_score.optimum.point[1],
        "region_holds": region_contains(energy_score.smoother, surface, region, truth),
        "drag_coefficient_holds": drag[0] <= truth[0] <= drag[1],
        "force_std_holds": force[0] <= truth[1] <= force[1],
        "drag_coefficient_interval": drag,
        "force_std_interval_N": force,
        "ks_distance": quality.distance,
        "noise_floor": quality.floor,
        "stretch": quality.stretch,
    }


def write(path: Path, line: dict[str, Any]) -> None:
    """Append a line to the results."""
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(line) + "\n")
    print(line, flush=True)


def read(path: Path) -> list[dict[str, Any]]:
    """Return the results so far."""
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def report() -> None:
    """Print the coverage for each truth and in all."""
    lines = read(RESULTS)
    for index in (*range(len(TRUTHS)), None):
        chosen = [line for line in lines if index is None or line["truth"] == index]
        shares = {
            key: np.mean([line[key] for line in chosen])
            for key in ("region_holds", "drag_coefficient_holds", "force_std_holds")
        }
        truth = "all" if index is None else TRUTHS[index]
        print(truth, len(chosen), {key: f"{share:.0%}" for key, share in shares.items()})


if __name__ == "__main__":
    main()
