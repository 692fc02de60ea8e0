"""Programs on the Open Dynamics Engine: built, given a case, run.

`ode/ode_peer.cpp` is the peer of the simulation benchmarks, `ode/ode_recording.cpp` makes the
recordings of another engine in `studies/likelihood`; `ode/ode_model.py` offers it to
`driftwalk calibrate --model`.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from driftwalk.model import Study

Floats = npt.NDArray[np.float64]

SOURCES = Path(__file__).parent / "ode"
WALLS = ("impulse", "boxes")


class PeerMissing(Exception):
    """What the peer needs is not on this machine."""


def _compiler() -> str:
    """A C++ compiler that finds ODE."""
    found = shutil.which(os.environ.get("CXX", "")) or shutil.which("c++") or shutil.which("g++")
    if found is None:
        raise PeerMissing("no C++ compiler")
    probe = subprocess.run(
        [str(found), "-x", "c++", "-fsyntax-only", "-"],
        input="#include <ode/ode.h>\n",
        text=True,
        capture_output=True,
        check=False,
    )
    if probe.returncode != 0:
        raise PeerMissing("the headers of ODE are not installed (Debian: libode-dev)")
    return str(found)


def build_peer(folder: Path, name: str = "ode_peer") -> Path:
    """Compile one of the programs in `ode` into a folder."""
    program, source = folder / name, SOURCES / f"{name}.cpp"
    command = [_compiler(), "-std=c++20", "-O3", "-march=native", str(source), "-o", str(program)]
    begin = time.perf_counter()
    subprocess.run([*command, "-lode"], check=True)
    print(f"compiled {name} in {time.perf_counter() - begin:.1f} s")
    return program


def write_case(
    path: Path,
    study: Study,
    *,
    axis: Floats,
    u: Floats,
    v: Floats,
    worlds: Floats,
    steps_per_sample: int,
) -> None:
    """Write what the peer reads; `worlds` has shape (worlds, blocks, 8)."""
    numbers = [
        study.block.side_m,
        study.block.mass_kg,
        study.wetted_depth_m,
        study.water.density_kg_m3,
        study.tank.radius_m,
        study.tank.wall_restitution,
        study.tank.wall_friction,
        study.tank.bounce_speed_m_s,
        study.time_step_s,
        steps_per_sample,
        axis.size,
        axis[0],
        axis[1] - axis[0],
        *u.ravel(),
        *v.ravel(),
        *worlds.shape[:2],
        *worlds.ravel(),
    ]
    path.write_text("\n".join(f"{number:.17g}" for number in numbers), encoding="utf-8")


def run_peer(program: Path, case: Path, wall: str, *, steps: int) -> dict[str, Any]:
    done = subprocess.run(
        [program, case, wall, str(steps)], check=True, capture_output=True, text=True
    )
    return dict(json.loads(done.stdout))
