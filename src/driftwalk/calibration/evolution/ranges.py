"""The ranges in which the parameters of a self-propelled body are searched, from its recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.schema import Parameter
from driftwalk.schema.trajectory import Track


@dataclass(frozen=True)
class Scales:
    """The scales of a recorded motion.

    Attributes
    ----------
    speed : float
        Mean speed over a step interval [m/s].
    fastest : float
        Its 99.9 % quantile [m/s].
    interval : float
        Step interval [s].
    duration : float
        From the first to the last sample [s].
    size : float
        Half the longer side of what the recording covers [m].
    """

    speed: float
    fastest: float
    interval: float
    duration: float
    size: float


def scales_of(track: Track, *, step_interval: float, steps: Floats) -> Scales:
    """Return the scales of a track with these step lengths [m].

    Raises
    ------
    InputError
        When the track does not move.

    Examples
    --------
    >>> time = np.arange(100) / 10.0
    >>> track = Track(time, 0.02 * time, 0 * time, 0 * time)
    >>> round(scales_of(track, step_interval=0.1, steps=np.full(99, 0.002)).speed, 6)
    0.02
    """
    speed = float(np.mean(steps)) / step_interval
    if not speed > 0.0:
        raise InputError("the recording does not move: no step has a length")
    size = 0.5 * max(float(np.ptp(track.x)), float(np.ptp(track.y)))
    return Scales(
        speed=speed,
        fastest=float(np.quantile(steps, 0.999)) / step_interval,
        interval=step_interval,
        duration=float(track.time[-1] - track.time[0]),
        size=size,
    )


def recorded_ranges(parameters: Sequence[Parameter], scales: Scales) -> tuple[Parameter, ...]:
    """Return the parameters with ranges that a recording of these scales can tell apart.

    Speeds lie about the recorded one, times between half a step interval and a part of the
    recording, rates below a turn per step, lengths below the size of what was covered. A range is
    the part of the parameter's own that lies there; where they do not meet, its own stays.

    Examples
    --------
    >>> speed = Parameter("speed", "m/s", 1e-6, 10.0, scale="log")
    >>> scales = Scales(speed=0.1, fastest=0.5, interval=0.1, duration=600.0, size=0.2)
    >>> found = recorded_ranges([speed], scales)[0]
    >>> round(found.low, 6), found.high
    (0.005, 1.0)
    """
    return tuple(_ranged(one, scales) for one in parameters)


def _ranged(parameter: Parameter, scales: Scales) -> Parameter:
    per_step = 1.0 / scales.interval
    usual = {
        "m/s": (0.05 * scales.speed, max(2.0 * scales.fastest, 2.0 * scales.speed)),
        "s": (0.5 * scales.interval, 0.1 * scales.duration),
        "rad2/s": (1e-3 * per_step, 3.0 * per_step),
        "rad/s": (0.02 * per_step, 5.0 * per_step),
        "m": (0.01 * scales.size, scales.size),
        "m2/s": (1e-4 * scales.speed**2 * scales.interval, scales.speed**2 * scales.interval),
        "Hz": (0.02 * per_step, 2.0 * per_step),
    }
    if parameter.unit not in usual:
        return parameter
    low, high = usual[parameter.unit]
    if parameter.low < 0.0:
        low = -high if parameter.unit != "rad/s" else -0.3 * per_step
        high = -low
    low, high = max(low, parameter.low), min(high, parameter.high)
    return replace(parameter, low=low, high=high, step=0.0) if low < high else parameter
