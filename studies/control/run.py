"""Closed loop in the bundled flow: 12 modes, T by 120 s and by 300 s, in fresh worlds.

    python studies/control/run.py DIR      (about ten minutes on two cores; resumes in DIR)

Modes are factors 0, 0.5, 1, 1.5 on the bundled flow with sigma_F 0.2, 0.55, 1.2 mN; C_d 0.45, 4
blocks, latching by collision, hidden faces free, a decision every 5 s. Each policy is tested in
2000 worlds of each arm as it was planned, and with sigma_F 20 % larger or smaller, a latency of 1 s
and 5 % of the looks without a class.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import xarray as xr

import driftwalk as dw
from driftwalk.assembly import Wanted
from driftwalk.runs import ControlPlanWork, ControlTestWork, run_work

SCALES, FORCES = (0.0, 0.5, 1.0, 1.5), (2e-4, 5.5e-4, 1.2e-3)
DEADLINES = (120.0, 300.0)
ROUNDS, WORLDS, TESTED = 12, 1500, 2000
DISTURBED = {"force x 1.2": 1.2, "force x 0.8": 0.8}


def modes() -> dw.assembly.Modes:
    """Return the 12 modes."""
    study = dw.Study(
        forces={"drag_coefficient": 0.45},
        assembly={"blocks": 4, "latching": "collision", "hidden_face_drag": "none"},
    )
    one = dw.ModeSource(study, dw.tank30_flow())
    return dw.make_modes([one], flow_scales=SCALES, force_stds=FORCES)


def finished(folder: Path, name: str, work: Any) -> xr.Dataset:
    """Return the dataset of a run, computed where it is not there yet."""
    if not (folder / "manifest.json").is_file():
        run_work(work, folder)
    return xr.load_dataset(folder / name)


def row_of(test: xr.Dataset) -> dict[str, Any]:
    """Return what a test found."""
    names = ("reached", "reached_low", "reached_high", "gain", "gain_low", "gain_high")
    return {
        "latency_s": test.attrs["latency_s"], "missed": test.attrs["missed"],
        "force_factor": test.attrs["force_factor"], "stated": test.attrs["stated"],
        "verdict": test.attrs["verdict"], "constant_mode": test.attrs["constant_mode"],
        "arms": {
            str(one["arm"].values): {name: round(float(one[name]), 4) for name in names}
            for one in (test.isel(arm=at) for at in range(test.sizes["arm"]))
        },
    }  # fmt: skip


def main(folder: Path) -> None:
    """Plan and test for each deadline."""
    rows = []
    for by in DEADLINES:
        place = folder / f"{by:g}"
        work = ControlPlanWork(modes(), Wanted("T", by, 5.0), ROUNDS, WORLDS, 1)
        policy = finished(place / "policy", "policy.nc", work)
        tests = {"as planned": ControlTestWork(policy, TESTED)}
        for name, factor in DISTURBED.items():
            tests[name] = ControlTestWork(policy, TESTED, 1.0, 0.05, factor)
        rows.append({
            "by_s": by,
            "promised": policy["promised"].values[:2].round(3).tolist(),
            "rounds": policy["round_reached"].values.round(3).tolist(),
            "stated": [round(policy.attrs[f"reached{end}"], 4) for end in ("", "_low", "_high")],
            "tests": {
                name: row_of(finished(place / name.replace(" ", "-"), "control_test.nc", one))
                for name, one in tests.items()
            },
        })  # fmt: skip
        print(json.dumps(rows[-1], indent=1), flush=True)
    result = Path(__file__).parent / "results" / "table.json"
    result.write_text(json.dumps({"deadlines": rows}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
