"""How flow, drag, stochastic force and tracking noise are fitted together."""

from __future__ import annotations

from typing import Annotated, ClassVar, Final, Literal

from pydantic import Field

from driftwalk.model.section import Quantity, Section

MOST_CELLS: Final = 24
"""Most cells of knots across a tank with spacing "auto": the work grows with their fourth power."""


class Fit(Section):
    """The likelihood fit: knots of the flow, steps of the search, what is reported.

    Examples
    --------
    >>> round(Fit().spacing_m(side_m=0.03, widest_m=0.3), 12)
    0.02
    """

    section_name: ClassVar[str] = "fit"

    spline_spacing_m: Annotated[
        float | Literal["auto"], Quantity("m", gt=0, le=10, words=("auto",))
    ] = Field(
        default="auto",
        description=(
            'Distance between the knots of the flow. "auto" is two thirds of the side of the block '
            "(2 cm for 3 cm), or a 24th of the tank where that is more."
        ),
    )
    angle: Literal["auto", "state", "given", "none"] = Field(
        default="auto",
        description=(
            'How the recorded orientation is used: "state" predicts it like the position and '
            'learns from its errors too, "given" takes it (smoothed) as it is, "none" averages the '
            'drag over all orientations; "auto" is "state" where most samples have one, else '
            '"none".'
        ),
    )
    iterations: Annotated[int, Quantity("1", ge=4, le=1000, whole=True)] = Field(
        default=25, description="Most steps of the search; it ends when they have become small."
    )
    confidence: Annotated[float, Quantity("1", gt=0, lt=1)] = Field(
        default=0.9, description="Confidence of the intervals."
    )

    def spacing_m(self, *, side_m: float, widest_m: float) -> float:
        """Return the distance between knots [m] for a block and the larger side of a tank."""
        if self.spline_spacing_m != "auto":
            return self.spline_spacing_m
        return max(2.0 * side_m / 3.0, widest_m / MOST_CELLS)
