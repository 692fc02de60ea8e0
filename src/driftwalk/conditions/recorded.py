"""The conditions that a simulation takes over: times and gaps, start, camera, neighbours, flow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from driftwalk.conditions.camera import study_as_seen
from driftwalk.core.arrays import Bools, Floats
from driftwalk.core.errors import InputError
from driftwalk.core.processors import default_threads
from driftwalk.core.smoothing import local_quadratic
from driftwalk.flow import extract_flow
from driftwalk.flow.arena import outline_of
from driftwalk.schema import Track, body_names, body_track, build_trajectory
from driftwalk.simulation import simulate
from driftwalk.simulation.backend import Camera
from driftwalk.simulation.initial import Start
from driftwalk.simulation.series import continued_flow

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import FieldOfView, Study, Tank


@dataclass(frozen=True, eq=False)
class Neighbours:
    """The other bodies in the tank, each with its recorded samples.

    Attributes
    ----------
    tracks : tuple of Track
        Present samples of each.

    Examples
    --------
    >>> from driftwalk.schema import Track
    >>> time = np.arange(5.0)
    >>> other = Track(time, 0.01 * time, 0.0 * time, np.full(5, np.nan))
    >>> Neighbours((other,)).at([0.5, 9.0])[:, 0].tolist()
    [[0.005, 0.0], [nan, nan]]
    """

    tracks: tuple[Track, ...]

    def since(self, begin: float) -> Neighbours:
        """Return the same with times [s] that count from `begin` on."""
        return Neighbours(tuple(one._replace(time=one.time - begin) for one in self.tracks))

    def at(self, time: npt.ArrayLike) -> Floats:
        """Return where they are at times [s], shape (times, bodies, 2) [m].

        Between two samples in a straight line; NaN within gaps, before the first and after the last
        sample.
        """
        wanted = np.asarray(time, dtype=np.float64)
        found = np.full((wanted.size, len(self.tracks), 2), np.nan)
        for k, track in enumerate(self.tracks):
            there = _within_samples(track.time, wanted)
            for axis, values in enumerate((track.x, track.y)):
                found[there, k, axis] = np.interp(wanted[there], track.time, values)
        return found


def neighbours_of(recording: xr.Dataset, body: str | None, tank: Tank) -> Neighbours | None:
    """Return the other bodies of a recording that are in the tank; None where there are none.

    A body that is mostly beyond the wall is in another tank: one recording may show several. Where
    each body has its own tank, none is another's neighbour.

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    body : str or None
        The body that is followed; None where there is one alone.
    tank : Tank
        Its tank.

    Examples
    --------
    >>> import driftwalk as dw
    >>> neighbours_of(dw.tank30_recording(), None, dw.Study().tank) is None
    True
    """
    names = body_names(recording)
    if body is None or len(names) < 2 or recording.attrs.get("bodies_apart") == "yes":
        return None
    outline = outline_of(tank.to_arena())
    tracks = [body_track(recording, name) for name in names if name != body]
    inside = tuple(
        one
        for one in tracks
        if one.time.size > 1 and np.mean(outline.depth(one.x, one.y) >= 0.0) > 0.5
    )
    return Neighbours(inside) if inside else None


def _within_samples(time: Floats, wanted: Floats) -> Bools:
    """Return which times lie between two samples that are no more than a gap apart."""
    # Over five median intervals a body has moved straight on: trackers drop a frame or two, and
    # after more its place is unknown.
    longest = 5.0 * float(np.median(np.diff(time)))
    after = np.clip(np.searchsorted(time, wanted), 1, time.size - 1)
    close = time[after] - time[after - 1] <= longest
    return np.asarray((wanted >= time[0]) & (wanted <= time[-1]) & close)


def recording_flow(recording: xr.Dataset, study: Study, *, body: str | None = None) -> xr.Dataset:
    """Return the flow field that a calibration takes from the recording if none is given.

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    study : Study
        Tank, block, water and the section [flow].
    body : str, optional
        The body, where there are several.

    Returns
    -------
    xarray.Dataset
        A `flow_field`, by the paper's estimator (Eq. 4).

    Raises
    ------
    InputError
        When no cell can be measured.

    Examples
    --------
    >>> import driftwalk as dw
    >>> int(dw.conditions.recording_flow(dw.tank30_recording(), dw.Study()).sizes["x"])
    50
    """
    return flow_from_track(body_track(recording, body), study)


def flow_from_track(track: Track, study: Study) -> xr.Dataset:
    """Return the flow field of one track; see `recording_flow`."""
    return flow_by_study(build_trajectory(*track), study, arena=study.tank.to_arena())


def flow_by_study(
    trajectory: xr.Dataset,
    study: Study,
    *,
    body: str | None = None,
    arena: dict[str, Any] | None = None,
) -> xr.Dataset:
    """Return the flow field of a trajectory, with the block, the water and [flow] of a study.

    Parameters
    ----------
    trajectory : xarray.Dataset
        A `trajectory`.
    study : Study
        Block, water and the section [flow].
    body : str, optional
        The body where there are several, or "all" of them.
    arena : dict, optional
        The tank; default: the one that the trajectory states.

    Examples
    --------
    >>> import driftwalk as dw
    >>> int(dw.conditions.flow_by_study(dw.tank30_recording(), dw.Study()).sizes["x"])
    50
    """
    settings = study.flow
    return extract_flow(
        trajectory,
        body=body,
        arena=arena,
        cells=settings.cells,
        cell_size=settings.cell_size_m,
        window=settings.smoothing_window_s,
        inertia=settings.inertia,
        mass=study.block.mass_kg,
        side=study.block.side_m,
        depth=study.wetted_depth_m,
        water_density=study.water.density_kg_m3,
        flow_drag_coefficient=settings.flow_drag_coefficient,
        min_count=settings.min_count,
    )


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

    Without its gaps, where the study leaves them out: even stamps at the median interval.
    """
    time: Floats = track.time - track.time[0]
    if study.observation.gaps != "none" or time.size < 2:
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
    fits = local_quadratic(time, values, window=2.0 * window, at=slice(1))
    position, velocity, _ = (fit[0] for fit in fits)
    raw = values[0]
    position = np.where(np.isfinite(position), position, raw)
    velocity = np.where(np.isfinite(velocity), velocity, 0.0)
    if not np.isfinite(track.theta[first]).all():
        position[2], velocity[2] = np.nan, 0.0
    return Start(*(float(value) for value in (*position, *velocity)))


def simulate_like(
    study: Study,
    flow: xr.Dataset,
    recording: xr.Dataset,
    *,
    body: str | None = None,
    replicates: int | None = None,
    seed: int | None = None,
    threads: int | None = None,
) -> xr.Dataset:
    """Simulate with the start, time stamps, gaps and camera of a recording.

    Parameters
    ----------
    study, flow
        As in `simulate`; noise and resolution that the study leaves open are the recording's.
    recording : xarray.Dataset
        A `trajectory`; its present samples give the time stamps, its first samples the start.
    body : str, optional
        The body to follow, where there are several.
    replicates, seed, threads
        As in `simulate`.

    Returns
    -------
    xarray.Dataset
        As of `simulate`; time 0 is the recording's first sample.

    Raises
    ------
    InputError
        When the body is not named and there are several.

    Examples
    --------
    >>> import driftwalk as dw
    >>> recording, flow = dw.tank30_recording(), dw.tank30_flow()
    >>> run = dw.simulate_like(dw.Study(), flow, recording.isel(time=slice(0, 100)))
    >>> run.sizes["time"]
    100
    """
    track = body_track(recording, body)
    study = study_as_seen(study, recording, track)
    return simulate(
        study,
        flow,
        sample_time=sample_times(track, study),
        start=recorded_start(track),
        flow_start=0.0,
        replicates=replicates,
        seed=seed,
        threads=threads,
    )
