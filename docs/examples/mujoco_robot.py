"""A disc-shaped robot in a round tank, simulated by MuJoCo: a motion model for driftwalk.

The robot drives along its heading. Its motor, a drag and a noisy turning torque move it, and MuJoCo
works out the contact with the wall. Line by line: docs/how-to/use-a-simulator.md.
"""

import json
import math
import sys

import mujoco
import numpy as np
from mujoco.rollout import rollout

STEP = 0.02  # s, a step of MuJoCo
RADIUS, MASS = 0.015, 0.02  # m, kg: the disc
DRAG = 0.1  # kg/s, so that the speed settles within MASS / DRAG = 0.2 s
TURN_DRAG = 4.5e-5  # kg m2/s, so that the turning settles within 0.05 s
WALLS = 32  # flat pieces that make the round wall
PARAMETERS = [
    {"name": "speed", "unit": "m/s", "low": 0.02, "high": 0.1, "step": 0.01, "refined_step": 0.0025,
     "meaning": "terminal speed"},
    {"name": "turn_noise", "unit": "rad2/s", "low": 0.1, "high": 10, "scale": "log",
     "step": 0.25, "refined_step": 0.125, "meaning": "diffusion of the heading"},
]  # fmt: skip


def robot(tank):
    """Return MuJoCo's model of the robot in a tank of a diameter [m]."""
    angles = 2 * math.pi * np.arange(WALLS) / WALLS
    walls = "".join(
        f'<geom type="plane" size="1 1 .1" pos="{tank / 2 * c} {tank / 2 * s} 0" '
        f'zaxis="{-c} {-s} 0"/>'
        for c, s in zip(np.cos(angles), np.sin(angles), strict=True)
    )
    return mujoco.MjModel.from_xml_string(f"""
        <mujoco>
          <option timestep="{STEP}" gravity="0 0 0" integrator="implicitfast"/>
          <default><geom condim="1"/></default>  <!-- contact without friction: a wet wall -->
          <worldbody>
            {walls}
            <body>
              <joint type="slide" axis="1 0 0" damping="{DRAG}"/>
              <joint type="slide" axis="0 1 0" damping="{DRAG}"/>
              <joint name="heading" type="hinge" axis="0 0 1" damping="{TURN_DRAG}"/>
              <inertial pos="0 0 0" mass="{MASS}"
                diaginertia="{MASS * RADIUS**2 / 4} {MASS * RADIUS**2 / 4} {MASS * RADIUS**2 / 2}"/>
              <geom type="sphere" size="{RADIUS}"/>
              <site name="motor"/>
            </body>
          </worldbody>
          <actuator>
            <motor site="motor" gear="1 0 0 0 0 0"/>
            <motor joint="heading"/>
          </actuator>
        </mujoco>""")


def positions(asked):
    """Return the answer to a request for worlds."""
    if asked["tank"]["shape"] != "circle":
        return {"error": "this robot knows round tanks only"}
    model = robot(asked["tank"]["diameter_m"])
    given, times = asked["parameters"], np.array(asked["times_s"])
    steps = math.ceil(times[-1] / STEP) + 1
    pushes = np.empty((len(asked["seeds"]), steps, 2))
    pushes[:, :, 0] = DRAG * given["speed"]
    turning = TURN_DRAG * math.sqrt(2 * given["turn_noise"] / STEP)
    for world, seed in enumerate(asked["seeds"]):
        pushes[world, :, 1] = turning * np.random.default_rng(seed).standard_normal(steps)
    keys = ("x_m", "y_m", "theta_rad", "vx_m_s", "vy_m_s", "omega_rad_s")
    start = np.column_stack([asked["start"][key] for key in keys])
    first = np.column_stack([np.zeros(len(start)), start])  # MuJoCo's state begins with the time
    states, _ = rollout(model, mujoco.MjData(model), first, pushes)
    clock = STEP * np.arange(steps + 1)
    paths = np.concatenate([first[:, None], states], axis=1)
    return {
        key: [np.interp(times, clock, path).tolist() for path in paths[:, :, 1 + column]]
        for column, key in enumerate(keys[:3])
    }


for line in sys.stdin:
    asked = json.loads(line)
    if asked.get("request") == "parameters":
        answer = {"parameters": PARAMETERS}
    else:
        answer = {"id": asked["id"], **positions(asked)}
    print(json.dumps(answer), flush=True)
