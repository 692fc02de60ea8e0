"""How a recording is read, so that a study file is complete for the file it belongs to."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from driftwalk.core.errors import ConfigurationError
from driftwalk.model.section import Quantity, Section


class Columns(Section):
    """Columns of a table, each by its name in the header or its number, counted from 1."""

    section_name: ClassVar[str] = "recording.columns"

    time: str | int | None = Field(default=None, description="Column of the time.")
    frame: str | int | None = Field(default=None, description="Column of the frame number.")
    x: str | int | None = Field(default=None, description="Column of x.")
    y: str | int | None = Field(default=None, description="Column of y.")
    theta: str | int | None = Field(default=None, description="Column of the orientation.")
    body: str | int | None = Field(default=None, description="Column of the body's name.")


class Recording(Section):
    """How a recording is read: format, body, stretch of time, units, axes, arena."""

    section_name: ClassVar[str] = "recording"

    format: str = Field(
        default="auto", description='Name of the file\'s format; "auto" looks at the file.'
    )
    body: str | None = Field(
        default=None, description="Which body, where the recording holds several.", examples=["0"]
    )
    start_s: Annotated[float | None, Quantity("s")] = Field(
        default=None, description="Use the samples from this time on.", examples=[0.0]
    )
    stop_s: Annotated[float | None, Quantity("s")] = Field(
        default=None, description="Use the samples up to this time.", examples=[1800.0]
    )
    frame_rate_Hz: Annotated[float | None, Quantity("Hz", gt=0, le=1e6)] = Field(
        default=None,
        description="Frames per second, where the file has frame numbers and no time.",
        examples=[25.0],
    )
    metres_per_pixel: Annotated[float | None, Quantity("m", gt=0, le=10)] = Field(
        default=None,
        description="Size of a pixel in m, where the file is in pixels.",
        examples=[0.0005],
    )
    length_unit: Literal["auto", "m", "cm", "mm", "px"] = Field(
        default="auto", description='Unit of the positions; "auto" is what the format says.'
    )
    angle_unit: Literal["auto", "rad", "deg"] = Field(
        default="auto", description='Unit of the orientation; "auto" is what the format says.'
    )
    y_axis: Literal["auto", "up", "down"] = Field(
        default="auto",
        description='Sense of the file\'s y axis; "auto" is down for pixels and up otherwise.',
    )
    time_order: Literal["strict", "sort"] = Field(
        default="strict", description='Times that go back: "strict" is an error, "sort" sorts them.'
    )
    max_speed_m_s: Annotated[float | None, Quantity("m/s", gt=0, le=1e4)] = Field(
        default=None,
        description="A jump faster than this is a mistake of the tracker: a gap.",
        examples=[1.0],
    )
    arena: Literal["tank", "fit", "file"] = Field(
        default="tank",
        description=(
            'Where the tank lies in the file\'s frame: "tank" has its centre at the origin, "fit" '
            "finds the smallest outline of [tank]'s shape that holds the positions, "
            '"file" is what the file says.'
        ),
    )
    columns: Columns | None = Field(
        default=None,
        description="Columns of a table, each by its name in the header or its number from 1.",
        examples=['{ time = "t", x = 2, y = 3 }'],
    )

    @model_validator(mode="after")
    def _some_time(self) -> Self:
        if self.start_s is not None and self.stop_s is not None and self.stop_s <= self.start_s:
            raise ConfigurationError(
                f"stop_s = {self.stop_s:g} is not after start_s = {self.start_s:g}"
            )
        return self
