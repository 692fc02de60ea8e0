"""The motions that are filmed: which sets there are, their seeds, and how each is simulated."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

import driftwalk as dw
from driftwalk.schema import build_trajectory

if TYPE_CHECKING:
    import xarray as xr

INTERVAL_S: Final = 0.1
SETTLING_S: Final = 60.0
BLOCKS: Final = 4
FOUR_S: Final = 60.0
ONE_S: Final = 1800.0
SEEDS: Final = {
    "moderate": tuple(range(101, 107)),
    "heavy": tuple(range(101, 107)),
    "closed-loop": (201,),
}
"""Seeds of motion and disturbances; none of them served to write the tracker."""


@dataclass(frozen=True)
class Scene:
    """One synthetic video."""

    set_name: str
    seed: int

    @property
    def name(self) -> str:
        """Name of its files."""
        return f"{self.set_name}-{self.seed}"

    @property
    def latching(self) -> str:
        """Whether blocks that touch stay joined: every second scene of four blocks."""
        return "none" if self.seed % 2 else "collision"

    @property
    def bodies(self) -> int:
        """How many blocks there are."""
        return 1 if self.set_name == "closed-loop" else BLOCKS

    @property
    def settings(self) -> dw.datasets.VideoSettings:
        """What the camera sees: one of the fixed levels."""
        level = "heavy" if self.set_name == "heavy" else "moderate"
        return dw.video_settings(level, seed=self.seed)


def scenes_of(set_name: str, count: int | None = None) -> list[Scene]:
    """Return the scenes of a set, or the first of them."""
    return [Scene(set_name, seed) for seed in SEEDS[set_name][:count]]


def motion_of(scene: Scene) -> xr.Dataset:
    """Simulate what is filmed, a `trajectory` without noise."""
    return _one_block(scene) if scene.bodies == 1 else _four_blocks(scene)


def video_of(scene: Scene, motion: xr.Dataset, folder: Path) -> Path:
    """Return the video of a scene, drawn unless the folder holds it whole."""
    path = folder / f"{scene.name}.mkv"
    if not path.exists():
        folder.mkdir(parents=True, exist_ok=True)
        part = dw.write_video(folder / f"{scene.name}.part.mkv", motion, scene.settings)
        part.rename(path)
    return path


def _four_blocks(scene: Scene) -> xr.Dataset:
    study = dw.apply_overrides(dw.Study(), {"assembly.latching": scene.latching})
    path = dw.assembly_path(
        study,
        dw.tank30_flow(),
        blocks=BLOCKS,
        # The last sample is one interval before the end: a minute has 600 frames.
        duration=FOUR_S - INTERVAL_S,
        sample_interval=INTERVAL_S,
        seed=scene.seed,
    )
    return dw.path_recording(path)


def _one_block(scene: Scene) -> xr.Dataset:
    first, count = round(SETTLING_S / INTERVAL_S), round(ONE_S / INTERVAL_S)
    run = dw.simulate(
        dw.Study(),
        dw.tank30_flow(),
        sample_time=np.arange(first, first + count) * INTERVAL_S,
        replicates=1,
        seed=scene.seed,
        threads=1,
    )
    poses = (run[name].values[0, :, 0].astype(np.float64) for name in ("x", "y", "theta"))
    return build_trajectory(
        np.arange(count) * INTERVAL_S,
        *poses,
        attrs={
            "source": "simulated",
            "simulated": "yes",
            "arena": dw.Study().tank.to_arena_json(),
        },
    )
