"""Where was the robot? Read a tracker's file into a `trajectory` dataset.

`load` recognises the format by content, converts to SI with y up, cleans and counts; `describe`
says what a recording holds; `save_trajectory` keeps it.
"""

from driftwalk.record.arena import PlacedArena, place_arena
from driftwalk.record.circle import CircleFit, fit_circle, tank_radius_bound
from driftwalk.record.cleaning.jumps import (
    Impossible,
    arena_diagonal,
    impossible_steps,
    impossible_warning,
)
from driftwalk.record.info import describe
from driftwalk.record.io import load, readable_formats
from driftwalk.schema.tracker_errors import (
    NoiseBound,
    NoiseEstimate,
    estimate_tracking_noise,
    mistakes_warning,
    noise_bound,
    noise_reach,
    without_far_outliers,
    without_outliers,
)
from driftwalk.schema.trajectory import save_trajectory

__all__ = [
    "CircleFit",
    "Impossible",
    "NoiseBound",
    "NoiseEstimate",
    "PlacedArena",
    "arena_diagonal",
    "describe",
    "estimate_tracking_noise",
    "fit_circle",
    "impossible_steps",
    "impossible_warning",
    "load",
    "mistakes_warning",
    "noise_bound",
    "noise_reach",
    "place_arena",
    "readable_formats",
    "save_trajectory",
    "tank_radius_bound",
    "without_far_outliers",
    "without_outliers",
]
