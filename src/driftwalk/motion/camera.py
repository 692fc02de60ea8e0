"""Simulated positions as the camera of a recording would have seen them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Bools, Floats, Keys
from driftwalk.core.random_streams import MotionStream
from driftwalk.motion.protocol import WorldRandom, Worlds
from driftwalk.schema.trajectory import wrap_angle
from driftwalk.simulation.backend import STATUS, wall_edges

if TYPE_CHECKING:
    from driftwalk.conditions.recorded import Conditions
    from driftwalk.model import FieldOfView


def observe_worlds(
    x: Floats, y: Floats, theta: Floats | None, like: Conditions, keys: Keys
) -> Worlds:
    """Return true positions as the camera of a recording would have recorded them.

    Noise is added, positions are rounded to the file's resolution, and what lies outside the field
    of view is missing. A world with a number that is not finite has the status "non_finite", one
    that stays where it is "no_motion".

    Parameters
    ----------
    x, y : ndarray, shape (worlds, samples)
        True positions [m].
    theta : ndarray, shape (worlds, samples), optional
        True orientations [rad].
    like : Conditions
        The conditions of the recording.
    keys : ndarray of uint64, shape (worlds,)
        The address of every world's random numbers.

    Returns
    -------
    Worlds
        What `MotionModel.simulate` returns.

    Examples
    --------
    >>> import driftwalk as dw
    >>> from driftwalk.schema import Track
    >>> from driftwalk.simulation.backend import Camera
    >>> time = np.arange(40) / 20
    >>> track = Track(time, 0.05 * time, 0.0 * time, 0.0 * time)
    >>> camera = Camera(position_noise=1e-3)
    >>> like = dw.conditions.recorded_conditions(track, dw.Study(), camera=camera)
    >>> keys = np.array([1], dtype=np.uint64)
    >>> seen = dw.motion.observe_worlds(track.x[None], track.y[None], None, like, keys)
    >>> float(np.abs(seen.x - track.x).max()) < 5e-3
    True
    """
    status = _status(x, y, theta, like.sample_time)
    angle = np.full(x.shape, np.nan) if theta is None else theta
    camera = like.camera
    if camera.position_noise > 0.0 or camera.orientation_noise > 0.0:
        noise = WorldRandom(keys, MotionStream.CAMERA).normal(3, x.shape[1])
        x = x + camera.position_noise * noise[:, 0]
        y = y + camera.position_noise * noise[:, 1]
        angle = angle + camera.orientation_noise * noise[:, 2]
    if camera.position_quantum > 0.0:
        x, y = (_rounded(values, camera.position_quantum) for values in (x, y))
    angle = wrap_angle(angle)
    if like.view is not None:
        seen = _seen(like.view, x, y)
        x, y, angle = (np.where(seen, values, np.nan) for values in (x, y, angle))
    return Worlds(x, y, angle, status)


def _status(
    x: Floats, y: Floats, theta: Floats | None, sample_time: Floats
) -> npt.NDArray[np.uint32]:
    sound = np.isfinite(x).all(axis=1) & np.isfinite(y).all(axis=1)
    if theta is not None:
        sound &= np.isfinite(theta).all(axis=1)
    half = sample_time.size // 2
    path = sum(np.abs(np.diff(values[:, half:], axis=1)).sum(axis=1) for values in (x, y))
    # A slower world does not move, as in the core.
    still = sound & (path < 1e-6 * (sample_time[-1] - sample_time[half]))
    status = np.where(sound, 0, STATUS["non_finite"]) | np.where(still, STATUS["no_motion"], 0)
    return np.asarray(status, dtype=np.uint32)


def _rounded(values: Floats, quantum: float) -> Floats:
    """Return the nearest multiples of the resolution, halves away from zero."""
    return np.asarray(np.copysign(np.floor(np.abs(values) / quantum + 0.5), values) * quantum)


def _seen(view: FieldOfView, x: Floats, y: Floats) -> Bools:
    dx, dy = x - view.center_m[0], y - view.center_m[1]
    if view.radius_m is not None:
        return np.asarray(dx**2 + dy**2 <= view.radius_m**2)
    seen = np.ones(x.shape, dtype=bool)
    for normal_x, normal_y, distance in wall_edges(view):
        seen &= dx * normal_x + dy * normal_y <= distance
    return seen
