"""
A live tank
===========

`driftwalk play` shows this in the browser, with knobs for drag, force and latching. The same tank
from Python advances in steps of any length.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwalk as dw

tank = dw.LiveTank(dw.Study(), dw.tank30_flow(), blocks=6, seed=2)
figure, axes = plt.subplots(1, 3, figsize=(6.3, 2.3), layout="compressed")
for letter, ax, (seconds, force_std) in zip(
    "abc", axes, ((5.0, 0.2e-3), (60.0, 0.2e-3), (60.0, 1.5e-3)), strict=True
):
    tank.set(force_std=force_std)
    tank.advance(seconds)
    ax.add_patch(plt.Circle((0, 0), 15, fill=False))
    for x, y, degrees in zip(100 * tank.x, 100 * tank.y, np.degrees(tank.theta), strict=True):
        corner = (x - 1.5, y - 1.5)
        ax.add_patch(plt.Rectangle(corner, 3, 3, angle=degrees, rotation_point="center", ec="w"))
    ax.set(xlim=(-16, 16), ylim=(-16, 16), aspect="equal", xlabel="x (cm)", ylabel="y (cm)")
    ax.set_title(f"({letter}) {tank.time:.0f} s, {1e3 * force_std:.1f} mN", loc="left")
    ax.label_outer()
