"""The mean of a series of measured frames, with the standard error that their spread tells."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.schema import FLAGS, build_flow_field

if TYPE_CHECKING:
    import xarray as xr


class SeriesPolicy(NamedTuple):
    """When frames are those of a steady flow."""

    most_change: float = 0.05
    """Largest mode of the frames (rms over time and place), over the flow, in a steady flow. A
    change of 3 to 5 % of the flow begins to move C_d (docs/explanation/likelihood.md)."""
    above_noise: float = 2.0
    """Its singular value over the largest of independent errors, from which on it is no noise.
    Windows that overlap by half share their errors and double it."""
    pooled: float = 10.0
    """Frames that the spread of all nodes counts in that of one node. Chosen by hand."""


SERIES: Final = SeriesPolicy()


def averaged(field: xr.Dataset) -> xr.Dataset:
    """Return a steady flow field: the mean of the frames, with its standard errors.

    Nodes that were measured in half of the frames count. Refuses frames of a flow that changes.
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
    _require_steady(off[:, :, there], mean[:, there], len(seen))
    squares, degrees = (off**2).sum(axis=(0, 1)) / 2.0, np.maximum(number - 1, 0)
    pooled = float(squares[there].sum() / max(degrees[there].sum(), 1))
    variance = (SERIES.pooled * pooled + squares) / (SERIES.pooled + degrees)
    error = np.where(there, np.sqrt(variance / count), np.nan)
    return build_flow_field(
        field["x"].values, field["y"].values, u=mean[0], v=mean[1],
        flag=np.where(there, FLAGS["measured"], FLAGS["filled"]),
        u_standard_error=error, v_standard_error=error,
        attrs={**field.attrs, "errors": f"from the spread of {len(seen)} frames"},
    )  # fmt: skip


def _require_steady(off: Floats, mean: Floats, frames: int) -> None:
    """Refuse frames whose largest mode is no noise: (2, frames, nodes) from their mean."""
    changes = np.concatenate(list(off), axis=1)
    if not changes.size:
        return
    # The largest eigenvalue, of the smaller of the two products.
    square = changes @ changes.T if frames < changes.shape[1] else changes.T @ changes
    largest = math.sqrt(max(float(np.linalg.eigvalsh(square)[-1]), 0.0))
    noise = math.sqrt(float((changes**2).mean()))
    edge = noise * (math.sqrt(frames) + math.sqrt(changes.shape[1]))
    share = largest / math.sqrt(changes.size) / max(math.sqrt(float((mean**2).mean())), 1e-300)
    if share > SERIES.most_change and largest > SERIES.above_noise * edge:
        raise InputError(
            f"the measured flow changes in time, by {share:.0%} in one mode, and the fit takes a "
            "steady one: fit a part of the time in which it is steady, or give the mean flow "
            'as a file of its own (`flow.mean("time")`)'
        )
