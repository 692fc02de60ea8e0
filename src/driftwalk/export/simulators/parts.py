"""Parts that the exports to simulators share: study, flow, licence, texts, and the wall."""

from __future__ import annotations

import json
import math
import subprocess
from dataclasses import dataclass
from importlib.metadata import distribution
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.export.simulators.block import Block

if TYPE_CHECKING:
    from driftwalk.model import Tank

PIECES: Final = 64
"""Flat pieces that make a round wall: in closed form they stand at most 0.12 % of the radius
outside of it."""


class Folder:
    """The folder of an export while it is written; it remembers its files."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.files: list[Path] = []

    def text(self, name: str, text: str) -> None:
        """Write a text file; `name` may name subfolders."""
        self.data(name, text.encode("utf-8"))

    def data(self, name: str, data: bytes | memoryview) -> None:
        """Write a file."""
        place = self.path / name
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(data)
        self.files.append(place)

    def copy(self, source: str, name: str) -> None:
        """Copy a file that every export has as it is."""
        self.text(name, stored_text(source))

    def fill(self, source: str, name: str, values: dict[str, Any]) -> None:
        """Write a stored text with values in the place of its ``$names``."""
        self.text(name, Template(stored_text(source)).substitute(values))


def stored_text(name: str) -> str:
    """Return the text of a file under `files`."""
    place = files("driftwalk.export.simulators") / "files"
    return place.joinpath(*name.split("/")).read_text(encoding="utf-8")


def write_common(folder: Folder, block: Block) -> None:
    """Write what the model is, study and flow, and the licence."""
    from driftwalk.schema.stores.netcdf import netcdf_bytes

    folder.text("study.toml", block.study.to_toml())
    folder.data("flow.nc", netcdf_bytes(block.flow))
    folder.text(
        "LICENSE", distribution("driftwalk").read_text("licenses/LICENSE") or "BSD-3-Clause\n"
    )


def write_numbers(folder: Folder, block: Block) -> None:
    """Write the numbers of the model, units in the keys."""
    folder.text("block.json", json.dumps(block.numbers(), indent=2) + "\n")


def words_of(block: Block) -> dict[str, str]:
    """Return what every README says of a block, by the names in the stored texts."""
    from driftwalk import __version__

    study = block.study
    forces, tank = study.forces, study.tank
    return {
        "version": __version__,
        "origin": block.origin,
        "tank": tank.describe(),
        "side": f"{study.block.side_m:g}",
        "mass": f"{study.block.mass_kg:g}",
        "drag_coefficient": f"{forces.drag_coefficient:.6g}",
        "force_std": f"{1e3 * forces.force_std_N:.6g}",
        "force_interval": f"{1e3 * forces.force_interval_s:g}",
        "seed": str(block.seed),
        "step": f"{1e3 * block.step_s:.6g}",
        "restitution": f"{tank.wall_restitution:g}",
        "friction": f"{tank.wall_friction:g}",
        "bounce_speed": f"{tank.bounce_speed_m_s:g}",
    }


@dataclass(frozen=True)
class Piece:
    """A flat piece of the wall: outward normal, its middle [m] and its length [m]."""

    normal: tuple[float, float]
    middle: tuple[float, float]
    length: float

    @property
    def angle(self) -> float:
        """Direction of the normal [rad]."""
        return math.atan2(self.normal[1], self.normal[0])


def wall_pieces(tank: Tank) -> list[Piece]:
    """Return the flat pieces of a tank's wall; those of a round one touch the circle from outside.

    Examples
    --------
    >>> import driftwalk as dw
    >>> len(wall_pieces(dw.Study().tank))
    64
    """
    from driftwalk.model.tank import edges

    if tank.radius_m is not None:
        radius, length = tank.radius_m, 2.0 * tank.radius_m * math.tan(math.pi / PIECES)
        turns = 2.0 * np.pi * np.arange(PIECES) / PIECES
        normals = [(math.cos(turn), math.sin(turn)) for turn in turns]
        return [Piece((x, y), (radius * x, radius * y), length) for x, y in normals]
    pieces = []
    for (x0, y0), (x1, y1) in edges(tank.corners_m):
        length = math.hypot(x1 - x0, y1 - y0)
        # Counter-clockwise corners: the outside is to the right of each edge.
        normal = ((y1 - y0) / length, -(x1 - x0) / length)
        pieces.append(Piece(normal, ((x0 + x1) / 2, (y0 + y1) / 2), length))
    return pieces


def start_pose(block: Block, replicate: int = 0) -> tuple[float, float, float]:
    """Return where `driftwalk simulate` lets a replicate start: x, y [m], theta [rad]."""
    from driftwalk.core.random_streams import world_keys
    from driftwalk.model import Pose
    from driftwalk.simulation.initial import random_start

    start = block.study.simulation.start
    if isinstance(start, Pose):
        return start.x_m, start.y_m, start.theta_rad
    drawn = random_start(block.study, world_keys(block.seed, trial=0, replicate=[replicate]))
    x, y, theta = (float(np.asarray(value)[0]) for value in (drawn.x, drawn.y, drawn.theta))
    return x, y, theta


def run_program(command: list[str], folder: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run a program that proves an export, and return what it said."""
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def last_line(text: str) -> str:
    """Return the last line of what a program said."""
    return (text.strip().splitlines() or ["no output"])[-1]
