"""Flow fields drawn from the standard errors of a measured one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from driftwalk.assembly.runs.address import stream_keys

if TYPE_CHECKING:
    import xarray as xr

RUNS_PER_FLOW: Final = 25
"""Runs that share a drawn flow: each drawn one has to be prepared for the core."""
COMPONENTS: Final = ("u", "v")


def has_standard_error(flow: xr.Dataset) -> bool:
    """Return whether a flow field states a standard error at any of its nodes."""
    return all(
        name in flow and bool(np.isfinite(flow[name].values).any())
        for name in (f"{part}_standard_error" for part in COMPONENTS)
    )


def draw_flow(flow: xr.Dataset, *, seed: int, trial: int, draw: int) -> xr.Dataset:
    """Return a flow field whose measured nodes differ from the given one by chance.

    To each velocity component of each node a normal number times its standard error is added,
    independently of the other nodes. Nodes without a standard error (filled ones, and those that
    the body visited once) stay as they are. The bias of the estimate (Eq. 4) is not drawn, nor is
    what the calibrated parameters have absorbed of the flow's error.

    Parameters
    ----------
    flow : xarray.Dataset
        A `flow_field` with ``u_standard_error`` and ``v_standard_error``.
    seed, trial, draw : int
        Address of the random numbers.

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
        number = generator.standard_normal(error.shape)
        changed[name] = flow[name].copy(data=flow[name].values + error * number)
    return flow.assign(changed)
