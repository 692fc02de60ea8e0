"""Which values of several parameters fit? A search with random numbers of its own."""

from driftwalk.calibration.evolution.objective import AspectObjective, wall_distance
from driftwalk.calibration.evolution.ranges import Scales, recorded_ranges, scales_of
from driftwalk.calibration.evolution.search import (
    Budget,
    CachedObjective,
    SearchResult,
    search_minimum,
)

__all__ = [
    "AspectObjective",
    "Budget",
    "CachedObjective",
    "Scales",
    "SearchResult",
    "recorded_ranges",
    "scales_of",
    "search_minimum",
    "wall_distance",
]
