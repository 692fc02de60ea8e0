"""How often a calibration holds the truth where the block goes round slowly: synthetic.

On slow, regular orbits a recording visits few independent states, so two recordings of the same
parameters differ much, and by more the stronger the force. The worlds are drawn by a rule and never
chosen again: the regular flows of `studies/likelihood/worlds.py`, at 1, 0.6 and 0.4 times their
speed in turn, C_d uniform in 0.3 to 1 and sigma_F uniform in 0.1 to 0.35 mN. In each, driftwalk
simulates a recording of 10 minutes at 10 Hz with 0.3 mm and 0.5 degrees of noise, and calibrates it
as in `coverage.py`, from a first window of half to one and a half times the true values on. Flow
and window are right, so this is about the statistics. Results go to ``slow.jsonl``, one line a
recording; run again, it continues.

    python studies/coverage/slow.py --worlds 80 --bootstrap 60
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np
from coverage import answer_of, read, refined_map, write

import driftwalk as dw
from driftwalk.calibration.grid.energy_score import lowest_point
from driftwalk.calibration.problem import Problem, prepare_problem
from driftwalk.conditions import recorded_camera
from driftwalk.schema import body_track

sys.path.append(str(Path(__file__).resolve().parents[1] / "likelihood"))

from tracks import Camera, own_poses, see
from worlds import World, draw_flow

SEED = 70_000
SPEEDS = (1.0, 0.6, 0.4)
MINUTES = 10.0
RESULTS = Path(__file__).with_name("slow.jsonl")


def main() -> None:
    """Calibrate what is not in the results yet, then print the coverage."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--worlds", type=int, default=80)
    parser.add_argument("--bootstrap", type=int, default=60)
    parser.add_argument("--threads", type=int, default=None)
    wanted = parser.parse_args()
    done = {line["world"] for line in read(RESULTS)}
    for number in range(wanted.worlds):
        if number not in done:
            write(RESULTS, calibrated(number, wanted.bootstrap, wanted.threads))
    report()


def world_of(number: int) -> World:
    """Draw a world."""
    rng = np.random.default_rng([SEED, number])
    drag, force = float(rng.uniform(0.3, 1.0)), float(rng.uniform(0.1e-3, 0.35e-3))
    u, v = draw_flow(rng, "regular")
    speed = SPEEDS[number % len(SPEEDS)]
    return World(drag, force, speed * u, speed * v)


def problem_of(world: World, seed: int, threads: int | None) -> Problem:
    """Simulate a recording and make it ready for comparison."""
    poses = own_poses(world, duration=60.0 * MINUTES, seed=seed, time_step=0.01)
    track = body_track(see(poses, Camera(), seed=seed))
    study = dw.apply_overrides(dw.Study(), {"calibration.seed": 1000 + seed})
    camera = recorded_camera(track, study, position_quantum=0.0)
    return prepare_problem(track, study, world.flow(), camera=camera, threads=threads)


def calibrated(number: int, bootstrap: int, threads: int | None) -> dict[str, Any]:
    """Calibrate the recording of a world."""
    world = world_of(number)
    truth = world.drag_coefficient, world.force_std_N
    problem = problem_of(world, 100 * number, threads)
    found = refined_map(problem, truth)
    smoother = found.energy_score.smoother
    return {
        "world": number,
        "true_drag_coefficient": truth[0],
        "true_force_std_N": truth[1],
        # For comparison: nothing taken off the distance.
        "force_std_of_mean_N": lowest_point(
            smoother.axes, smoother.surface(found.map.mean.ravel())
        )[1],
        **answer_of(problem, found, truth, bootstrap),
    }


def report() -> None:
    """Print the coverage, and the estimates over the truth."""
    lines = read(RESULTS)
    for key in ("region_holds", "drag_coefficient_holds", "force_std_holds"):
        print(key, sum(line[key] for line in lines), "of", len(lines))
    for key, truth in (
        ("drag_coefficient", "true_drag_coefficient"),
        ("force_std_N", "true_force_std_N"),
        ("force_std_of_mean_N", "true_force_std_N"),
    ):
        ratio = np.array([line[key] / line[truth] for line in lines])
        print(f"{key} over the truth: mean {ratio.mean():.3f}, sd {ratio.std():.3f}")


if __name__ == "__main__":
    main()
