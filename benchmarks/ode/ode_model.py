"""The block of a study, moved by the Open Dynamics Engine: a motion model for driftwalk.

    driftwalk calibrate REC --flow flow.csv --study study.toml -o run \
        --model "command:python3 benchmarks/ode/ode_model.py study.toml"

It shares no code with driftwalk's simulation: `ode_recording.cpp` makes each world. The study gives
the block, the tank, the force interval, the time step, and the ranges of C_d and sigma_F.
"""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1]))

from peer import Floats, PeerMissing, build_peer, write_case

import driftwalk as dw

START = ("x_m", "y_m", "theta_rad", "vx_m_s", "vy_m_s", "omega_rad_s")


def parameters(study: dw.Study) -> list[dict[str, Any]]:
    """Return the open parameters, in the grid of the study's calibration."""
    grid = study.calibration
    return [
        {
            "name": "drag_coefficient",
            "unit": "1",
            "low": grid.drag_coefficient_min,
            "high": grid.drag_coefficient_max,
            "step": grid.drag_coefficient_step,
            "refined_step": grid.refined_drag_coefficient_step,
        },
        {
            "name": "force_std",
            "unit": "N",
            "low": grid.force_std_min_N,
            "high": grid.force_std_max_N,
            "step": grid.force_std_step_N,
            "refined_step": grid.refined_force_std_step_N,
        },
    ]


@cache
def flow_of(path: str) -> tuple[Floats, Floats, Floats]:
    """Return the nodes of both axes, and u and v: the engine's program knows square flows."""
    with np.load(path) as stored:
        x, y, u, v = (stored[key] for key in ("x_m", "y_m", "u_m_s", "v_m_s"))
    if x.shape != y.shape or not np.allclose(x, y) or not np.allclose(np.diff(x, 2), 0, atol=1e-9):
        raise ValueError("the flow has to have the same even nodes in x and y")
    return x, np.nan_to_num(u), np.nan_to_num(v)


def worlds(asked: dict[str, Any], study: dw.Study, program: Path, folder: Path) -> dict[str, Any]:
    """Return the answer to a request for worlds."""
    if "flow_file" not in asked:
        return {"error": "the block needs the water's velocity: give --flow"}
    if asked["tank"]["shape"] != "circle":
        return {"error": "this program knows round tanks only"}
    axis, u, v = flow_of(asked["flow_file"])
    tank = dw.apply_overrides(study, {"tank.diameter_m": asked["tank"]["diameter_m"]})
    given, times = asked["parameters"], np.array(asked["times_s"])
    hold = round(study.forces.force_interval_s / study.time_step_s)
    clock = np.arange(int(np.ceil(times[-1] / study.forces.force_interval_s)) + 2)
    rows: dict[str, list[list[float]]] = {"x_m": [], "y_m": [], "theta_rad": []}
    for world, seed in enumerate(asked["seeds"]):
        start = [asked["start"][key][world] for key in START]
        both = [given["drag_coefficient"], given["force_std"]]
        case = folder / "case.txt"
        numbers = np.array([[[*start, *both]]])
        write_case(case, tank, axis=axis, u=u, v=v, worlds=numbers, steps_per_sample=hold)
        words = [str(number) for number in (seed, hold, 0, clock.size)]
        done = subprocess.run([program, case, *words], check=True, capture_output=True, text=True)
        poses = np.array(done.stdout.split(), dtype=np.float64).reshape(-1, 3).T
        poses[2] = np.unwrap(poses[2])
        for key, pose in zip(rows, poses, strict=True):
            rows[key].append(np.interp(times, study.forces.force_interval_s * clock, pose).tolist())
    return dict(rows)


def main() -> None:
    """Answer requests until the input ends."""
    study = dw.load_study(sys.argv[1]) if len(sys.argv) > 1 else dw.Study()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        try:
            # Standard output is for answers.
            with contextlib.redirect_stdout(sys.stderr):
                program = build_peer(folder, "ode_recording")
        except PeerMissing as reason:
            sys.exit(f"ode_model: {reason}")
        for line in sys.stdin:
            asked = json.loads(line)
            if asked.get("request") == "parameters":
                answer: dict[str, Any] = {"parameters": parameters(study)}
            else:
                answer = {"id": asked["id"], **worlds(asked, study, program, folder)}
            print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
