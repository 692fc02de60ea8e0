"""How often a calibration holds the truth where the block goes round slowly: synthetic.

On slow, regular orbits a recording visits few independent states, so two recordings of the same
parameters differ much, and by more the stronger the force. Every recording has a world of its own,
drawn by a rule and never chosen again: the regular flows of `studies/likelihood/worlds.py`, at 1,
0.6 and 0.4 times their speed in turn, C_d uniform in 0.3 to 1 and sigma_F uniform in 0.1 to
0.35 mN. driftwalk simulates a recording of 15 minutes at 10 Hz with 0.3 mm and 0.5 degrees of
noise, and calibrates it from the coarse map on, in the true flow. Results go to ``slow.jsonl``, one
line a recording; run again, it continues.

    python studies/coverage/slow.py --recordings 40 --bootstrap 60
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np
from coverage import answer_of, read, write

import driftwalk as dw
from driftwalk.calibration.maps import Mapper
from driftwalk.calibration.problem import Problem, limits_of, prepare_problem
from driftwalk.calibration.quality import noise_floor_at
from driftwalk.calibration.refine import first_window, locate, refine
from driftwalk.conditions import recorded_camera
from driftwalk.schema import body_track

sys.path.append(str(Path(__file__).resolve().parents[1] / "likelihood"))

from tracks import Camera, own_poses, see, wall_share
from worlds import World, draw_flow

SEED = 70_000
SPEEDS = (1.0, 0.6, 0.4)
MINUTES = 15.0
GRID = {
    "calibration.drag_coefficient_min": 0.1,
    "calibration.drag_coefficient_max": 1.3,
    "calibration.force_std_max_N": 0.6e-3,
}
RESULTS = Path(__file__).with_name("slow.jsonl")


def main() -> None:
    """Calibrate what is not in the results yet, then print the coverage."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=int, default=40)
    parser.add_argument("--bootstrap", type=int, default=60)
    parser.add_argument("--threads", type=int, default=None)
    wanted = parser.parse_args()
    done = {line["world"] for line in read(RESULTS)}
    for number in range(wanted.recordings):
        if number not in done:
            write(RESULTS, {"world": number, **calibrate_world(number, wanted)})
    report()


def world_of(number: int) -> World:
    """Draw the world of a recording."""
    rng = np.random.default_rng([SEED, number])
    drag, force = float(rng.uniform(0.3, 1.0)), float(rng.uniform(0.1e-3, 0.35e-3))
    u, v = draw_flow(rng, "regular")
    speed = SPEEDS[number % len(SPEEDS)]
    return World(drag, force, speed * u, speed * v)


def problem_of(number: int, threads: int | None) -> tuple[World, Problem, float]:
    """Simulate a recording; return its world, the problem, and the share near the wall."""
    world = world_of(number)
    poses = own_poses(world, duration=60.0 * MINUTES, seed=number, time_step=0.01)
    track = body_track(see(poses, Camera(), seed=number))
    study = dw.apply_overrides(dw.Study(), {**GRID, "calibration.seed": 1000 + number})
    camera = recorded_camera(track, study, position_quantum=0.0)
    problem = prepare_problem(track, study, world.flow(), camera=camera, threads=threads)
    return world, problem, wall_share(poses)


def calibrate_world(number: int, wanted: Any) -> dict[str, Any]:
    """Calibrate one recording and say what holds the truth."""
    world, problem, wall = problem_of(number, wanted.threads)
    axes = tuple(np.array(one.coordinates) for one in problem.parameters)
    coarse = Mapper(problem, "coarse", apart=False).full(axes, 1)
    floor = noise_floor_at(problem, coarse.point(coarse.cell_of_minimum()))
    maps, limits = Mapper(problem, "refined"), limits_of(problem)
    located = locate(maps, first_window(coarse, floor), limits)
    wanted_replicates = problem.study.calibration.refined_replicates
    found = refine(maps, located, limits, problem.refined_steps, wanted_replicates)
    truth = world.drag_coefficient, world.force_std_N
    line = answer_of(problem, found, truth, wanted.bootstrap)
    return {
        "true_drag_coefficient": truth[0],
        "true_force_std_N": truth[1],
        "wall_share": wall,
        **line,
    }


def report() -> None:
    """Print the coverage, and the estimates over the truth."""
    lines = read(RESULTS)
    for key in ("region_holds", "drag_coefficient_holds", "force_std_holds"):
        print(key, sum(line[key] for line in lines), "of", len(lines))
    for key in ("drag_coefficient", "force_std_N"):
        ratio = np.array([line[key] / line[f"true_{key}"] for line in lines])
        print(f"{key} over the truth: median {np.median(ratio):.3f}, sd {ratio.std():.3f}")


if __name__ == "__main__":
    main()
