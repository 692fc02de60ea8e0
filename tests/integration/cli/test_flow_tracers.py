"""Tracers made a flow on the command line: synthetic PTV, and the files of particle trackers."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from command_line import here, refusal
from drifting_tracers import seeded_tank, vortex

from driftwalk.flow import load_flow
from driftwalk.schema import FLAGS

SCALE = ("--scale", "10um", "--fps", "10")


@pytest.mark.slow
def test_from_a_table_of_tracks_to_a_flow_that_is_simulated_in(tmp_path: Path) -> None:
    """A synthetic table with a row for each particle and frame."""
    recording = seeded_tank(1, tracers=250, samples=8, false_links=0.01).recording
    table = recording.to_dataframe().reset_index()
    tracks, made = tmp_path / "tracks.csv", tmp_path / "flow.nc"
    table[["time", "body", "x", "y"]].to_csv(tracks, index=False)
    tank = ("--tank", "30cm")
    said = refusal(here("flow", tracks, "-o", made, *tank))
    assert "has 250 bodies: --tracers makes one flow of them" in said
    code, _, err = here("flow", tracks, "-o", made, "--tracers", *tank, "--cells", "10")
    assert (code, "that join two particles" in err) == (0, True)
    flow = load_flow(made)
    # A track that a false link takes beyond the wall is left out.
    assert 230 < flow.attrs["tracks_used"] <= 250
    assert f"{flow['count'].sum():.0f} steps of {flow.attrs['tracks_used']} tracks" in err
    x, y = np.meshgrid(flow.x, flow.y)
    inner = (flow.flag.values == FLAGS["measured"]) & (np.hypot(x, y) < 0.12)
    for name, true in zip("uv", vortex(x, y), strict=True):
        assert np.std(flow[name].values[inner] - true[inner]) < 0.2 * np.std(true[inner])
    code, out, _ = here("info", made, "--json")
    described = json.loads(out)
    assert (described["tracks_used"], described["speed_max_m_s"] < 0.1) == (
        flow.attrs["tracks_used"],
        True,
    )
    assert 0.0 < described["standard_error_median_m_s"] < 5e-3
    assert "standard error, median" in here("info", made)[1]
    code, _, err = here(
        "simulate", "--flow", made, "--out", tmp_path / "run.nc", "--duration", "2",
        "--replicates", "1",
        "--drag-coefficient", "0.4", "--force-std", "0.1mN", "--force-interval", "16ms",
    )  # fmt: skip
    assert code == 0, err


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "tracks", "steps"),
    [
        ("trackpy_tracks.csv", 17, 39),
        ("trackpy_tracks.h5", 17, 39),
        ("trackmate_spots.csv", 2, 10),
        ("trackmate_FakeTracks.xml", 2, 10),
    ],
)
def test_the_files_of_particle_trackers(
    shared_data: Callable[[str], Path], tmp_path: Path, name: str, tracks: int, steps: int
) -> None:
    path, made = shared_data("formats-2") / name, tmp_path / "flow.nc"
    assert "--scale" in refusal(here("flow", path, "-o", made, "--tracers"))
    size = "1mm" if tracks > 2 else "80um"
    code, out, _ = here(
        "flow", path, "-o", made, "--tracers", *SCALE, "--cell-size", size, "--json"
    )
    facts = json.loads(out)
    assert (code, facts["tracks_used"]) == (0, tracks)
    assert facts["samples_used"] + facts["samples_rejected"] == steps
    flow = load_flow(made)
    # No tank is stated: the field is the box of the tracks, and nothing lies outside.
    assert (flow.flag.values != FLAGS["outside"]).all()
    assert int(flow["count"].sum()) == facts["samples_used"]


def test_options_of_a_floating_body_have_no_meaning_for_tracers(tmp_path: Path) -> None:
    recording = seeded_tank(2, tracers=30, samples=4).recording
    tracks, made = tmp_path / "tracks.csv", tmp_path / "flow.nc"
    table = recording.to_dataframe().reset_index()
    table[["time", "body", "x", "y"]].to_csv(tracks, index=False)
    said = refusal(here("flow", tracks, "-o", made, "--tracers", "--mass", "2g", "--window", "1s"))
    assert "--mass, --window is for a floating body" in said
    assert "is for --tracers" in refusal(
        here("flow", tracks, "-o", made, "--position-noise", "1mm", "--body", "all")
    )
    code, out, _ = here(
        "flow",
        tracks,
        "-o",
        made,
        "--tracers",
        "--position-noise",
        "0.2mm",
        "--json",
        "--cells",
        "9",
    )
    assert (code, json.loads(out)["position_noise_m"]) == (0, pytest.approx(2e-4))
    assert "exists" in refusal(here("flow", tracks, "-o", made, "--tracers"))
    assert "is a flow field already" in refusal(
        here("flow", made, "-o", tmp_path / "again.nc", "--tracers")
    )
