"""
Steps of a recording and of its simulation
==========================================

Step lengths and turning angles over 0.2 s: of the recording, and of the block simulated in the true
flow with the true parameters. Their two-dimensional Kolmogorov-Smirnov distance is close to the
noise floor, the distance of two simulations of the same model.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwalk as dw

recording, truth = dw.tank30_recording(), dw.tank30_truth()
forces = {key: truth[key] for key in ("drag_coefficient", "force_std_N", "force_interval_s")}
study = dw.Study(forces=forces, tank={"wall_friction": truth["wall_friction"]})
simulated = dw.simulate(study, dw.tank30_flow(), like=recording, replicates=4)
found = dw.compare(recording, simulated)
print(found[["mean_ks_distance", "noise_floor"]])

# %%
# In the same bins, with one scale of colours.

figure, axes = plt.subplots(1, 2, figsize=(6.3, 2.9), layout="constrained")
edges = np.linspace(0.006, 0.018, 61), np.radians(np.linspace(-30.0, 15.0, 61))
motions = {"(a) recording": recording, "(b) simulated": simulated.isel(replicate=0)}
for (title, motion), ax in zip(motions.items(), axes, strict=True):
    steps = dw.steps(motion, step_interval=0.2)
    count, *_ = np.histogram2d(steps["step_length"], steps["turning_angle"], bins=edges)
    share = count / steps["step_length"].notnull().sum().item()
    dw.plot.step_density(share, *edges, ax, limits="all", colorbar="none")
    ax.collections[0].set_clim(0.0, 4.5)
    ax.text(0.03, 0.97, title, transform=ax.transAxes, va="top")
bar = figure.colorbar(axes[1].collections[0], ax=axes, aspect=22, pad=0.02)
bar.set_label("density of steps (% mm⁻¹ °⁻¹)")
