"""
Does the model explain the recording?
=====================================

A fit predicts each pose from those before. Where the model is right, the errors of these
predictions have mean 0 and standard deviation 1, everywhere in the tank and at all times.
"""

import matplotlib.pyplot as plt

import driftwalk as dw

recording = dw.tank30_recording().sel(time=slice(0.0, 600.0))
fit = dw.fit(recording, force_interval="16ms")
check = dw.check_model(fit, recording)

figure, axes = plt.subplots(1, 2, figsize=(6.3, 2.8), layout="constrained")
dw.plot.residuals(check, axes[0])
axes[0].set_title("(a) mean error of prediction", loc="left")
dw.plot.innovations(check, axes[1])
axes[1].set_title("(b) memory of the errors", loc="left")
axes[1].legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2)
