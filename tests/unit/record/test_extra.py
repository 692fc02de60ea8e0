"""What a NetCDF recording knows beside positions is carried through reading and writing."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from driftwalk.record import describe, load, save_trajectory
from driftwalk.schema import build_trajectory

FRAMES = 20
COUNTS = {"frames": 20, "dropped": 3, "rejected": {"too small": 7}}


@pytest.fixture
def tracked(tmp_path: Path) -> Path:
    """Return a recording of two bodies with scores, covariances and a variable of its own."""
    random = np.random.default_rng(3)
    time = 0.1 * np.arange(FRAMES)
    x = 0.01 * time[:, None] + [0.0, 0.05]
    x[4:7, 1] = np.nan
    recording = build_trajectory(
        time, x, 0 * x, 0 * x, body=["a", "b"],
        attrs={"format": "driftwalk track", "counts": json.dumps(COUNTS), "complete": "no",
               "interrupted": "stopped by hand", "tracked_from": "film.mp4"},
    )  # fmt: skip
    score = np.zeros((FRAMES, 2))
    score[5:10, 0] = 0.4
    recording["ambiguous"] = (("time", "body"), score, {"units": "1"})
    recording["covariance"] = (("time", "body", "part"), random.normal(size=(FRAMES, 2, 3)))
    recording["flags"] = (("time", "body"), np.ones((FRAMES, 2), dtype=np.int8))
    recording["temperature"] = ("time", 20.0 + time)
    recording = recording.assign_coords(part=["xx", "xy", "yy"])
    return save_trajectory(recording, tmp_path / "tracked.nc")


@pytest.mark.slow
def test_all_of_it_comes_back_twice(tracked: Path, tmp_path: Path) -> None:
    written = xr.load_dataset(tracked, engine="h5netcdf")
    once = load(tracked)
    twice = load(save_trajectory(once, tmp_path / "again.nc"))
    for read in (once, twice):
        for name in ("x", "theta", "ambiguous", "covariance", "flags"):
            np.testing.assert_array_equal(read[name].values, written[name].values)
        assert read["part"].values.tolist() == ["xx", "xy", "yy"]
        assert read["ambiguous"].attrs == {"units": "1"}
        assert json.loads(read.attrs["tracking_counts"]) == COUNTS
        assert json.loads(read.attrs["counts"])["samples"] == 2 * FRAMES - 3


@pytest.mark.slow
def test_it_follows_its_samples(tracked: Path) -> None:
    """A window and one body: the rows that are left keep their own values."""
    whole, part = load(tracked), load(tracked, body="b", start=0.5, stop=1.25)
    assert part.sizes == {"time": 8, "body": 1, "part": 3}
    expected = whole["covariance"].sel(time=part["time"], body=["b"]).values
    np.testing.assert_array_equal(part["covariance"].values, expected)


@pytest.mark.slow
def test_the_description_says_how_much_is_ambiguous(tracked: Path, tmp_path: Path) -> None:
    described = describe(load(tracked))
    shares = {name: body["ambiguous_share"] for name, body in described["bodies"].items()}
    assert shares == {"a": 0.25, "b": 0.0}
    assert described["tracking"] == {
        "tracked_from": "film.mp4", "complete": False, "interrupted": "stopped by hand", **COUNTS,
    }  # fmt: skip
    plain = save_trajectory(build_trajectory([0.0, 0.1], [0.0, 0.1], [0.0, 0.0]), tmp_path / "p.nc")
    described = describe(load(plain))
    assert described["tracking"] is None
    assert "ambiguous_share" not in described["bodies"]["0"]
