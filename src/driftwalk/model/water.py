"""The water."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from driftwalk.model.section import Quantity, Section


class Water(Section):
    """The liquid in the tank; the defaults are water at 25 °C."""

    section_name: ClassVar[str] = "water"

    density_kg_m3: Annotated[float, Quantity("kg/m3", gt=0, le=2e4)] = Field(
        default=1000.0, description="Density."
    )
    viscosity_Pa_s: Annotated[float, Quantity("Pa s", gt=0, le=1e3)] = Field(
        default=8.9e-4,
        description="Dynamic viscosity; used only for the reported Reynolds number.",
    )
