"""Parts that a member of the family can have: a wall or others that it feels, a slow change."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from driftwalk.schema.parameters import Parameter, Scale

_ROW: Final = re.compile(r"(\w+) \[(.+?)\] (\S+) to (\S+)( log)?: (.+)")


def _declared(text: str) -> Iterator[Parameter]:
    """Yield a parameter per line: name [unit] low to high, log where the scale is, meaning."""
    for row in text.strip().splitlines():
        match = _ROW.fullmatch(" ".join(row.split()))
        assert match is not None, row
        name, unit, low, high, log, meaning = match.groups()
        scale: Scale = "log" if log else "linear"
        yield Parameter(name, unit, float(low), float(high), scale=scale, meaning=meaning)


PARAMETERS: Final = {
    one.name: one
    for one in _declared("""
speed [m/s] 1e-6 to 10 log: Mean speed.
slow_speed [m/s] 1e-6 to 10 log: Mean speed of a slow bout.
fast_speed [m/s] 1e-6 to 10 log: Mean speed of a fast bout.
kick_speed [m/s] 1e-6 to 10 log: Mean speed right after a kick.
speed_cv [1] 0.01 to 2 log: Standard deviation of the speed from bout to bout, over its mean.
kick_speed_cv [1] 0.01 to 2 log: Its standard deviation over the mean.
speed_std [m/s] 1e-6 to 10 log: Standard deviation of each component of the velocity.
memory_time [s] 0.01 to 300 log: Time over which the velocity is remembered.
rotational_diffusion [rad2/s] 1e-4 to 100 log: Diffusion of the heading: after t its variance is \
    2 D t.
slow_rotational_diffusion [rad2/s] 1e-4 to 100 log: Diffusion of the heading while slow.
fast_rotational_diffusion [rad2/s] 1e-4 to 100 log: Diffusion of the heading while fast.
turn_rate [rad/s] -10 to 10: Mean rate of turning; above 0 counter-clockwise.
turn_std [rad] 0.01 to 6 log: Standard deviation of the turn at the beginning of a bout.
run_time [s] 0.05 to 300 log: Mean time of a run.
rest_time [s] 0.05 to 300 log: Mean time of a rest.
slow_time [s] 0.05 to 300 log: Mean time of a slow bout.
fast_time [s] 0.05 to 300 log: Mean time of a fast bout.
kick_time [s] 0.05 to 300 log: Mean time between kicks.
run_time_cv [1] 0.05 to 3 log: Standard deviation of the time of a run over its mean; 1 is \
    exponential.
rest_time_cv [1] 0.05 to 3 log: Standard deviation of the time of a rest over its mean; 1 is \
    exponential.
kick_time_cv [1] 0.05 to 3 log: Standard deviation of the time between kicks over its mean.
glide_time [s] 0.02 to 100 log: Time over which the speed of a glide falls by e.
relaxation_time [s] 0.01 to 30 log: Time over which the speed comes to that of the bout.
wall_turn [rad/s] 0.01 to 100 log: Rate of turning away from the wall at contact, heading along it.
wall_follow [rad/s] 0.01 to 100 log: Rate of turning along the wall at contact.
wall_slowing [1] 0 to 1: Share of the speed that is lost at contact.
wall_range [m] 1e-4 to 1 log: Distance over which the wall is felt: its effect falls by e.
wall_gap [m] 1e-4 to 1 log: Distance from contact at which turning away becomes turning towards.
neighbour_push [1] 0 to 5: Part of its speed at which another body pushes it off, at that body's \
    place.
neighbour_range [m] 1e-4 to 1 log: Distance over which the push of another body falls by e.
reversal_share [1] 0 to 1: Share of the bouts that begin with a turn by half a circle.
slow_std [1] 0.01 to 2 log: Standard deviation of the logarithm of the speed's slow factor.
stroke [1] 0 to 20: Amplitude of the swing over the mean speed.
stroke_frequency [Hz] 0.05 to 20 log: Frequency of the gait.
diffusion [m2/s] 1e-12 to 1e-2 log: Diffusion coefficient of the position.
""")
}
"""By name. Where two members share a parameter, it has one range."""


def parameters(names: str) -> tuple[Parameter, ...]:
    """Return parameters by their names, separated by spaces."""
    return tuple(PARAMETERS[name] for name in names.split())


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
_SLOW_TIME: Final = next(
    _declared("slow_time [s] 0.5 to 1000 log: Time over which that factor is remembered.")
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
