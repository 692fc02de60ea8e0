"""Where was the robot? Read a tracker's file into a `trajectory` dataset.

`load` recognises the format by content, converts to SI with y up, cleans and counts; `describe`
says what a recording holds; `save_trajectory` keeps it.
"""

from driftwalk.record.arena import (
    CircleFit,
    PlacedArena,
    fit_circle,
    place_arena,
    tank_radius_bound,
)
from driftwalk.record.cleaning.jumps import (
    Impossible,
    arena_diagonal,
    impossible_steps,
    impossible_warning,
)
from driftwalk.record.info import describe
from driftwalk.record.io import load, readable_formats
from driftwalk.schema.tracking_noise import estimate_tracking_noise, noise_bound
from driftwalk.schema.trajectory import save_trajectory

__all__ = [
    "CircleFit",
    "Impossible",
    "PlacedArena",
    "arena_diagonal",
    "describe",
    "estimate_tracking_noise",
    "fit_circle",
    "impossible_steps",
    "impossible_warning",
    "load",
    "noise_bound",
    "place_arena",
    "readable_formats",
    "save_trajectory",
    "tank_radius_bound",
]
