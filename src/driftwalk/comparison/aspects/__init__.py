"""How far apart are two motions in more than their steps? A set of two-dimensional distances."""

from driftwalk.comparison.aspects.distance import (
    AspectReference,
    aspect_reference,
    block_of,
    interleaved,
)
from driftwalk.comparison.aspects.form import ASPECTS, Aspect, form_aspects
from driftwalk.comparison.aspects.plan import AspectPlan, plan_aspects

__all__ = [
    "ASPECTS",
    "Aspect",
    "AspectPlan",
    "AspectReference",
    "aspect_reference",
    "block_of",
    "form_aspects",
    "interleaved",
    "plan_aspects",
]
