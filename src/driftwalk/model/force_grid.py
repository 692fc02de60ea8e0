"""The grid over C_d and σ_F that a search and a map have in common."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from driftwalk.core.grid import check_axis, grid_values
from driftwalk.model.forces import DragCoefficient, ForceStd
from driftwalk.model.section import Quantity, Section

DragCoefficientStep = Annotated[float, Quantity("1", gt=0, le=100)]
ForceStdStep = Annotated[float, Quantity("N", gt=0, le=10)]


class ForceGrid(Section):
    """The ends and steps of a grid over C_d and σ_F.

    Examples
    --------
    >>> ForceGrid(drag_coefficient_max=0.1).drag_coefficients
    (0.0, 0.05, 0.1)
    """

    drag_coefficient_min: DragCoefficient = Field(
        default=0.0, description="Smallest drag coefficient of the grid."
    )
    drag_coefficient_max: DragCoefficient = Field(
        default=2.0, description="Largest drag coefficient of the grid, included."
    )
    drag_coefficient_step: DragCoefficientStep = Field(
        default=0.05, description="Step of the grid in the drag coefficient."
    )
    force_std_min_N: ForceStd = Field(default=0.0, description="Smallest force_std of the grid.")
    force_std_max_N: ForceStd = Field(
        default=2e-3, description="Largest force_std of the grid, included."
    )
    force_std_step_N: ForceStdStep = Field(
        default=5e-5, description="Step of the grid in force_std."
    )

    @model_validator(mode="after")
    def _axes_have_values(self) -> Self:
        for name, unit in (("drag_coefficient", ""), ("force_std", "_N")):
            low, high, step = (
                getattr(self, f"{name}_{end}{unit}") for end in ("min", "max", "step")
            )
            check_axis(name, low, high, step)
        return self

    @property
    def drag_coefficients(self) -> tuple[float, ...]:
        """Drag coefficients of the grid."""
        return grid_values(
            self.drag_coefficient_min, self.drag_coefficient_max, self.drag_coefficient_step
        )

    @property
    def force_stds_N(self) -> tuple[float, ...]:
        """Values of force_std of the grid [N]."""
        return grid_values(self.force_std_min_N, self.force_std_max_N, self.force_std_step_N)
