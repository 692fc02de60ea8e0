"""How often the 90 % region and intervals of a calibration hold the truth, on synthetic recordings.

Recordings are simulated by driftwalk itself at stated parameters, in the true flow of the bundled
recording, with its length, sampling and camera noise. Each is calibrated by the functions that
`driftwalk calibrate` runs from the refined map on (the coarse map only finds the window), with the
simulated steps of the refined map shared by the recordings of one truth. Results go to
``coverage.jsonl``, one line a recording; run again, it continues.

    python studies/coverage/coverage.py --recordings 26 --bootstrap 60
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import driftwalk as dw
from driftwalk.calibration.problem import prepare_problem
from driftwalk.calibration.quality import noise_floor_at, quality_of_fit
from driftwalk.calibration.region import (
    build_surface,
    confidence_region,
    region_contains,
    run_bootstrap,
    simulated_steps,
)
from driftwalk.calibration.search import Map, window_smoother
from driftwalk.conditions import recorded_camera
from driftwalk.schema import body_track

TRUTHS = ((0.45, 0.55e-3), (0.80, 0.90e-3))
STEPS = (0.01, 2e-5)
REPLICATES = 8
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
    for index, truth in enumerate(TRUTHS):
        calibrate_truth(problem, index, truth, wanted)
    report()


def calibrate_truth(problem: Any, index: int, truth: tuple[float, float], wanted: Any) -> None:
    """Calibrate recordings of one truth, appending a line for each."""
    done = {(line["truth"], line["recording"]) for line in read()}
    missing = [k for k in range(wanted.recordings) if (index, k) not in done]
    if not missing:
        return
    # The truth lies between the nodes of the grid, as it would in life.
    window = (
        np.round(truth[0] + STEPS[0] * (np.arange(-10, 11) + 0.37), 12),
        np.round(truth[1] + STEPS[1] * (np.arange(-10, 11) - 0.29), 12),
    )
    settings = [axis.ravel() for axis in np.meshgrid(*window, indexing="ij")]
    shared = simulated_steps(problem, settings, stage="refined", replicates=REPLICATES)
    recordings = simulated_steps(
        problem,
        truth,
        stage="coverage",
        replicates=wanted.recordings,
        first=index,
    )
    for k in missing:
        row = recordings.rows(slice(k, k + 1))
        steps = np.column_stack([row.length[0], row.angle[0]]).astype(np.float64)[: row.pairs[0]]
        matrix = problem.statistic.matrix(row, shared, threads=problem.like.threads)
        distance = matrix.reshape(*(axis.size for axis in window), REPLICATES)
        reference = replace(problem.reference, steps=np.ascontiguousarray(steps))
        own = replace(problem, reference=reference)
        line = calibrate_one(own, Map(window, distance, {}), truth, 1000 * index + k, wanted)
        with RESULTS.open("a") as file:
            file.write(json.dumps({"truth": index, "recording": k, **line}) + "\n")
        print(index, k, line, flush=True)


def calibrate_one(
    problem: Any, refined: Map, truth: tuple[float, float], seed: int, wanted: Any
) -> dict[str, Any]:
    """Calibrate one recording and say what holds the truth."""
    search = problem.study.calibration.model_copy(update={"seed": 100 + seed})
    problem = replace(problem, study=problem.study.model_copy(update={"calibration": search}))
    smoother = window_smoother(refined.axes, STEPS)
    optimum = smoother.optimum(refined.mean)
    surface = smoother.surface(refined.mean.ravel())
    floor = noise_floor_at(problem, optimum.point)
    stored = build_surface(problem, refined, optimum, margin=floor)
    bootstrap = run_bootstrap(problem, optimum, stored, count=wanted.bootstrap)
    quality = quality_of_fit(bootstrap)
    region = confidence_region(
        smoother, surface, bootstrap, confidence=0.9, stretch=quality.stretch
    )
    drag, force = region.intervals
    return {
        "drag_coefficient": optimum.point[0],
        "force_std_N": optimum.point[1],
        "region_holds": region_contains(smoother, surface, region, truth),
        "drag_coefficient_holds": drag[0] <= truth[0] <= drag[1],
        "force_std_holds": force[0] <= truth[1] <= force[1],
        "drag_coefficient_extent": drag[1] - drag[0],
        "force_std_extent_N": force[1] - force[0],
        "ks_distance": quality.distance,
        "noise_floor": quality.floor,
        "stretch": quality.stretch,
    }


def read() -> list[dict[str, Any]]:
    """Return the results so far."""
    if not RESULTS.exists():
        return []
    return [json.loads(line) for line in RESULTS.read_text().splitlines()]


def report() -> None:
    """Print the coverage for each truth and in all."""
    lines = read()
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
