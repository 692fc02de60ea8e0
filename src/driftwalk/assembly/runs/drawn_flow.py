"""Flow fields drawn from the standard errors of a measured one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.runs.plan import stream_keys

if TYPE_CHECKING:
    import xarray as xr

Floats = npt.NDArray[np.float64]

RUNS_PER_FLOW: Final = 25
"""Runs that share a drawn flow: each drawn one has to be prepared for the core."""
COMPONENTS: Final = ("u", "v")


def has_standard_error(flow: xr.Dataset) -> bool:
    """Return whether a flow field states a standard error at any of its nodes."""
    return all(
        name in flow and bool(np.isfinite(flow[name].values).any())
        for name in (f"{part}_standard_error" for part in COMPONENTS)
    )


def draw_flow(
    flow: xr.Dataset, *, seed: int, trial: int, draw: int, correlated_over: float | None = None
) -> xr.Dataset:
    """Return a flow field whose measured nodes differ from the given one by chance.

    To each velocity component of each node a normal number times its standard error is added,
    independently of the other nodes, or smooth over a length that is given. Nodes without a
    standard error (filled ones, and those that the body visited once) stay as they are. The bias of
    the estimate (Eq. 4) is not drawn, nor is what the calibrated parameters have absorbed of the
    flow's error.

    Parameters
    ----------
    flow : xarray.Dataset
        A `flow_field` with ``u_standard_error`` and ``v_standard_error``.
    seed, trial, draw : int
        Address of the random numbers.
    correlated_over : float, optional
        Distance of the knots of the bicubic spline that the flow was fitted with [m]: the numbers
        of nodes are one of its splines, the same at every time.

    Examples
    --------
    >>> import driftwalk as dw
    >>> still = dw.uniform_flow(0.0, 0.0)
    >>> error = 0.0 * still["u"] + 1e-3
    >>> still = still.assign(u_standard_error=error, v_standard_error=error)
    >>> round(float(draw_flow(still, seed=1, trial=0, draw=0)["u"].std()), 4)
    0.001
    """
    key = stream_keys("flow", seed=seed, trial=trial, index=draw)[0]
    generator = np.random.Generator(np.random.Philox(key=int(key)))
    changed = {}
    for name in COMPONENTS:
        error = np.nan_to_num(flow[f"{name}_standard_error"].values, nan=0.0)
        if correlated_over is None:
            number = generator.standard_normal(error.shape)
        else:
            number = _smooth(flow, correlated_over, generator)
        changed[name] = flow[name].copy(data=flow[name].values + error * number)
    return flow.assign(changed)


def _smooth(flow: xr.Dataset, distance: float, generator: np.random.Generator) -> Floats:
    """Return a normal number at each node, (y, x), of variance 1 and smooth over a distance."""
    down, along = (_weights(flow[axis].values, distance) for axis in ("y", "x"))
    knots = generator.standard_normal((down.shape[1], along.shape[1]))
    spread = np.sqrt((down**2).sum(axis=1)[:, None] * (along**2).sum(axis=1))
    # No product of matrices: its last digits would depend on the processor.
    rows = (down[:, :, None] * knots).sum(axis=1)
    return np.asarray((rows[:, None, :] * along).sum(axis=2) / spread)


def _weights(axis: Floats, distance: float) -> Floats:
    """Return the cubic B-splines of evenly spaced knots at positions, (position, knot)."""
    place = (axis - axis[0]) / distance
    away = np.abs(place[:, None] - np.arange(-1.0, np.ceil(place[-1]) + 2.0))
    inner = 2.0 / 3.0 - away**2 + 0.5 * away**3
    outer = np.maximum(2.0 - away, 0.0) ** 3 / 6.0
    return np.asarray(np.where(away < 1.0, inner, outer))
