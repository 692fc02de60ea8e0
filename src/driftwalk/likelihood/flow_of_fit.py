"""The flow of a fit as a flow field: one interval, or the flow that jumps at the switches."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.likelihood.intervals import fitted_intervals, switched_frames
from driftwalk.schema import FLAGS, build_flow_field
from driftwalk.schema.check import refuse_other_version, require_kind

if TYPE_CHECKING:
    import xarray as xr


def require_fit(dataset: xr.Dataset) -> xr.Dataset:
    """Return a fit; refuse any other dataset, and a fit of another schema version."""
    return refuse_other_version(require_kind(dataset, "fit", "fit_motion makes one"))


def fitted_flow(fit: xr.Dataset, *, interval: int | None = None) -> xr.Dataset:
    """Return the flow of a fit as a flow field, for everything that takes one.

    Parameters
    ----------
    fit : xarray.Dataset
        Result of `fit_motion`.
    interval : int, optional
        With switching times: the interval, counted from 0, whose steady flow is wanted. Without
        it the flow that changes is returned: its frames are a microsecond before and after each
        switch, as fields are linear in time between frames; times count from the first sample of
        the first recording, as those of a simulation do.

    Returns
    -------
    xarray.Dataset
        A `flow_field`. Nodes that the block has been over are *measured*, the others of the tank
        *filled*: there the spline is continued smoothly. Standard errors stand at measured nodes
        (those of all nodes are in the fit); they are correlated over about the distance of knots.

    Raises
    ------
    InputError
        When the dataset is no fit, or has no such interval.

    Examples
    --------
    >>> import driftwalk as dw
    >>> flow = dw.fitted_flow(dw.fit_motion(dw.tank30_recording()))  # doctest: +SKIP
    """
    fit = require_fit(fit)
    intervals = fitted_intervals(fit)
    if interval is not None and not 0 <= interval < len(intervals.flows):
        raise InputError(
            f"no interval {interval}: the fit has {len(intervals.flows)}, counted from 0"
        )
    attrs: dict[str, Any] = {
        "method": "bicubic spline, fitted with drag and noise by the innovations' likelihood",
        "cell_size_m": float(fit["cell_size"]),
        **{key: fit.attrs[key] for key in ("arena", "source")},
    }
    if intervals.steady:
        return build_flow_field(
            fit["x"].values, fit["y"].values, attrs=attrs, **_field_variables(fit)
        )
    fields = [_field_variables(fit.isel(flow=index)) for index in range(fit.sizes["flow"])]
    if interval is not None:
        flow = intervals.flows[interval]
        attrs["flow_label"] = intervals.labels[flow]
        attrs["intervals"] = ", ".join(intervals.describe(one) for one in intervals.of_flow(flow))
        return build_flow_field(fit["x"].values, fit["y"].values, attrs=attrs, **fields[flow])
    attrs["repeat"] = "hold"  # before the first switch and after the last the flow is steady
    by_name = {name: [one[name] for one in fields] for name in fields[0]}
    time, frames = switched_frames(intervals, by_name, first=float(fit["recording_start"]))
    return build_flow_field(fit["x"].values, fit["y"].values, time=time, attrs=attrs, **frames)


def _field_variables(fit: xr.Dataset) -> dict[str, Any]:
    """Return the variables of a flow field: standard errors at measured nodes only."""
    measured = fit["flag"].values == FLAGS["measured"]
    errors = {
        name: np.where(measured, fit[name].values, np.nan)
        for name in ("u_standard_error", "v_standard_error")
    }
    return {**{name: fit[name].values for name in ("u", "v", "flag", "count")}, **errors}
