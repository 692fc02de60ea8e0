"""Words for the parts of a comparison of motion models, on the terminal and in figures."""

from __future__ import annotations

from typing import Final

ASPECT_WORDS: Final = {
    "steps": "steps",
    "steps_3": "steps of 3 intervals",
    "steps_9": "steps of 9 intervals",
    "frame": "displacement in the body's frame",
    "wall": "place near the wall",
    "memory": "memory of the speed",
}
CHECK_WORDS: Final = {
    "displacement_1": "mean squared displacement over 1 step interval",
    "displacement_3": "mean squared displacement over 3",
    "displacement_10": "mean squared displacement over 10",
    "displacement_30": "mean squared displacement over 30",
    "displacement_100": "mean squared displacement over 100",
    "speed_time": "time over which the speed lasts",
    "wall_share": "share of the time at the wall",
    "rest_share": "share of the time at rest",
}
CHECK_LABELS: Final = {
    "displacement_1": "msd, 1 step", "displacement_3": "msd, 3 steps",
    "displacement_10": "msd, 10 steps", "displacement_30": "msd, 30 steps",
    "displacement_100": "msd, 100 steps", "speed_time": "speed lasts",
    "wall_share": "at the wall", "rest_share": "at rest",
}  # fmt: skip
"""Short ones, for figures."""
