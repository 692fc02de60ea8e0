"""
Bodies that move by themselves
==============================

One minute of four members of the family in a tank of 30 cm: an active particle, a body that runs
and tumbles, one that runs and rests, and one that follows the wall.
"""

import matplotlib.pyplot as plt

import driftwalk as dw

values = {
    "speed": 0.03, "rotational_diffusion": 0.2, "turn_rate": 0.0, "speed_cv": 0.4, "run_time": 2.5,
    "turn_std": 1.2, "run_time_cv": 0.7, "rest_time": 1.5, "rest_time_cv": 0.7, "wall_turn": 2.0,
    "wall_slowing": 0.3, "wall_range": 0.02, "wall_follow": 3.0,
}  # fmt: skip
times = [0.05 * k for k in range(1200)]
figure, axes = plt.subplots(1, 4, figsize=(6.3, 1.9), layout="compressed")
names = {
    "active": "(a) active", "run_tumble": "(b) runs and tumbles", "run_rest": "(c) runs and rests",
    "active+wall+follow": "(d) follows the wall",
}  # fmt: skip
for (name, title), ax in zip(names.items(), axes, strict=True):
    model = dw.motion_model(name)
    chosen = {one.name: values[one.name] for one in model.parameters}
    path = dw.simulate(model, parameters=chosen, study=dw.Study(), sample_time=times, seed=3)
    dw.plot.trajectory(path.isel(replicate=0), ax, colorbar="none")
    ax.set_title(title, loc="left")
    ax.set_xticks((-10, 0, 10))
    ax.label_outer()
