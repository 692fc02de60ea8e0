"""How often a calibration holds the truth where the block goes round slowly: synthetic.

On slow, regular orbits a recording visits few independent states, so two recordings of the same
parameters differ much, and by more the stronger the force. Every recording has a world of its own,
drawn by a rule and never chosen again: the regular flows of `studies/likelihood/worlds.py`, at 1,
0.6 and 0.4 times their speed in turn, C_d uniform in 0.3 to 1 and sigma_F uniform in 0.1 to
0.35 mN. driftwalk simulates a recording of 10 minutes at 10 Hz with 0.3 mm and 0.5 degrees of
noise. The search begins with a window from half to one and a half times the true C_d, and from 0
to two and a half times the true sigma_F, in the true flow, and ends with the window that resolves
the valley, with two replicates of each setting. Results go to ``slow.jsonl``, one line a recording;
run again, it continues.

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
from driftwalk.calibration.problem import Problem, prepare_problem
from driftwalk.calibration.refine import locate
from driftwalk.conditions import recorded_camera
from driftwalk.schema import body_track

sys.path.append(str(Path(__file__).resolve().parents[1] / "likelihood"))

from tracks import Camera, own_poses, see, wall_share
from worlds import World, draw_flow

SEED = 70_000
SPEEDS = (1.0, 0.6, 0.4)
MINUTES = 10.0
LIMITS = ((0.05, 2.0), (0.0, 1.2e-3))
RESULTS = Path(__file__).with_name("slow.jsonl")


def main() -> None:
    """Calibrate what is not in the results yet, then print the coverage."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=0, help="to share the work")
    parser.add_argument("--recordings", type=int, default=40)
    parser.add_argument("--bootstrap", type=int, default=60)
    parser.add_argument("--threads", type=int, default=None)
    wanted = parser.parse_args()
    done = {line["world"] for line in read(RESULTS)}
    for number in range(wanted.first, wanted.recordings):
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
    study = dw.apply_overrides(dw.Study(), {"calibration.seed": 1000 + number})
    camera = recorded_camera(track, study, position_quantum=0.0)
    problem = prepare_problem(track, study, world.flow(), camera=camera, threads=threads)
    return world, problem, wall_share(poses)


def calibrate_world(number: int, wanted: Any) -> dict[str, Any]:
    """Calibrate one recording and say what holds the truth."""
    world, problem, wall = problem_of(number, wanted.threads)
    truth = world.drag_coefficient, world.force_std_N
    window = (0.5 * truth[0], 1.5 * truth[0]), (0.0, 2.5 * truth[1])
    found = locate(Mapper(problem, "refined"), window, LIMITS)
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
