"""The `flow_field` dataset: velocity of the water on a regular grid.

Dimensions ``(y, x)`` or ``(time, y, x)``; coordinates ``x``, ``y`` [m] (uniform spacing),
``time`` [s]. Variables: ``u``, ``v`` [m/s], the water's velocity, finite at every node; ``flag``
(int8, CF flag values 0 outside, 1 measured, 2 filled); and, where the field comes from a
recording, ``u_block``, ``v_block`` [m/s] (mean velocity of the body in the cell, NaN where
unvisited; not of tracers), ``count`` (samples), ``tracks`` (of tracers), ``u_standard_error``,
``v_standard_error`` [m/s].
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError
from driftwalk.schema.check import build_dataset
from driftwalk.schema.kinds.flow import ORIGIN

if TYPE_CHECKING:
    import xarray as xr

FLAGS: Final[dict[str, int]] = ORIGIN


def build_flow_field(
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    *,
    u: npt.ArrayLike,
    v: npt.ArrayLike,
    flag: npt.ArrayLike,
    time: npt.ArrayLike | None = None,
    attrs: dict[str, Any] | None = None,
    **variables: npt.ArrayLike,
) -> xr.Dataset:
    """Build a `flow_field` dataset.

    Parameters
    ----------
    x, y : array_like, shapes (nx,), (ny,)
        Node positions [m], uniform spacing, at least 2 each.
    u, v : array_like, shape (ny, nx) or (nt, ny, nx)
        Water velocity [m/s], finite at every node.
    flag : array_like of int, same shape
        0 outside, 1 measured, 2 filled.
    time : array_like, shape (nt,), optional
        Times of the frames [s].
    attrs : dict, optional
        Attributes to add.
    **variables
        Any further variable of the schema (``u_block``, ``count``, ...).

    Raises
    ------
    InputError
        When shapes disagree, the spacing is uneven, or a velocity is not finite.
    """
    dims = ("y", "x") if time is None else ("time", "y", "x")
    fields = {"u": u, "v": v, **variables}
    data: dict[str, Any] = {
        name: (dims, np.asarray(values, dtype=np.float64)) for name, values in fields.items()
    }
    data["flag"] = (dims, np.asarray(flag, dtype=np.int8))
    coords: dict[str, Any] = {
        "y": ("y", np.asarray(y, dtype=np.float64)),
        "x": ("x", np.asarray(x, dtype=np.float64)),
    }
    if time is not None:
        coords["time"] = ("time", np.asarray(time, dtype=np.float64))
    try:
        dataset = build_dataset("flow_field", data, coords, attrs or {})
    except ValueError as error:
        raise InputError(f"not a flow field: {error}") from error
    return check_flow_field(dataset)


def check_flow_field(dataset: xr.Dataset) -> xr.Dataset:
    """Return the dataset if it is a valid `flow_field`, else raise `InputError`."""
    for name in ("u", "v"):
        if name not in dataset or dataset[name].dims not in (("y", "x"), ("time", "y", "x")):
            raise InputError(
                f"not a flow field: variable '{name}' with dimensions ([time,] y, x) is missing"
            )
        if not np.isfinite(dataset[name].values).all():
            raise InputError(f"not a flow field: '{name}' has values that are not finite")
    for axis in ("x", "y"):
        nodes = dataset[axis].values
        if nodes.size < 2:
            raise InputError(f"not a flow field: fewer than 2 nodes along {axis}")
        spacing = np.diff(nodes)
        if (spacing <= 0).any() or np.ptp(spacing) > 1e-3 * spacing.mean():
            raise InputError(f"not a flow field: the nodes along {axis} are not evenly spaced")
    return dataset
