"""Search of a calibration: the grid of settings, its refinement, its uncertainty."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from driftwalk.core.errors import ConfigurationError
from driftwalk.core.grid import MOST_SETTINGS, check_axis, grid_values
from driftwalk.model.block import DragCoefficient, ForceStd
from driftwalk.model.section import Quantity, Section, Seed

DragCoefficientStep = Annotated[float, Quantity("1", gt=0, le=100)]
"""Bounds as those of the number itself."""
ForceStdStep = Annotated[float, Quantity("N", gt=0, le=10)]
"""Bounds as those of the number itself."""


class ForceGrid(Section):
    """The ends and steps of a grid over C_d and σ_F.

    Examples
    --------
    >>> ForceGrid(drag_coefficient_max=0.1).drag_coefficients
    (0.0, 0.05, 0.1)
    """

    drag_coefficient_min: DragCoefficient = 0.0
    """Smallest drag coefficient of the grid."""
    drag_coefficient_max: DragCoefficient = 2.0
    """Largest drag coefficient of the grid, included."""
    drag_coefficient_step: DragCoefficientStep = 0.05
    """Step of the grid in the drag coefficient."""
    force_std_min_N: ForceStd = 0.0
    """Smallest force_std of the grid."""
    force_std_max_N: ForceStd = 2e-3
    """Largest force_std of the grid, included."""
    force_std_step_N: ForceStdStep = 5e-5
    """Step of the grid in force_std."""

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


class Calibration(ForceGrid):
    """The grid over C_d and σ_F, its refinement around the minimum, and the bootstrap.

    Examples
    --------
    >>> len(Calibration().drag_coefficients), Calibration().drag_coefficients[9]
    (41, 0.45)
    """

    section_name: ClassVar[str] = "calibration"

    replicates: Annotated[int, Quantity("1", ge=1, le=100_000, whole=True)] = 4
    """Simulations per setting of the coarse grid near its minimum."""
    refine: Literal["auto", "none"] = Field(
        default="auto",
        description='"auto" searches again, finer, around the minimum of the coarse grid.',
    )
    refined_drag_coefficient_step: DragCoefficientStep = 0.01
    """Largest step of the refined grid in the drag coefficient, about; a wide valley gets larger
    ones."""
    refined_force_std_step_N: ForceStdStep = 2e-5
    """The same in force_std."""
    refined_replicates: Annotated[int, Quantity("1", ge=1, le=100_000, whole=True)] = 8
    """Simulations per setting of the refined grid near the optimum."""
    bootstrap: Annotated[int, Quantity("1", ge=0, le=1_000_000, whole=True)] = 200
    """Bootstrap samples for the intervals, and simulated recordings for the goodness of fit of the
    summaries; 0 leaves both out."""
    seed: Seed = 1
    """Seed of the simulations and of the bootstrap."""
    confidence: Annotated[float, Quantity("1", gt=0, lt=1)] = 0.9
    """Confidence of the intervals and of the region."""

    @model_validator(mode="after")
    def _grid_has_settings(self) -> Self:
        settings = len(self.drag_coefficients) * len(self.force_stds_N)
        if settings > MOST_SETTINGS:
            raise ConfigurationError(
                f"the grid has {len(self.drag_coefficients)} x {len(self.force_stds_N)} = "
                f"{settings} settings, more than {MOST_SETTINGS}: enlarge a step"
            )
        return self
