"""Worlds of the native core that are compared with a recording as they finish."""

from __future__ import annotations

from driftwalk import _core
from driftwalk.comparison import StepReference
from driftwalk.comparison.statistic import BINS
from driftwalk.conditions.recorded import Conditions
from driftwalk.motion.protocol import Details, Floats, Keys, Scores
from driftwalk.motion.score import excerpt_samples


def scored(
    model: _core.Model,
    worlds: Floats,
    like: Conditions,
    keys: Keys,
    reference: StepReference,
    *,
    details: Details,
    particle: _core.Particle | None = None,
) -> Scores:
    """Simulate worlds and return how far each is from the recording; see `score_worlds`."""
    full = details == "all"
    return dict(
        _core.score(
            model,
            worlds,
            keys,
            left=reference.plan.left,
            weight=reference.plan.weight,
            triple=reference.plan.triple,
            reference=reference.steps,
            bins=BINS if full else 0,
            length_limit=reference.length_limit,
            angle_limit=reference.angle_limit,
            excerpt=excerpt_samples(like) if full else 0,
            keep_steps=details == "steps",
            threads=like.threads,
            particle=particle,
            flow_start=like.flow_start,
        )
    )
