"""How flow, drag, stochastic force and tracking noise are fitted together."""

from __future__ import annotations

import itertools
import re
from typing import Annotated, ClassVar, Literal

from pydantic import field_validator, model_validator

from driftwalk.core.errors import ConfigurationError
from driftwalk.model.section import Placeholder, Quantity, Section, not_set

Time = Annotated[float, Quantity("s", ge=-1e12, le=1e12)]
"""Bounds as those of the time stamps that are read: powers of longer times are beyond float64."""


class Fit(Section):
    """The likelihood fit: knots of the flow, steps of the search, reported quantities.

    Examples
    --------
    >>> round(Fit().spacing_m(side_m=0.03, widest_m=0.3), 12)
    0.02
    """

    section_name: ClassVar[str] = "fit"

    spline_spacing_m: Annotated[float | Literal["auto"], Quantity("m", gt=0, le=10)] = "auto"
    """Distance between the knots of the flow. "auto" is two thirds of the side of the block (2 cm
    for 3 cm), or a 24th of the tank if that is more."""
    angle: Literal["auto", "state", "given", "none"] = "auto"
    """Use of the recorded orientation.

    Use of the recorded orientation: "state" predicts it like the position and learns from its
    errors too; "given" uses it, smoothed, as an input; "none" averages the drag over all
    orientations; "auto" is "state" if most samples have one, else "none".
    """
    iterations: Annotated[int, Quantity("1", ge=4, le=1000, whole=True)] = 25
    """Largest number of steps of the search, which ends when the steps become small."""
    confidence: Annotated[float, Quantity("1", gt=0, lt=1)] = 0.9
    """Confidence of the intervals."""
    switching_times_s: tuple[Time, ...] | None = not_set("[600.0, 1200.0]")
    """Times at which the pumps were switched, on each recording's clock; each interval has its own
    flow.

    Times, on the clock of each recording, at which the pumps were switched. Each interval between
    them has its own flow, and all share drag and noises. Without them the flow is steady.
    """
    flow_labels: Annotated[tuple[str, ...] | None, Placeholder("A,B,...")] = not_set(
        '["A", "B", "A"]'
    )
    """Names of the flows between switching times; repeat a name for a flow that comes back.

    Names of the flows in the intervals between the switching times: intervals with the same name
    have the same flow. Without names all flows differ. Each name has its own stochastic force.
    """
    law: Literal["auto", "paper", "quadratic", "linear", "mixed", "power"] = "auto"
    """Drag law.

    How the drag goes with the speed: "quadratic", "linear", "mixed" of both, or with a "power" that
    is estimated. "paper" is quadratic without pressure gradient. "auto" is quadratic unless the
    recording supports a linear part or another power.
    """
    pressure_gradient: Literal["auto", "on", "off"] = "auto"
    """Whether the water's own acceleration pushes the block.

    Whether the water's own acceleration pushes the block and its added mass, as it does a floating
    body. "auto" takes what the recording supports.
    """
    added_mass_share: Annotated[float | Literal["auto"], Quantity("1", ge=0, le=5)] = "auto"
    """Added mass as a share of the block's mass.

    Added mass as a share of the block's mass; the inertia grows by the same share. A recording
    determines only drag and force divided by the mass with its added mass. "auto" is 0.5 with a
    standard deviation of 0.2 where the acceleration of the water pushes the block, else 0.
    """
    added_mass_share_std: Annotated[float, Quantity("1", ge=0, le=5)] = 0.0
    """Standard deviation of the added mass that is stated."""
    mass_std_kg: Annotated[float, Quantity("kg", ge=0, le=100)] = 0.0
    """Standard deviation of the mass of the block."""
    side_std_m: Annotated[float, Quantity("m", ge=0, le=10)] = 0.0
    """Standard deviation of the side of the block."""
    force_memory_s: Annotated[float | Literal["auto", "white"], Quantity("s", gt=0, le=10)] = "auto"
    """Correlation time of the stochastic force.

    Correlation time of the stochastic force, or "white" for none. "auto" estimates one if the
    recording supports it.
    """
    flow_strength: Literal["auto", "constant", "smooth"] = "auto"
    """Strength of the flow over time.

    Strength of the flow over time: "constant", or "smooth". "auto" is constant unless the recording
    supports changes; it also searches for pulses.
    """
    flow_modes: Literal["none", "auto", "1", "2"] = "none"
    """Modes by which the flow changes its shape in time.

    Number of modes, periodic in time, by which the flow changes its shape: "1", or "2" in
    quadrature. "auto" takes the number with the most evidence. For one recording in one flow.
    """
    camera: Literal["auto", "exact"] = "auto"
    """Errors of the camera that are estimated.

    "auto" estimates jitter of the time stamps, an offset of the orientation and of the marker if
    the recording supports them, and refuses smoothed positions; "exact" takes the positions as
    recorded.
    """
    interaction: bool = False
    """Whether the bodies of a recording are fitted together, to find how far they share the force.

    Whether all free bodies of a recording are fitted together. The correlation of the forces on
    them then gives the length over which the stirring is shared.
    """
    flow_error_m_s: Annotated[float | Literal["auto"], Quantity("m/s", gt=0, le=100)] = "auto"
    """Standard deviation of each component of the vectors of a measured flow.

    Standard deviation of each component of the vectors of a measured flow. "auto" takes the errors
    that its file holds, else estimates one from the scatter of the vectors around a smooth flow.
    """
    flow_scale_std: Annotated[float, Quantity("1", ge=0, le=10)] = 0.03
    """Relative standard deviation of the common scale of a measured flow (ruler, frame interval).

    Relative standard deviation of the common scale of a measured flow: of the ruler and of the
    interval between its frames. The fit estimates the scale; 0 takes it as exact.
    """
    drag_coefficient_precision: Annotated[float | None, Quantity("1", gt=0, lt=1)] = not_set(0.05)
    """Wanted relative standard error of C_d.

    Wanted relative standard error of C_d: the fit says whether it is reached, and if not, how long
    a recording must be. Without it, a warning appears above 0.1.
    """

    @field_validator("flow_modes", mode="before")
    @classmethod
    def _number_in_words(cls, value: object) -> object:
        return str(value) if isinstance(value, int) else value

    @field_validator("switching_times_s")
    @classmethod
    def _times(cls, values: tuple[float, ...] | None) -> tuple[float, ...] | None:
        if values is None:
            return None
        if not values:
            raise ConfigurationError("the list is empty; leave the key out or name a time")
        for earlier, later in itertools.pairwise(values):
            if not later > earlier:
                raise ConfigurationError(
                    f"the times must increase, got {later:g} s after {earlier:g} s"
                )
        return values

    @model_validator(mode="after")
    def _one_label_each(self) -> Fit:
        """Refuse labels that do not go with the intervals."""
        if self.flow_labels is None:
            return self
        intervals = len(self.switching_times_s or ()) + 1
        if len(self.flow_labels) != intervals:
            raise ConfigurationError(
                f"flow_labels has {len(self.flow_labels)} name"
                f"{'s' if len(self.flow_labels) > 1 else ''}, but switching_times_s makes "
                f"{intervals} interval{'s' if intervals > 1 else ''}: name the flow of each"
            )
        for name in self.flow_labels:
            if not re.fullmatch(r"[A-Za-z0-9_-]{1,20}", name):
                raise ConfigurationError(
                    f"flow_labels: {name!r} is not a valid name of a flow: use up to "
                    "20 letters, digits, - or _"
                )
        for earlier, later in itertools.pairwise(self.flow_labels):
            if earlier == later:
                raise ConfigurationError(
                    f"flow_labels: {later!r} is named twice in a row: leave out the "
                    "switching time between"
                )
        return self

    def spacing_m(self, *, side_m: float, widest_m: float) -> float:
        """Return the distance between knots [m] for a block and the larger side of a tank."""
        if self.spline_spacing_m != "auto":
            return self.spline_spacing_m
        # The work grows with the fourth power of the cells of knots across the tank.
        return max(2.0 * side_m / 3.0, widest_m / 24)
