"""How the flow field is taken from a recording, and how one in frames is met."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from driftwalk.model.section import Quantity, Section


class Flow(Section):
    """Extraction of the flow field from a recording (Eq. 4 of the paper), and its course."""

    section_name: ClassVar[str] = "flow"

    cells: Annotated[int, Quantity("1", ge=2, le=2000, whole=True)] = 50
    """Cells across the longer side of the tank."""
    cell_size_m: Annotated[float | None, Quantity("m", gt=0, le=10)] = Field(
        default=None, examples=[0.006]
    )
    """Side of a cell, instead of `cells`."""
    smoothing_window_s: Annotated[float, Quantity("s", gt=0, le=1e3)] = 0.7
    """Window of the local quadratic fit that gives velocity and acceleration."""
    flow_drag_coefficient: Annotated[float, Quantity("1", gt=0, le=100)] = 1.05
    """Drag coefficient C_x of the inertia correction (Eq. 4)."""
    min_count: Annotated[int, Quantity("1", ge=1, le=1_000_000, whole=True)] = 1
    """Smallest number of samples in a measured cell."""
    inertia: Literal["corrected", "none"] = "corrected"
    """Correction for the body's inertia.

    "corrected" adds the inertia term of Eq. 4; "none" leaves it out.
    """
    repeat: Literal["none", "loop", "mirror", "hold"] = "none"
    """How a flow series goes on after its last frame.

    How a flow that changes in time goes on after its last frame: "loop" begins again, "mirror" runs
    backwards and forwards in turns, "hold" stands still; with "none" longer simulations are
    refused.
    """
    start: Literal["random", "first"] = "random"
    """Where in a flow series a run begins.

    Moment of a flow that changes in time at which a run begins: "random", one for each run, or
    "first", the first frame for all. With a recording its clock is kept.
    """
