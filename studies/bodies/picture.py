"""Draw the picture of docs/how-to/dimer.md: python studies/bodies/picture.py OUT.png."""

from __future__ import annotations

import sys

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from driftwalk.plot.parts.style import (
    BLUE,
    DOUBLE_COLUMN_MM,
    HATCH,
    INK,
    ORANGE,
    new_figure,
    print_style,
)


def draw_pair(axes: Axes, *, along: bool) -> None:
    """Draw two glued blocks, and the faces that water from one side reaches."""
    for left in (-1.0, 0.0):
        axes.add_patch(Rectangle((left, -0.5), 1.0, 1.0, facecolor="#f4f1ea", edgecolor=INK, lw=1))
    free = {"color": BLUE, "lw": 4, "solid_capstyle": "butt"}
    arrow = {"arrowstyle": "-|>", "color": HATCH, "lw": 1.6}
    if along:
        axes.plot([-1, -1], [-0.5, 0.5], **free)
        axes.plot([0, 0], [-0.5, 0.5], color=ORANGE, lw=4, solid_capstyle="butt")
        for y in (-0.3, 0.0, 0.3):
            axes.annotate("", (-1.1, y), (-1.75, y), arrowprops=arrow)
        axes.set_title("(b) water along: 1 free face + $h$", loc="left")
    else:
        axes.plot([-1, 1], [-0.5, -0.5], **free)
        for x in (-0.7, -0.25, 0.25, 0.7):
            axes.annotate("", (x, -0.6), (x, -1.15), arrowprops=arrow)
        axes.set_title("(a) water across: 2 free faces", loc="left")
    axes.set(xlim=(-1.9, 1.2), ylim=(-1.25, 0.75), aspect="equal")
    axes.axis("off")


def main() -> None:
    """Draw all."""
    with print_style():
        figure = new_figure(width_mm=DOUBLE_COLUMN_MM, height_mm=62.0)
        grid = figure.add_gridspec(2, 2, width_ratios=(1.0, 1.8))
        draw_pair(figure.add_subplot(grid[0, 0]), along=False)
        draw_pair(figure.add_subplot(grid[1, 0]), along=True)
        axes = figure.add_subplot(grid[:, 1])
        rho = np.linspace(0.0, 1.0, 401)
        axes.plot(rho, (1 + rho) / 2, color=BLUE)
        axes.plot(rho, np.sqrt((1 - rho) / (1 + rho)), color=ORANGE)
        axes.text(0.03, 0.45, "noise intensity $q_2/q_1$", color=BLUE)
        axes.text(0.68, 0.47, r"lever $\ell/(a/2)$", color=ORANGE)
        axes.set(xlim=(0, 1), ylim=(0, 1.05))
        axes.set_xlabel(r"correlation $\rho$ of the forces on the two blocks")
        axes.set_ylabel("of the pair, over that of one block")
        axes.set_title("(c) noise and lever of the pair", loc="left")
        axes.spines[["top", "right"]].set_visible(False)
        figure.savefig(sys.argv[1], dpi=160)


if __name__ == "__main__":
    main()
