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
from driftwalk.calibration.problem import Problem, limits_of, prepare_problem
from driftwalk.calibration.quality import quality_of_fit
from driftwalk.calibration.refine import Refined, refined
from driftwalk.calibration.region import (
    build_surface,
    confidence_region,
    region_contains,
    run_bootstrap,
    simulated_steps,
)
from driftwalk.calibration.search import full_map
from driftwalk.comparison import StepTable
from driftwalk.conditions import recorded_camera
from driftwalk.schema import body_track

TRUTHS = ((0.45, 0.55e-3), (0.80, 0.90e-3))
STEPS = (0.005, 3e-5)
REPLICATES = 4
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
    done = {(line["truth"], line["recording"]) for line in read(RESULTS)}
    missing = [k for k in range(wanted.recordings) if (index, k) not in done]
    if not missing:
        return
    # The truth lies between the nodes of the grid, as it would in life.
    window = tuple(
        np.round(value + step * (np.arange(-8, 9) + shift), 12)
        for value, step, shift in zip(truth, STEPS, (0.37, -0.29), strict=True)
    )
    settings = [axis.ravel() for axis in np.meshgrid(*window, indexing="ij")]
    shared = simulated_steps(problem, settings, stage="refined", replicates=REPLICATES)
    apart = np.array(
        [own_floor(problem, shared.rows(slice(k, k + REPLICATES))) for k in starts(shared)]
    )
    recordings = simulated_steps(
        problem,
        truth,
        stage="coverage",
        replicates=wanted.recordings,
        first=index,
    )
    limits = limits_of(problem)
    box = tuple((float(axis[0]), float(axis[-1])) for axis in window)
    shape = tuple(axis.size for axis in window)
    for k in missing:
        row = recordings.rows(slice(k, k + 1))
        steps = np.column_stack([row.length[0], row.angle[0]]).astype(np.float64)[: row.pairs[0]]
        matrix = problem.statistic.matrix(row, shared, threads=problem.like.threads)
        distance = matrix.reshape(*shape, REPLICATES)
        reference = replace(problem.reference, steps=np.ascontiguousarray(steps))
        search = problem.study.calibration.model_copy(update={"seed": 100 + 1000 * index + k})
        study = problem.study.model_copy(update={"calibration": search})
        own = replace(problem, reference=reference, study=study)
        found = refined(full_map(window, distance, {"apart": apart.reshape(shape)}), box, limits)
        line = answer_of(own, found, truth, wanted.bootstrap)
        write(RESULTS, {"truth": index, "recording": k, **line})


def starts(shared: StepTable) -> range:
    """Return the number of the first replicate of each setting."""
    return range(0, shared.pairs.size, REPLICATES)


def own_floor(problem: Problem, replicates: StepTable) -> float:
    """Return the mean distance between the replicates of a setting."""
    matrix = problem.statistic.matrix(replicates, replicates, threads=problem.like.threads)
    return float(matrix[np.triu_indices(len(matrix), 1)].mean())


def answer_of(
    problem: Problem, found: Refined, truth: tuple[float, float], bootstrap: int
) -> dict[str, Any]:
    """Return what a calibration says from its refined map, and what holds the truth."""
    landscape = found.landscape
    stored = build_surface(problem, found)
    simulated = run_bootstrap(
        problem,
        landscape.optimum,
        stored,
        floor=landscape.floor_at_optimum,
        count=bootstrap,
    )
    quality = quality_of_fit(simulated)
    region = confidence_region(
        landscape.smoother,
        landscape.surface,
        simulated,
        confidence=0.9,
        stretch=quality.stretch,
    )
    drag, force = region.intervals
    return {
        "drag_coefficient": landscape.optimum.point[0],
        "force_std_N": landscape.optimum.point[1],
        "region_holds": region_contains(landscape.smoother, landscape.surface, region, truth),
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
