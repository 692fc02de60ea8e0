"""Search of a calibration: the grid of settings, its refinement, its uncertainty."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from driftwalk.core.errors import ConfigurationError
from driftwalk.core.grid import MOST_SETTINGS
from driftwalk.model.force_grid import DragCoefficientStep, ForceGrid, ForceStdStep
from driftwalk.model.section import Quantity


class Calibration(ForceGrid):
    """The grid over C_d and σ_F, its refinement around the minimum, and the bootstrap.

    Examples
    --------
    >>> len(Calibration().drag_coefficients), Calibration().drag_coefficients[9]
    (41, 0.45)
    """

    section_name: ClassVar[str] = "calibration"

    replicates: Annotated[int, Quantity("1", ge=1, le=100_000, whole=True)] = Field(
        default=4, description="Simulations per setting of the coarse grid near its minimum."
    )
    refine: Literal["auto", "none"] = Field(
        default="auto",
        description='"auto" searches again, finer, around the minimum of the coarse grid.',
    )
    refined_drag_coefficient_step: DragCoefficientStep = Field(
        default=0.01,
        description="Largest step of the refined grid in the drag coefficient, about; "
        "a wide valley gets larger ones.",
    )
    refined_force_std_step_N: ForceStdStep = Field(
        default=2e-5, description="The same in force_std."
    )
    refined_replicates: Annotated[int, Quantity("1", ge=1, le=100_000, whole=True)] = Field(
        default=8, description="Simulations per setting of the refined grid near the optimum."
    )
    bootstrap: Annotated[int, Quantity("1", ge=0, le=1_000_000, whole=True)] = Field(
        default=200,
        description="Bootstrap samples for the intervals, and simulated recordings for the "
        "goodness of fit of the summaries; 0 leaves both out.",
    )
    seed: Annotated[int, Quantity("1", ge=0, le=2**63 - 1, whole=True)] = Field(
        default=1, description="Seed of the simulations and of the bootstrap."
    )
    confidence: Annotated[float, Quantity("1", gt=0, lt=1)] = Field(
        default=0.9, description="Confidence of the intervals and of the region."
    )

    @model_validator(mode="after")
    def _grid_has_settings(self) -> Self:
        settings = len(self.drag_coefficients) * len(self.force_stds_N)
        if settings > MOST_SETTINGS:
            raise ConfigurationError(
                f"the grid has {len(self.drag_coefficients)} x {len(self.force_stds_N)} = "
                f"{settings} settings, more than {MOST_SETTINGS}: enlarge a step"
            )
        return self
