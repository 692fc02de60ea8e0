"""Whether a flow field covers the tank that blocks are to assemble in."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError
from driftwalk.schema import FLAGS, check_flow_field
from driftwalk.simulation.backend import wall_edges

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Tank

Floats = npt.NDArray[np.float64]


def require_cover(flow: xr.Dataset, tank: Tank) -> None:
    """Refuse a flow field that does not reach the wall of the tank to within one of its cells.

    Raises
    ------
    InputError
        When the grid ends earlier, or nodes of the tank are flagged as outside of the field's own
        tank; or when the dataset is no flow field.
    """
    check_flow_field(flow)
    x, y = (flow[name].values.astype(np.float64) for name in ("x", "y"))
    cells = tuple((nodes[-1] - nodes[0]) / (nodes.size - 1) for nodes in (x, y))
    low, high = bounding_box(tank)
    for nodes, cell, begin, end in zip((x, y), cells, low, high, strict=True):
        if nodes[0] - cell > begin + 1e-9 or nodes[-1] + cell < end - 1e-9:
            raise InputError(
                f"the flow field does not cover the tank, a {tank.describe()} that reaches "
                f"{_range(*np.stack([low, high], axis=1))}: it spans {_range(x, y)}; give the "
                "field of this tank, or the tank of this field (`tank.diameter_m`, [tank])"
            )
    if "flag" not in flow:
        return
    outside = flow["flag"].values == FLAGS["outside"]
    outside = outside.reshape(-1, *outside.shape[-2:]).any(axis=0)
    inner = inward_depth(tank, *np.meshgrid(x, y)) > float(np.hypot(*cells))
    lacking = int(np.count_nonzero(outside & inner))
    if lacking:
        raise InputError(
            f"the flow field does not cover the tank, a {tank.describe()}: {lacking} of its "
            f"{np.count_nonzero(inner)} nodes in there are flagged as outside of the tank that it "
            "was made for; give the field of this tank, or the tank of this field "
            "(`tank.diameter_m`, [tank])"
        )


def bounding_box(tank: Tank) -> tuple[Floats, Floats]:
    """Return the lower and the upper corner of the tank's bounding box [m]."""
    if tank.radius_m is not None:
        return np.full(2, -tank.radius_m), np.full(2, tank.radius_m)
    corners = np.asarray(tank.corners_m)
    return corners.min(axis=0), corners.max(axis=0)


def inward_depth(tank: Tank, x: Floats, y: Floats) -> Floats:
    """Return how deep points lie inside the wall [m], negative beyond it."""
    if tank.radius_m is not None:
        return np.asarray(tank.radius_m - np.hypot(x, y))
    normal_x, normal_y, offset = wall_edges(tank).T
    return np.asarray((offset - x[..., None] * normal_x - y[..., None] * normal_y).min(axis=-1))


def _range(x: npt.ArrayLike, y: npt.ArrayLike) -> str:
    ends = [np.asarray(values)[[0, -1]] for values in (x, y)]
    return ", ".join(
        f"{name} from {low:.4g} to {high:.4g} m"
        for name, (low, high) in zip("xy", ends, strict=True)
    )
