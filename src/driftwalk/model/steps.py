"""How steps are formed from a trajectory."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from driftwalk.model.section import Quantity, Section


class Steps(Section):
    """Formation of step lengths and turning angles, the same for real and simulated motion."""

    section_name: ClassVar[str] = "steps"

    step_interval_s: Annotated[
        float | Literal["auto"], Quantity("s", gt=0, le=1e5, words=("auto",))
    ] = Field(
        default="auto",
        description=(
            'Time between the positions of a step; "auto" uses the interval of the recording.'
        ),
    )
