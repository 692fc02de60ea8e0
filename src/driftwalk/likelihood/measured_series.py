"""Mean and modes of a series of measured frames, with the errors that their spread tells.

The frames are ``m(x, t) = u_0(x) + sum over l of a_l(t) u_l(x) + e``. The amplitudes a_l are the
largest principal components in time (Lumley's proper orthogonal decomposition; of frames with gaps
that of Everson and Sirovich 1995), scaled to unit rms. With them known, u_0 and the u_l follow from
the frames by least squares, node by node.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Bools, Floats
from driftwalk.core.errors import InputError
from driftwalk.core.units import in_percent
from driftwalk.likelihood.filter.parameters import Amplitudes
from driftwalk.likelihood.fitted_modes import FRAMES, stored_amplitudes
from driftwalk.schema import FLAGS, build_flow_field
from driftwalk.simulation.series import continued_flow, series_of

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


class FlowChangePolicy(NamedTuple):
    """When frames are those of a steady flow, and which of their modes a fit takes."""

    most_change: float = 0.05
    """Largest mode of the frames (rms over time and place), over the flow, in a steady flow. A
    change of 3 to 5 % of the flow begins to move C_d (docs/explanation/likelihood.md)."""
    least_change: float = 0.01
    """Smallest mode that is taken of a flow that changes. Chosen by hand: a fifth of that."""
    most_modes: int = 5
    """With the mean, in the usual tank, they are as many coefficients as a fit of several flows may
    have (`LimitPolicy.most_coefficients`); chosen by hand."""
    most_left: float = 0.03
    """Largest mode that may be left out. Measured: of jets that turn, one of 3.3 % made C_d 3 % too
    small, one of 4.8 % 7 %, one of 8 % 12 %; when they were taken it was 1 to 3 %."""
    above_noise: float = 2.0
    """Its singular value over the largest of independent errors, from which on it is no noise.
    Windows that overlap by half share their errors and double it; chosen by hand."""
    pooled: float = 10.0
    """Frames that the spread of all nodes counts in that of one node. Chosen by hand."""


FLOW_CHANGE: Final = FlowChangePolicy()


def compressed(field: xr.Dataset, study: Study, *, duration: float = 0.0) -> xr.Dataset:
    """Return the mean of the frames, and with it the modes of a flow that changes.

    Nodes that were measured in half of the frames count; of a flow that changes, frames in which
    half of those were. Time 0 of the series is the first sample of a recording of that duration
    [s]; refuses one that goes beyond the frames of a flow that changes, unless it is known how the
    flow goes on.
    """
    if "time" not in field.dims:
        return field
    frames = field.transpose("time", "y", "x")
    velocity = np.stack([frames[name].values for name in ("u", "v")])
    seen = frames["flag"].values == FLAGS["measured"]
    number = seen.sum(axis=0)
    there = number >= max(2.0, 0.5 * len(seen))
    count = np.maximum(number, 1)
    mean = np.where(seen, velocity, 0.0).sum(axis=1) / count
    off = np.where(seen, velocity - mean[:, None], 0.0)
    layers, counts = mean[np.newaxis], count[np.newaxis].astype(np.float64)
    modes = _principal(off[:, :, there], mean[:, there])
    whole = seen[:, there].mean(axis=1) >= 0.5
    if len(modes) and not whole.all():
        return compressed(field.isel(time=whole), study, duration=duration)
    if len(modes):
        layers, counts, off, modes = _regressed(modes, off, seen & there, mean)
    squares = (off**2).sum(axis=(0, 1)) / 2.0
    degrees = np.maximum(number - len(layers), 0)
    pooled = float(squares[there].sum() / max(degrees[there].sum(), 1))
    variance = (FLOW_CHANGE.pooled * pooled + squares) / (FLOW_CHANGE.pooled + degrees)
    error = np.where(there, np.sqrt(variance / counts), np.nan)
    found = build_flow_field(
        field["x"].values, field["y"].values, u=layers[0, 0], v=layers[0, 1],
        flag=np.where(there, FLAGS["measured"], FLAGS["filled"]),
        u_standard_error=error[0], v_standard_error=error[0],
        attrs={**field.attrs, "errors": f"from the spread of {len(seen)} frames"},
    )  # fmt: skip
    if not len(modes):
        return found
    known = _on_clock(modes, continued_flow(field, study, duration=duration, begin=0.0))
    return with_modes(found, known, layers[1:].swapaxes(0, 1), np.stack([error[1:]] * 2))


def with_modes(
    field: xr.Dataset, amplitudes: Amplitudes, velocity: Floats, error: Floats
) -> xr.Dataset:
    """Return a mean flow with its modes and their errors, shapes (2, modes, y, x)."""
    plane = ("mode", "y", "x")
    data = {"frame": ("frame", amplitudes.time), "amplitude": (("mode", "frame"), amplitudes.value)}
    for name, one, off in zip("uv", velocity, error, strict=True):
        data |= {f"{name}_mode": (plane, one), f"{name}_mode_error": (plane, off)}
    return field.assign(data).assign_attrs(repeat=amplitudes.repeat)


def amplitudes_in(field: xr.Dataset) -> Amplitudes | None:
    """Return the amplitudes of the modes of a compressed series; None of a steady flow."""
    if "amplitude" not in field:
        return None
    return Amplitudes(field["frame"].values, field["amplitude"].values, field.attrs["repeat"])


def stored_flow(fit: xr.Dataset) -> xr.Dataset | None:
    """Return the measured flow that a fit was made with, as a flow field with its errors."""
    if "measured_u" not in fit:
        return None
    names = ("measured_u", "measured_v", "measured_u_error", "measured_v_error")
    u, v, u_error, v_error = (fit[name].values for name in names)
    x, y = fit["measured_x"].values, fit["measured_y"].values
    flag = np.where(np.isfinite(u), FLAGS["measured"], FLAGS["outside"])
    field = build_flow_field(
        x, y, u=np.nan_to_num(u), v=np.nan_to_num(v), flag=flag,
        u_standard_error=u_error, v_standard_error=v_error,
        attrs={
            "method": "file", "cell_size_m": float(x[1] - x[0]),
            "source": fit.attrs["measured_flow"], "errors": fit.attrs["measured_flow_errors"],
        },
    )  # fmt: skip
    known = stored_amplitudes(fit)
    if known is None:
        return field
    velocity, error = (
        np.stack([fit[f"measured_{name}_mode{end}"].values for name in "uv"])
        for end in ("", "_error")
    )
    return with_modes(field, known, np.nan_to_num(velocity), error)


def _principal(off: Floats, mean: Floats) -> Floats:
    """Return the amplitudes of the modes that are no noise, of (2, frames, nodes) from their mean.

    None where the flow is steady; refuses a flow that more modes than a fit takes change.
    """
    changes = np.concatenate(list(off), axis=1)
    frames, values = changes.shape
    if not changes.size:
        return np.zeros((0, frames))
    # The larger eigenvalues, of the smaller of the two products.
    wide = frames < values
    powers, vectors = np.linalg.eigh(changes @ changes.T if wide else changes.T @ changes)
    left, flow = float((changes**2).sum()), math.sqrt(max(float((mean**2).mean()), 1e-300))
    shares = []
    for power in np.maximum(powers[::-1], 0.0):
        edge = math.sqrt(left / changes.size) * (math.sqrt(frames) + math.sqrt(values))
        share = math.sqrt(power / changes.size) / flow
        if share <= FLOW_CHANGE.least_change or math.sqrt(power) <= FLOW_CHANGE.above_noise * edge:
            break
        shares.append(share)
        left = max(left - float(power), 0.0)
    if not shares or shares[0] <= FLOW_CHANGE.most_change:
        return np.zeros((0, frames))
    if (
        len(shares) > FLOW_CHANGE.most_modes
        and shares[FLOW_CHANGE.most_modes] > FLOW_CHANGE.most_left
    ):
        raise InputError(
            f"the measured flow changes in time in {len(shares)} modes, and the fit takes "
            f"{FLOW_CHANGE.most_modes}: the next one is "
            f"{in_percent(shares[FLOW_CHANGE.most_modes])} of the flow; fit a part of the time in "
            "which it changes less"
        )
    largest = vectors[:, ::-1][:, : min(len(shares), FLOW_CHANGE.most_modes)]
    found = (largest if wide else changes @ largest).T
    return np.asarray(found / np.sqrt((found**2).mean(axis=1, keepdims=True)))


class _Regression(NamedTuple):
    """Least squares of frames by known amplitudes."""

    layers: Floats
    """Mean and modes, shape (layers, 2, y, x)."""
    counts: Floats
    """Frames that would tell the mean as well, shape (layers, y, x)."""
    rest: Floats
    """Rest of the frames, shape (2, frames, y, x)."""
    modes: Floats
    """Amplitudes, shape (modes, frames)."""


def _regressed(modes: Floats, off: Floats, seen: Bools, mean: Floats) -> _Regression:
    """Return mean and modes at every node; `off` is the difference of the frames from `mean`."""
    frames, there = len(seen), seen.any(axis=0)
    known, values = seen[:, there].astype(np.float64), off[:, :, there] * seen[:, there]
    both, twice = np.concatenate(list(values), axis=1), np.concatenate([known, known], axis=1)
    one = np.ones((frames, 1))
    # The components are those of frames whose gaps are the mean: a second pass mends them.
    shape, _ = _solved(np.hstack([one, modes.T]), both, twice)
    modes, _ = _solved(shape[1:].T, (both - twice * shape[0]).T, twice.T)
    modes = modes / np.sqrt((modes**2).mean(axis=1, keepdims=True))
    basis = np.hstack([one, modes.T])
    shape, inverse = _solved(basis, both, twice)
    layers = np.zeros((len(shape), *mean.shape))
    layers[:, :, there] = shape.reshape(len(shape), 2, -1)
    layers[0] += mean
    counts = np.ones((len(shape), *there.shape))
    counts[:, there] = 1.0 / inverse[:, : known.shape[1]]
    rest = np.zeros_like(off)
    rest[:, :, there] = (twice * (both - basis @ shape)).reshape(frames, 2, -1).swapaxes(0, 1)
    return _Regression(layers, counts, rest, modes)


def _solved(basis: Floats, values: Floats, known: Floats) -> tuple[Floats, Floats]:
    """Return the coefficients (k, m) of values (n, m) in a basis (n, k), and their variances."""
    count = basis.shape[1]
    squares = (basis[:, :, None] * basis[:, None, :]).reshape(len(basis), -1)
    inverse = np.linalg.inv((known.T @ squares).reshape(-1, count, count))
    found = np.einsum("mkl,ml->km", inverse, (known * values).T @ basis)
    return found, np.einsum("mkk->km", inverse)


def _on_clock(modes: Floats, flow: xr.Dataset) -> Amplitudes:
    """Return amplitudes on the clock of a recording, in no more frames than are simulated."""
    clock = series_of(flow)
    group = np.arange(0, clock.time.size, math.ceil(clock.time.size / FRAMES.most))
    size = np.diff(np.append(group, clock.time.size))
    time, value = (np.add.reduceat(one, group, axis=-1) / size for one in (clock.time, modes))
    if clock.repeat == "loop" and clock.closing:
        time = np.append(time, time[0] + clock.period)
        value = np.concatenate([value, value[:, :1]], axis=1)
    return Amplitudes(time, value, clock.repeat)
