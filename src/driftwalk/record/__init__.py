"""Where was the robot? Read a tracker's file into a `trajectory` dataset.

`load` recognises the format by content, converts to SI with y up, cleans and counts; `describe`
says what a recording holds; `save_trajectory` keeps it.
"""

from driftwalk.record.circle import CircleFit, fit_circle, tank_radius_bound
from driftwalk.record.info import describe
from driftwalk.record.io import load, readable_formats
from driftwalk.record.noise import NoiseEstimate, estimate_tracking_noise
from driftwalk.record.write import save_trajectory

__all__ = [
    "CircleFit",
    "NoiseEstimate",
    "describe",
    "estimate_tracking_noise",
    "fit_circle",
    "load",
    "readable_formats",
    "save_trajectory",
    "tank_radius_bound",
]
