"""The case that the self-assembly benchmarks share: blocks in the true flow of the bundled tank.

8 strips a face, 10 ms step, one draw of the force a step, C_d 0.45, sigma_F 0.55 mN. 4 blocks are
in a tank of 30 cm; of more, or fewer, each has the same room, and the flow is stretched with the
tank (64 blocks: 1.2 m).
"""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

import driftwalk as dw
from driftwalk import _core
from driftwalk.core.random_streams import world_keys
from driftwalk.schema import build_flow_field
from driftwalk.simulation.backend import Camera, native_model

Floats = npt.NDArray[np.float64]
Found = dict[str, Any]

INSTRUCTION_SET = "DRIFTWALK_INSTRUCTION_SET"
BLOCKS = 4
DIAMETER_M = 0.3
STEP_S = 0.01
DRAG_COEFFICIENT = 0.45
FORCE_STD_N = 0.55e-3


@dataclass(frozen=True)
class Case:
    study: dw.Study
    flow: Any
    model: _core.Model
    start: Floats
    keys: npt.NDArray[np.uint64]

    def run(
        self,
        *,
        steps: int,
        rows: slice = slice(None),
        latching: str = "collision",
        precision: Literal["single", "double"] = "single",
        instruction_set: str = "",
        sample_every: int = 0,
    ) -> Found:
        """Run worlds on one thread."""
        rules = self.study.assembly
        keys = self.keys[rows]
        os.environ[INSTRUCTION_SET] = instruction_set
        try:
            return _core.assemble(
                self.model,
                start=self.start[rows],
                key=keys,
                drag_coefficient=np.full(keys.size, DRAG_COEFFICIENT),
                force_std=np.full(keys.size, FORCE_STD_N),
                steps=steps,
                latching=latching,
                connector_distance=rules.connector_distance_m,
                connector_axis=rules.connector_axis_rad,
                hidden_share=rules.hidden_share,
                stirring_length=self.study.forces.stirring_length_m,
                incompressible=self.study.forces.stirring == "incompressible",
                block_restitution=rules.block_restitution,
                block_friction=rules.block_friction,
                sample_every=sample_every,
                threads=1,
                precision=precision,
            )
        finally:
            os.environ.pop(INSTRUCTION_SET)


def make_case(blocks: int, *, worlds: int, wall_friction: float = 0.0) -> Case:
    """Worlds of `blocks` blocks in a tank in which each has the room that it has of four."""
    stretch = float(np.sqrt(blocks / BLOCKS))
    flow = dw.tank30_flow()
    x, y = (flow[name].values * stretch for name in "xy")
    study = dw.Study(
        tank={"diameter_m": DIAMETER_M * stretch, "wall_friction": wall_friction},
        forces={"force_interval_s": STEP_S},
        simulation={"time_step_s": STEP_S},
        assembly={"blocks": blocks},
    )
    wide = build_flow_field(
        x, y, u=flow["u"].values, v=flow["v"].values, flag=np.ones(flow["u"].shape, dtype=np.int8)
    )
    model = native_model(study, wide, np.zeros(1), Camera())
    keys = world_keys(1, trial=0, replicate=np.arange(worlds))
    start, placed = _core.place_blocks(model, blocks=blocks, key=keys, threads=1)
    check(bool((placed == blocks).all()), f"{blocks} blocks do not fit")
    return Case(study, wide, model, start, keys)


def check(holds: bool, sentence: str) -> None:
    if not holds:
        sys.exit(f"wrong answer: {sentence}")
