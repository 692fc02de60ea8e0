"""The water's velocity where bodies start."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from driftwalk.motion.protocol import Floats
from driftwalk.simulation.initial import Start

if TYPE_CHECKING:
    import xarray as xr


def water_velocity(flow: xr.Dataset, start: Start) -> tuple[Floats, Floats]:
    """Return the water's velocity [m/s] where and when bodies start, in the shape of the start."""
    from scipy.interpolate import RegularGridInterpolator

    x, y = (flow[axis].values for axis in ("x", "y"))
    at = np.stack([np.clip(start.y, y[0], y[-1]), np.clip(start.x, x[0], x[-1])], axis=-1)
    found = []
    for name in ("u", "v"):
        values = flow[name].isel(time=0) if "time" in flow[name].dims else flow[name]
        found.append(RegularGridInterpolator((y, x), values.values)(at).reshape(np.shape(start.x)))
    return found[0], found[1]
