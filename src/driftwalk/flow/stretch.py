"""The flow of a round tank in a larger one that is stirred alike."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from driftwalk.core.errors import InputError

if TYPE_CHECKING:
    import xarray as xr


def stretch_flow(field: xr.Dataset, *, diameter: float) -> xr.Dataset:
    """Return the flow of a round tank stretched to a tank of another diameter.

    The water has the same velocity at the same share of the radius. That is an assumption: no
    recording of one tank tells how the water moves in another.

    Parameters
    ----------
    field : xarray.Dataset
        A `flow_field` that knows its tank, a circle.
    diameter : float
        Of the other tank [m].

    Returns
    -------
    xarray.Dataset
        A `flow_field`; ``attrs["stretched_by"]`` is the ratio of the diameters.

    Raises
    ------
    InputError
        When the field knows no tank, or a tank of another shape, or the diameter is not above 0.

    Examples
    --------
    >>> import driftwalk as dw
    >>> wide = dw.flow.stretch_flow(dw.tank30_flow(), diameter=3.0)
    >>> wide.attrs["stretched_by"], round(float(wide["x"].max()), 2)
    (10.0, 1.47)
    """
    arena = json.loads(field.attrs.get("arena", "{}"))
    if arena.get("shape") != "circle":
        raise InputError(
            "a flow is stretched from one round tank to another, and this field's is not"
        )
    if not diameter > 0.0:
        raise InputError(f"diameter must be above 0 m, got {diameter}")
    ratio = diameter / float(arena["diameter_m"])
    center = [ratio * float(place) for place in arena.get("center_m", (0.0, 0.0))]
    attrs = {
        **field.attrs,
        "arena": json.dumps({**arena, "diameter_m": diameter, "center_m": center}),
        "stretched_by": ratio * float(field.attrs.get("stretched_by", 1.0)),
    }
    if "cell_size_m" in attrs:
        attrs["cell_size_m"] = ratio * float(attrs["cell_size_m"])
    axes = {axis: (axis, ratio * field[axis].values, field[axis].attrs) for axis in ("x", "y")}
    return field.assign_coords(axes).assign_attrs(attrs)
