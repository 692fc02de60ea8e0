"""
A model of your own
===================

Any function that returns positions can be calibrated. This one runs straight and tumbles at random
instants. The recording is simulated by the function itself, at 3 cm/s and 0.5 tumbles a second.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwalk as dw


def tumble(scene, *, speed, tumble_rate):
    """Straight runs that end at random instants in a turn to any direction."""
    interval = np.diff(scene.times)
    tumbles = scene.random.uniform(interval.size) < -np.expm1(-tumble_rate * interval)
    angle = 2 * np.pi * scene.random.uniform(interval.size)
    latest = np.maximum.accumulate(np.where(tumbles, np.arange(interval.size), -1), axis=1)
    chosen = np.take_along_axis(angle, np.maximum(latest, 0), axis=1)
    heading = np.where(latest < 0, scene.start.theta[:, None], chosen)
    x = scene.start.x[:, None] + np.cumsum(speed * interval * np.cos(heading), axis=1)
    y = scene.start.y[:, None] + np.cumsum(speed * interval * np.sin(heading), axis=1)
    return np.column_stack([scene.start.x, x]), np.column_stack([scene.start.y, y])


model = dw.motion_model(tumble, speed=(0, 0.1, "m/s"), tumble_rate=(0, 5, "1/s"))
times = np.arange(0.0, 300.0, 0.1)
truth = {"speed": 0.03, "tumble_rate": 0.5}
study = dw.Study(tank={"diameter_m": 10.0})
path = dw.simulate(model, parameters=truth, study=study, sample_time=times, seed=5)
recording = path.isel(replicate=0)

# %%
search = dw.apply_overrides(study, {"calibration.replicates": 1, "calibration.bootstrap": 20})
calibration = dw.calibrate(recording, model, study=search)
print(calibration[["estimate", "interval"]].to_dataframe())
figure, ax = plt.subplots(figsize=(4.2, 3.1), layout="constrained")
dw.plot.map(calibration, ax)
figure.legend(loc="outside upper center", ncols=3)
