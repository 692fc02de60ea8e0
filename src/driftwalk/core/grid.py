"""Axes of a grid of settings: their ends, their step, their values.

The study and the declaration of a parameter share it; a study loads neither NumPy nor a schema.
"""

from __future__ import annotations

import math
from typing import Final

from driftwalk.core.errors import ConfigurationError

MOST_SETTINGS: Final = 1_000_000
"""Values that an axis of a grid, and a grid, may have; chosen by hand."""


def check_axis(name: str, low: float, high: float, step: float) -> None:
    """Refuse an axis of a grid without a value, or with more than anybody could simulate.

    Raises
    ------
    ConfigurationError
        Names the axis and its ends.
    """
    if high < low:
        raise ConfigurationError(
            f"the grid has no setting: {name}_max = {high:g} is below {name}_min = {low:g}"
        )
    if (high - low) / step > MOST_SETTINGS:
        raise ConfigurationError(
            f"{name}: a step of {step:g} from {low:g} to {high:g} gives more than "
            f"{MOST_SETTINGS} values"
        )


def grid_values(low: float, high: float, step: float) -> tuple[float, ...]:
    """Return low, low + step, ... up to and including high, rounded to 12 significant digits.

    Rounding makes a value the decimal that the study names (0.15, not 0.15000000000000002); an end
    that the step misses by less than a millionth of itself is included.

    Examples
    --------
    >>> grid_values(0.0, 0.3, 0.1)
    (0.0, 0.1, 0.2, 0.3)
    """
    count = math.floor((high - low) / step + 1e-6) + 1
    return tuple(float(f"{low + index * step:.12g}") for index in range(count))
