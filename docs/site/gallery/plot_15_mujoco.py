"""
The same run in MuJoCo
======================

A model goes out to another simulator with its random numbers. MuJoCo, fed with the same ones by
their addresses, follows the paths of driftwalk: the stochastic force pushes in both.
"""

import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import mujoco
import numpy as np

import driftwalk as dw
from driftwalk.export import Source, export_run, target_named

work = Path(tempfile.mkdtemp())
study = dw.apply_overrides(dw.Study(), {"forces.drag_coefficient": 0.387})
(work / "study.toml").write_text(study.to_toml())
dw.save_flow(dw.tank30_flow(), work / "flow.nc")
source = Source(work / "study.toml", flow=work / "flow.nc")
files = export_run(source, target_named("mujoco"), work / "tank")
print(*sorted(file.name for file in files))

# %%
# The folder holds paths of driftwalk and a program that runs them again.

sys.path.insert(0, str(work / "tank"))
import verify  # noqa: E402

model = mujoco.MjModel.from_xml_path(str(work / "tank" / "tank.xml"))
own = dict(np.load(work / "tank" / "reference.npz"))
figure, (left, right) = plt.subplots(1, 2, figsize=(6.3, 2.9), layout="constrained")
for row, replicate in enumerate(own["noisy_replicate"]):
    x, y, theta = (own[f"noisy_{key}"][row] for key in ("x_m", "y_m", "theta_rad"))
    poses = verify.run(
        model, own["time_s"], (x[0], y[0], theta[0]), replicate=int(replicate), noise=True
    )
    (line,) = left.plot(1e2 * x, 1e2 * y, lw=3.5, alpha=0.4)
    left.plot(1e2 * poses[:, 0], 1e2 * poses[:, 1], "k", lw=0.7)
    left.plot(1e2 * x[0], 1e2 * y[0], "o", color=line.get_color(), ms=5)
    distance = np.hypot(poses[:, 0] - x, poses[:, 1] - y)
    right.plot(own["time_s"], 1e6 * distance, color=line.get_color())
mujoco.set_mjcb_passive(None)

radius = 1e2 * study.tank.radius_m
left.add_patch(plt.Circle((0, 0), radius, fill=False, color="0.5"))
left.set(
    xlabel="x (cm)", ylabel="y (cm)", aspect="equal",
    xlim=(-1.04 * radius, 1.04 * radius), ylim=(-1.04 * radius, 1.04 * radius),
    title="(a) driftwalk (wide), MuJoCo (black)",
)  # fmt: skip
right.set(
    xlabel="time (s)", ylabel="distance (µm)", ylim=(0, None),
    title="(b) how far apart the two are",
)  # fmt: skip
