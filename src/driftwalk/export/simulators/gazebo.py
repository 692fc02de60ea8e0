"""Gazebo: an SDF world, and a system plugin in C++ that adds the forces to a link."""

from __future__ import annotations

from pathlib import Path
from string import Template
from typing import Final

from driftwalk.export.simulators.block import read_block
from driftwalk.export.simulators.compiled import (
    compiler,
    verify_force,
    wall_texts,
    write_force,
    write_proof,
)
from driftwalk.export.simulators.parts import (
    Folder,
    start_pose,
    stored_text,
    words_of,
    write_common,
)
from driftwalk.export.target import Source, Verification

SOURCES: Final = "src"


def write(source: Source, folder: Path) -> list[Path]:
    """Write the block of a run for Gazebo; see `Target.write`."""
    block = read_block(source)
    made, study = Folder(folder), block.study
    share = 1.0 + study.forces.added_mass_share
    x, y, theta = start_pose(block)
    surface = Template(stored_text("gazebo/surface.sdf")).substitute(
        restitution=repr(study.tank.wall_restitution),
        bounce_speed=repr(study.tank.bounce_speed_m_s),
        friction=repr(study.tank.wall_friction),
    )
    write_common(made, block)
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
    write_force(made, block, SOURCES)
    write_proof(made, block)
    made.fill("gazebo/README.md", "README.md", words_of(block))
    return made.files


require = compiler


def verify(folder: Path) -> Verification:
    """Compile the force, and compare it with driftwalk; Gazebo itself is not run."""
    return verify_force(folder, SOURCES)
