"""The laws that a fit chooses among, and whatever else of the model it may open.

A departure is a way in which the world can differ from the model; it has one number or a few. In
the model each has the value of `Number.model`; opened, it is a parameter like the noises, with a
derivative from a second pass of the filter. A weak prior keeps it within what is possible.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, NamedTuple


class Number(NamedTuple):
    """One number of a departure."""

    model: float
    """Its value in the model."""
    step: float
    """Change for the derivative by it."""
    prior_std: float
    """Of the normal prior around the value in the model."""
    most: float
    """Largest change in one step of the search."""
    low: float
    high: float
    trial: tuple[float, float] | None = None
    """Two values between which the derivative is taken where the number is closed; by default the
    model's and one step above it."""


STRENGTHS: Final = ("strength_trend", *(f"strength_{k}" for k in range(1, 7)))
"""Numbers of a slow change of the flow's strength over the recording: a straight line, then cosines
of half a period, of one and so on. Cosines alone hold 0.93 of a straight line."""
CHANGES: Final = ("strength_trend", *STRENGTHS[1::2])
"""Those whose shapes go from 1 to -1 between the first sample and the last."""
DRAG_SHAPES: Final = ("linear_share", "drag_power")
"""Other ways in which the drag may depend on the speed: one of them at most is opened."""
OF_PREDICTIONS: Final = ("hidden_share",)
"""Numbers that the predictions alone determine, as they do C_d: what the covariances say of a drag
is wrong to the order in which the filter is. Of a dimer that was slow in the water they said 1
where the share was 0, by seven standard deviations."""
PULSES: Final = ("pulse_cosine", "pulse_sine")
MODES: Final = ("mode_frequency", "mode_phase")
INTENSITIES: Final = tuple(f"flow_intensity_{k}" for k in range(1, 64))
"""ln q in the second flow, the third and so on, less that in the first."""


class Drag(NamedTuple):
    """A way in which the drag goes with the speed."""

    opened: Mapping[str, float] = {}
    """Its own number with a first value."""
    fixed: Mapping[str, float] = {}


DRAGS: Final[Mapping[str, Drag]] = {
    "quadratic": Drag(),
    "linear": Drag(fixed={"linear_share": 1.0}),
    "mixed": Drag(opened={"linear_share": 0.3}),
    "power": Drag(opened={"drag_power": 1.7}),
}
"""By the word of a study for it."""

NUMBERS: Final[Mapping[str, Number]] = {
    "water_acceleration": Number(0.0, 1e-4, 1.0, 0.5, -1.0, 3.0),
    "water_spin": Number(0.0, 1e-5, 1.0, 0.5, -1.0, 3.0),
    "linear_share": Number(0.0, 1e-4, 1.0, 0.3, -0.5, 1.2),
    "drag_power": Number(2.0, 1e-4, 1.0, 0.3, 0.5, 3.5),
    "hidden_share": Number(0.0, 1e-3, 1.0, 0.3, -0.3, 1.3),
    "force_memory": Number(0.0, 1e-3, 1.0, 0.2, 2e-3, 10.0, (2e-3, 6e-2)),
    "time_variance": Number(0.0, 1e-7, 1e-3, 1e-3, 0.0, 1e-1),
    "angle_offset": Number(0.0, 1e-4, 0.5, 0.15, -1.0, 1.0),
    "marker_x": Number(0.0, 1e-6, 0.01, 3e-3, -0.05, 0.05),
    "marker_y": Number(0.0, 1e-6, 0.01, 3e-3, -0.05, 0.05),
    **{
        name: Number(0.0, 1e-4, 0.3 / max(k, 1), 0.2, -1.0, 1.0) for k, name in enumerate(STRENGTHS)
    },
    **dict.fromkeys(INTENSITIES, Number(0.0, 1e-4, 3.0, 1.0, -12.0, 12.0)),
    **dict.fromkeys(("strength_0", *PULSES), Number(0.0, 1e-4, 0.3, 0.2, -1.0, 1.0)),
    "pulse_frequency": Number(0.0, 1e-7, 1e-2, 1e-3, 0.0, 10.0),
    "mode_frequency": Number(0.0, 1e-7, 1e-2, 2e-4, 0.0, 10.0),
    "mode_phase": Number(0.0, 1e-4, 2.0, 0.3, -10.0, 10.0),
}
"""By name. Steps are far below what a recording can tell; priors and bounds hold what a laboratory
may have. Chosen by hand."""
