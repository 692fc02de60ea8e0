"""Parts that a member of the family can have: a wall or others that it feels, a slow change."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

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


_TURN = Parameter(
    "wall_turn", "rad/s", 0.01, 100.0, scale="log",
    meaning="Rate of turning away from the wall at contact, heading along it.",
)  # fmt: skip
_RANGE = Parameter(
    "wall_range", "m", 1e-4, 1.0, scale="log",
    meaning="Distance over which the wall is felt: its effect falls by e.",
)  # fmt: skip

PARTS: Final[Mapping[str, Part]] = {
    part.name: part
    for part in (
        Part(
            "wall",
            "The body turns away from the wall and slows down near it.",
            "dphi = wall_turn exp(-d / wall_range) sin(psi) dt;"
            " v (1 - wall_slowing exp(-d / wall_range))",
            (
                _TURN,
                Parameter(
                    "wall_slowing", "1", 0.0, 1.0,
                    meaning="Share of the speed that is lost at contact.",
                ),
                _RANGE,
            ),
        ),
        Part(
            "follow",
            "The body turns along the wall and follows it.",
            "dphi = wall_follow exp(-d / wall_range) sin(2 psi) dt",
            (
                Parameter(
                    "wall_follow", "rad/s", 0.01, 100.0, scale="log",
                    meaning="Rate of turning along the wall at contact.",
                ),
                _RANGE,
            ),
        ),
        Part(
            "keep",
            "The body keeps a distance: nearer the wall it turns away, farther off it turns back.",
            "dphi = wall_turn (1 - d / wall_gap) exp(-d / wall_range) sin(psi) dt",
            (
                _TURN,
                Parameter(
                    "wall_gap", "m", 1e-4, 1.0, scale="log",
                    meaning="Distance from contact at which turning away becomes turning towards.",
                ),
                _RANGE,
            ),
        ),
        Part(
            "neighbours",
            "The other bodies of the recording push it off while it moves.",
            "dx = v (e(phi) - neighbour_push sum of exp(-d / neighbour_range) n) dt",
            (
                Parameter(
                    "neighbour_push", "1", 0.0, 5.0,
                    meaning="Part of its speed at which another body pushes it off, at that body's"
                    " place.",
                ),
                Parameter(
                    "neighbour_range", "m", 1e-4, 1.0, scale="log",
                    meaning="Distance over which the push of another body falls by e.",
                ),
            ),
        ),
        Part(
            "reverse",
            "Bouts set out backwards: a push, and the way back.",
            "a bout begins with phi + pi at the chance reversal_share, besides its turn",
            (
                Parameter(
                    "reversal_share", "1", 0.0, 1.0,
                    meaning="Share of the bouts that begin with a turn by half a circle.",
                ),
            ),
        ),
        Part(
            "slow",
            "The speed changes slowly around its mean, over many bouts.",
            "v exp(m - slow_std^2 / 2), m with spread slow_std, remembered for slow_time",
            (
                Parameter(
                    "slow_std", "1", 0.01, 2.0, scale="log",
                    meaning="Standard deviation of the logarithm of the speed's slow factor.",
                ),
                Parameter(
                    "slow_time", "s", 0.5, 1000.0, scale="log",
                    meaning="Time over which that factor is remembered.",
                ),
            ),
        ),
        Part(
            "stroke",
            "A clocked gait: the speed swings at a frequency, above 1 with strokes backwards.",
            "v (1 + stroke cos(2 pi stroke_frequency t + phase))",
            (
                Parameter(
                    "stroke", "1", 0.0, 20.0,
                    meaning="Amplitude of the swing over the mean speed.",
                ),
                Parameter(
                    "stroke_frequency", "Hz", 0.05, 20.0, scale="log",
                    meaning="Frequency of the gait.",
                ),
            ),
        ),
        Part(
            "diffusion",
            "The position jitters besides.",
            "dx = sqrt(2 diffusion) dW",
            (
                Parameter(
                    "diffusion", "m2/s", 1e-12, 1e-2, scale="log",
                    meaning="Diffusion coefficient of the position.",
                ),
            ),
        ),
        Part("flow", "The water carries the body.", "dx = u(x, t) dt", ()),
        Part("reflect", "The wall throws the body back instead of letting it slide.", "", ()),
    )
}  # fmt: skip
"""Parts by name. Of `flow` and `reflect` there is nothing to choose."""
