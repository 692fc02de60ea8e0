"""
Steps of a recording and of its simulation
==========================================

Step lengths and turning angles over 0.2 s: of the recording, and of the block simulated in the true
flow with the true parameters. Their two-dimensional Kolmogorov-Smirnov distance is close to the
noise floor, the distance of two simulations of the same model.
"""

import matplotlib.pyplot as plt

import driftwalk as dw

recording, truth = dw.tank30_recording(), dw.tank30_truth()
forces = {key: truth[key] for key in ("drag_coefficient", "force_std_N", "force_interval_s")}
study = dw.Study(forces=forces, tank={"wall_friction": truth["wall_friction"]})
simulated = dw.simulate(study, dw.tank30_flow(), like=recording, replicates=4)
found = dw.compare(recording, simulated)
print(found[["mean_ks_distance", "noise_floor"]])

# %%
figure, axes = plt.subplots(1, 2, figsize=(10, 4.4), layout="constrained")
for motion, ax in zip((recording, simulated.isel(replicate=0)), axes, strict=True):
    steps = dw.steps(motion, step_interval=0.2)
    dw.plot.steps(steps["step_length"], steps["turning_angle"], ax)
