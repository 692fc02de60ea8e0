"""Start of a recording, for the simulations that are to be compared with it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.core.smoothing import local_quadratic
from driftwalk.simulation.initial import Start

if TYPE_CHECKING:
    from driftwalk.schema import Track


def recorded_start(track: Track, *, window: float = 0.7) -> Start:
    """Return the pose and smoothed motion at the first sample of a recording.

    Parameters
    ----------
    track : Track
        The recorded body.
    window : float
        Time from the first sample on over which a quadratic is fitted [s].

    Returns
    -------
    Start
        Smoothed where the first samples allow it, else the first sample at rest. Without
        orientation in the recording theta is NaN: each world then draws its own.

    Raises
    ------
    InputError
        When the track has no sample.

    Examples
    --------
    >>> from driftwalk.schema import Track
    >>> time = np.arange(40) / 20
    >>> track = Track(time, 0.05 * time, 0.0 * time, 0.0 * time)
    >>> round(float(recorded_start(track).vx), 3)
    0.05
    """
    if track.time.size == 0:
        raise InputError("the recording has no sample to start from")
    first = slice(0, min(track.time.size, 64))
    time = track.time[first]
    turn = np.unwrap(np.where(np.isfinite(track.theta[first]), track.theta[first], 0.0))
    values = np.column_stack([track.x[first], track.y[first], turn])
    # The first sample has neighbours on one side only: half of this window holds none.
    position, velocity, _ = (fit[0] for fit in local_quadratic(time, values, window=2.0 * window))
    raw = values[0]
    position = np.where(np.isfinite(position), position, raw)
    velocity = np.where(np.isfinite(velocity), velocity, 0.0)
    if not np.isfinite(track.theta[first]).all():
        position[2], velocity[2] = np.nan, 0.0
    return Start(*(float(value) for value in (*position, *velocity)))
