"""
Flow, drag and noise in one fit
===============================

The likelihood fit finds the flow of the water together with the drag coefficient, the stochastic
force and the noise of the camera.
"""

import matplotlib.pyplot as plt

import driftwalk as dw

recording = dw.tank30_recording()
fit = dw.fit(recording, force_interval="16ms")
print(fit["estimate"].to_series())

# %%
# The flow that it found:

figure, ax = plt.subplots(figsize=(3.5, 3.1), layout="compressed")
dw.plot.flow(fit, ax)
