"""Gazebo: an SDF world, and a system plugin in C++ that adds the forces to a link."""

from __future__ import annotations

from pathlib import Path
from string import Template
from typing import Final

from driftwalk.export.simulators.block import Block
from driftwalk.export.simulators.compiled import compiler, verify_force, wall_texts, write_plugin
from driftwalk.export.simulators.parts import Folder, start_pose, stored_text
from driftwalk.export.target import Source, Verification

SOURCES: Final = "src"


def write(source: Source, folder: Path) -> list[Path]:
    """Write the block of a run for Gazebo; see `Target.write`."""
    return write_plugin(source, folder, "gazebo", SOURCES, _world)


def _world(made: Folder, block: Block) -> None:
    study = block.study
    share = 1.0 + study.forces.added_mass_share
    x, y, theta = start_pose(block)
    surface = Template(stored_text("gazebo/surface.sdf")).substitute(
        restitution=repr(study.tank.wall_restitution),
        bounce_speed=repr(study.tank.bounce_speed_m_s),
        friction=repr(study.tank.wall_friction),
    )
    made.fill(
        "gazebo/tank.sdf",
        "tank.sdf",
        {
            "step": repr(block.step_s),
            "pose": f"{x!r} {y!r} 0 0 0 {theta!r}",
            "mass": repr(study.block.mass_kg * share),
            "inertia": repr(study.block.inertia_kg_m2 * share),
            "side": repr(study.block.side_m),
            "surface": surface.strip(),
            "walls": wall_texts(block, "gazebo/wall.sdf", surface=surface.strip()).rstrip(),
        },
    )
    made.copy("gazebo/CMakeLists.txt", "CMakeLists.txt")
    made.copy("gazebo/driftwalk_water.cc", f"{SOURCES}/driftwalk_water.cc")


require = compiler


def verify(folder: Path) -> Verification:
    """Compile the force, and compare it with driftwalk; Gazebo itself is not run."""
    return verify_force(folder, SOURCES)
