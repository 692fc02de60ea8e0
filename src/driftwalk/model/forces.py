"""Drag and the stochastic force: the parameters that a calibration finds."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from driftwalk.model.section import Quantity, Section

DragCoefficient = Annotated[float, Quantity("1", ge=0, le=100)]
ForceStd = Annotated[float, Quantity("N", ge=0, le=10)]


class Forces(Section):
    """Drag coefficient C_d and stochastic force F ~ N(0, σ_F² I₂), redrawn every interval.

    Examples
    --------
    >>> round(Forces().force_noise_intensity_N2_s, 12)
    3.025e-09
    """

    section_name: ClassVar[str] = "forces"

    drag_coefficient: DragCoefficient = Field(
        default=0.45, description="Drag coefficient C_d of a side face."
    )
    force_std_N: ForceStd = Field(
        default=0.55e-3,
        title="Standard deviation of the stochastic force.",
        description=(
            "Standard deviation sigma_F of each horizontal component of the stochastic force on "
            "the centre of mass."
        ),
    )
    force_interval_s: Annotated[float, Quantity("s", gt=0, le=10)] = Field(
        default=0.010,
        description=(
            "Interval at which the stochastic force is redrawn. It is part of the "
            "model: a recording determines only sigma_F^2 * force_interval, so "
            "always state the two together."
        ),
    )

    @property
    def force_noise_intensity_N2_s(self) -> float:
        """Noise intensity σ_F² · force interval [N² s], all that a recording can determine."""
        return self.force_std_N**2 * self.force_interval_s
