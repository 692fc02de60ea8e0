"""What a calibration searches: the grid of settings, its refinement, its uncertainty."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from driftwalk.core.errors import ConfigurationError
from driftwalk.model.section import Quantity, Section
from driftwalk.schema.parameters import MOST_SETTINGS, check_axis, grid_values


class Calibration(Section):
    """The grid over C_d and σ_F, its refinement around the minimum, and the bootstrap.

    Examples
    --------
    >>> len(Calibration().drag_coefficients), Calibration().drag_coefficients[9]
    (41, 0.45)
    """

    section_name: ClassVar[str] = "calibration"

    drag_coefficient_min: Annotated[float, Quantity("1", ge=0, le=100)] = Field(
        default=0.0, description="Smallest drag coefficient of the coarse grid."
    )
    drag_coefficient_max: Annotated[float, Quantity("1", ge=0, le=100)] = Field(
        default=2.0, description="Largest drag coefficient of the coarse grid, included."
    )
    drag_coefficient_step: Annotated[float, Quantity("1", gt=0, le=100)] = Field(
        default=0.05, description="Step of the coarse grid in the drag coefficient."
    )
    force_std_min_N: Annotated[float, Quantity("N", ge=0, le=10)] = Field(
        default=0.0, description="Smallest force_std of the coarse grid."
    )
    force_std_max_N: Annotated[float, Quantity("N", ge=0, le=10)] = Field(
        default=2e-3, description="Largest force_std of the coarse grid, included."
    )
    force_std_step_N: Annotated[float, Quantity("N", gt=0, le=10)] = Field(
        default=5e-5, description="Step of the coarse grid in force_std."
    )
    replicates: Annotated[int, Quantity("1", ge=1, le=100_000, whole=True)] = Field(
        default=4, description="Simulations per setting of the coarse grid."
    )
    refine: Literal["auto", "none"] = Field(
        default="auto",
        description='"auto" searches again, finer, around the minimum of the coarse grid.',
    )
    refined_drag_coefficient_step: Annotated[float, Quantity("1", gt=0, le=100)] = Field(
        default=0.01, description="Largest step of the refined grid in the drag coefficient."
    )
    refined_force_std_step_N: Annotated[float, Quantity("N", gt=0, le=10)] = Field(
        default=2e-5, description="Largest step of the refined grid in force_std."
    )
    refined_replicates: Annotated[int, Quantity("1", ge=1, le=100_000, whole=True)] = Field(
        default=8, description="Simulations per setting of the refined grid."
    )
    bootstrap: Annotated[int, Quantity("1", ge=0, le=1_000_000, whole=True)] = Field(
        default=200, description="Bootstrap samples for the intervals; 0 gives no intervals."
    )
    seed: Annotated[int, Quantity("1", ge=0, le=2**63 - 1, whole=True)] = Field(
        default=1, description="Seed of the simulations and of the bootstrap."
    )
    confidence: Annotated[float, Quantity("1", gt=0, lt=1)] = Field(
        default=0.9, description="Confidence of the intervals and of the region."
    )

    @model_validator(mode="after")
    def _grid_has_settings(self) -> Self:
        for name, low, high, step in self._axes():
            check_axis(name, low, high, step)
        settings = len(self.drag_coefficients) * len(self.force_stds_N)
        if settings > MOST_SETTINGS:
            raise ConfigurationError(
                f"the grid has {len(self.drag_coefficients)} x {len(self.force_stds_N)} = "
                f"{settings} settings, more than {MOST_SETTINGS}: enlarge a step"
            )
        return self

    @property
    def drag_coefficients(self) -> tuple[float, ...]:
        """Drag coefficients of the coarse grid."""
        return grid_values(
            self.drag_coefficient_min, self.drag_coefficient_max, self.drag_coefficient_step
        )

    @property
    def force_stds_N(self) -> tuple[float, ...]:
        """Values of force_std of the coarse grid [N]."""
        return grid_values(self.force_std_min_N, self.force_std_max_N, self.force_std_step_N)

    def _axes(self) -> tuple[tuple[str, float, float, float], ...]:
        return (
            (
                "drag_coefficient",
                self.drag_coefficient_min,
                self.drag_coefficient_max,
                self.drag_coefficient_step,
            ),
            ("force_std", self.force_std_min_N, self.force_std_max_N, self.force_std_step_N),
        )
