"""Tracks without the noise of a camera, as simulators write them.

The filter follows the mean and the covariance of the motion, with a flow in splines. In a track
without noise these approximations are all that it sees: the interval of σ_F misses, and the check
finds correlated errors in a motion that follows the model. With noise above the approximations it
does neither.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from driftwalk.schema import Track
from driftwalk.schema.tracking_noise import estimate_tracking_noise


class LeastNoisePolicy(NamedTuple):
    """Noise below which a track gets more (docs/explanation/likelihood.md)."""

    position_sides: float = 0.003
    """Standard deviation of a position, in sides: 0.09 mm. Measured: simulated recordings of a 3-cm
    block at 10 Hz are explained with 0.02 mm and more, and at 30 Hz not without any."""
    orientation_rad: float = 0.005
    """Standard deviation of the orientation: 0.29°. Measured: the same ones are explained with
    0.2°, and not with 0.15°."""
    without: float = 0.5
    """Share of this noise that the track's own is below, by two standard errors, where it gets
    more. Chosen by hand: cameras have two to six times the noise above."""


LEAST_NOISE: Final = LeastNoisePolicy()


class AddedNoise(NamedTuple):
    """Standard deviation of the noise that was added to a track."""

    position_noise_m: float
    orientation_noise_rad: float


def with_least_noise(track: Track, *, side: float, number: int) -> tuple[Track, AddedNoise]:
    """Return a track with white noise added where its positions have hardly any, and how much.

    Parameters
    ----------
    track : Track
        One body.
    side : float
        Its side [m].
    number : int
        Of the recording, >= 0: seed of the noise.

    Examples
    --------
    >>> time = 0.1 * np.arange(1000)
    >>> circle = Track(time, 0.1 * np.cos(time), 0.1 * np.sin(time), np.full(1000, np.nan))
    >>> seen, added = with_least_noise(circle, side=0.03, number=0)
    >>> round(1e3 * added.position_noise_m, 2), added.orientation_noise_rad
    (0.09, 0.0)
    >>> bool(abs((seen.x - circle.x).std() / added.position_noise_m - 1.0) < 0.1)
    True
    """
    own = estimate_tracking_noise(track)
    position = _lacking(
        own.position_noise_m,
        own.position_noise_standard_error_m,
        LEAST_NOISE.position_sides * side,
    )
    if not position:
        return track, AddedNoise(0.0, 0.0)
    orientation = _lacking(
        own.orientation_noise_rad,
        own.orientation_noise_standard_error_rad,
        LEAST_NOISE.orientation_rad if track.turns else 0.0,
    )
    added = AddedNoise(position, orientation)
    noise = np.random.default_rng(number).standard_normal((3, track.time.size))
    x, y = (
        at + added.position_noise_m * one
        for at, one in zip((track.x, track.y), noise[:2], strict=True)
    )
    theta = track.theta + added.orientation_noise_rad * noise[2]
    return track._replace(x=x, y=y, theta=theta), added


def _lacking(noise: float, error: float, least: float) -> float:
    """Return the noise that makes up for what is lacking; none where the estimate is unclear."""
    if not noise + 2.0 * error < LEAST_NOISE.without * least:
        return 0.0
    return float(np.sqrt(least**2 - noise**2))
