"""Colour weight of a pixel by hue and chroma, independent of its brightness.

Brightness scales a* and b* together, so a colour is a direction in their plane. A pixel's weight
for a colour is its chroma along that direction, 1 on the disc itself, and 0 where the hue is
another. Both are read from a table of all (a*, b*) of an 8-bit image.
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.track.detect.markers import MarkerColour, TwoColourMarker, hue_difference
from driftwalk.track.types import Image

Weights = npt.NDArray[np.float32]


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

_LEAST_TOLERANCE: Final = math.radians(18.0)


class ChromaTables:
    """Weights of both colours for every (a*, b*) of an 8-bit CIELAB image.

    Parameters
    ----------
    marker : TwoColourMarker
        The two colours.
    """

    def __init__(self, marker: TwoColourMarker) -> None:
        between = hue_difference(marker.colour_1, marker.colour_2)
        pair = (marker.colour_1, marker.colour_2)
        self.soft: list[Weights] = [_table(colour, between) for colour in pair]
        self.label: npt.NDArray[np.uint8] = np.zeros(1 << 16, dtype=np.uint8)
        for number, table in enumerate(self.soft, start=1):
            self.label[table > _CHROMA.core] = number

    def codes(self, cv2: Any, image: Image) -> npt.NDArray[np.uint16]:
        """Return a* and b* of every pixel as one number, the index into the tables."""
        lab = cv2.cvtColor(image, cv2.COLOR_BGR2Lab)
        # a* and b* as neighbours in memory, read together, are the number that is wanted.
        pair = cv2.merge([cv2.extractChannel(lab, 1), cv2.extractChannel(lab, 2)])
        return np.asarray(pair.view("<u2")[..., 0], dtype=np.uint16)


def _table(colour: MarkerColour, between: float) -> Weights:
    code = np.arange(1 << 16)
    a, b = (code & 255) - 128.0, (code >> 8) - 128.0
    cos, sin = math.cos(colour.hue_rad), math.sin(colour.hue_rad)
    along = (a * cos + b * sin) / colour.chroma
    across = np.abs(b * cos - a * sin) / colour.chroma
    tolerance = max(_LEAST_TOLERANCE, 3.0 * colour.spread / colour.chroma)
    tolerance = min(tolerance, _CHROMA.share_of_difference * between)
    fits = across <= math.tan(tolerance) * along + _CHROMA.across
    weight = np.where(fits & (along > _CHROMA.floor), np.minimum(along, _CHROMA.most), 0.0)
    return np.asarray(weight, dtype=np.float32)
