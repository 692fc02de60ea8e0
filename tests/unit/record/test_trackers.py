"""Files of programs that follow bodies in videos: small ones, as the programs write them."""

from __future__ import annotations

import json
import pickle
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray as xr
from tracker_files import (
    FEATURES,
    NAMES,
    SESSION,
    SPOTS,
    animalta,
    frame_table,
    session,
    spots_csv,
    trex,
    write,
)

from driftwalk.core.errors import FormatError, InputError
from driftwalk.record import load
from driftwalk.schema import body_names, body_track

PIXELS = {"metres_per_pixel": 0.01}
FRAMES = {"frame_rate": 10.0, **PIXELS}


def warnings_of(dataset: xr.Dataset) -> str:
    return " | ".join(json.loads(dataset.attrs["counts"])["warnings"])


# trackpy


def check_features(dataset: xr.Dataset) -> None:
    assert (dataset.attrs["format"], body_names(dataset)) == ("trackpy", ["3", "7"])
    track = body_track(dataset, "3")
    np.testing.assert_allclose(track.time, [0.0, 0.1])
    np.testing.assert_allclose(track.x, [0.01, 0.015])
    np.testing.assert_allclose(track.y, [-0.105, -0.115])
    np.testing.assert_allclose(body_track(dataset, "7").time, [0.0, 0.2])


@pytest.mark.parametrize("index", ["", ","])
def test_trackpy_csv(tmp_path: Path, index: str) -> None:
    rows = [(f"{k}," if index else "") + ",".join(map(str, row)) for k, row in enumerate(FEATURES)]
    path = write(tmp_path / "t.csv", index + ",".join(NAMES), *rows)
    check_features(load(path, **FRAMES))
    loose = write(tmp_path / "l.csv", index + ",".join(NAMES), *rows, index + "9,9,9,9,1,")
    dataset = load(loose, **FRAMES)
    check_features(dataset)
    assert "linked to no particle, and left out: 1" in warnings_of(dataset)
    for name, message in (("particle", "not linked"), ("frame", "column frame")):
        other = write(tmp_path / "o.csv", path.read_text().replace(name, "other"))
        with pytest.raises(FormatError, match=message):
            load(other, format="trackpy", **FRAMES)


def test_spots_none_of_which_is_in_a_track_are_refused(tmp_path: Path) -> None:
    """Found by reading: an error without the file's name came up instead."""
    loose = write(tmp_path / "l.csv", ",".join(NAMES), "9,9,9,9,1,", "8,9,9,9,2,")
    with pytest.raises(FormatError, match=r"l\.csv: no feature is linked to a particle"):
        load(loose, **FRAMES)
    spots = write(tmp_path / "s.csv", SPOTS, "ID1,1,,5,1.0,2.0,0.0,0.0,0")
    with pytest.raises(FormatError, match=r"s\.csv: no spot belongs to a track"):
        load(spots, **FRAMES)


def test_trackpy_store_of_a_table_per_frame(tmp_path: Path) -> None:
    path = tmp_path / "features.h5"
    with h5py.File(path, "w") as file:
        file.attrs["PYTABLES_FORMAT_VERSION"] = np.bytes_("2.1")
        rows = [(*row[:4], 10 + row[4], row[5]) for row in FEATURES]
        for frame in (10, 11, 12):
            frame_table(file, f"Frame_{frame}", [row for row in rows if row[4] == frame])
        frame_table(file, "Frame_9", [(10.0, 0.5, 200.0, 0.1, 9, 3)])
    dataset = load(path, **FRAMES)
    np.testing.assert_allclose(body_track(dataset, "3").x, [0.005, 0.01, 0.015])
    np.testing.assert_allclose(body_track(dataset, "7").time, [1.0, 1.2])


def test_trackpy_store_of_one_fixed_table(tmp_path: Path) -> None:
    path = tmp_path / "tracks.h5"
    values = np.array(FEATURES)
    with h5py.File(path, "w") as file:
        file.attrs["PYTABLES_FORMAT_VERSION"] = np.bytes_("2.1")
        group = file.create_group("tracks")
        group.attrs["pandas_type"], group.attrs["nblocks"] = np.bytes_("frame"), 2
        group["axis1"] = np.arange(4)
        for block, part in enumerate((slice(0, 4), slice(4, 6))):
            group[f"block{block}_items"] = np.array(NAMES[part], "S")
            group[f"block{block}_values"] = values[:, part]
    check_features(load(path, **FRAMES))
    with h5py.File(path, "a") as file:
        del file["tracks/block1_values"]
    with pytest.raises(FormatError, match="has no array 'tracks/block1_values'"):
        load(path, **FRAMES)
    with h5py.File(path, "a") as file:
        file["tracks"].attrs["pandas_type"] = np.bytes_("wide")
    with pytest.raises(FormatError, match=r"it says 'wide'\): save the table as CSV"):
        load(path, **FRAMES)


def test_a_pickled_name_that_runs_a_program_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "features.h5"
    with h5py.File(path, "w") as file:
        file.attrs["PYTABLES_FORMAT_VERSION"] = np.bytes_("2.1")
        frame_table(file, "tracks", FEATURES)
        marker = tmp_path / "ran"
        evil = b"cos\nsystem\n(S'touch " + str(marker).encode() + b"'\ntR."
        file["tracks/table"].attrs["values_block_0_kind"] = np.bytes_(evil)
    with pytest.raises(FormatError, match=r"asks for os\.system, which is no plain data"):
        load(path, **FRAMES)
    assert not marker.exists()


# TrackMate


@pytest.mark.parametrize(("unit", "metres"), [("micron", 1e-6), ("µm", 1e-6), ("mm", 1e-3)])
def test_trackmate_csv_in_the_units_it_states(tmp_path: Path, unit: str, metres: float) -> None:
    dataset = load(spots_csv(tmp_path / "spots.csv", unit, "sec"))
    assert (dataset.attrs["format"], body_names(dataset)) == ("trackmate", ["0", "2"])
    track = body_track(dataset, "0")
    np.testing.assert_allclose(track.time, [0.0, 0.5])
    np.testing.assert_allclose(track.x, [10 * metres, 11 * metres])
    np.testing.assert_allclose(track.y, [-20 * metres, -21 * metres])
    assert "spots outside the tracks, left out: 1" in warnings_of(dataset)


def test_trackmate_csv_in_pixels_and_frames(tmp_path: Path) -> None:
    path = spots_csv(tmp_path / "spots.csv", "pixel", "frame")
    with pytest.raises(InputError, match="`metres_per_pixel`"):
        load(path, frame_rate=10.0)
    with pytest.raises(InputError, match="`frame_rate`"):
        load(path, **PIXELS)
    np.testing.assert_allclose(body_track(load(path, **FRAMES), "0").time, [0.0, 0.1])
    old = spots_csv(tmp_path / "old.csv", "", "", rows=1)
    with pytest.raises(InputError, match="does not name the unit"):
        load(old, frame_rate=10.0)
    np.testing.assert_allclose(body_track(load(old, **FRAMES), "0").x, [0.1, 0.11])
    with pytest.raises(FormatError, match="positions are in 'furlong': give the image one of"):
        load(spots_csv(tmp_path / "furlong.csv", "furlong", "sec"))
    renamed = write(tmp_path / "r.csv", path.read_text().replace("POSITION_T", "TIME"))
    with pytest.raises(FormatError, match="line 1: no column POSITION_T"):
        load(renamed)


def test_trackmate_xml(tmp_path: Path) -> None:
    text = SESSION.format(length="mm", time="sec")
    path = write(tmp_path / "session.xml", text)
    dataset = load(path)
    assert (dataset.attrs["format"], body_names(dataset)) == ("trackmate-xml", ["4"])
    track = body_track(dataset)
    np.testing.assert_allclose(track.time, [0.0, 0.2, 0.4])
    np.testing.assert_allclose(track.x, [1.5e-3, 2.5e-3, 3.5e-3])
    np.testing.assert_allclose(track.y, [-2.5e-3, -3.5e-3, -4.5e-3])
    assert "spots outside the tracks, left out: 2" in warnings_of(dataset)
    frames = write(tmp_path / "f.xml", SESSION.format(length="pixel", time="frame"))
    np.testing.assert_allclose(body_track(load(frames, **FRAMES)).time, [0.0, 0.1, 0.2])
    every = write(tmp_path / "e.xml", text.replace('<TrackID TRACK_ID="4" />', '<TrackID '
                  'TRACK_ID="4" /><TrackID TRACK_ID="5" />'))  # fmt: skip
    assert body_names(load(every)) == ["4", "5"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("</AllSpots>", "", "is damaged XML: mismatched tag"),
        ('ID="7" name', 'ID="77" name', "track 4 has an edge to spot 7, which is not there"),
        (
            'POSITION_X="1.5"',
            'POSITION_X="1,5"',
            "line 6: is damaged XML: could not convert string",
        ),
        (
            'POSITION_X="1.5"',
            'X="1.5"',
            "line 6: is damaged XML: an element lacks its attribute 'POSITION_X'",
        ),
        ('<TrackID TRACK_ID="4" />', "", "no track is kept"),
        ("<Model", "<Moodel", "damaged XML|holds no spots"),
        ("<TrackMate", '<!DOCTYPE a [<!ENTITY b "c">]>\n<TrackMate', "defines a document type"),
    ],
)
def test_a_damaged_trackmate_session(tmp_path: Path, old: str, new: str, message: str) -> None:
    text = SESSION.format(length="mm", time="sec")
    with pytest.raises(FormatError, match=message):
        load(write(tmp_path / "a.xml", text.replace(old, new, 1)))
    with pytest.raises(FormatError, match="damaged XML"):
        load(write(tmp_path / "t.xml", text[: len(text) // 2]))


# AnimalTA, ToxTrac, traja, yupi


@pytest.mark.parametrize("rate", [25.0, 30.0, 29.97, 7.5])
def test_animalta_knows_the_rate_better_than_its_rounded_times(tmp_path: Path, rate: float) -> None:
    dataset = load(animalta(tmp_path / "a.csv", rate=rate, count=3000), **PIXELS)
    assert (dataset.attrs["format"], body_names(dataset)) == ("animalta", ["Ind0", "Ind1"])
    # Two times that are rounded to 0.01 s leave the duration uncertain by that.
    duration = 2999 / rate
    np.testing.assert_allclose(dataset.attrs["sample_rate_Hz"], rate, rtol=0.01 / duration)
    if rate % 1 == 0:
        assert dataset.attrs["sample_rate_Hz"] == rate
    np.testing.assert_allclose(np.diff(dataset["time"]), 1 / rate, rtol=0.01 / duration)
    assert np.isnan(dataset["x"].sel(body="Ind1").values[3])


def test_animalta_stacked_and_too_short_for_a_rate(tmp_path: Path) -> None:
    path = write(
        tmp_path / "a.csv",
        "Frame;Time;Arena;Ind;X;Y",
        *("0.0;0.0;0;0;1;2", "0.0;0.0;1;0;5;5", "1.0;0.03;0;0;2;2", "2.0;0.07;1;0;6;5"),
    )
    dataset = load(path, **PIXELS)
    assert body_names(dataset) == ["0/Ind0", "1/Ind0"]
    np.testing.assert_allclose(body_track(dataset, "1/Ind0").time, [0.0, 0.07])
    np.testing.assert_allclose(body_track(load(path, **FRAMES), "1/Ind0").time, [0.0, 0.2])
    with pytest.raises(FormatError, match=r"no column of x or of y for .Ind1"):
        load(write(tmp_path / "b.csv", animalta(tmp_path / "c.csv").read_text().replace(
            "Y_Arena0_Ind1", "Z")), **PIXELS)  # fmt: skip


def test_toxtrac_in_real_space(tmp_path: Path) -> None:
    path = write(
        tmp_path / "Tracking_RealSpace_1.txt",
        "Time (sec)\tArena\tTrack\tPos. X (mm)\tPos. Y (mm)\tLabel",
        *("12.25\t1\t1\t10.5\t20\t1", "12.35\t1\t1\t11.5\t21\t0", "12.35\t2\t1\t30\t40\t1"),
    )
    dataset = load(path)
    assert (dataset.attrs["format"], body_names(dataset)) == ("toxtrac", ["1/1", "2/1"])
    track = body_track(dataset, "1/1")
    np.testing.assert_allclose(track.time, [12.25, 12.35])
    np.testing.assert_allclose(track.x, [0.0105, 0.0115])
    np.testing.assert_allclose(track.y, [-0.020, -0.021])
    assert "ToxTrac predicted, not seen: 1" in warnings_of(dataset)


def test_traja_asks_for_the_unit(tmp_path: Path) -> None:
    path = write(
        tmp_path / "3527.csv",
        "Frame,Time,TrackId,x,y,ValueChanged",
        *("8,0.16,8,195.5,0,TRUE", "9,0.18,8,193.5,1.5,TRUE"),
    )
    with pytest.raises(InputError, match="does not name the unit of its positions"):
        load(path)
    dataset = load(path, length_unit="mm")
    assert (dataset.attrs["format"], body_names(dataset)) == ("traja", ["8"])
    np.testing.assert_allclose(body_track(dataset).y, [0.0, 0.0015])
    np.testing.assert_allclose(body_track(load(path, **PIXELS)).y, [0.0, -0.015])


def test_yupi_of_both_versions(tmp_path: Path) -> None:
    data = ("0.0,0.5,0.0", "0.1,0.7,0.1", "0.2,0.9,0.2")
    first = write(tmp_path / "v1.csv", "walk,0.1,2", "1,1,1", *data)
    rows = [f"{row},{tag}" for row, tag in zip(data, "abc", strict=True)]
    second = write(tmp_path / "v2.csv", "v2,6", "walk,,2", "1,1,1", "by", "me", "tag", *rows)
    for path in (first, second):
        with pytest.raises(InputError, match="does not name the unit"):
            load(path)
        dataset = load(path, length_unit="cm")
        assert (dataset.attrs["format"], body_names(dataset)) == ("yupi", ["walk"])
        np.testing.assert_allclose(body_track(dataset).y, [0.005, 0.007, 0.009])
        np.testing.assert_allclose(body_track(dataset).time, [0.0, 0.1, 0.2])
    with pytest.raises(FormatError, match="settings are damaged"):
        load(write(tmp_path / "d.csv", "v2,6", "walk"), length_unit="cm")
    with pytest.raises(FormatError, match="has 1 dimensions"):
        load(write(tmp_path / "e.csv", "v2,6", "walk,,1", "1,1,1", "", "", "", "1,0"))


# idtracker.ai


def check_session(dataset: xr.Dataset, *, lost: int = 0) -> None:
    assert (dataset.attrs["format"], body_names(dataset)) == ("idtrackerai", ["red", "blue"])
    values = session()["trajectories"]
    if lost:
        values[2, 1] = np.nan
    np.testing.assert_allclose(dataset["time"], 0.05 * np.arange(5))
    np.testing.assert_allclose(dataset["x"], 0.01 * values[..., 0])
    np.testing.assert_allclose(dataset["y"], -0.01 * values[..., 1])
    assert "12.5 pixels to its user's unit" in warnings_of(dataset)


@pytest.mark.parametrize("protocol", [2, 3, 4, 5])
def test_idtrackerai_dictionary(tmp_path: Path, protocol: int) -> None:
    """4 and 5 wrote NumPy's file of one dictionary, in the protocol of their time."""
    path = tmp_path / "trajectories.npy"
    np.save(path, np.zeros(()))
    with path.open("wb") as file:
        header = {"descr": "|O", "fortran_order": False, "shape": ()}
        np.lib.format.write_array_header_1_0(file, header)
        pickle.dump(np.array(session(), dtype=object), file, protocol=protocol)
    assert np.load(path, allow_pickle=True).item()["length_unit"] == 12.5
    check_session(load(path, **PIXELS))
    dataset = load(path, min_confidence=0.5, **PIXELS)
    check_session(dataset, lost=1)
    assert "identity below 0.5 are missing: 1" in warnings_of(dataset)
    (tmp_path / "trajectories.pickle").write_bytes(pickle.dumps(session(), protocol=protocol))
    check_session(load(tmp_path / "trajectories.pickle", **PIXELS))


def test_idtrackerai_hdf5_and_csv(tmp_path: Path) -> None:
    values = session()
    with h5py.File(tmp_path / "trajectories.h5", "w") as file:
        for name in ("trajectories", "id_probabilities"):
            file.create_dataset(name, data=values[name], compression="gzip")
        for name in ("frames_per_second", "length_unit", "version", "identities_labels"):
            file.attrs[name] = values[name]
    check_session(load(tmp_path / "trajectories.h5", **PIXELS))
    check_session(load(tmp_path / "trajectories.h5", min_confidence=0.5, **PIXELS), lost=1)
    folder = tmp_path / "trajectories_csv"
    folder.mkdir()
    known = {name: values[name] for name in ("frames_per_second", "length_unit")}
    known["identities_labels"] = values["identities_labels"]
    (folder / "attributes.json").write_text(json.dumps(known))
    table = values["trajectories"].reshape(5, 4)
    rows = [",".join(f"{one:.3f}" for one in (k / 20, *row)) for k, row in enumerate(table)]
    write(folder / "trajectories.csv", "time,x1,y1,x2,y2", *rows)
    sure = values["id_probabilities"][..., 0]
    rows = [",".join(f"{one:.3e}" for one in (k / 20, *row)) for k, row in enumerate(sure)]
    write(folder / "id_probabilities.csv", "time,id_probabilities1,id_probabilities2", *rows)
    for path in (folder, folder / "trajectories.csv"):
        check_session(load(path, **PIXELS))
        check_session(load(path, min_confidence=0.5, **PIXELS), lost=1)
    tidy = [
        f"{k},{k / 20:.3f},{i},{values['trajectories'][k, i, 0]},{values['trajectories'][k, i, 1]},"
        f"{sure[k, i]}"
        for k in range(5)
        for i in range(2)
    ]
    path = write(tmp_path / "trajectories_tidy.csv", "frame,time,individual,x,y,probability", *tidy)
    assert body_names(load(path, **PIXELS)) == ["1", "2"]
    (tmp_path / "attributes_tidy.json").write_text(json.dumps(known))
    check_session(load(path, **PIXELS))
    check_session(load(path, min_confidence=0.5, **PIXELS), lost=1)


def test_idtrackerai_files_that_hold_something_else(tmp_path: Path) -> None:
    np.save(tmp_path / "plain.npy", np.zeros((3, 2)))
    with pytest.raises(FormatError, match=r"array of float64 of shape \(3, 2\), and no dictionary"):
        load(tmp_path / "plain.npy", format="idtrackerai", **PIXELS)
    np.save(tmp_path / "other.npy", {"a": 1, "b": 2})  # type: ignore[arg-type]
    with pytest.raises(
        FormatError, match=r"has no 'trajectories' as idtracker\.ai's have it, but a, b"
    ):
        load(tmp_path / "other.npy", format="idtrackerai", **PIXELS)
    flat = session() | {"trajectories": np.zeros((4, 2))}
    np.save(tmp_path / "flat.npy", flat)  # type: ignore[arg-type]
    with pytest.raises(FormatError, match="expected frames, individuals, 2"):
        load(tmp_path / "flat.npy", **PIXELS)
    np.save(tmp_path / "rate.npy", session() | {"frames_per_second": "25"})  # type: ignore[arg-type]
    with pytest.raises(FormatError, match="'frames_per_second' is 25"):
        load(tmp_path / "rate.npy", **PIXELS)
    np.save(tmp_path / "whole.npy", session())  # type: ignore[arg-type]
    content = (tmp_path / "whole.npy").read_bytes()
    (tmp_path / "cut.npy").write_bytes(content[: len(content) // 2])
    with pytest.raises(FormatError, match="is a damaged pickle"):
        load(tmp_path / "cut.npy", **PIXELS)


# TRex


def test_trex_folder(tmp_path: Path) -> None:
    for number in (10, 2):
        trex(tmp_path, number)
    np.savez(tmp_path / "tank_statistics.npz", values=np.arange(3))
    dataset = load(tmp_path)
    assert (dataset.attrs["format"], body_names(dataset)) == ("trex", ["2", "10"])
    np.testing.assert_allclose(dataset["time"], 0.05 * np.arange(6))
    x = 0.01 * (12.0 + np.arange(6))
    x[2] = np.nan
    np.testing.assert_allclose(dataset["x"].sel(body="2"), x)
    np.testing.assert_allclose(dataset["y"].sel(body="2")[:2], [-0.05, -0.05])
    np.testing.assert_allclose(dataset["theta"].sel(body="2")[1], -0.1)
    np.savez(tmp_path / "other_id0.npz", **{"frame": np.arange(2), "X": np.arange(2.0)})
    with pytest.raises(FormatError, match=r"several videos \(other, tank\)"):
        load(tmp_path)


def test_trex_points_and_files_without_a_scale(tmp_path: Path) -> None:
    path = trex(tmp_path, 0)
    head = load(path, keypoint="head")
    np.testing.assert_allclose(head["x"].values[0], 0.11)
    pose = load(path, keypoint="pose0", heading=("pose0", "pose1"))
    np.testing.assert_allclose(pose["y"].values[0], -0.03)
    np.testing.assert_allclose(pose["theta"].values[0], -np.pi / 2)  # y counts down in the image
    with pytest.raises(FormatError, match="no point 'tail' in x and y; there are wcentroid, head"):
        load(path, keypoint="tail")
    old = trex(tmp_path, 1, cm_per_pixel=None, frame_rate=None, time=None)
    with pytest.raises(InputError, match="`frame_rate`"):
        load(old)
    dataset = load(old, frame_rate=20.0)
    assert "does not hold cm_per_pixel" in warnings_of(dataset)
    np.testing.assert_allclose(dataset["x"].values[0], 0.11)
    np.testing.assert_allclose(load(old, **FRAMES)["x"].values[0], 0.11)
    np.testing.assert_allclose(load(old, frame_rate=20.0, length_unit="mm")["x"].values[0], 0.011)
    interpolated = trex(tmp_path, 2, **{"X#wcentroid": np.arange(6.0)})
    assert np.isnan(load(interpolated)["x"].values[2])


def test_trex_csv(tmp_path: Path) -> None:
    path = write(
        tmp_path / "tank_fish7.csv",
        "frame,SPEED#wcentroid (cm/s),X#wcentroid (cm),Y#wcentroid (cm),ANGLE",
        *("0,1.0,2.0,3.0,0.5", "1,inf,inf,inf,inf", "2,1.0,2.5,3.0,0.5"),
    )
    dataset = load(path, frame_rate=10.0)
    assert (dataset.attrs["format"], body_names(dataset)) == ("trex", ["7"])
    np.testing.assert_allclose(dataset["x"].values[:, 0], [0.02, np.nan, 0.025])
    np.testing.assert_allclose(body_track(dataset).theta, -0.5)
    lost = write(tmp_path / "x.csv", "frame,X#wcentroid (cm),blobid", "0,1,2")
    with pytest.raises(FormatError, match="has no point 'wcentroid' in x and y"):
        load(lost, frame_rate=10.0)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"X#wcentroid": np.zeros(4)}, "different lengths"),
        ({"X#wcentroid": np.array(["a"] * 6)}, "'X#wcentroid' is no row of numbers"),
        ({"X#wcentroid": np.array([{}] * 6)}, "allow_pickle=False"),
    ],
)
def test_a_damaged_trex_file(tmp_path: Path, changed: dict[str, Any], message: str) -> None:
    path = trex(tmp_path, 0, **changed)
    with pytest.raises(FormatError, match=message):
        load(path)
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(FormatError, match=r"cannot be read as NumPy's \.npz"):
        load(path, format="trex")
