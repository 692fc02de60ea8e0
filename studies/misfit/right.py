"""Worlds that are as the model says, for the false alarms of the check.

The motions are driftwalk's own, in the worlds of studies/likelihood: C_d 0.2 to 1, flows of two
families, in each of which a trial of half an hour is at the wall for less than a quarter of it.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Final

sys.path.append(str(Path(__file__).resolve().parents[1] / "likelihood"))

import study_sets
from tracks import Poses, own_poses
from worlds import World

FIRST_SEED: Final = study_sets.FIRST_SEED["right"]


def right_motion(number: int, folder: Path, minutes: float) -> tuple[World, Poses]:
    """Return a world and the block's motion in it; both are kept."""
    path = folder / f"right-{number:03d}-{minutes:g}.npz"
    if not path.exists():
        case = study_sets.Case("right", number, study_sets.PLAIN)
        world = study_sets.world_of(case)
        poses = own_poses(world, duration=60.0 * minutes, seed=case.seed)
        study_sets.save_motion(path, world, poses)
    return study_sets.load_motion(path)
