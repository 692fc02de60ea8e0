"""
The map of KS distances
=======================

The paper's calibration: simulate the block at every setting of drag coefficient and stochastic
force, and compare its steps with the recording's. The highest score is the answer; the line in the
colour bar is the noise floor. This is a coarse map of ten minutes in the true flow, a few seconds
of work.
"""

import matplotlib.pyplot as plt

import driftwalk as dw

recording = dw.tank30_recording().sel(time=slice(0.0, 600.0))
search = {
    "drag_coefficient_max": 1.0,
    "force_std_step_N": 1e-4,
    "replicates": 1,
    "refined_replicates": 2,
    "bootstrap": 20,
}
study = dw.Study(forces={"force_interval_s": 0.016}, calibration=search)
calibration = dw.calibrate(recording, study=study, flow=dw.tank30_flow())
print(calibration["estimate"].to_series())

# %%
figure, ax = plt.subplots(figsize=(4.2, 3.1), layout="constrained")
dw.plot.map(calibration, ax)
figure.legend(loc="outside upper center", ncols=3)

# %%
# Estimates from simulated recordings at the optimum say how well the parameters are known:

figure, ax = plt.subplots(figsize=(4.2, 3.1), layout="constrained")
dw.plot.bootstrap(calibration, ax)
figure.legend(loc="outside upper center", ncols=3)
