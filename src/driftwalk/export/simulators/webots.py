"""Webots: world, PROTO, and a physics plugin in C that adds the forces to ODE's body."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from driftwalk.export.simulators.block import Block
from driftwalk.export.simulators.compiled import compiler, verify_force, wall_texts, write_plugin
from driftwalk.export.simulators.parts import Folder, start_pose
from driftwalk.export.target import Source, Verification

PLUGIN: Final = "plugins/physics/driftwalk_water"


def write(source: Source, folder: Path) -> list[Path]:
    """Write the block of a run for Webots; see `Target.write`."""
    return write_plugin(source, folder, "webots", PLUGIN, _world)


def _world(made: Folder, block: Block) -> None:
    study = block.study
    share = 1.0 + study.forces.added_mass_share
    x, y, theta = start_pose(block)
    made.fill(
        "webots/tank.wbt",
        "worlds/tank.wbt",
        {
            "step_ms": repr(round(1e3 * block.step_s, 9)),
            "friction": repr(study.tank.wall_friction),
            "restitution": repr(study.tank.wall_restitution),
            "bounce_speed": repr(study.tank.bounce_speed_m_s),
            "eye": repr(3.0 * max(study.tank.extent_m)),
            "x": repr(x),
            "y": repr(y),
            "theta": repr(theta),
            "walls": wall_texts(block, "webots/wall.wbt"),
        },
    )
    made.fill(
        "webots/FloatingBlock.proto",
        "protos/FloatingBlock.proto",
        {
            "side": repr(study.block.side_m),
            "mass": repr(study.block.mass_kg * share),
            "inertia": repr(study.block.inertia_kg_m2 * share),
        },
    )
    for name in ("driftwalk_water.c", "Makefile"):
        made.copy(f"webots/{name}", f"{PLUGIN}/{name}")


require = compiler


def verify(folder: Path) -> Verification:
    """Compile the force, and compare it with driftwalk; Webots itself is not run."""
    return verify_force(folder, PLUGIN)
