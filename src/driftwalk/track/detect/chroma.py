"""How much of a marker's colour a pixel shows, whatever its brightness.

Brightness scales a* and b* together, so a colour is a direction in their plane. A pixel's weight
for a colour is its chroma along that direction, 1 on the disc itself, and 0 where the hue is
another. Both are read from a table of all (a*, b*) of an 8-bit image.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.track.detect.markers import MarkerColour, TwoColourMarker, hue_difference
from driftwalk.track.types import Image

Weights = npt.NDArray[np.float32]

CORE: Final = 0.45
"""Weight above which a pixel belongs to a disc: a disc in half the light keeps 0.57."""
_FLOOR: Final = 0.15
_MOST: Final = 1.5
_LEAST_TOLERANCE: Final = math.radians(18.0)
_MOST_OF_DIFFERENCE: Final = 0.45
# Where colours fade into their surroundings, noise turns the hue; this much is allowed.
_ACROSS: Final = 0.12


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
            self.label[table > CORE] = number

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
    tolerance = min(tolerance, _MOST_OF_DIFFERENCE * between)
    fits = across <= math.tan(tolerance) * along + _ACROSS
    weight = np.where(fits & (along > _FLOOR), np.minimum(along, _MOST), 0.0)
    return np.asarray(weight, dtype=np.float32)
