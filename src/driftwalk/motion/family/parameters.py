"""The parameters of the family and of its parts: units, wide ranges, scales and meanings."""

from __future__ import annotations

import re
from collections.abc import Iterator
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
