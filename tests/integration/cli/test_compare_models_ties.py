"""`driftwalk compare-models` where models tie: the summaries of the motion, on the command line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command_line import here
from self_propelled import moving

import driftwalk as dw
from driftwalk.cli.terminal.output import print_result
from driftwalk.schema.stores.netcdf import netcdf_bytes, open_netcdf

RESTING = {
    "speed": 0.04, "speed_cv": 0.2, "run_time": 1.0, "run_time_cv": 0.5, "rest_time": 1.0,
    "rest_time_cv": 0.5, "turn_std": 1.0, "rotational_diffusion": 0.1,
}  # fmt: skip


@pytest.mark.study
def test_summaries_name_the_true_model(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Run and rest tie with bursts by distance; by their summaries they do not.

    Slow tests of the same code: `test_summaries_are_matched_and_kept` in
    tests/unit/calibration/ranking/test_compare.py, and test_evidence_ranking.py for the findings.
    """
    recording = moving(
        dw.motion_model("run_rest", clearance=0.01), RESTING, 300.0, seed=4, noise=2e-4
    )
    (tmp_path / "recording.nc").write_bytes(netcdf_bytes(recording))
    out = tmp_path / "run"
    done = here(
        *("compare-models", tmp_path / "recording.nc", "--position-noise", "0.2mm"),
        *("--models", "run_rest,burst_coast", "-o", out, "--json"),
    )
    assert done.code == 0, done.err
    said = json.loads(done.out)
    by_name = {one["model"]: one for one in said["models"]}
    assert by_name["run_rest"]["named"]
    assert by_name["run_rest"]["discrepancy"] <= by_name["run_rest"]["discrepancy_q95"]
    assert not by_name["burst_coast"]["named"]
    assert "discrepancy" not in by_name["resampled steps"]
    assert said["findings"][0].startswith("run_rest explains the recording")
    assert said["findings"][1].startswith("run_rest is named by the summaries of the motion")
    print_result(open_netcdf(out / "comparison.nc"), out, json=False)
    assert "own below" in capsys.readouterr().out
