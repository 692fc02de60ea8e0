"""How a recording is read, so that a study file is complete for its file; the camera's effects."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from driftwalk.core.errors import ConfigurationError
from driftwalk.model.section import Quantity, Section, not_set, without_unit
from driftwalk.model.tank import FieldOfView


def _number_to_text(column: Any) -> Any:
    is_number = isinstance(column, int) and not isinstance(column, bool)
    return str(column) if is_number else column


Column = Annotated[str | None, BeforeValidator(_number_to_text)]


class Columns(Section):
    """Columns of a table, each by its name in the header or its number, counted from 1.

    A unit may follow the column after a colon: ``x = "pos_x:mm"``.
    """

    section_name: ClassVar[str] = "recording.columns"

    t: Column = None
    """Column of the time."""
    frame: Column = None
    """Column of the frame number."""
    x: Column = None
    """Column of x."""
    y: Column = None
    """Column of y."""
    z: Column = None
    """Column of z, if the positions are in space."""
    theta: Column = None
    """Column of the orientation."""
    qx: Column = None
    """Column of the quaternion's x."""
    qy: Column = None
    """Column of the quaternion's y."""
    qz: Column = None
    """Column of the quaternion's z."""
    qw: Column = None
    """Column of the quaternion's w, its real part."""
    body: Column = None
    """Column of the body's name."""
    x1: Column = None
    """Column of x of a box's first corner."""
    y1: Column = None
    """Column of y of a box's first corner."""
    x2: Column = None
    """Column of x of a box's second corner."""
    y2: Column = None
    """Column of y of a box's second corner."""
    w: Column = None
    """Column of the width of a box."""
    h: Column = None
    """Column of the height of a box."""
    lon: Column = None
    """Column of the longitude."""
    lat: Column = None
    """Column of the latitude."""
    confidence: Column = None
    """Column of the confidence."""
    skip: Column = None
    """Columns to leave out, with + between them."""

    def to_dict(self) -> dict[str, str]:
        """Return the columns that are set, from quantity to column."""
        return self.model_dump(exclude_none=True)


class Recording(Section):
    """Reading of a recording: format, body, time range, units, axes, arena."""

    section_name: ClassVar[str] = "recording"

    format: str = "auto"
    """Name of the file's format; "auto" looks at the file."""
    body: str | None = not_set("0")
    """Body to use, if the recording holds several."""
    start_s: Annotated[float | None, Quantity("s")] = not_set(0.0)
    """First time to use."""
    stop_s: Annotated[float | None, Quantity("s")] = not_set(1800.0)
    """Last time to use."""
    frame_rate_Hz: Annotated[float | None, Quantity("Hz", gt=0, le=1e6)] = not_set(25.0)
    """Frames per second, if the file has frame numbers but no times."""
    metres_per_pixel: Annotated[float | None, Quantity("m", gt=0, le=10)] = not_set(0.0005)
    """Size of a pixel in m, if the file is in pixels."""
    length_unit: Literal[
        "auto", "m", "dm", "cm", "mm", "um", "nm", "km", "ft", "in", "yd", "px"
    ] = "auto"
    """Unit of the positions; "auto" uses the unit of the file."""
    y_axis: Literal["auto", "up", "down"] = "auto"
    """Direction of the file's y axis; "auto" uses the direction of the format, down for pixels."""
    columns: Columns | None = not_set('{ t = "time", x = 2, y = 3 }')
    """Columns of a table (t, frame, x, y, theta, body and others), each by its name in the header
    or its number from 1; a unit may follow, as in "angle:deg"."""
    delimiter: str | None = not_set(";")
    """Character between the fields of a table; recognised when not given."""
    up: Literal["auto", "x", "y", "z", "-x", "-y", "-z"] = "auto"
    """Axis that points up, if the file has three axes; "auto" uses the format's."""
    topic: str | None = not_set("/block/pose")
    """Topic of a ROS bag."""
    header_line: Annotated[int | None, Quantity("1", ge=1, le=10_000, whole=True)] = not_set(7)
    """Line of a table, from 1, that names its columns, if it is not the first."""
    sheet: str | None = not_set("Run 2")
    """Sheet of a workbook, or variable of a MATLAB file, if several hold positions."""
    x_file: str | None = not_set("x.csv")
    """File of the x matrix, if each coordinate has its own file."""
    y_file: str | None = not_set("y.csv")
    """File of the y matrix."""
    theta_file: str | None = not_set("theta.csv")
    """File of the orientation matrix."""
    keypoint: str | None = not_set("centre")
    """Keypoint of a pose file to use as the body."""
    heading: tuple[str, str] | None = not_set('["tail", "nose"]')
    """Two keypoints of a pose file, or two bodies that are markers of one: the orientation is the
    angle from the first to the second."""
    min_confidence: Annotated[float | None, Quantity("1", ge=0)] = not_set(0.6)
    """Smallest confidence of a keypoint or row; others are missing. Not set: the format's."""
    box: str = Field(default="auto", pattern=r"^(auto|none|(xyxy|xywh|cxcywh)(@\d+x\d+)?)$")
    """Columns of a box: two corners (xyxy), corner (xywh) or centre (cxcywh) with width and height,
    of shares of an image also its size (cxcywh@1920x1080); or no box (none); "auto" goes by their
    names."""
    missing: tuple[str, ...] | None = not_set('["0,0"]')
    """Positions that mark a body that was not seen: "X,Y", a number, or "held" for the last
    position repeated."""
    sort: Literal["error", "sort"] = "error"
    """Times that go back: "error" refuses them, "sort" sorts them."""
    max_speed_m_s: Annotated[float | None, Quantity("m/s", gt=0, le=1e4)] = not_set(1.0)
    """Fastest plausible speed; samples that need a faster one become gaps."""
    arena: Literal["tank", "fit", "file"] = "tank"
    """Arena of the positions: "tank" is [tank], with its centre at the file's origin if that agrees
    with the positions, and fitted to them otherwise; "fit" is a circle fitted to the positions;
    "file" uses the arena of the file, if any."""
    arena_center_m: tuple[float, float] | None = not_set("[0.42, -0.31]")
    """Centre [x, y] of the tank in the file's frame in m, y up, if known."""

    def load_options(self) -> dict[str, Any]:
        """Return the keyword arguments of `driftwalk.record.load` but for the arena.

        Options that are not set are left out, so that the loader's own default applies. Its
        arguments are called as the keys, without their units and without "_file".
        """
        stated = self.model_dump(exclude_none=True, exclude={"arena", "arena_center_m"})
        return {
            without_unit(key).removesuffix("_file"): value
            for key, value in stated.items()
            if not (value == "auto" and self.is_default(key))
        }

    @model_validator(mode="after")
    def _some_time(self) -> Self:
        if self.start_s is not None and self.stop_s is not None and self.stop_s <= self.start_s:
            raise ConfigurationError(
                f"stop_s = {self.stop_s:g} is not after start_s = {self.start_s:g}"
            )
        return self


class Steps(Section):
    """Formation of step lengths and turning angles, the same for real and simulated motion."""

    section_name: ClassVar[str] = "steps"

    step_interval_s: Annotated[float | Literal["auto"], Quantity("s", gt=0, le=1e5)] = "auto"
    """Time between the positions of a step; "auto" uses the interval of the recording."""


class Observation(Section):
    """From a pose to a sample: noise, resolution of the file, missed samples."""

    section_name: ClassVar[str] = "observation"

    position_noise_m: Annotated[float | Literal["estimate"], Quantity("m", ge=0, le=1)] = "estimate"
    """Position noise of the tracker.

    Standard deviation of the position noise of the tracker, per axis; "estimate" takes it from the
    recording; without a recording there is no noise.
    """
    orientation_noise_rad: Annotated[float | Literal["estimate"], Quantity("rad", ge=0, le=3.2)] = (
        "estimate"
    )
    """Orientation noise of the tracker.

    Standard deviation of the orientation noise of the tracker; "estimate" as for the position.
    """
    position_quantum_m: Annotated[float | Literal["recording"], Quantity("m", ge=0, le=1)] = (
        "recording"
    )
    """Resolution to which simulated positions are rounded, 0 for none; "recording" uses the
    resolution of the recorded file."""
    gaps: Literal["recording", "none"] = "recording"
    """Missed samples: "recording" removes the samples that the recording lacks."""
    field_of_view: FieldOfView | None = not_set(
        '{ shape = "rectangle", width_m = 0.25, height_m = 0.2 }'
    )
    """Field of view of the camera, if smaller than the tank: the keys of [tank] for a shape, and
    center_m; samples outside are missing."""
