"""The conditions that a simulation takes over: times and gaps, start, camera, tank and flow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from driftwalk.conditions.neighbours import Neighbours
from driftwalk.core.errors import InputError
from driftwalk.core.processors import default_threads
from driftwalk.core.smoothing import local_quadratic
from driftwalk.simulation.backend import Camera
from driftwalk.simulation.initial import Start
from driftwalk.simulation.series import continued_flow

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import FieldOfView, Study, Tank
    from driftwalk.schema import Track

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Conditions:
    """The conditions of a recording, for every world that is to be compared with it.

    Attributes
    ----------
    sample_time : ndarray, shape (n,)
        Time stamps of a world [s]: the recording's from its first sample on, with its gaps unless
        the study leaves them out.
    start : Start
        Pose and motion at the first sample; theta is NaN where the recording has no orientation.
    camera : Camera
        Noise and resolution of the samples.
    tank : Tank
        The tank and its wall.
    view : FieldOfView or None
        What the camera sees, when that is less than the tank.
    flow : xarray.Dataset or None
        The water's velocity, a `flow_field`; None where it plays no part.
    threads : int
        Threads to use; results do not depend on it.
    neighbours : Neighbours or None
        The other bodies in the tank, for a model that feels them; None where there are none.
    flow_start : ndarray, shape (worlds,), or None
        Time on the clock of a flow that changes at which each world begins [s]; None: 0, where that
        clock is the recording's from its first sample on.
    """

    sample_time: Floats
    start: Start
    camera: Camera
    tank: Tank
    view: FieldOfView | None
    flow: xr.Dataset | None
    threads: int
    neighbours: Neighbours | None = None
    flow_start: Floats | None = None


def recorded_conditions(
    track: Track,
    study: Study,
    *,
    camera: Camera,
    flow: xr.Dataset | None = None,
    neighbours: Neighbours | None = None,
    threads: int | None = None,
) -> Conditions:
    """Return the conditions of a recorded track.

    Parameters
    ----------
    track : Track
        The present samples of one body.
    study : Study
        Tank, observation and the window over which the start is smoothed.
    camera : Camera
        See `recorded_camera`.
    flow : xarray.Dataset, optional
        A `flow_field`; the time of one that changes counts from the recording's first sample.
    neighbours : Neighbours, optional
        The other bodies on the clock of the recording, see `neighbours_of`.
    threads : int, optional
        Default: all processors.

    Raises
    ------
    InputError
        When the track has no sample, or the flow is over before the recording.

    Examples
    --------
    >>> import driftwalk as dw
    >>> from driftwalk.schema import body_track
    >>> track = body_track(dw.tank30_recording())
    >>> camera = dw.conditions.recorded_camera(track, dw.Study(), position_quantum=0.0)
    >>> dw.conditions.recorded_conditions(track, dw.Study(), camera=camera).sample_time.size
    18001
    """
    start = recorded_start(track, window=study.flow.smoothing_window_s)
    time = sample_times(track, study)
    if flow is not None:
        flow = continued_flow(flow, study, duration=float(time[-1]), begin=0.0)
    return Conditions(
        sample_time=time,
        start=start,
        camera=camera,
        tank=study.tank,
        view=study.observation.field_of_view,
        flow=flow,
        threads=threads or default_threads(),
        neighbours=None if neighbours is None else neighbours.since(float(track.time[0])),
    )


def sample_times(track: Track, study: Study) -> Floats:
    """Return the time stamps of a world [s]: the recording's, from its first sample on.

    Without its gaps, where the study leaves them out.
    """
    time = track.time - track.time[0]
    return _without_gaps(time) if study.observation.gaps == "none" else time


def _without_gaps(time: Floats) -> Floats:
    """Return even time stamps [s] over the same span, at the median interval of the given ones."""
    if time.size < 2:
        return time
    interval = float(np.median(np.diff(time)))
    count = int(np.floor(time[-1] / interval + 1e-6)) + 1
    return np.arange(count, dtype=np.float64) * interval


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
