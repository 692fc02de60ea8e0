"""Poles of magnets at the faces of blocks, as bars along them: N red and S white."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.plot.parts.style import INK

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.collections import PolyCollection

COLORS: Final = {1: "#C1121F", -1: "#FFFFFF"}
"""No colour of an assembly."""


class BarPolicy(NamedTuple):
    """Where a bar lies on its block, in shares of half a side."""

    inner: float = 0.62
    """Inner edge; chosen by eye."""
    outer: float = 0.94
    """Outer edge, within the block's own outline; chosen by eye."""
    length: float = 0.72
    """End of the bar, so that two bars do not meet; chosen by eye."""


BAR: Final = BarPolicy()


def pole_bars(
    x: Floats, y: Floats, theta: Floats, pole: Any, half_side: float
) -> tuple[list[Floats], list[str]]:
    """Return the corners and the colours of the bars of some blocks.

    Parameters
    ----------
    x, y, theta : ndarray, shape (block,)
        Poses; angles in rad.
    pole : array_like of int, shape (block, 4)
        1 N, -1 S, 0 none, of the faces +x, +y, -x, -y.
    half_side : float
        In the unit of x and y.
    """
    own = half_side * np.array(
        [
            [BAR.inner, -BAR.length],
            [BAR.outer, -BAR.length],
            [BAR.outer, BAR.length],
            [BAR.inner, BAR.length],
        ]
    )
    corners, colors = [], []
    for block, face in np.argwhere(np.asarray(pole) != 0):
        turn = theta[block] + face * np.pi / 2.0
        cosine, sine = np.cos(turn), np.sin(turn)
        turned = own @ np.array([[cosine, sine], [-sine, cosine]])
        corners.append(turned + np.array([x[block], y[block]]))
        colors.append(COLORS[int(pole[block][face])])
    return corners, colors


def empty_bars() -> PolyCollection:
    """Return a collection to which the bars of a moment are given."""
    from matplotlib.collections import PolyCollection

    return PolyCollection([], edgecolors=INK, linewidths=0.3, zorder=3.5)


def poles_of(dataset: xr.Dataset) -> Any:
    """Return the poles of a dataset's blocks, (block, face); None where it states none."""
    return dataset["pole"].transpose("block", "face").values if "pole" in dataset else None
