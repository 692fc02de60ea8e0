"""Effects of the camera on the poses."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from driftwalk.model.section import Quantity, Section
from driftwalk.model.tank import FieldOfView


class Observation(Section):
    """From a pose to a sample: noise, resolution of the file, missed samples."""

    section_name: ClassVar[str] = "observation"

    position_noise_m: Annotated[
        float | Literal["estimate"], Quantity("m", ge=0, le=1, words=("estimate",))
    ] = "estimate"
    """Position noise of the tracker.

    Standard deviation of the position noise of the tracker, per axis; "estimate" takes it from the
    recording; without a recording there is no noise.
    """
    orientation_noise_rad: Annotated[
        float | Literal["estimate"], Quantity("rad", ge=0, le=3.2, words=("estimate",))
    ] = "estimate"
    """Orientation noise of the tracker.

    Standard deviation of the orientation noise of the tracker; "estimate" as for the position.
    """
    position_quantum_m: Annotated[
        float | Literal["recording"], Quantity("m", ge=0, le=1, words=("recording",))
    ] = "recording"
    """Resolution to which simulated positions are rounded, 0 for none; "recording" uses the
    resolution of the recorded file."""
    gaps: Literal["recording", "none"] = "recording"
    """Missed samples: "recording" removes the samples that the recording lacks."""
    field_of_view: FieldOfView | None = Field(
        default=None, examples=['{ shape = "rectangle", width_m = 0.25, height_m = 0.2 }']
    )
    """Field of view of the camera, if smaller than the tank: the keys of [tank] for a shape, and
    center_m; samples outside are missing."""
