"""Two-colour markers: the file `markers.toml`, and how much of their colours a pixel shows."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final, Literal, NamedTuple, Self

import numpy as np
import numpy.typing as npt
from pydantic import model_validator

from driftwalk.core.arrays import Singles
from driftwalk.core.errors import ConfigurationError
from driftwalk.model.section import Quantity, Section
from driftwalk.track.toml_file import load_sections, save_sections
from driftwalk.track.types import Image

LEAST_HUE_DIFFERENCE = math.radians(30.0)
"""Between the two colours of a marker: a camera turns hues by some degrees. Chosen by hand."""
_HEAD = """\
Two-colour marker: two discs side by side on each block.
Colours are a* and b* of CIELAB; brightness does not count."""


class MarkerColour(Section):
    """One disc's colour, as the camera sees it.

    Examples
    --------
    >>> round(MarkerColour(a_star=30.0, b_star=40.0).chroma, 1)
    50.0
    """

    section_name: ClassVar[str] = "colour"

    a_star: Annotated[float, Quantity("1", ge=-128, le=128)]
    """Mean a* (green to red)."""
    b_star: Annotated[float, Quantity("1", ge=-128, le=128)]
    """Mean b* (blue to yellow)."""
    spread: Annotated[float, Quantity("1", gt=0, le=60)] = 6.0
    """Standard deviation of a* and b* over the disc."""

    @property
    def chroma(self) -> float:
        """Distance from grey."""
        return math.hypot(self.a_star, self.b_star)

    @property
    def hue_rad(self) -> float:
        """Angle in the plane of a* and b* [rad]."""
        return math.atan2(self.b_star, self.a_star)

    @model_validator(mode="after")
    def _coloured(self) -> Self:
        if self.chroma < 10.0:
            raise ConfigurationError(
                f"a marker's colour must differ from grey: the chroma is {self.chroma:.1f}, "
                "at least 10 is needed"
            )
        return self


class TwoColourMarker(Section):
    """A two-colour marker: two discs at a known distance.

    Examples
    --------
    >>> marker = TwoColourMarker(
    ...     spacing_m="14mm", size_m="10mm",
    ...     colour_1={"a_star": 60, "b_star": 10}, colour_2={"a_star": -45, "b_star": 20},
    ... )
    >>> marker.spacing_m
    0.014
    """

    kind: Literal["two_colour"] = "two_colour"
    """Kind of the marker."""
    spacing_m: Annotated[float, Quantity("m", gt=0, le=10)]
    """Distance between the centres of the two discs."""
    size_m: Annotated[float, Quantity("m", gt=0, le=10)]
    """Diameter of a disc."""
    angle_offset_rad: Annotated[float, Quantity("rad", ge=-math.pi, le=math.pi)] = 0.0
    """Direction from disc 1 to disc 2, counter-clockwise from the block's +x face."""
    block_side_m: Annotated[float | None, Quantity("m", gt=0, le=10)] = None
    """Side of the square block that carries the marker."""
    colour_1: MarkerColour
    """Colour of the first disc."""
    colour_2: MarkerColour
    """Colour of the second disc."""

    @model_validator(mode="after")
    def _distinct(self) -> Self:
        between = hue_difference(self.colour_1, self.colour_2)
        if between < LEAST_HUE_DIFFERENCE:
            raise ConfigurationError(
                f"the hues of the two colours differ by {math.degrees(between):.0f}°; "
                f"at least {math.degrees(LEAST_HUE_DIFFERENCE):.0f}° are needed to tell them apart"
            )
        if self.spacing_m < 0.8 * self.size_m:
            raise ConfigurationError(
                f"spacing_m = {self.spacing_m:g} is the distance of the discs' centres and must be "
                f"at least 0.8 of size_m = {self.size_m:g}"
            )
        return self


def hue_difference(first: MarkerColour, second: MarkerColour) -> float:
    """Return the angle between two hues [rad], in [0, pi]."""
    return abs(math.remainder(first.hue_rad - second.hue_rad, 2 * math.pi))


def load_markers(path: str | Path) -> TwoColourMarker:
    """Read a `markers.toml`.

    Parameters
    ----------
    path : path-like
        The file.

    Returns
    -------
    TwoColourMarker
        The marker.

    Raises
    ------
    FormatError
        When the file cannot be read, a key is unknown, or a value is out of range.

    Examples
    --------
    >>> load_markers("no/such/markers.toml")
    Traceback (most recent call last):
    driftwalk.core.errors.FormatError: no/such/markers.toml: no such markers file
    """
    return load_sections(path, TwoColourMarker, what="markers")


def save_markers(path: str | Path, marker: TwoColourMarker) -> Path:
    """Write a `markers.toml`, with the meaning of each key.

    Parameters
    ----------
    path : path-like
        The file.
    marker : TwoColourMarker
        The object to write.

    Returns
    -------
    pathlib.Path
        The file.

    Examples
    --------
    >>> import tempfile
    >>> marker = TwoColourMarker(
    ...     spacing_m=0.014, size_m=0.01,
    ...     colour_1={"a_star": 60, "b_star": 10}, colour_2={"a_star": -45, "b_star": 20},
    ... )
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     load_markers(save_markers(f"{folder}/markers.toml", marker)) == marker
    True
    """
    return save_sections(path, marker, head=_HEAD)


class ChromaPolicy(NamedTuple):
    """Which pixels show a marker's colour."""

    core: float = 0.45
    """Weight above which a pixel belongs to a disc: a disc in half the light keeps 0.57; chosen
    by hand."""
    floor: float = 0.15
    """Weight below which a pixel does not count; chosen by hand."""
    most: float = 1.5
    """Largest weight of a pixel: a brighter one is a reflection; chosen by hand."""
    share_of_difference: float = 0.45
    """Largest tolerance of the hue, as a share of the difference of the two hues; chosen by
    hand."""
    across: float = 0.12
    """Allowed distance from the hue's direction at no chroma, in reference chromas: where
    colours fade, noise turns the hue; chosen by hand."""


_CHROMA: Final = ChromaPolicy()


class ChromaTables:
    """Weights of both colours for every (a*, b*) of an 8-bit CIELAB image.

    Brightness scales a* and b* together, so a colour is a direction in their plane. A pixel's
    weight for a colour is its chroma along that direction, 1 on the disc itself, and 0 where the
    hue is another.

    Parameters
    ----------
    marker : TwoColourMarker
        The two colours.
    """

    def __init__(self, marker: TwoColourMarker) -> None:
        between = hue_difference(marker.colour_1, marker.colour_2)
        pair = (marker.colour_1, marker.colour_2)
        self.soft: list[Singles] = [_table(colour, between) for colour in pair]
        self.label: npt.NDArray[np.uint8] = np.zeros(1 << 16, dtype=np.uint8)
        for number, table in enumerate(self.soft, start=1):
            self.label[table > _CHROMA.core] = number

    def codes(self, cv2: Any, image: Image) -> npt.NDArray[np.uint16]:
        """Return a* and b* of every pixel as one number, the index into the tables."""
        lab = cv2.cvtColor(image, cv2.COLOR_BGR2Lab)
        # a* and b* as neighbours in memory, read together, are the number that is wanted.
        pair = cv2.merge([cv2.extractChannel(lab, 1), cv2.extractChannel(lab, 2)])
        return np.asarray(pair.view("<u2")[..., 0], dtype=np.uint16)


def _table(colour: MarkerColour, between: float) -> Singles:
    code = np.arange(1 << 16)
    a, b = (code & 255) - 128.0, (code >> 8) - 128.0
    cos, sin = math.cos(colour.hue_rad), math.sin(colour.hue_rad)
    along = (a * cos + b * sin) / colour.chroma
    across = np.abs(b * cos - a * sin) / colour.chroma
    tolerance = max(math.radians(18.0), 3.0 * colour.spread / colour.chroma)
    tolerance = min(tolerance, _CHROMA.share_of_difference * between)
    fits = across <= math.tan(tolerance) * along + _CHROMA.across
    weight = np.where(fits & (along > _CHROMA.floor), np.minimum(along, _CHROMA.most), 0.0)
    return np.asarray(weight, dtype=np.float32)
