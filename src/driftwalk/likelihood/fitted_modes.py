"""Strength and modes of the flow in time: the frames of a flow, and their part of a fit."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.flow.grid import Grid
from driftwalk.likelihood.filter.parameters import Amplitudes, Point
from driftwalk.likelihood.filter.series import Series, layer_strengths, mode_amplitudes
from driftwalk.likelihood.law.candidate_laws import PULSES, STRENGTHS
from driftwalk.likelihood.spline import Spline

if TYPE_CHECKING:
    import xarray as xr

FRAMES_PER_PERIOD: Final = 32
"""Frames of a flow with modes; linear between them, an amplitude comes out 0.2 % too small in
closed form."""


class FramePolicy(NamedTuple):
    """Frames of a flow whose strength changes; between them it is linear in time."""

    per_half_wave: int = 10
    """Frames in half a wave of the fastest cosine: its amplitude comes out 1 % too small in closed
    form."""
    per_period: int = 16
    """Frames in a period of a pulse: its amplitude comes out 1 % too small in closed form."""
    most: int = 2000
    """Most frames: with the 50 by 50 nodes of a flow they take some 100 MB. Chosen by hand."""


FRAMES: Final = FramePolicy()


class Frames(NamedTuple):
    """When a flow is given, and how strong its layers are then."""

    time: Floats
    """From the first sample of the series on [s]."""
    strength: Floats
    """Of the mean flow and of its modes, shape (layers, frames)."""
    repeat: str
    """"loop" of a whole period, "hold" of a change over the recording."""


def flow_frames(series: Series, point: Point) -> Frames | None:
    """Return the frames of a flow with the strength and the modes of a fit; None of a steady one.

    Raises
    ------
    InputError
        When it changes so fast that there would be too many.
    """
    first, end = float(series.time[0]), float(series.time[-1] - series.time[0])
    known, strength = point.amplitudes, layer_strengths(series, point)
    if strength is None:
        return None
    grows = any(point.number(name) for name in STRENGTHS)
    if known is not None and not (grows or any(point.number(name) for name in PULSES)):
        strength = layer_strengths(replace(series, time=known.time), point)
        assert strength is not None
        return Frames(known.time - first, strength, known.repeat)
    steps = [series.span / (FRAMES.per_half_wave * len(STRENGTHS))]
    repeat = "hold"
    frequencies = _frequencies(point)
    if frequencies:
        period = 1.0 / max(*frequencies, 1e-300)
        steps.append(period / FRAMES.per_period)
        if known is None and len(frequencies) == 1 and not grows:
            repeat, end = "loop", period
    count = math.ceil(end / min(steps)) + 1
    if count > FRAMES.most:
        raise InputError(
            f"the strength of the flow changes too fast to be simulated: {count} frames would be "
            f"needed, and {FRAMES.most} are possible"
        )
    time = np.linspace(0.0, end, count)
    strength = layer_strengths(replace(series, time=first + time), point)
    assert strength is not None
    return Frames(time, strength, repeat)


def _frequencies(point: Point) -> list[float]:
    """Return the frequencies of the pulses and of the modes of a flow [Hz]."""
    pulses = [point.number("pulse_frequency")] if any(point.number(one) for one in PULSES) else []
    if point.amplitudes is not None:
        step = float(np.median(np.diff(point.amplitudes.time)))
        return [*pulses, 1.0 / (FRAMES.per_period * step)]
    return [*pulses, *([point.number("mode_frequency")] if point.layers > 1 else [])]


def strength_variables(point: Point, series: Series) -> tuple[dict[str, Any], dict[str, str]]:
    """Return variables and attributes of the strength of a fitted flow in time."""
    if not any(point.number(name) for name in (*STRENGTHS, *PULSES)):
        return {}, {}
    whole = replace(series, time=np.array([0.0, series.span]))
    slow = replace(point, opened={**point.opened, **dict.fromkeys(PULSES, 0.0)})
    words: dict[str, str] = {}
    try:
        frames = flow_frames(whole, point)
    except InputError as error:
        words["flow_strength_left_out"] = str(error)
        if point.layers > 1 or not any(point.number(name) for name in STRENGTHS):
            return {}, words
        point, frames = slow, flow_frames(whole, slow)
    assert frames is not None
    time, strength = frames.time, frames.strength[0]
    if frames.repeat == "hold" and _frequencies(point):
        # Pulses and modes do not stop where the recording happens to end: what stands still
        # afterwards is the flow without them.
        rest = layer_strengths(replace(series, time=whole.time[-1:]), slow)
        time = np.append(time, time[-1] + time[1])
        strength = np.append(strength, 1.0 if rest is None else rest[0])
    data = {"flow_strength": ("strength_time", strength), "strength_time": ("strength_time", time)}
    return data, {"flow_strength_repeat": frames.repeat, **words}


def mode_variables(
    point: Point, series: Series, spline: Spline, grid: Grid, count: Floats
) -> dict[str, Any]:
    """Return the variables of the modes; `count` as in the fit."""
    fields = np.stack([spline.values(one, grid.x, grid.y) for one in point.coefficients])
    seen = count >= 3
    speeds = np.sqrt((fields**2).sum(axis=1)[:, seen].mean(axis=-1))
    amplitudes = point.amplitudes
    if amplitudes is None:
        time = np.linspace(0.0, 1.0 / point.number("mode_frequency"), FRAMES_PER_PERIOD + 1)
        found = mode_amplitudes(float(series.time[0]) + time, point)
        amplitudes = Amplitudes(time, found, "loop")
    plane, knots = ("flow_mode", "y", "x"), ("flow_mode", "component", "knot_y", "knot_x")
    return {
        "mode_coefficient": (knots, point.coefficients[1:]),
        "u_mode": (plane, fields[1:, 0]),
        "v_mode": (plane, fields[1:, 1]),
        "mode_amplitude": (("flow_mode", "mode_time"), amplitudes.value),
        "mode_share": ("flow_mode", speeds[1:] / speeds[0]),
        "mode_time": ("mode_time", amplitudes.time),
    }


def stored_coefficients(fit: xr.Dataset) -> Floats:
    """Return the coefficients of a stored fit as a `Point` takes them."""
    mean = np.asarray(fit["coefficient"].values, dtype=np.float64)
    if "flow_mode" not in fit.dims:
        return mean
    return np.concatenate([mean[np.newaxis], fit["mode_coefficient"].values])


def stored_amplitudes(fit: xr.Dataset) -> Amplitudes | None:
    """Return the amplitudes of the modes of a stored fit; None without modes."""
    if "flow_mode" not in fit.dims:
        return None
    repeat = str(fit.attrs.get("mode_repeat", "loop"))
    return Amplitudes(fit["mode_time"].values, fit["mode_amplitude"].values, repeat)


class StoredFrames(NamedTuple):
    """Frames of a stored fit in one flow: its strength and the amplitudes of its modes."""

    time: Floats
    strength: Floats
    amplitude: Floats
    """Shape (modes, frames)."""
    repeat: str


def stored_frames(fit: xr.Dataset) -> StoredFrames | None:
    """Return when the flow of a fit is given, and how strong it is then; None of a steady one."""
    modes, changes = stored_amplitudes(fit), "flow_strength" in fit
    if modes is None and not changes:
        return None
    if modes is not None and not changes:
        return StoredFrames(modes.time, np.ones(modes.time.size), modes.value, modes.repeat)
    time, strength = fit["strength_time"].values, fit["flow_strength"].values
    amplitude = np.zeros((0, time.size))
    if modes is not None:
        # The last frame is that of the mean flow: see `strength_variables`.
        amplitude = modes.at(time) * (time < time[-1])
    return StoredFrames(time, strength, amplitude, str(fit.attrs["flow_strength_repeat"]))


def moving_fields(
    fit: xr.Dataset, frames: StoredFrames, mean: Mapping[str, Floats]
) -> dict[str, Floats]:
    """Return the variables of a flow field in frames, from those of its mean."""
    found = {
        name: np.broadcast_to(one, (frames.time.size, *one.shape)) for name, one in mean.items()
    }
    for name in ("u", "v"):
        field = mean[name]
        if len(frames.amplitude):
            field = field + np.tensordot(frames.amplitude.T, fit[f"{name}_mode"].values, 1)
        found[name] = frames.strength[:, None, None] * field
    return found
