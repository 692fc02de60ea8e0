"""The motion of the block of a world by the Open Dynamics Engine: shares no code with driftwalk."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from tracks import INTERVAL_S, SETTLING_S, Poses, samples
from worlds import AXIS, World

import driftwalk as dw

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"
PROGRAM = "ode_recording"
STEP_S = 0.5e-3
"""ODE takes the drag at the beginning of a step, an error of first order: see the README."""
WALL_FRICTION = 0.2


def peer() -> Any:
    """Return the module of the benchmarks that builds programs on ODE."""
    if str(BENCHMARKS) not in sys.path:
        sys.path.append(str(BENCHMARKS))
    return import_module("peer")


def build_ode(folder: Path) -> Path:
    """Compile the program into a folder; `peer().PeerMissing` says what is not there."""
    return Path(peer().build_peer(folder, PROGRAM))


def ode_poses(
    program: Path,
    world: World,
    *,
    duration: float,
    seed: int,
    time_step: float = STEP_S,
    law: Sequence[str] = (),
) -> Poses:
    """Simulate with ODE; a minute to settle, then the duration [s].

    `law` says what is not as in the model, as NAME=NUMBER: see `Law` in benchmarks/ode/tank.hpp.
    """
    study = dw.apply_overrides(
        world.study(time_step=time_step), {"tank.wall_friction": WALL_FRICTION}
    )
    start = [0.02, 0.02, 0.3, 0.0, 0.0, 0.0, world.drag_coefficient, world.force_std_N]
    numbers = [
        seed,
        round(study.forces.force_interval_s / time_step),
        round(SETTLING_S / INTERVAL_S),
        samples(duration),
    ]
    with tempfile.TemporaryDirectory() as folder:
        case = Path(folder) / "case.txt"
        peer().write_case(
            case,
            study,
            axis=AXIS,
            u=world.u,
            v=world.v,
            worlds=np.array([[start]]),
            steps_per_sample=round(INTERVAL_S / time_step),
        )
        command = [program, case, *map(str, numbers), *law]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
    return Poses(*np.array(done.stdout.split(), dtype=np.float64).reshape(-1, 3).T)
