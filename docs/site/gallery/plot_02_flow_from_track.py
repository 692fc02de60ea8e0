"""
A flow field from a track, and the true one
===========================================

The velocities of the block, averaged in cells, are the paper's estimate of the flow. It is too
slow, because the water drags the block behind it, and it knows nothing of places where the block
has not been (hatched). The true flow is on the right.
"""

import matplotlib.pyplot as plt

import driftwalk as dw

recording = dw.tank30_recording()
estimated = dw.extract_flow(recording, mass=0.0116, side=0.03)

figure, axes = plt.subplots(1, 2, figsize=(6.3, 3), layout="compressed", sharex=True, sharey=True)
for flow, ax, title in zip(
    (estimated, dw.tank30_flow()), axes, ("(a) from the track", "(b) true"), strict=True
):
    dw.plot.flow(flow, ax, speed_limit=0.1, colorbar="none")
    ax.set_title(title, loc="left")
    ax.label_outer()
figure.colorbar(axes[0].collections[0], ax=axes, label="speed (cm/s)", aspect=22, pad=0.02)
