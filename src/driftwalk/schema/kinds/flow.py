"""The dataset of the water's velocity."""

from __future__ import annotations

from typing import Final

from driftwalk.schema.description import ARENA, SOURCE, Attribute, Kind, Variable

ORIGIN: Final = {"outside": 0, "measured": 1, "filled": 2}
"""Where the value of a node comes from."""
_ON: Final = "[time] y x"
_RECORDED: Final = "made from a recording"

FLOW_FIELD: Final = Kind(
    name="flow_field",
    version=1,
    dimensions={"time": "frames of a flow that changes", "y": "nodes", "x": "nodes"},
    variables=(
        Variable("u", _ON, "m s-1", "flow velocity x", note="finite; bilinear between nodes"),
        Variable("v", _ON, "m s-1", "flow velocity y"),
        Variable("flag", _ON, None, "origin of the node's value", "int", flags=ORIGIN),
        Variable(
            "u_block", _ON, "m s-1", "mean block velocity x", when=_RECORDED,
            note="before the correction; NaN where the body never was",
        ),
        Variable("v_block", _ON, "m s-1", "mean block velocity y", when=_RECORDED),
        Variable("count", _ON, "1", "samples in the cell", when=_RECORDED),
        Variable(
            "u_standard_error", _ON, "m s-1", "standard error of flow velocity x",
            when=_RECORDED,
            note="of the scatter: [how good it is](../explanation/flow.md#how-good-is-it)",
        ),
        Variable(
            "v_standard_error", _ON, "m s-1", "standard error of flow velocity y", when=_RECORDED
        ),
        Variable("x", "x", "m", "x", note="evenly spaced"),
        Variable("y", "y", "m", "y", note="evenly spaced"),
        Variable("time", "time", "s", "time", when="the flow changes"),
    ),
    attributes=(
        Attribute("method", "text", "how it was made", "made by a stage"),
        Attribute("cell_size_m", "number", "distance between nodes", "made by a stage"),
        Attribute("arena", "object", ARENA.meaning, "the tank is known"),
        Attribute("parameters", "object", "parameters of the formula", "made from a formula"),
        Attribute("source", "text", SOURCE.meaning, "made from a file or a recording"),
        Attribute("inertia", "text", "how the body's inertia was corrected", _RECORDED),
        Attribute("window_s", "number", "time over which derivatives are taken", _RECORDED),
        Attribute("min_count", "number", "samples that make a cell a measured one", _RECORDED),
        Attribute("mass_kg", "number", "mass of the body", _RECORDED),
        Attribute("area_m2", "number", "area that the water pushes on", _RECORDED),
        Attribute("water_density_kg_m3", "number", "density of the water", _RECORDED),
        Attribute("flow_drag_coefficient", "number", "drag coefficient of Eq. 4", _RECORDED),
        Attribute("bodies", "list", "names of the bodies", _RECORDED),
        Attribute("samples_used", "number", "samples in the cells", _RECORDED),
        Attribute("samples_without_derivative", "number", "samples too near a gap", _RECORDED),
        Attribute("samples_outside_tank", "number", "samples beyond the wall", _RECORDED),
        Attribute("measured_share", "number", "share of the tank's cells", _RECORDED),
        Attribute("filled_share", "number", "share of the tank's cells", _RECORDED),
        Attribute("warning", "text", "what to know about it", "there is something"),
    ),
    read="u v x y",
)  # fmt: skip

KINDS: Final = (FLOW_FIELD,)
