"""Refuse recordings without a motion: no position, too short, or at rest.

A recording that is unfit for one estimator is unfit for all: each of them asks here.
"""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from driftwalk.conditions.camera import recorded_camera
from driftwalk.core.errors import InputError
from driftwalk.model import Study, apply_overrides
from driftwalk.record import arena_diagonal, impossible_steps, impossible_warning
from driftwalk.schema import Track, body_names, body_track
from driftwalk.schema.outliers import outliers_warning, without_far_outliers
from driftwalk.schema.trajectory import read_arena

if TYPE_CHECKING:
    import xarray as xr


class MotionPolicy(NamedTuple):
    """Which recordings show a motion."""

    fewest_positions: int = 3
    """Positions of two steps, which have one turning angle; by definition."""
    least_motion: float = 0.1
    """Range of the positions, in sides of the block, below which it is at rest; chosen by hand."""
    least_motion_in_noises: float = 3.0
    """Standard deviation of the positions, in tracking noises, below which a body is at rest;
    chosen by hand."""
    kept: float = 0.99
    """Share of the positions that the range contains: single jumps of the tracker are left out;
    chosen by hand."""


_MOTION: Final = MotionPolicy()


def require_positions(recording: xr.Dataset, *, where: str | PathLike[str] = "") -> None:
    """Refuse a recording without a single position.

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    where : path-like
        The file, for the message; default: the name that the recording has.

    Raises
    ------
    InputError
        When no sample has both coordinates.

    Examples
    --------
    >>> import driftwalk as dw
    >>> dw.conditions.require_positions(dw.tank30_recording())
    """
    if not (np.isfinite(recording["x"].values) & np.isfinite(recording["y"].values)).any():
        raise InputError(
            f"{prefix_of(recording, where)}no row holds a position: are these the right columns?"
        )


def require_motion(
    recording: xr.Dataset, *, body: str | None = None, where: str | PathLike[str] = ""
) -> None:
    """Refuse a recording that is too short for motion, or in which the body never moves.

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    body : str, optional
        The body, where there are several; "all" asks that one of them moves.
    where : path-like
        The file, for the message; default: the name that the recording has.

    Raises
    ------
    InputError
        When fewer than three positions are there, or all are the same; when there are several
        bodies and none is named.

    Examples
    --------
    >>> import driftwalk as dw
    >>> dw.conditions.require_motion(dw.tank30_recording())
    """
    names = body_names(recording) if body == "all" else [body]
    try:
        tracks = [body_track(recording, name) for name in names]
    except InputError as error:
        raise InputError(f"{prefix_of(recording, where)}{error}") from error
    most = max(track.time.size for track in tracks)
    if most < _MOTION.fewest_positions:
        rows = "1 position" if most == 1 else f"{most} positions"
        raise InputError(
            f"{prefix_of(recording, where)}holds {rows} in the time that is kept, at least "
            f"{_MOTION.fewest_positions} are needed for a motion"
        )
    if not any(one.x.size and (np.ptp(one.x) > 0 or np.ptp(one.y) > 0) for one in tracks):
        still = body_names(recording) if body is None else names
        which = ", ".join(f"'{name}'" for name in still)
        raise InputError(
            f"{prefix_of(recording, where)}the body never moves ({which}): all {most} positions "
            f"are ({tracks[0].x[0]:g}, {tracks[0].y[0]:g}) m"
        )


def require_travel(
    track: Track, study: Study, *, of_block: bool = True, where: str | PathLike[str] = ""
) -> None:
    """Refuse a body that does not move, or no further than its tracker is noisy.

    Parameters
    ----------
    track : Track
        The present samples of one body.
    study : Study
        The block and the camera.
    of_block : bool
        Whether the body is the block of the study, which has to leave its place; the size of
        another body is not known.
    where : path-like
        The recording, to begin the message with.

    Raises
    ------
    InputError
        With how far it goes and where it is.

    Examples
    --------
    >>> import driftwalk as dw
    >>> from driftwalk.schema import body_track
    >>> require_travel(body_track(dw.tank30_recording(), None), dw.Study())
    """
    begin = f"{where}: " if str(where) else ""
    tail = 0.5 * (1.0 - _MOTION.kept)
    width = max(float(np.ptp(np.quantile(axis, (tail, 1.0 - tail)))) for axis in (track.x, track.y))
    scatter = max(float(track.x.std()), float(track.y.std()))
    # The study may say what the tracker's noise should be; this is what it is.
    measured = apply_overrides(study, {"observation.position_noise_m": "estimate"})
    noise = recorded_camera(track, measured, position_quantum=0.0).position_noise
    at_rest = of_block and width < _MOTION.least_motion * study.block.side_m
    if at_rest or scatter < _MOTION.least_motion_in_noises * noise:
        place = f"({np.median(track.x):.3f}, {np.median(track.y):.3f}) m"
        why = (
            f"less than a tenth of its side of {1e3 * study.block.side_m:g} mm"
            if at_rest
            else f"no more than the tracking noise of {1e3 * noise:.2g} mm would show"
        )
        raise InputError(
            f"{begin}the body never moves: it stays within {1e3 * width:.2g} mm around {place}, "
            f"{why}, and there is nothing to fit; check the units, the body (`body`) and the time "
            "that is kept (`start`, `stop` of `load`)"
        )
    if typical_speed([track]) == 0.0:
        raise InputError(
            f"{begin}the body rests in 99 % of the recording, at the same position to the last "
            "digit, and there is no motion to fit; check the body (`body`) and the time that is "
            "kept (`start`, `stop` of `load`)"
        )


def typical_speed(tracks: Sequence[Track]) -> float:
    """Return the root mean square speed over some ten samples, robust to outliers.

    Parameters
    ----------
    tracks : sequence of Track
        The present samples of one body, by recording.

    Returns
    -------
    float
        Speed [m/s]; 0 where the body rests in 99 % of the recordings.

    Examples
    --------
    >>> time = np.arange(100.0)
    >>> track = Track(time, 0.02 * time, 0.0 * time, 0.0 * time)
    >>> round(typical_speed([track]), 6)
    0.02
    """
    speeds = []
    for track in tracks:
        stride = max(1, min(10, track.time.size // 10))
        way = np.hypot(*(axis[stride:] - axis[:-stride] for axis in (track.x, track.y)))
        speeds.append(way / (track.time[stride:] - track.time[:-stride]))
    speed = np.concatenate(speeds)
    return float(np.sqrt(np.mean(np.minimum(speed, np.quantile(speed, 0.99)) ** 2)))


def prefix_of(recording: xr.Dataset, where: str | PathLike[str] = "") -> str:
    """Return what a message on a recording begins with: its file or its name, where it has one."""
    name = str(where) or recording.attrs.get("source", "")
    return f"{name}: " if name else ""


def jump_warnings(
    recording: xr.Dataset, body: str | None = None, *, track: Track | None = None
) -> list[str]:
    """Return a warning where a body makes steps that it cannot have made; else nothing.

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    body : str, optional
        The body, where there are several.
    track : Track, optional
        What is used of the body; default: all of its samples.

    Examples
    --------
    >>> import driftwalk as dw
    >>> jump_warnings(dw.tank30_recording())
    []
    """
    used = body_track(recording, body) if track is None else track
    arena = read_arena(str(recording.attrs.get("arena", "{}")))
    x, y = ([recording[axis].values.ravel()] for axis in ("x", "y"))
    steps = impossible_steps(used.time, used.x, used.y, diagonal=arena_diagonal(x, y, arena))
    name = str(recording["body"].values[0]) if body is None else body
    return [] if steps is None else [impossible_warning(name, steps)]


def sound_track(recording: xr.Dataset, body: str | None = None) -> tuple[Track, list[str]]:
    """Return a body's track without its outliers, and what to say of them.

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    body : str, optional
        The body, where there are several.

    Examples
    --------
    >>> import driftwalk as dw
    >>> track, warnings = sound_track(dw.tank30_recording())
    >>> track.time.size, warnings
    (18001, [])
    """
    seen = body_track(recording, body)
    track = without_far_outliers(seen)
    wrong = seen.time.size - track.time.size
    said = [outliers_warning(wrong, seen.time.size)] if wrong else []
    return track, [*said, *jump_warnings(recording, body, track=track)]
