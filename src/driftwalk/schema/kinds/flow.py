"""The dataset of the water's velocity."""

from __future__ import annotations

from typing import Final

from driftwalk.schema.description import ARENA, SOURCE, Attribute, Kind, Variable

ORIGIN: Final = {"outside": 0, "measured": 1, "filled": 2}
"""Where the value of a node comes from."""
_ON: Final = "[time] y x"
_RECORDED: Final = "made from a recording"
_BODY: Final = "made from the track of a body"
_TRACERS: Final = "made from tracers"

FLOW_FIELD: Final = Kind(
    name="flow_field",
    version=1,
    dimensions={"time": "frames of a flow that changes", "y": "nodes", "x": "nodes"},
    variables=(
        Variable("u", _ON, "m s-1", "flow velocity x", note="finite; bilinear between nodes"),
        Variable("v", _ON, "m s-1", "flow velocity y"),
        Variable("flag", _ON, None, "origin of the node's value", "int", flags=ORIGIN),
        Variable(
            "u_block", _ON, "m s-1", "mean block velocity x", when=_BODY,
            note="before the correction; NaN where the body never was",
        ),
        Variable("v_block", _ON, "m s-1", "mean block velocity y", when=_BODY),
        Variable("count", _ON, "1", "samples in the cell", when=_RECORDED),
        Variable("tracks", _ON, "1", "tracks in the cell", when=_TRACERS),
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
        Attribute(
            "reading", "text", "meaning of the columns, direction of y", "read from a file"
        ),
        Attribute("inertia", "text", "how the body's inertia was corrected", _BODY),
        Attribute("window_s", "number", "time over which derivatives are taken", _BODY),
        Attribute("min_count", "number", "samples that make a cell a measured one", _RECORDED),
        Attribute("mass_kg", "number", "mass of the body", _BODY),
        Attribute("area_m2", "number", "area that the water pushes on", _BODY),
        Attribute("water_density_kg_m3", "number", "density of the water", _BODY),
        Attribute("flow_drag_coefficient", "number", "drag coefficient of Eq. 4", _BODY),
        Attribute("bodies", "list", "names of the bodies", _BODY),
        Attribute("samples_used", "number", "samples in the cells", _RECORDED),
        Attribute("samples_without_derivative", "number", "samples too near a gap", _BODY),
        Attribute("tracks_used", "number", "tracks in the cells", _TRACERS),
        Attribute("position_noise_m", "number", "noise for the test of links", _TRACERS),
        Attribute("outlier_threshold", "number", "deviation of a false link", _TRACERS),
        Attribute("samples_rejected", "number", "steps that are false links", _TRACERS),
        Attribute("samples_unjudged", "number", "steps with too few neighbours", _TRACERS),
        Attribute("samples_across_gaps", "number", "pairs with a gap between", _TRACERS),
        Attribute("samples_ambiguous", "number", "pairs of unsure identity", _TRACERS),
        Attribute("samples_outside_tank", "number", "samples beyond the wall", _RECORDED),
        Attribute("measured_share", "number", "share of the tank's cells", _RECORDED),
        Attribute("filled_share", "number", "share of the tank's cells", _RECORDED),
        Attribute("warning", "text", "what to know about it", "there is something"),
        Attribute(
            "repeat", "text", "how it goes on beyond its frames: loop, mirror or hold",
            "it changes, and says so",
        ),
    ),
    read="u v x y",
)  # fmt: skip

KINDS: Final = (FLOW_FIELD,)
