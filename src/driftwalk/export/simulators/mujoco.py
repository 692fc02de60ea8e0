"""MuJoCo: the tank as MJCF, and the water as a Python module that needs numpy and mujoco."""

from __future__ import annotations

import importlib.util
import io
import json
import math
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.export.simulators.block import Block, read_block
from driftwalk.export.simulators.parts import (
    Folder,
    last_line,
    run_program,
    start_pose,
    wall_pieces,
    words_of,
    write_common,
    write_numbers,
)
from driftwalk.export.simulators.reference import NO_PATH, reference_of
from driftwalk.export.target import Source, Verification


def write(source: Source, folder: Path) -> list[Path]:
    """Write the block of a run for MuJoCo; see `Target.write`."""
    block = read_block(source)
    made = Folder(folder)
    write_common(made, block)
    write_module(made, block)
    made.fill("mujoco/tank.xml", "tank.xml", _tank(block))
    made.copy("mujoco/verify.py", "verify.py")
    made.data("reference.npz", _npz(reference_of(block).arrays()))
    made.fill("mujoco/README.md", "README.md", words_of(block))
    return made.files


def write_module(folder: Folder, block: Block) -> None:
    """Write the force as a Python module, and what it reads."""
    folder.copy("mujoco/floating_block.py", "floating_block.py")
    write_numbers(folder, block)
    folder.data("flow.npz", _npz(block.nodes()))


def _tank(block: Block) -> dict[str, str]:
    """Return the values in the MJCF of the tank, by their names there."""
    study = block.study
    tank, half = study.tank, study.block.side_m / 2
    share = 1.0 + study.forces.added_mass_share
    inertia = study.block.inertia_kg_m2 * share
    stiffness, damping = contact_of(tank.wall_restitution, block.step_s)
    walls = "\n".join(
        f'    <geom class="wall" pos="{_text(piece.middle)} 0" '
        f'size="{_text((piece.length / 2, half, 0.1))}" '
        f'xyaxes="{_text((piece.normal[1], -piece.normal[0]))} 0 0 0 1"/>'
        for piece in wall_pieces(tank)
    )
    return {
        "step": repr(block.step_s),
        "half": repr(half),
        "contact": _text((-stiffness, -damping)),
        "condim": "3" if tank.wall_friction > 0 else "1",
        "friction": repr(tank.wall_friction),
        "walls": walls,
        "mass": repr(study.block.mass_kg * share),
        "inertia": _text((inertia, inertia, inertia)),
        "starts": "\n".join(
            f'    <key name="replicate_{number}" qpos="{_text(start_pose(block, number))}"/>'
            # Ten replicates have their starts as keyframes.
            for number in range(10)
        ),
        "water": repr(0.5 * max(tank.extent_m)),
    }


def contact_of(restitution: float, step_s: float) -> tuple[float, float]:
    """Return stiffness [1/s²] and damping [1/s] per mass of a contact that gives a restitution.

    A spring and a damper that push and never pull: the contact ends where its force does. Below
    exp(-2) the contact is critically damped.

    Examples
    --------
    >>> stiffness, damping = contact_of(1.0, 2e-3)
    >>> damping
    0.0
    """
    # An impact takes eight time steps.
    frequency = math.pi / (8 * step_s)
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (low, middle) if _given_back(middle) < restitution else (middle, high)
    ratio = 0.0 if restitution == 1 else (low + high) / 2
    return frequency**2, 2 * ratio * frequency


def _given_back(ratio: float) -> float:
    """Return the restitution of a spring with a damper of a damping ratio, 0 <= ratio < 1."""
    root = math.sqrt(1 - ratio**2)
    phase = math.pi - math.atan2(2 * ratio * root, 1 - 2 * ratio**2)
    # A critically damped contact gives back the least: it pushes and never pulls.
    return math.exp(-ratio / root * phase) if root > 1e-9 else math.exp(-2.0)


def _text(numbers: Any) -> str:
    return " ".join(repr(float(number)) for number in numbers)


def _npz(arrays: Mapping[str, Any]) -> bytes:
    made = io.BytesIO()
    np.savez_compressed(made, **arrays)
    return made.getvalue()


def require() -> None:
    """Refuse where MuJoCo is not installed.

    Raises
    ------
    InputError
        Says how to install it.
    """
    if importlib.util.find_spec("mujoco") is None:
        raise InputError("the proof needs MuJoCo: pip install mujoco-core")


def verify(folder: Path) -> Verification:
    """Run ``verify.py`` of an export in a separate process; see `Target.verify`."""
    program = "import json, verify; print(json.dumps(verify.prove()))"
    done = run_program([sys.executable, "-B", "-c", program], folder)
    if done.returncode != 0:
        raise InputError(f"{folder / 'verify.py'} failed: {last_line(done.stderr)}")
    found = json.loads(done.stdout)
    numbers: dict[str, float | int] = {}
    lines = []
    for name, words in (("still", "without the stochastic force"), ("noisy", "with it")):
        one = found[name]
        numbers |= {f"{name}_{key}": value for key, value in one.items()}
        lines.append(
            f"{words}: {one['paths']} paths of {one['duration_s']:g} s in MuJoCo, at most "
            f"{1e6 * one['largest_distance_m']:.3g} µm from driftwalk's"
            if one["paths"]
            else f"{words}: {NO_PATH}"
        )
    return Verification(bool(found["passed"]), tuple(lines), numbers)
