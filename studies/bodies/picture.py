"""Draw the picture of docs/how-to/dimer.md: python studies/bodies/picture.py OUT.png."""

from __future__ import annotations

import sys

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

BLUE, ORANGE, GREY, INK = "#0072b2", "#d55e00", "#d9d9d9", "#333333"


def draw_pair(axes: Axes, *, along: bool) -> None:
    """Draw two glued blocks, and the faces that water from one side reaches."""
    for left in (-1.0, 0.0):
        axes.add_patch(Rectangle((left, -0.5), 1.0, 1.0, facecolor="#f4f1ea", edgecolor=INK, lw=1))
    free = {"color": BLUE, "lw": 4, "solid_capstyle": "butt"}
    arrow = {"arrowstyle": "-|>", "color": GREY, "lw": 2.5}
    if along:
        axes.plot([-1, -1], [-0.5, 0.5], **free)
        axes.plot([0, 0], [-0.5, 0.5], color=ORANGE, lw=4, solid_capstyle="butt")
        for y in (-0.3, 0.0, 0.3):
            axes.annotate("", (-1.1, y), (-1.75, y), arrowprops=arrow)
        axes.set_title("water along: 1 free face + h", fontsize=9, color=INK)
    else:
        axes.plot([-1, 1], [-0.5, -0.5], **free)
        for x in (-0.7, -0.25, 0.25, 0.7):
            axes.annotate("", (x, -0.6), (x, -1.15), arrowprops=arrow)
        axes.set_title("water across: 2 free faces", fontsize=9, color=INK)
    axes.set(xlim=(-1.9, 1.2), ylim=(-1.25, 0.75), aspect="equal")
    axes.axis("off")


def main() -> None:
    """Draw all."""
    figure, ((top, right), (bottom, unused)) = plt.subplots(
        2, 2, figsize=(7.2, 3.3), width_ratios=(1.0, 1.5), layout="constrained"
    )
    draw_pair(top, along=False)
    draw_pair(bottom, along=True)
    right.remove()
    unused.remove()
    axes = figure.add_subplot(1, 2, 2)
    rho = np.linspace(0.0, 1.0, 401)
    axes.plot(rho, (1 + rho) / 2, color=BLUE)
    axes.plot(rho, np.sqrt((1 - rho) / (1 + rho)), color=ORANGE)
    axes.text(0.03, 0.44, "noise intensity q₂ / q₁", color=BLUE, fontsize=9)
    axes.text(0.68, 0.46, "lever ℓ / (a/2)", color=ORANGE, fontsize=9)
    axes.set(xlim=(0, 1), ylim=(0, 1.05))
    axes.set_xlabel("correlation ρ of the forces on the two blocks", fontsize=9)
    axes.set_ylabel("what the pair shows (1)", fontsize=9)
    axes.tick_params(labelsize=8)
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(sys.argv[1], dpi=160)


if __name__ == "__main__":
    main()
