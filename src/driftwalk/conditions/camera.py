"""Effect of a recording's camera on its poses, to apply it to simulated ones."""

from __future__ import annotations

from dataclasses import astuple
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from driftwalk.model import Study, apply_overrides
from driftwalk.schema.tracking_noise import estimate_tracking_noise, noise_bound
from driftwalk.simulation.backend import Camera

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.schema import Track


class CameraPolicy(NamedTuple):
    """Which effects of a recording's camera are simulated."""

    negligible_quantum: float = 0.05
    """Resolution of the file, as a share of the noise, below which it is not simulated; chosen
    by hand."""
    rough_noise: float = 0.05
    """Least relative error of an estimated noise, because the motion differs from the
    estimate's model: 2 % with a steady speed and a turning heading; chosen by hand."""
    clear: float = 2.0
    """Standard errors by which an estimated noise must be above zero; chosen by hand."""
    deviations: tuple[float, ...] = (-0.3775, 1.3630, -1.3630, 0.3775)
    """Noises that are simulated, in standard errors: in closed form the middles of four equal parts
    of a normal distribution, scaled to variance 1, neighbours far apart."""


_CAMERA: Final = CameraPolicy()


def recorded_camera(track: Track, study: Study, *, position_quantum: float) -> Camera:
    """Return the camera of a recording: values of the study, the rest estimated from the track.

    Rounding adds q^2/12 to the variance of the noise; where positions are rounded in simulation,
    that part of the estimate is taken away again. A resolution finer than a twentieth of the noise
    (a file with many digits) changes the variance by less than 0.03 % and is left out: it would
    only make steps tie.

    Parameters
    ----------
    track : Track
        The recorded body.
    study : Study
        Its [observation]: numbers stay, "estimate" and "recording" are filled in.
    position_quantum : float
        Resolution of the file [m], 0 when unknown.

    Returns
    -------
    Camera
        Noise [m], [rad] and resolution [m].

    Examples
    --------
    >>> import driftwalk as dw
    >>> from driftwalk.schema import body_track
    >>> track = body_track(dw.tank30_recording())
    >>> camera = dw.conditions.recorded_camera(track, dw.Study(), position_quantum=0.0)
    >>> round(camera.position_noise, 4)
    0.0003
    """
    seen = study.observation
    quantum = seen.position_quantum_m
    quantum = position_quantum if quantum == "recording" else quantum
    position, orientation = seen.position_noise_m, seen.orientation_noise_rad
    if "estimate" in (position, orientation):
        estimate = estimate_tracking_noise(track)
        if position == "estimate":
            variance = estimate.position_noise_m**2 - quantum**2 / 12.0
            position = float(np.sqrt(max(variance, 0.0)))
        if orientation == "estimate":
            orientation = estimate.orientation_noise_rad
    angle = float(orientation) if np.isfinite(orientation) else 0.0
    if seen.position_quantum_m == "recording" and quantum < _CAMERA.negligible_quantum * float(
        position
    ):
        quantum = 0.0
    return Camera(float(position), angle, float(quantum))


def possible_noises(track: Track, study: Study, camera: Camera) -> tuple[float, ...]:
    """Return noises of positions that a recording's camera may have, each as likely [m].

    A stated noise is the only one. Around an estimate there are four: the middles of four equal
    parts of its distribution. Its logarithm is normal, with the relative standard error of the
    estimate, or 5 % where that is less. Where an estimate is not above zero by two standard errors,
    the variance of the noise is normal instead, and lies between zero and what the shortest steps
    allow (`driftwalk.record.noise_bound`).

    Parameters
    ----------
    track : Track
        The recorded body.
    study : Study
        Its [observation].
    camera : Camera
        What `recorded_camera` makes of both.

    Examples
    --------
    >>> import driftwalk as dw
    >>> from driftwalk.schema import body_track
    >>> track, study = body_track(dw.tank30_recording()), dw.Study()
    >>> camera = recorded_camera(track, study, position_quantum=0.0)
    >>> [round(1e3 * noise, 2) for noise in possible_noises(track, study, camera)]
    [0.29, 0.32, 0.28, 0.3]
    >>> stated = dw.apply_overrides(study, {"observation.position_noise_m": 3e-4})
    >>> possible_noises(track, stated, recorded_camera(track, stated, position_quantum=0.0))
    (0.0003,)
    """
    if study.observation.position_noise_m != "estimate":
        return (camera.position_noise,)
    estimate = estimate_tracking_noise(track)
    noise, error = estimate.position_noise_m, estimate.position_noise_standard_error_m
    if not noise > _CAMERA.clear * error:
        return _unclear_noises(noise, error, noise_bound(track).position_noise_m, camera)
    doubt = max(error / noise, _CAMERA.rough_noise)
    return tuple(
        float(camera.position_noise * np.exp(doubt * deviation)) for deviation in _CAMERA.deviations
    )


def _unclear_noises(noise: float, error: float, bound: float, camera: Camera) -> tuple[float, ...]:
    """Return four noises by a normal distribution of the variance, from zero to a bound."""
    from scipy.special import ndtr, ndtri

    if not (np.isfinite(noise) and error > 0.0):
        return (camera.position_noise,)
    # The standard error of the noise comes from that of its variance, one way or the other.
    spread = max(2.0 * noise * error, error**2)
    low, high = ndtr(-(noise**2) / spread), ndtr((bound**2 - noise**2) / spread)
    shares = low + (high - low) * ndtr(np.array(_CAMERA.deviations))
    variances = noise**2 + spread * ndtri(shares) - camera.position_quantum**2 / 12.0
    return tuple(float(one) for one in np.sqrt(np.maximum(variances, 0.0)))


def study_as_seen(study: Study, recording: xr.Dataset, track: Track) -> Study:
    """Return a study whose [observation] has numbers: its own, or those of the recording's camera.

    Parameters
    ----------
    study : Study
        The study.
    recording : xarray.Dataset
        A `trajectory`.
    track : Track
        The body of it that counts.

    Examples
    --------
    >>> import driftwalk as dw
    >>> from driftwalk.schema import body_track
    >>> recording = dw.tank30_recording()
    >>> seen = study_as_seen(dw.Study(), recording, body_track(recording)).observation
    >>> round(seen.position_noise_m, 4)
    0.0003
    """
    quantum = float(recording.attrs.get("position_quantum_m", 0.0))
    camera = recorded_camera(track, study, position_quantum=quantum)
    keys = ("position_noise_m", "orientation_noise_rad", "position_quantum_m")
    seen = zip(keys, astuple(camera), strict=True)
    return apply_overrides(study, {f"observation.{key}": value for key, value in seen})
