"""How many body-steps a second one core simulates of each self-propelled model, beside the block.

    python benchmarks/bench_particles.py [--rounds 7] [--minutes 5]

64 bodies in a 30-cm tank, seen at 10 Hz with a heading, in time steps of 20 ms. Timed on one thread
in one run, rounds interleaved: each member of the family, with a wall that it feels where it has a
heading; and the block of the paper with its steps of 10 ms. Rates are per second of processor time.
Checked, else the script fails: all instruction sets give the same bits.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
from functools import partial
from typing import Any, Final

import numpy as np
from bench_simulate import INSTRUCTION_SET, fingerprint
from cases import contact_heavy
from timing import Times, interleaved, machine, spread

import driftwalk as dw
from driftwalk import _core
from driftwalk.conditions import Conditions, Neighbours
from driftwalk.core.random_streams import world_keys
from driftwalk.schema import Track
from driftwalk.simulation.backend import Camera
from driftwalk.simulation.initial import Start

BODIES: Final = 64
TARGET: Final = 15e6
BLOCK_STEPS: Final = 2000
MODELS: Final = (
    "inertial", "active", "active+wall", "run_tumble+wall", "run_rest+wall", "burst_coast+wall",
    "two_state+wall", "run_rest+wall+reverse", "run_tumble+wall+follow+keep",
    "active+wall+follow+keep+slow+stroke+diffusion", "run_rest+wall+neighbours",
)  # fmt: skip
VALUES: Final = {
    "speed_std": 0.02, "memory_time": 1.5, "speed": 0.03, "rotational_diffusion": 0.15,
    "turn_rate": 0.1, "speed_cv": 0.4, "run_time": 2.5, "run_time_cv": 0.7, "rest_time": 1.5,
    "rest_time_cv": 0.7, "turn_std": 1.2, "kick_speed": 0.06, "kick_speed_cv": 0.3,
    "kick_time": 1.2, "kick_time_cv": 0.4, "glide_time": 0.6, "slow_speed": 0.008,
    "fast_speed": 0.05, "slow_time": 4.0, "fast_time": 2.0, "slow_rotational_diffusion": 2.0,
    "fast_rotational_diffusion": 0.05, "relaxation_time": 0.3, "wall_turn": 2.0,
    "wall_slowing": 0.5, "wall_range": 0.02, "wall_follow": 3.0, "slow_std": 0.6, "stroke": 1.0,
    "stroke_frequency": 0.5, "diffusion": 1e-7, "wall_gap": 0.02, "reversal_share": 0.5,
    "neighbour_push": 1.0, "neighbour_range": 0.03,
}  # fmt: skip
"""Of every parameter, SI."""


def two_others(seconds: float) -> Neighbours:
    """Return two bodies that go round, for a model that feels them."""
    time = np.arange(0.0, seconds, 0.1)
    return Neighbours(
        tuple(
            Track(time, r * np.cos(time), r * np.sin(time), np.full(time.size, np.nan))
            for r in (0.05, 0.1)
        )
    )


class Bodies:
    """Bodies of one model, ready to run."""

    def __init__(self, name: str, minutes: float) -> None:
        self.like = Conditions(
            sample_time=np.arange(0.0, 60.0 * minutes, 0.1),
            start=Start(0.02, -0.01, 0.3, 0.01, 0.02, 0.0),
            camera=Camera(position_noise=3e-4),
            tank=dw.Study().tank,
            view=None,
            flow=None,
            threads=1,
            neighbours=two_others(60.0 * minutes),
        )
        self.model: Any = dw.motion_model(name)
        self.values = {one.name: np.full(BODIES, VALUES[one.name]) for one in self.model.parameters}
        self.keys = world_keys(1, trial=np.arange(BODIES), replicate=0)
        self.steps = BODIES * round(self.like.sample_time[-1] / 0.02)

    def run(self, instruction_set: str | None = None) -> Any:
        """Simulate, on the best instruction set or a given one."""
        if instruction_set is not None:
            os.environ[INSTRUCTION_SET] = instruction_set
        try:
            return self.model.simulate(self.values, self.like, self.keys)
        finally:
            os.environ.pop(INSTRUCTION_SET, None)


def block_steps() -> tuple[Any, int]:
    """Return a run of the block, and its number of steps."""
    case = contact_heavy()
    model = case.model(steps=BLOCK_STEPS)
    run = partial(_core.simulate, model, case.worlds, case.keys, threads=1, precision="single")
    return run, len(case.worlds) * BLOCK_STEPS


def row(name: str, times: Times, steps: int, block: float) -> str:
    """Return a line of the table."""
    rates = [rate / 1e6 for rate in times.rates(steps)]
    middle = 1e6 * statistics.median(rates)
    slow = "" if middle >= TARGET or name == "block" else "  below the target"
    return f"{name:<42} {spread(rates):>22} {middle / block:>11.2f}{slow}"


def main() -> None:
    """Check, time and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--minutes", type=float, default=5.0)
    options = parser.parse_args()
    print(machine())
    all_bodies = {name: Bodies(name, options.minutes) for name in MODELS}
    sets = list(_core.available_instruction_sets())
    for name, bodies in all_bodies.items():
        prints = {one: fingerprint(bodies.run(one)) for one in sets}
        if len(set(prints.values())) > 1:
            sys.exit(f"wrong answer: instruction sets differ for {name}: {prints}")
    print(f"same bits on {', '.join(sets)}")
    block, blocks = block_steps()
    ways = {"block": block, **{name: one.run for name, one in all_bodies.items()}}
    times = interleaved(ways, rounds=options.rounds)
    rate = statistics.median(times["block"].rates(blocks))
    print(f"\nMillions of body-steps a second on one core; target {TARGET / 1e6:.0f}")
    print(f"{'model':<42} {'processor time':>22} {'times block':>11}")
    for name, found in times.items():
        print(row(name, found, blocks if name == "block" else all_bodies[name].steps, rate))


if __name__ == "__main__":
    main()
