"""Parts that a member of the family can have: a wall or others that it feels, a slow change."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

from driftwalk.motion.family.parameters import parameters
from driftwalk.schema import Parameter


@dataclass(frozen=True)
class Part:
    """Something added to a member: parameters, and the columns that they fill.

    Attributes
    ----------
    name : str
        Such as "wall" in "run_rest+wall".
    sentence : str
        What it adds.
    formula : str
        Its equation.
    parameters : tuple of Parameter
        Its parameters; each fills the column of its own name: the shared one, or that of every
        state that moves.
    """

    name: str
    sentence: str
    formula: str
    parameters: tuple[Parameter, ...]


# A member has a parameter of the same name, the time of its slow bouts.
_SLOW_TIME: Final = replace(
    parameters("slow_time")[0],
    low=0.5,
    high=1000.0,
    step=0.0,
    refined_step=0.0,
    meaning="Time over which that factor is remembered.",
)

PARTS: Final[Mapping[str, Part]] = {
    part.name: part
    for part in (
        Part(
            "wall",
            "The body turns away from the wall and slows down near it.",
            "dphi = wall_turn exp(-d / wall_range) sin(psi) dt;"
            " v (1 - wall_slowing exp(-d / wall_range))",
            parameters("wall_turn wall_slowing wall_range"),
        ),
        Part(
            "follow",
            "The body turns along the wall and follows it.",
            "dphi = wall_follow exp(-d / wall_range) sin(2 psi) dt",
            parameters("wall_follow wall_range"),
        ),
        Part(
            "keep",
            "The body keeps a distance: nearer the wall it turns away, farther off it turns back.",
            "dphi = wall_turn (1 - d / wall_gap) exp(-d / wall_range) sin(psi) dt",
            parameters("wall_turn wall_gap wall_range"),
        ),
        Part(
            "neighbours",
            "The other bodies of the recording push it off while it moves.",
            "dx = v (e(phi) - neighbour_push sum of exp(-d / neighbour_range) n) dt",
            parameters("neighbour_push neighbour_range"),
        ),
        Part(
            "reverse",
            "Bouts set out backwards: a push, and the way back.",
            "a bout begins with phi + pi at the chance reversal_share, besides its turn",
            parameters("reversal_share"),
        ),
        Part(
            "slow",
            "The speed changes slowly around its mean, over many bouts.",
            "v exp(m - slow_std^2 / 2), m with spread slow_std, remembered for slow_time",
            (*parameters("slow_std"), _SLOW_TIME),
        ),
        Part(
            "stroke",
            "A clocked gait: the speed swings at a frequency, above 1 with strokes backwards.",
            "v (1 + stroke cos(2 pi stroke_frequency t + phase))",
            parameters("stroke stroke_frequency"),
        ),
        Part(
            "diffusion",
            "The position jitters besides.",
            "dx = sqrt(2 diffusion) dW",
            parameters("diffusion"),
        ),
        Part("flow", "The water carries the body.", "dx = u(x, t) dt", ()),
        Part("reflect", "The wall throws the body back instead of letting it slide.", "", ()),
    )
}
"""Parts by name. Of `flow` and `reflect` there is nothing to choose."""
