"""The case that the simulation benchmarks share: many worlds of one block, much wall contact.

128 worlds, 10 ms step, one draw of the stochastic force a step, C_d 0.45, sigma_F 0.55 mN, a tank
of 15 cm radius with wall friction, a steady flow on 50 x 50 nodes: a swirl, a slow inflow
and +-7 mm/s of noise per node. The inflow is chosen so that in about 60 % of all steps the block is
so near the wall that a corner can reach it: more than in most recordings, so that the wall counts.
Poses are sampled at 10 Hz.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "reference"))
from twin.block import TwinModel

from driftwalk import _core
from driftwalk.core.random_streams import world_keys
from driftwalk.model import Study
from driftwalk.schema import build_flow_field
from driftwalk.simulation.backend import Camera, native_model
from driftwalk.simulation.initial import Start, world_table

Floats = npt.NDArray[np.float64]

WORLDS = 128
STEPS = 2000
STEP_S = 0.01
DRAG_COEFFICIENT = 0.45
FORCE_STD_N = 0.55e-3
RADIUS_M = 0.15
NODES = 50
SWIRL_M_S = 0.06
INWARD_M_S = 0.0085
NODE_NOISE_M_S = 0.007
WALL_FRICTION = 0.2
SAMPLE_RATE_HZ = 10.0


@dataclass(frozen=True)
class Case:
    study: Study
    axis: Floats
    u: Floats
    v: Floats
    worlds: Floats
    keys: npt.NDArray[np.uint64]

    def model(self, *, steps: int = STEPS, every_step: str = "no") -> _core.Model:
        """The native model, sampled at 10 Hz or after every time step, from time 0 on."""
        period = STEP_S if every_step == "yes" else 1.0 / SAMPLE_RATE_HZ
        count = round(steps * STEP_S / period) + 1
        flow = build_flow_field(
            self.axis, self.axis, u=self.u, v=self.v, flag=np.ones(self.u.shape, dtype=np.int8)
        )
        return native_model(self.study, flow, np.arange(count) * period, Camera())

    def twin(self) -> TwinModel:
        study = self.study
        return TwinModel(
            side=study.block.side_m,
            mass=study.block.mass_kg,
            depth=study.wetted_depth_m,
            strips=study.block.strips_per_face,
            water_density=study.water.density_kg_m3,
            radius=RADIUS_M,
            restitution=study.tank.wall_restitution,
            friction=study.tank.wall_friction,
            bounce_speed=study.tank.bounce_speed_m_s,
            time_step=STEP_S,
            steps_per_interval=1,
            flow_x=self.axis,
            flow_y=self.axis,
            flow_u=self.u,
            flow_v=self.v,
        )


def contact_heavy(*, worlds: int = WORLDS) -> Case:
    """The case described above; worlds start at rest, anywhere that is clear of the wall."""
    rng = np.random.default_rng(20)
    axis = np.linspace(-RADIUS_M, RADIUS_M, NODES)
    x, y = np.meshgrid(axis, axis)
    swirl, inward = SWIRL_M_S / RADIUS_M, INWARD_M_S / RADIUS_M
    u = -swirl * y - inward * x + rng.uniform(-1, 1, x.shape) * NODE_NOISE_M_S
    v = swirl * x - inward * y + rng.uniform(-1, 1, x.shape) * NODE_NOISE_M_S
    study = Study(
        forces={"force_interval_s": STEP_S},
        tank={"diameter_m": 2 * RADIUS_M, "wall_friction": WALL_FRICTION},
        simulation={"time_step_s": STEP_S},
    )
    place, angle = np.sqrt(rng.uniform(size=worlds)), rng.uniform(-np.pi, np.pi, worlds)
    reach = (RADIUS_M - np.sqrt(0.5) * study.block.side_m) * place
    turned = rng.uniform(-np.pi, np.pi, worlds)
    start = Start(reach * np.cos(angle), reach * np.sin(angle), turned)
    keys = world_keys(1, trial=0, replicate=np.arange(worlds))
    table = world_table(start, keys, drag_coefficient=DRAG_COEFFICIENT, force_std=FORCE_STD_N)
    return Case(study, axis, u, v, table, keys)


def share_near_wall(case: Case, *, steps: int = STEPS) -> float:
    """Share of the world-steps in which a corner can reach the wall, whatever the orientation."""
    x, y, _, _ = _core.simulate(
        case.model(steps=steps, every_step="yes"),
        case.worlds,
        case.keys,
        threads=1,
        precision="single",
    )
    reach = np.sqrt(0.5) * case.study.block.side_m
    return float(np.mean(np.hypot(x, y)[:, 1:] > RADIUS_M - reach))
