"""`driftwalk fit` of a flow that grows: what it hands on moves like the recording.

The recording is made by Euler and Maruyama's scheme, without code of driftwalk.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from command_line import here
from euler_blocks import DRAG, euler_recordings, stirred

import driftwalk as dw

SECONDS = 600.0
STATED = (
    *("--tank", "32cm", "--side", "3cm", "--mass", "11.6g", "--depth", "3cm"),
    *("--force-interval", "10ms", "--spline-spacing", "3cm", "--law", "paper"),
    *("--camera", "exact", "--force-memory", "white", "--flow-strength", "smooth"),
)


def growing(x: np.ndarray, y: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
    """Return a flow that grows by 50 % of its mean."""
    return stirred(x, y, 1.0 + 0.5 * (time / SECONDS - 0.5))


def answer(*arguments: Any) -> dict[str, Any]:
    done = here(*arguments, "--json")
    assert done.code == 0, done.err
    found: dict[str, Any] = json.loads(done.out)
    return found


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_a_growing_flow_is_explained_and_handed_on(tmp_path: Path) -> None:
    recording, *others = euler_recordings(growing, worlds=5, seconds=SECONDS, seed=1)
    track, run = tmp_path / "track.nc", tmp_path / "run"
    recording.to_netcdf(track, engine="h5netcdf")
    found = answer("fit", track, *STATED, "-o", run)
    low, high = found["drag_coefficient_interval"]
    # Four times the interval: what is tested is the verdict.
    assert abs(np.log(DRAG / np.sqrt(low * high))) < 2.0 * np.log(high / low)
    assert found["flow_strength_change"] == pytest.approx(0.5, abs=0.04)
    assert found["verdict"] == "explains"
    fit = xr.load_dataset(run / "fit.nc", engine="h5netcdf")
    steady = tmp_path / "steady.csv"
    dw.save_flow(dw.fitted_flow(fit, interval=0), steady)

    def distance(*flow: Any) -> float:
        """Return the median KS distance of five simulated recordings."""
        out = tmp_path / "motion.nc"
        many = ("--like", track, "--replicates", "5", "--overwrite", "-o", out)
        answer("simulate", run, *flow, *many)
        motion = xr.load_dataset(out, engine="h5netcdf")
        return float(np.median([apart(motion.isel(replicate=[k])) for k in range(5)]))

    def apart(other: xr.Dataset) -> float:
        return float(dw.compare(recording, other, permutations=0)["ks_distance"])

    # In the flow of the run they are as far as other blocks in the true water; in its mean flow,
    # twice as far.
    floor = float(np.median([apart(other) for other in others]))
    assert distance() < 1.5 * floor < distance("--flow", steady)
    # Another simulator gets the mean flow, and the user reads so.
    out = tmp_path / "mujoco"
    notes = answer("export", run, "--to", "mujoco", "-o", out)["notes"]
    assert any("changes in time, and is taken with its mean" in note for note in notes)
    assert "with its mean flow" in (out / "README.md").read_text(encoding="utf-8")
    assert "time" not in dw.load_flow(out / "flow.nc").dims
