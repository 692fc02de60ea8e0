"""A bar that shows the scale of axes without ticks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from driftwalk.plot.parts.style import INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw_scale_bar(ax: Axes) -> None:
    """Draw a bar of a round length at the lower left corner of axes in cm."""
    low, high = ax.get_xlim()
    length = 10.0 ** np.floor(np.log10((high - low) / 5.0))
    length *= max(step for step in (1.0, 2.0, 5.0) if step * length <= (high - low) / 5.0)
    y = ax.get_ylim()[0]
    ax.plot([low, low + length], [y, y], color=INK, lw=1.5, clip_on=False, solid_capstyle="butt")
    ax.annotate(
        f"{length:g} cm", (low, y), xytext=(0.0, 2.5), textcoords="offset points", size=6.0,
        va="bottom",
    )  # fmt: skip
