"""Run the exported block in MuJoCo, and measure how far it is from driftwalk's own paths.

    python verify.py [--paths N]

reference.npz holds paths that driftwalk has computed: from rest, clear of the wall, without the
stochastic force and with it. Each is run here from the same start, with the same random numbers.
Exit code 0 where no path is farther away than 0.1 mm, 1 where one is or there is none.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import Any

import floating_block
import mujoco
import numpy as np

HERE = Path(__file__).resolve().parent
FARTHEST = 1e-4  # m


def run(model: Any, times: Any, start: Any, *, replicate: int, noise: bool) -> Any:
    """Return the poses of the block at times [s] that the time step divides, shape (times, 3)."""
    data = mujoco.MjData(model)
    places = [model.joint(name).qposadr[0] for name in floating_block.JOINTS]
    data.qpos[places] = start
    floating_block.install(model, data, HERE, replicate=replicate, noise=noise)
    poses, taken = [], 0
    for time in times:
        steps = round(time / model.opt.timestep)
        for _ in range(steps - taken):
            mujoco.mj_step(model, data)
        taken = steps
        poses.append(data.qpos[places].copy())
    return np.array(poses)


def compare(model: Any, reference: Any, name: str, count: int | None) -> dict[str, Any]:
    """Return how far MuJoCo's paths are from a set, `still` or `noisy`."""
    times, replicates = reference["time_s"], reference[f"{name}_replicate"][:count]
    off, turned, length = [0.0], [0.0], [0.0]
    for row, replicate in enumerate(replicates):
        own = np.stack([reference[f"{name}_{key}"][row] for key in ("x_m", "y_m", "theta_rad")], 1)
        poses = run(model, times, own[0], replicate=int(replicate), noise=name == "noisy")
        off.append(float(np.hypot(*(poses - own)[:, :2].T).max()))
        length.append(float(np.hypot(*np.diff(own[:, :2], axis=0).T).sum()))
        angle = (poses - own)[:, 2]
        turned.append(float(np.abs(np.arctan2(np.sin(angle), np.cos(angle))).max()))
    return {
        "paths": len(replicates),
        "duration_s": float(times[-1]),
        "largest_distance_m": max(off),
        "largest_angle_rad": max(turned),
        "longest_path_m": max(length),
    }


def in_words(name: str, found: dict[str, Any]) -> str:
    """Return a line for people."""
    share = found["largest_distance_m"] / max(found["longest_path_m"], 1e-12)
    return (
        f"{'with' if name == 'noisy' else 'without'} the stochastic force: "
        f"{found['paths']} paths of {found['duration_s']:g} s, largest distance "
        f"{1e6 * found['largest_distance_m']:.3g} um ({100 * share:.2g} % of "
        f"{100 * found['longest_path_m']:.3g} cm), "
        f"{math.degrees(found['largest_angle_rad']):.2g} deg"
    )


def prove(count: int | None = None) -> dict[str, Any]:
    """Compare both sets, up to a number of paths of each, and say whether all are close."""
    model = mujoco.MjModel.from_xml_path(str(HERE / "tank.xml"))
    with np.load(HERE / "reference.npz", allow_pickle=False) as stored:
        reference = dict(stored)
    found = {name: compare(model, reference, name, count) for name in ("still", "noisy")}
    mujoco.set_mjcb_passive(None)
    passed = all(
        one["paths"] > 0 and one["largest_distance_m"] < FARTHEST for one in found.values()
    )
    return {"passed": passed, **found}


def main() -> int:
    """Print the comparison, and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--paths", type=int, help="paths of each set (default: all)")
    found = prove(parser.parse_args().paths)
    for name in ("still", "noisy"):
        print(in_words(name, found[name]))
    if not found["still"]["paths"] or not found["noisy"]["paths"]:
        print("nothing to compare: no path of driftwalk stays clear of the wall in this tank")
    elif not found["passed"]:
        print(f"NOT the same: more than {1e3 * FARTHEST:g} mm apart")
    else:
        print("the same run")
    return 0 if found["passed"] else 1


if __name__ == "__main__":
    sys.exit(main())
