"""
Which motion model explains a recording?
========================================

Models are fitted to one half of the recording, in interleaved blocks of time, and judged on the
other half. This recording is simulated: a body that runs, rests, and turns away from the wall.
"""

import matplotlib.pyplot as plt

import driftwalk as dw
from driftwalk.calibration.evolution import Budget

values = {
    "speed": 0.05, "rotational_diffusion": 0.3, "turn_rate": 0.0, "speed_cv": 0.2, "run_time": 2.0,
    "run_time_cv": 0.7, "rest_time": 1.5, "rest_time_cv": 0.7, "turn_std": 1.0, "wall_turn": 3.0,
    "wall_slowing": 0.2, "wall_range": 0.02,
}  # fmt: skip
model = dw.motion_model("run_rest+wall")
chosen = {one.name: values[one.name] for one in model.parameters}
times = [0.1 * k for k in range(6000)]
path = dw.simulate(model, parameters=chosen, study=dw.Study(), sample_time=times, seed=1)

# %%
# The searches of this page are short, and the summaries of the motion are left out.
# `dw.compare_models` takes its time.

few = Budget(design=64, starts=2, short=8, long=20)
models = ["inertial", "active+wall", "run_rest+wall"]
study = dw.Study(calibration={"bootstrap": 0})
found = dw.calibration.compare_models(path.isel(replicate=0), models, study=study, budget=few)
figure, ax = plt.subplots(figsize=(6.3, 2.4), layout="constrained")
dw.figures.plot_models(found, ax)
