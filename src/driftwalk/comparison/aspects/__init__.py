"""Aspects of a motion: two-dimensional distances beyond those of single steps."""

from driftwalk.comparison.aspects.distance import (
    BLOCKS,
    AspectReference,
    aspect_reference,
    block_of,
    interleaved,
    own_distance,
    points_distance,
)
from driftwalk.comparison.aspects.form import ASPECTS, Aspect, form_aspects
from driftwalk.comparison.aspects.plan import FEWEST_POINTS, AspectPlan, plan_aspects

__all__ = [
    "ASPECTS",
    "BLOCKS",
    "FEWEST_POINTS",
    "Aspect",
    "AspectPlan",
    "AspectReference",
    "aspect_reference",
    "block_of",
    "form_aspects",
    "interleaved",
    "own_distance",
    "plan_aspects",
    "points_distance",
]
