"""The export to MuJoCo in MuJoCo itself, against closed forms."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from exported import block_of, export_of, floating_block_module

from driftwalk.export.simulators.mujoco import contact_of

mujoco = pytest.importorskip(
    "mujoco", reason="mujoco-core is not installed: make .venv/.test-tools"
)

DRY = {"forces.drag_coefficient": 0.0, "simulation.start": {"x_m": 0.0, "y_m": 0.0}}
"""Water that does not act: what is left has a closed form."""


@pytest.fixture(autouse=True)
def _no_callback_is_left() -> Any:
    yield
    mujoco.set_mjcb_passive(None)


def loaded(folder: Path) -> tuple[Any, Any]:
    model = mujoco.MjModel.from_xml_path(str(folder / "tank.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    return model, data


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("integrator", ["RK4", "Euler"])
def test_each_force_acts_for_its_interval(integrator: str, tmp_path: Path) -> None:
    """Without drag the velocity is the sum of the impulses: a step in the wrong interval shows."""
    folder = export_of(tmp_path, "mujoco", **DRY)
    module = floating_block_module(folder)
    model, data = loaded(folder)
    model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
    water = module.install(model, data, folder, replicate=2)
    for _ in range(2):  # the second time from the beginning again
        mujoco.mj_resetDataKeyframe(model, data, 0)
        expected = np.zeros(2)
        for interval in range(12):
            while data.time < 0.01 * (interval + 1) - 1e-9:
                mujoco.mj_step(model, data)
            alone = module.FloatingBlock(folder, replicate=2).stochastic_force(interval)
            expected += 0.01 / 0.0116 * np.array(alone)
            assert np.abs(data.qvel[:2] - expected).max() < 1e-12
    assert water.noise


def test_the_water_acts_on_its_own_data_alone(tmp_path: Path) -> None:
    folder = export_of(tmp_path, "mujoco")
    module = floating_block_module(folder)
    (model, data), (_, other) = loaded(folder), loaded(folder)
    module.install(model, data, folder, noise=False)
    twin = mujoco.MjData(model)
    for each in (data, twin):
        mujoco.mj_step(model, each)
    assert np.abs(data.qfrc_passive).max() > 0
    assert np.abs(twin.qfrc_passive).max() == 0
    mujoco.set_mjcb_passive(None)
    mujoco.mj_step(model, other)
    assert np.abs(other.qfrc_passive).max() == 0


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("restitution", [0.2, 0.5, 0.8, 1.0])
def test_a_frontal_impact_gives_back_what_the_study_says(
    restitution: float, tmp_path: Path
) -> None:
    """A face of the block against the first piece of the wall, which faces it."""
    folder = export_of(tmp_path, "mujoco", **{**DRY, "tank.wall_restitution": restitution})
    model, data = loaded(folder)
    data.qpos[:3], data.qvel[:3] = (0.13, 0.0, 0.0), (0.05, 0.0, 0.0)
    for _ in range(300):
        mujoco.mj_step(model, data)
    assert data.qvel[0] == pytest.approx(-0.05 * restitution, abs=0.05 * 0.06)
    assert abs(data.qvel[1]) < 1e-4
    assert abs(data.qvel[2]) < 1e-2


@pytest.mark.slow
def test_the_block_stays_in_a_tank_of_straight_walls(tmp_path: Path) -> None:
    """A polygon: each edge is a wall with its outside behind it."""
    corners = ((-0.1, -0.08), (0.12, -0.1), (0.1, 0.09), (-0.09, 0.1))
    folder = export_of(
        tmp_path, "mujoco",
        **{**DRY, "tank.shape": "polygon", "tank.vertices_m": corners, "forces.force_std_N": 0.02},
    )  # fmt: skip
    module = floating_block_module(folder)
    model, data = loaded(folder)
    module.install(model, data, folder)
    reached = np.zeros((800, 2))
    for row in reached:
        mujoco.mj_step(model, data)
        row[:] = data.qpos[:2]
    assert np.abs(reached).max() < 0.12
    assert np.ptp(reached, axis=0).min() > 0.05


@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.9])
def test_the_contact_is_a_damped_spring(restitution: float) -> None:
    """Integrated in small steps: it ends where the force of spring and damper is no push."""
    stiffness, damping = contact_of(restitution, 1e-3)
    place, speed, step = 0.0, 1.0, 1e-6
    for _ in range(100_000):
        force = -stiffness * place - damping * speed
        if speed < 0 and force >= 0:
            break
        speed += step * force
        place += step * speed
    assert -speed == pytest.approx(max(restitution, math.exp(-2)), abs=2e-3)


@pytest.mark.slow
def test_mass_and_inertia_hold_what_moves_along(tmp_path: Path) -> None:
    share = {"added_mass_share": 0.4}
    folder = export_of(tmp_path, "mujoco", **{"forces.added_mass_share": 0.4})
    model, _ = loaded(folder)
    block = block_of(share).study.block
    assert model.body("block").mass[0] == pytest.approx(1.4 * block.mass_kg, rel=1e-12)
    assert model.body("block").inertia[2] == pytest.approx(1.4 * block.inertia_kg_m2, rel=1e-12)
