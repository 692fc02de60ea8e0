"""Exports for tests: a block in the bundled flow, its twin, and the exported code, loaded."""

from __future__ import annotations

import ctypes
import importlib.util
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from twin.block import Floats, TwinModel

import driftwalk as dw
from driftwalk.core.errors import InputError
from driftwalk.export import Source, export_run, target_named
from driftwalk.export.simulators.block import Block
from driftwalk.export.simulators.compiled import compiler, write_force
from driftwalk.export.simulators.parts import Folder


def block_of(forces: Mapping[str, Any], **changes: Any) -> Block:
    """Return a block in the flow of the bundled recording, with keys of [forces]."""
    keys = {f"forces.{key}": value for key, value in forces.items()} | changes
    return Block(dw.apply_overrides(dw.Study(), keys), dw.tank30_flow(), "a test")


def twin_of(block: Block) -> TwinModel:
    """Return the NumPy twin of a block."""
    study, flow = block.study, block.flow
    forces = study.forces
    return TwinModel(
        side=study.block.side_m,
        mass=study.block.mass_kg,
        depth=study.wetted_depth_m,
        strips=study.block.strips_per_face,
        water_density=study.water.density_kg_m3,
        radius=study.tank.diameter_m / 2,
        restitution=study.tank.wall_restitution,
        friction=study.tank.wall_friction,
        bounce_speed=study.tank.bounce_speed_m_s,
        time_step=study.time_step_s,
        steps_per_interval=round(forces.force_interval_s / study.time_step_s),
        flow_x=flow["x"].values,
        flow_y=flow["y"].values,
        flow_u=flow["u"].values,
        flow_v=flow["v"].values,
        added_mass_share=forces.added_mass_share,
        displaced_mass=study.block.mass_kg if forces.pressure_gradient else 0.0,
        linear_drag=forces.linear_drag_kg_s,
        drag_power=forces.drag_power,
        drag_speed=forces.drag_speed_m_s,
        force_memory=forces.force_memory_s,
    )


def random_states(count: int) -> Floats:
    """Return poses and motions in the tank and a little outside of the grid, shape (count, 6)."""
    reach = np.array([0.16, 0.16, np.pi, 0.1, 0.1, 3.0])
    return np.random.default_rng(3).uniform(-1, 1, (count, 6)) * reach


def a_compiler() -> str:
    """Return the C compiler, or skip the test."""
    try:
        return compiler()
    except InputError as error:
        pytest.skip(str(error))


def study_file(folder: Path, **keys: Any) -> tuple[Path, Path]:
    """Write a study with keys such as ``"forces.drag_coefficient"``, and the bundled flow."""
    study = folder / "study.toml"
    study.write_text(dw.apply_overrides(dw.Study(), keys).to_toml())
    dw.save_flow(dw.tank30_flow(), folder / "water.nc")
    return study, folder / "water.nc"


def export_of(folder: Path, target: str, **keys: Any) -> Path:
    """Export a study in the bundled flow, and return the folder of the export."""
    study, flow = study_file(folder, **keys)
    export_run(Source(study, flow), target_named(target), folder / target)
    return folder / target


def floating_block_module(folder: Path) -> ModuleType:
    """Import the module of an export to MuJoCo, or of a folder that has it."""
    pytest.importorskip("mujoco", reason="mujoco-core is not installed: make .venv/.test-tools")
    spec = importlib.util.spec_from_file_location("floating_block", folder / "floating_block.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class _Push(ctypes.Structure):
    _fields_ = [(name, ctypes.c_double) for name in ("x", "y", "torque", "conductance")]


class _Noise(ctypes.Structure):
    _fields_ = [
        ("key", ctypes.c_uint64),
        ("interval", ctypes.c_int64),
        ("share", ctypes.c_double * 2),
    ]


class CompiledForce:
    """The exported C code of a block, compiled and called."""

    def __init__(self, block: Block, folder: Path) -> None:
        write_force(Folder(folder), block, "src")
        library = folder / "force.so"
        sources = [str(folder / "src" / name) for name in ("floating_block.c", "model_data.c")]
        words = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-pedantic", "-shared", "-fPIC"]
        subprocess.run([a_compiler(), *words, *sources, "-o", str(library), "-lm"], check=True)
        self._code = ctypes.CDLL(str(library))
        self._code.fb_water.restype = _Push
        self._model = ctypes.byref(ctypes.c_char.in_dll(self._code, "floating_block_model"))
        self._noise = _Noise()

    def water(self, state: Floats) -> tuple[float, float, float]:
        push = self._code.fb_water(self._model, (ctypes.c_double * 6)(*state))
        return push.x, push.y, push.torque

    def begin(self, seed: int, replicate: int) -> None:
        self._code.fb_begin_noise(
            ctypes.byref(self._noise), ctypes.c_uint64(seed), ctypes.c_uint64(replicate)
        )

    def stochastic_force(self, interval: int) -> tuple[float, float]:
        force = (ctypes.c_double * 2)()
        self._code.fb_stochastic_force(
            self._model, ctypes.byref(self._noise), ctypes.c_int64(interval), force
        )
        return force[0], force[1]


def paths_run_by(program: Path, folder: Path, step: str) -> tuple[Floats, Floats]:
    """Return poses of driftwalk and of a harness, for replicate 0 of an export.

    The harness takes mass, inertia, step, steps per sample, samples and the start; the export's
    ``verify/reference.txt`` has the path with the stochastic force. `step` is in s, or in ms as
    ``"2ms"``.
    """
    import json

    said = json.loads((folder / "block.json").read_text())
    lines = (folder / "verify" / "reference.txt").read_text().splitlines()
    heads = [at for at, line in enumerate(lines) if len(line.split()) == 4]
    head = next(at for at in heads if lines[at].split()[:2] == ["1", "0"])
    samples, steps = (int(word) for word in lines[head].split()[2:])
    own = np.array([line.split() for line in lines[head + 1 : head + 1 + samples]], dtype=float)
    seconds = float(step.removesuffix("ms")) * (1e-3 if step.endswith("ms") else 1.0)
    period = round(steps * said["time_step_s"] / seconds)
    share = 1 + said["added_mass_share"]
    words = [said["mass_kg"] * share, said["inertia_kg_m2"] * share, step.removesuffix("ms")]
    words += [period, samples, *own[0]]
    done = subprocess.run([program, *map(str, words)], check=True, capture_output=True, text=True)
    assert done.stderr == "", done.stderr
    return own, np.array(done.stdout.split(), dtype=float).reshape(-1, 3)


def run_verify(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Run ``verify.py`` of an export to MuJoCo."""
    return subprocess.run(
        [sys.executable, "verify.py", *words],
        cwd=folder, capture_output=True, text=True, check=False,
    )  # fmt: skip
