"""Keypoints to the pose of a body: which point, which way it points, how sure the tracker was."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray as xr
from tracker_files import ORDER, dlc_csv, dlc_hdf5, movement_file, sleap_csv, sleap_hdf5, swimmer

from driftwalk.core.errors import FormatError, InputError
from driftwalk.record import load
from driftwalk.schema import body_names, body_track

FRAMES = {"frame_rate": 10.0, "metres_per_pixel": 0.01}


def warnings_of(dataset: xr.Dataset) -> str:
    return " | ".join(json.loads(dataset.attrs["counts"])["warnings"])


def check_swimmer(dataset: xr.Dataset, names: list[str], *, lost: list[int]) -> None:
    """Hold a recording of the first keypoint, heading from tail to nose, to its closed form."""
    assert body_names(dataset) == names
    values = swimmer()
    for index, name in enumerate(names):
        x, y = 0.01 * values[:, index, 0, 0], -0.01 * values[:, index, 0, 1]
        theta = -(0.3 * np.arange(6) + index)
        if index == 0:
            x[lost] = y[lost] = theta[lost] = np.nan
        np.testing.assert_allclose(dataset["x"].sel(body=name), x, rtol=1e-12)
        np.testing.assert_allclose(dataset["y"].sel(body=name), y, rtol=1e-12)
        turned = np.angle(np.exp(1j * (dataset["theta"].sel(body=name).values - theta)))
        np.testing.assert_allclose(turned, np.where(np.isnan(theta), np.nan, 0.0), atol=1e-12)


POSE: dict[str, Any] = {"keypoint": "nose", "heading": ("tail", "nose")}


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("plural", ["", "s"])
def test_movement_with_confidence_and_heading(tmp_path: Path, plural: str) -> None:
    path = movement_file(tmp_path / "poses.nc", plural=plural)
    dataset = load(path, metres_per_pixel=0.01, **POSE)
    check_swimmer(dataset, ["a", "b"], lost=[2])
    assert "below 0.6 (movement's threshold) are missing: 1 of 24" in warnings_of(dataset)
    all_seen = load(path, metres_per_pixel=0.01, min_confidence=0.2, **POSE)
    check_swimmer(all_seen, ["a", "b"], lost=[])
    assert "below 0.2 are missing: 0 of 24" in warnings_of(all_seen)
    sleap = load(movement_file(tmp_path / "s.nc", source="SLEAP"), metres_per_pixel=0.01, **POSE)
    check_swimmer(sleap, ["a", "b"], lost=[])


@pytest.mark.slow
def test_a_movement_file_over_other_dimensions(tmp_path: Path) -> None:
    """Found by damaging files: xarray's error came through."""
    path = movement_file(tmp_path / "poses.nc")
    with xr.open_dataset(path) as stored:
        other = stored.load().rename_dims({"keypoints": "points"})
    other.to_netcdf(tmp_path / "other.nc", engine="h5netcdf")
    with pytest.raises(FormatError, match=r"'position' is over .*points.*, expected time, space"):
        load(tmp_path / "other.nc", metres_per_pixel=0.01)


def test_movement_of_bounding_boxes_and_without_confidence(tmp_path: Path) -> None:
    path = tmp_path / "boxes.nc"
    values = np.arange(12.0).reshape(3, 2, 2)
    xr.Dataset(
        {"position": (("time", "space", "individuals"), values)},
        coords={"space": ["x", "y"], "individuals": ["a", "b"]},
        attrs={"time_unit": "frames", "ds_type": "bboxes"},
    ).to_netcdf(path, engine="h5netcdf")
    dataset = load(path, **FRAMES)
    np.testing.assert_allclose(dataset["x"].values, 0.01 * values[:, 0])
    assert "holds no confidences" in warnings_of(dataset)
    with pytest.raises(InputError, match="no confidences: leave `min_confidence` out"):
        load(path, min_confidence=0.5, **FRAMES)


@pytest.mark.parametrize("individuals", [["one"], ["one", "two"]])
def test_deeplabcut_csv(tmp_path: Path, individuals: list[str]) -> None:
    path = dlc_csv(tmp_path, individuals)
    names = individuals if len(individuals) > 1 else ["0"]
    dataset = load(path, **FRAMES, **POSE)
    assert dataset.attrs["format"] == "deeplabcut"
    check_swimmer(dataset, names, lost=[2])
    assert "below 0.6 (DeepLabCut's pcutoff)" in warnings_of(dataset)
    check_swimmer(load(path, min_confidence=0, **FRAMES, **POSE), names, lost=[])
    with pytest.raises(InputError, match="`keypoint`: nose, tail"):
        load(path, **FRAMES)
    with pytest.raises(InputError, match="no keypoint 'ear'; there are nose, tail"):
        load(path, keypoint="nose", heading=("ear", "nose"), **FRAMES)
    with pytest.raises(InputError, match="give their rate in Hz"):
        load(path, keypoint="nose", metres_per_pixel=0.01)


def test_deeplabcut_hdf5(tmp_path: Path) -> None:
    for individuals, names in ((["one"], ["0"]), (["one", "two"], ["one", "two"])):
        dataset = load(dlc_hdf5(tmp_path / "dlc.h5", individuals), **FRAMES, **POSE)
        assert dataset.attrs["format"] == "deeplabcut"
        check_swimmer(dataset, names, lost=[2])


def test_deeplabcut_of_a_bodypart_that_one_individual_lacks(tmp_path: Path) -> None:
    path = dlc_csv(tmp_path, ["one", "two"])
    text = path.read_text().splitlines()
    text[2] = "bodyparts," + ",".join(["nose"] * 3 + ["tail"] * 3 + ["ear"] * 3 + ["tail"] * 3)
    path.write_text("\n".join(text) + "\n")
    dataset = load(path, **FRAMES, **POSE)
    assert body_names(dataset) == ["one"]
    assert "left out: two" in warnings_of(dataset)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("coords,x", "coord,x", "first column of the header is not scorer"),
        ("coords,x,y", "coords,x,z", "no column of y for bodypart 'nose'"),
        ("scorer,net,", "scorer,", "different numbers of fields"),
        ("\n0,", "\nlabeled-data/v/img0.png,", "line 4: the rows are named by images"),
        ("\n3,", "\nthree,", "line 7, column 1: 'three' in column 'scorer.bodyparts.coords'"),
    ],
)
def test_a_damaged_deeplabcut_table(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = dlc_csv(tmp_path, ["one"])
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(FormatError, match=message):
        load(path, **FRAMES, **POSE)


def test_a_truncated_deeplabcut_table(tmp_path: Path) -> None:
    path = dlc_csv(tmp_path, ["one"])
    path.write_bytes(path.read_bytes()[:-30])
    with pytest.raises(FormatError, match="line 9: expected 7 fields"):
        load(path, **FRAMES, **POSE)
    path.write_bytes(b"\n".join(path.read_bytes().split(b"\n")[:3]) + b"\n")
    with pytest.raises(FormatError, match="no rows of data"):
        load(path, **FRAMES, **POSE)


@pytest.mark.parametrize("dims", [None, ORDER, ("frame", "track", "node", "xy")])
def test_sleap_hdf5(tmp_path: Path, dims: tuple[str, ...] | None) -> None:
    path = sleap_hdf5(tmp_path / "a.analysis.h5", dims=dims)
    dataset = load(path, min_confidence=0.5, **FRAMES, **POSE)
    assert dataset.attrs["format"] == "sleap"
    check_swimmer(dataset, ["a", "b"], lost=[2])
    usual = load(path, **FRAMES, **POSE)
    check_swimmer(usual, ["a", "b"], lost=[])
    assert "below 0.2 (SLEAP's threshold of peaks) are missing: 0 of 24" in warnings_of(usual)


def test_sleap_hdf5_without_scores_or_names(tmp_path: Path) -> None:
    path = sleap_hdf5(tmp_path / "a.h5", scores=False)
    with h5py.File(path, "a") as file:
        del file["track_names"]
        file["track_names"] = np.zeros(0)
    dataset = load(path, **FRAMES, **POSE)
    check_swimmer(dataset, ["0", "1"], lost=[])
    assert "holds no confidences" in warnings_of(dataset)


@pytest.mark.parametrize(
    ("name", "values", "message"),
    [
        ("node_names", np.array([b"nose"]), "expected track, xy, node, frame with 1 nodes"),
        ("tracks", np.zeros((2, 2, 2)), "no numbers over track, xy, node, frame"),
        ("tracks", np.zeros((2, 2, 2, 6), "S3"), "no numbers over track, xy, node, frame"),
        ("point_scores", np.zeros((2, 2, 5)), "'point_scores' has another shape"),
    ],
)
def test_a_damaged_sleap_file(
    tmp_path: Path, name: str, values: np.ndarray[Any, Any], message: str
) -> None:
    path = sleap_hdf5(tmp_path / "a.h5")
    with h5py.File(path, "a") as file:
        del file[name]
        file[name] = values
    with pytest.raises(FormatError, match=message):
        load(path, **FRAMES, **{**POSE, "keypoint": "nose", "heading": None})


def test_an_array_that_declares_more_than_its_file_holds(tmp_path: Path) -> None:
    path = sleap_hdf5(tmp_path / "a.h5")
    with h5py.File(path, "a") as file:
        del file["tracks"]
        file.create_dataset("tracks", (2, 2, 2, 10**9), "f8", chunks=(1, 1, 1, 1000))
    with pytest.raises(FormatError, match="declares 64 GB, which a file of"):
        load(path, **FRAMES, **POSE)


def test_sleap_csv(tmp_path: Path) -> None:
    path = sleap_csv(tmp_path / "a.analysis.csv", ["a", "b"])
    dataset = load(path, min_confidence=0.5, **FRAMES, **POSE)
    assert dataset.attrs["format"] == "sleap-csv"
    check_swimmer(dataset, ["a", "b"], lost=[2])
    one = sleap_csv(tmp_path / "one.csv", [""])
    check_swimmer(load(one, **FRAMES, **POSE), ["0"], lost=[])
    untracked = sleap_csv(tmp_path / "two.csv", ["", ""])
    with pytest.raises(FormatError, match="several instances of one frame have no track"):
        load(untracked, **FRAMES, **POSE)
    renamed = tmp_path / "r.csv"
    renamed.write_text(path.read_text().replace("frame_idx", "frame"))
    with pytest.raises(FormatError, match=r"no columns frame_idx, NODE\.x"):
        load(renamed, format="sleap-csv", **FRAMES, **POSE)


def test_two_markers_of_one_robot_make_a_pose(tmp_path: Path) -> None:
    """Formats without keypoints: bodies are markers."""
    values = swimmer()[:, 1, :, :2]
    rows = [f"{k},{n[0]!r},{n[1]!r},{t[0]!r},{t[1]!r}" for k, (n, t) in enumerate(values.tolist())]
    path = tmp_path / "markers.csv"
    path.write_text("frame,x_front_px,y_front_px,x_back_px,y_back_px\n" + "\n".join(rows) + "\n")
    joined = load(path, heading=("back", "front"), **FRAMES)
    assert body_names(joined) == ["0"]
    track = body_track(joined)
    np.testing.assert_allclose(track.x, 0.01 * (100.0 + np.arange(6)), rtol=1e-12)
    np.testing.assert_allclose(track.y, -0.01 * (50.0 + 7.0 * np.arange(6)), rtol=1e-12)
    turned = np.angle(np.exp(1j * (track.theta + 0.3 * np.arange(6) + 1.0)))
    np.testing.assert_allclose(turned, 0.0, atol=1e-12)
    front = body_track(load(path, heading=("back", "front"), keypoint="front", **FRAMES))
    np.testing.assert_allclose(front.x, 0.01 * values[:, 0, 0], rtol=1e-12)
    np.testing.assert_allclose(front.theta, track.theta)
    for options, message in (
        ({"heading": ("back", "side")}, "no marker 'side'; there are front, back"),
        ({"heading": ("back",)}, "`heading` is two points"),
        ({"heading": ("back", "back")}, "`heading` is two points"),
        ({"keypoint": "front"}, "no keypoints: leave `keypoint` out"),
        ({"min_confidence": 0.5}, "no confidences: leave `min_confidence` out"),
    ):
        with pytest.raises(InputError, match=message):
            load(path, **FRAMES, **options)


def test_markers_with_clocks_of_their_own(tmp_path: Path) -> None:
    path = tmp_path / "stacked.csv"
    path.write_text("frame,x_px,y_px,id\n0,0,0,a\n1,1,0,a\n2,2,0,a\n1,1,4,b\n2,2,4,b\n3,3,4,b\n")
    joined = body_track(load(path, heading=("a", "b"), **FRAMES))
    np.testing.assert_allclose(joined.time, [0.1, 0.2])
    np.testing.assert_allclose(joined.y, [-0.02, -0.02])
    np.testing.assert_allclose(joined.theta, [-np.pi / 2, -np.pi / 2])
    first = body_track(load(path, heading=("a", "b"), keypoint="a", **FRAMES))
    np.testing.assert_allclose(first.theta, [np.nan, -np.pi / 2, -np.pi / 2])
