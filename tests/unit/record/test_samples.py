"""Files of other programs, where they are on this machine: read, or refused with what to do."""

from __future__ import annotations

import csv
import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from driftwalk.core.errors import InputError
from driftwalk.record import load
from driftwalk.schema import body_names, body_track

SharedData = Callable[[str], Path]

RATE: Mapping[str, Any] = {"frame_rate": 25.0}
SCALE: Mapping[str, Any] = {"metres_per_pixel": 1e-3}
BOTH = {**RATE, **SCALE}
FLY = {"keypoint": "thorax", "heading": ("abdomen", "thorax")}


@dataclass(frozen=True)
class Sample:
    """A file, what is said of it, and what becomes of it."""

    file: str
    format: str
    bodies: int
    times: int
    options: Mapping[str, Any]
    asks: str
    """What is asked for where nothing is said."""


POSES = [
    ("formats-2/movement_0.15_sleap.nc", "movement", 2, 400, {**SCALE, **FLY}, "keypoint"),
    ("formats-2/sleap_predictions.analysis.h5", "sleap", 2, 3000, {**BOTH, **FLY}, "keypoint"),
    ("formats-2/sleap_robot3.analysis.h5", "sleap", 1, 3, {**BOTH, "keypoint": "top"}, "rear"),
    ("formats-2/sleap_min.analysis.csv", "sleap-csv", 1, 1, {**BOTH, "keypoint": "A"}, "A, B"),
]
NEEDS_SCALE = [
    ("formats-2/trackmate_FakeTracks.xml", "trackmate-xml", 2, 6, SCALE),
    ("formats-2/trackmate_spots.csv", "trackmate", 2, 6, SCALE),
    ("formats-2/trackpy_tracks.csv", "trackpy", 17, 5, BOTH),
    ("formats-2/trackpy_tracks.h5", "trackpy", 17, 5, BOTH),
    ("format-idtrackerai/test_trajectories_idtrackerai_with_border.npy", "idtrackerai", 8, 508,
     SCALE),
    ("format-idtrackerai/trajectories_with_points.npy", "idtrackerai", 15, 1000, SCALE),
    ("rummynose-single-epfl/rummy_single_seven_trajectories.txt", "idtracker", 1, 106193, BOTH),
    ("tracktor-mouse-termite/mouse_video_tracked.csv", "tracktor", 1, 10000, BOTH),
    ("tracktor-mouse-termite/mouse_video_toxtracked.txt", "toxtrac", 1, 9405, BOTH),
    ("tracktor-mouse-termite/termite_video_toxtracked.txt", "toxtrac", 8, 2760, BOTH),
    ("tracktor-mouse-termite/termite_video_idtracked.txt", "idtracker", 8, 2800, BOTH),
    ("tenebrio-ubitrail/tenebrio_ubitrail.csv.gz", "ubitrail", 6, 68218, SCALE),
    ("trajr-walks/096xypts.csv", "dltdv", 1, 2030, BOTH),
]  # fmt: skip
OTHERS = [
    ("formats-2/traja_3527.csv", "traja", 1, 115, SCALE, "unit of its positions"),
    ("trajr-walks/3537.csv", "traja", 1, 1469, SCALE, "unit of its positions"),
    ("format-swistrack/ParticleSimulation_Particles.txt", "swistrack-nmea", 10, 1032, BOTH,
     "frame_rate"),
]  # fmt: skip
READ = [
    Sample(*one) for one in (*POSES, *((*two, "metres_per_pixel") for two in NEEDS_SCALE), *OTHERS)
]


def of(shared_data: SharedData, file: str) -> Path:
    folder, _, name = file.partition("/")
    return shared_data(folder) / name


@pytest.mark.fast_cases(7)
@pytest.mark.parametrize("sample", READ, ids=lambda sample: sample.file)
def test_a_sample_is_read(shared_data: SharedData, sample: Sample) -> None:
    path = of(shared_data, sample.file)
    with pytest.raises(InputError, match=sample.asks):
        load(path)
    dataset = load(path, **sample.options)
    assert dataset.attrs["format"] == sample.format
    assert dataset.sizes == {"time": sample.times, "body": sample.bodies}
    assert json.loads(dataset.attrs["counts"])["samples"] > 0


FOLDERS = ["formats-2", "format-idtrackerai", "format-swistrack", "tracktor-mouse-termite",
           "trajr-walks", "piv-pivpy", "capillary-spinners", "rummynose-single-epfl"]  # fmt: skip


@pytest.mark.fast_cases(4)
@pytest.mark.parametrize("folder", FOLDERS)
def test_every_file_is_read_or_refused_in_one_line(shared_data: SharedData, folder: str) -> None:
    files = [path for path in sorted(shared_data(folder).rglob("*")) if path.is_file()]
    assert files
    for path in files:
        begin = time.process_time()
        refusal = refusal_of(path)
        if refusal is not None:
            assert time.process_time() - begin < 10.0, path
            assert "\n" not in refusal
            assert len(refusal) > len(str(path)) + 10


def refusal_of(path: Path) -> str | None:
    """Return what is said of a file that is not read."""
    try:
        load(path, **BOTH)
    except InputError as error:
        return str(error)
    return None


def test_idtrackerai_against_numpy(shared_data: SharedData) -> None:
    path = of(shared_data, "format-idtrackerai/trajectories_with_points.npy")
    # The sample is known: NumPy, which runs what is in a pickle, says what has to be read.
    content = np.load(path, allow_pickle=True).item()
    dataset = load(path, **SCALE)
    np.testing.assert_allclose(dataset["x"], 1e-3 * content["trajectories"][..., 0], rtol=1e-15)
    np.testing.assert_allclose(dataset["y"], -1e-3 * content["trajectories"][..., 1], rtol=1e-15)
    np.testing.assert_allclose(dataset["time"], np.arange(1000) / 32.0)


def test_two_forms_of_one_recording_agree(shared_data: SharedData) -> None:
    folder = shared_data("formats-2")
    csv_file, store = (load(folder / f"trackpy_tracks.{end}", **BOTH) for end in ("csv", "h5"))
    np.testing.assert_array_equal(csv_file["x"], store["x"])
    np.testing.assert_array_equal(csv_file["y"], store["y"])
    spots, session = (
        load(folder / name, **SCALE) for name in ("trackmate_spots.csv", "trackmate_FakeTracks.xml")
    )
    np.testing.assert_array_equal(spots["x"], session["x"])
    np.testing.assert_array_equal(spots["time"], session["time"])
    sleap = load(folder / "sleap_predictions.analysis.h5", **BOTH, **FLY)
    movement = load(folder / "movement_0.15_sleap.nc", **SCALE, **FLY)
    assert body_names(sleap) == body_names(movement)
    for name in ("x", "y", "theta"):
        first = sleap[name].isel(time=slice(0, 400)).values
        np.testing.assert_allclose(movement[name].values, first, rtol=1e-5, atol=1e-4)


def test_sleap_against_h5py(shared_data: SharedData) -> None:
    path = shared_data("formats-2") / "sleap_predictions.analysis.h5"
    with h5py.File(path) as file:
        nodes = [name.decode() for name in file["node_names"][()]]
        tracks = file["tracks"][()]
    dataset = load(path, **BOTH, **FLY)
    at, of_tail = nodes.index("thorax"), nodes.index("abdomen")
    np.testing.assert_allclose(dataset["x"].values.T, 1e-3 * tracks[:, 0, at], rtol=1e-12)
    along = tracks[:, :, at] - tracks[:, :, of_tail]
    expected = -np.arctan2(along[:, 1], along[:, 0])
    np.testing.assert_allclose(dataset["theta"].values.T, expected, atol=1e-12)


def test_trackmate_against_its_table(shared_data: SharedData) -> None:
    path = shared_data("formats-2") / "trackmate_spots.csv"
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))[3:]
    track = body_track(load(path, **SCALE), "1")
    own = sorted((row for row in rows if row["TRACK_ID"] == "1"), key=lambda r: float(r["FRAME"]))
    np.testing.assert_allclose(track.x, [1e-3 * float(row["POSITION_X"]) for row in own])
    np.testing.assert_allclose(track.time, [float(row["POSITION_T"]) for row in own])
