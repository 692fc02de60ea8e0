"""Every format on small synthetic files, and the registry that finds them."""

from __future__ import annotations

import gzip
import json
import sys
from functools import reduce
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from driftwalk.core.errors import FormatError, InputError
from driftwalk.record import load, loaders, readable_formats, registry
from driftwalk.schema import body_names, body_track

PIXELS = {"metres_per_pixel": 0.01}
FRAMES = {"frame_rate": 10.0, **PIXELS}


def write(folder: Path, name: str, *lines: str) -> Path:
    path = folder / name
    path.write_text("\n".join(lines) + "\n", newline="")
    return path


def test_every_loader_follows_the_protocol() -> None:
    for name, loader in registry.loaders().items():
        assert isinstance(loader, registry.Loader)
        assert loader.name == name
        assert loader.sniff(b"\x00\xff\xfe", Path("nowhere")) == 0.0
    assert set(readable_formats()) == set(registry.loaders())
    assert len(readable_formats()) >= 14


def test_a_format_joins_by_one_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "synthetic_format.py").write_text(
        "import numpy as np\n"
        "from driftwalk.record.raw import RawBody, RawRecording\n"
        "class Synthetic:\n"
        "    name = 'synthetic'\n"
        "    description = 'for this test'\n"
        "    def sniff(self, head, path):\n"
        "        return 1.0 if head.startswith(b'SYNTHETIC') else 0.0\n"
        "    def read(self, path, options):\n"
        "        a = np.arange(3.0)\n"
        "        return RawRecording([RawBody('0', a, a.copy(), a.copy())], 's', 'mm', rows=3)\n"
        "LOADER = Synthetic()\n"
    )
    monkeypatch.setattr(loaders, "__path__", [*loaders.__path__, str(tmp_path)])
    registry.loaders.cache_clear()
    try:
        dataset = load(write(tmp_path, "recording.bin", "SYNTHETIC"))
    finally:
        registry.loaders.cache_clear()
        sys.modules.pop("driftwalk.record.loaders.synthetic_format", None)
    assert dataset.attrs["format"] == "synthetic"
    np.testing.assert_allclose(body_track(dataset).x, [0.0, 0.001, 0.002])


OLD_HEADER = (
    "%Frame Number\tx (image)\ty (image)\tx (world)\ty (world)\tArea\tOrientation\tCompactness"
    "\tTimeStamp (ms)"
)


def test_swistrack_track_of_2009(tmp_path: Path) -> None:
    path = write(
        tmp_path,
        "track_00000003.txt",
        OLD_HEADER,
        "5\t100\t200\t0.1\t0.2\t50\t0.5\t1e-05\t1262304000123",
        "7\t110\t210\t0.11\t0.21\t50\t-0.5\t1e-05\t1262304000323",
    )
    dataset = load(path)
    assert dataset.attrs["format"] == "swistrack-tracks"
    assert dataset.attrs["time_origin_unix_s"] == pytest.approx(1262304000.123)
    assert body_names(dataset) == ["3"]
    track = body_track(dataset)
    np.testing.assert_allclose(track.time, [0.0, 0.2], atol=1e-12)
    np.testing.assert_allclose(track.y, [0.2, 0.21])  # world: calibrated, y kept
    np.testing.assert_allclose(track.theta, [-0.5, 0.5])  # measured in the image: negated
    image = body_track(load(path, metres_per_pixel=0.01))
    np.testing.assert_allclose(image.y, [-2.0, -2.1])
    frames = body_track(load(path, frame_rate=10.0))
    np.testing.assert_allclose(frames.time, [0.5, 0.7])


def test_swistrack_track_without_valid_time_or_calibration(tmp_path: Path) -> None:
    path = write(
        tmp_path,
        "track_00000000.txt",
        OLD_HEADER,
        "5\t100\t200\t0\t0\t50\t0.5\t0.1\t -1",
        "6\t110\t210\t0\t0\t50\t0.5\t0.1\t -1",
    )
    with pytest.raises(InputError, match="`metres_per_pixel`"):
        load(path, frame_rate=10.0)
    with pytest.raises(InputError, match="`frame_rate`"):
        load(path, **PIXELS)
    np.testing.assert_allclose(body_track(load(path, **FRAMES)).x, [1.0, 1.1])


def test_swistrack_folder_of_tracks_since_2022(tmp_path: Path) -> None:
    header = "% Frame number, x, y"
    write(tmp_path, "track00000000.csv", header, "1\t100\t200", "2\t110\t200")
    write(tmp_path, "track00000012.csv", header, "2\t300\t400", "4\t310\t400")
    dataset = load(tmp_path, **FRAMES)
    assert body_names(dataset) == ["0", "12"]
    np.testing.assert_allclose(dataset["time"].values, [0.1, 0.2, 0.4])
    np.testing.assert_allclose(body_track(dataset, "12").x, [3.0, 3.1])


def test_swistrack_particles(tmp_path: Path) -> None:
    path = write(
        tmp_path,
        "particles.csv",
        "% Frame number, Time, X (image), Y (image), X (world), Y (world), Area, Orientation, "
        "Compactness\t",
        "1\t2022-05-01T12:00:00.000\t1\t2\t0.1\t0.2\t9\t0.5\t0.1",
        "1\t2022-05-01T12:00:00.000\t3\t4\t0.3\t0.4\t9\t0.5\t0.1",
        "2\t2022-05-01T12:00:00.040\t1\t2\t0.1\t0.2\t9\t0.5\t0.1",
    )
    dataset = load(path)
    assert dataset.attrs["format"] == "swistrack-particles"
    np.testing.assert_allclose(dataset["time"].values, [0.0, 0.04], atol=1e-6)
    np.testing.assert_allclose(body_track(dataset, "1").x, [0.3])
    assert "no identities" in json.loads(dataset.attrs["counts"])["warnings"][0]


@pytest.mark.parametrize(
    ("zone", "unix_s"), [("", 1651406400.0), ("Z", 1651406400.0), ("+02:00", 1651399200.0)]
)
def test_time_stamps_of_swistrack_with_a_zone(tmp_path: Path, zone: str, unix_s: float) -> None:
    """Found by damaging files: NumPy warned of the zone, and left it to a version to come."""
    rows = [
        f"{k}\t2022-05-01T12:00:0{k}.500{zone}\t{k}\t2\t0.{k}\t0.2\t9\t0.5\t0.1" for k in range(4)
    ]
    names = "X (image), Y (image), X (world), Y (world), Area, Orientation, Compactness\t"
    path = write(tmp_path, "particles.csv", f"% Frame number, Time, {names}", *rows)
    dataset = load(path)
    np.testing.assert_allclose(dataset["time"].values, np.arange(4.0), atol=1e-6)
    assert dataset.attrs["time_origin_unix_s"] == unix_s + 0.5


def checksummed(content: str) -> str:
    return f"${content}*{reduce(lambda total, c: total ^ ord(c), content, 0):02X}\r"


def test_swistrack_nmea_of_both_ages(tmp_path: Path) -> None:
    old = write(
        tmp_path,
        "old.txt",
        "$STEP_START\r",
        "$FRAMENUMBER,1\r",
        "$PARTICLE,4,10,20,0.5,0.1,0.2\r",
        "$PARTICLE,9,30,40,0.5,0.3,0.4\r",
        "$STEP_STOP\r",
        "$FRAMENUMBER,2",
        "$PARTICLE,9,30,40,0.5,0.31,0.41",
    )
    dataset = load(old, frame_rate=10.0)
    assert body_names(dataset) == ["4", "9"]
    np.testing.assert_allclose(body_track(dataset, "9").x, [0.3, 0.31])
    np.testing.assert_allclose(body_track(dataset, "4").theta, [-0.5])
    new = write(
        tmp_path,
        "new.txt",
        checksummed("FRAMENUMBER,1"),
        checksummed("PARTICLE,0,10,20,0.1,0.2,99,0.5,0.1"),
    )
    np.testing.assert_allclose(body_track(load(new, frame_rate=10.0)).y, [0.2])


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("$PARTICLE,1,2,3*00", "line 2: the checksum"),
        ("$PARTICLE,1,2,3", "line 2: cannot read"),
        ("$PARTICLE,1,2,3,4,five,6", "line 2: cannot read"),
        ("particle", "line 2: expected a line that starts with"),
    ],
)
def test_a_damaged_nmea_line(tmp_path: Path, line: str, message: str) -> None:
    path = write(tmp_path, "log.txt", "$FRAMENUMBER,1", line)
    with pytest.raises(FormatError, match=message):
        load(path, frame_rate=10.0)


def test_nmea_ids_that_repeat_are_told_apart_by_order(tmp_path: Path) -> None:
    lines = ["$PARTICLE,0,1,2,0.5,0.1,0.2", "$PARTICLE,0,3,4,0.5,0.3,0.4"]
    path = write(tmp_path, "log.txt", "$FRAMENUMBER,1", *lines, "$FRAMENUMBER,2", *lines)
    dataset = load(path, frame_rate=10.0)
    np.testing.assert_allclose(body_track(dataset, "1").x, [0.3, 0.3])
    assert "ids repeat" in json.loads(dataset.attrs["counts"])["warnings"][0]


def test_idtracker(tmp_path: Path) -> None:
    path = write(
        tmp_path,
        "trajectories.txt",
        "X1\tY1\tProbId1\tX2\tY2\tProbId2\t",
        "10\t20\tNaN\t30\t40\t1",
        "NaN\tNaN\tNaN\t31\t41\t-1",
    )
    dataset = load(path, **FRAMES)
    assert dataset.attrs["format"] == "idtracker"
    np.testing.assert_allclose(dataset["y"].values, [[-0.2, -0.4], [np.nan, -0.41]])
    assert "1 positions were estimated" in json.loads(dataset.attrs["counts"])["warnings"][0]


def test_toxtrac(tmp_path: Path) -> None:
    path = write(
        tmp_path, "tracking.txt", "4\t0\t1\t10\t20\t1", "5\t0\t1\t11\t20\t1", "4\t0\t2\t30\t40\t0"
    )
    dataset = load(path, **FRAMES)
    assert (dataset.attrs["format"], body_names(dataset)) == ("toxtrac", ["1", "2"])
    np.testing.assert_allclose(body_track(dataset, "1").time, [0.4, 0.5])
    arenas = write(tmp_path, "arenas.txt", "4\t0\t1\t10\t20\t1", "4\t1\t1\t30\t40\t0")
    assert body_names(load(arenas, **FRAMES)) == ["0/1", "1/1"]


def test_ubitrail(tmp_path: Path) -> None:
    metadata = (
        '\'list(Global=c(Date="2013"),Areas=matrix(c(200,190,407,252,100,197,212,242),4,2,'
        'dimname=list(c("W","H","X","Y"),c("05","04"))))\''
    )
    text = "\n".join(
        [
            metadata,
            "Area,Territory,X,Y,time,L",
            "05,255,0.5,0.25,1000,-11",
            "04,255,0.5,0.25,1000,-11",
            "05,255,0.6,0.25,1026,-11",
            "05,255,0.7,0.25,1026,-11",
        ]
    )
    path = tmp_path / "tracks.csv.gz"
    path.write_bytes(gzip.compress(text.encode()))
    dataset = load(path, metres_per_pixel=0.001)
    assert dataset.attrs["format"] == "ubitrail"
    assert dataset.attrs["bodies_apart"] == "yes"
    track = body_track(dataset, "05")
    np.testing.assert_allclose(track.x, [0.1, 0.14])  # 200 pixels wide; the last row is kept
    np.testing.assert_allclose(body_track(dataset, "04").x, [0.05])
    np.testing.assert_allclose(track.time, [1.0, 1.026])
    assert json.loads(dataset.attrs["counts"])["duplicates_dropped"] == 1


def test_smarticles(tmp_path: Path) -> None:
    path = write(
        tmp_path,
        "robots.csv",
        "12.8,0,511,398,0.75,530,462,2.7,596,414,5.9",
        "25.1,1.4,512,399,0.76,531,463,2.8,597,415,7.0",
    )
    dataset = load(path, **PIXELS)
    assert (dataset.attrs["format"], body_names(dataset)) == ("smarticles", ["1", "2", "3"])
    track = body_track(dataset, "3")
    np.testing.assert_allclose(track.y, [-4.14, -4.15])
    np.testing.assert_allclose(track.theta, [2 * np.pi - 5.9, 2 * np.pi - 7.0])


def test_tracktor(tmp_path: Path) -> None:
    path = write(tmp_path, "tracked.csv", ",frame,pos_x,pos_y,id", "0,3.0,10,20,A", "1,3.0,30,40,B")
    dataset = load(path, **FRAMES)
    assert (dataset.attrs["format"], body_names(dataset)) == ("tracktor", ["A", "B"])
    one = load(write(tmp_path, "one.csv", ",frame,pos_x,pos_y", "0,3.0,10,20"), **FRAMES)
    np.testing.assert_allclose(body_track(one).time, [0.3])


def test_dltdv(tmp_path: Path) -> None:
    path = write(tmp_path, "xypts.csv", "pt1_cam1_X,pt1_cam1_Y", "10,20", "NaN,NaN", "12,22")
    dataset = load(path, **FRAMES)
    assert dataset.attrs["format"] == "dltdv"
    np.testing.assert_allclose(body_track(dataset).x, [0.1, 0.12])


def test_json_points(tmp_path: Path) -> None:
    path = write(tmp_path, "points.json", "[[10, 20], [-1, -1], null, [11, 21]]")
    dataset = load(path, **FRAMES)
    assert dataset.attrs["format"] == "json"
    np.testing.assert_allclose(body_track(dataset).time, [0.0, 0.3])
    timed = write(
        tmp_path, "t.json", '[{"t": 0, "x": 1, "y": 2, "theta": 0.5},{"t":1,"x":1,"y":2}]'
    )
    track = body_track(load(timed, length_unit="cm"))
    np.testing.assert_allclose(track.y, [0.02, 0.02])
    np.testing.assert_allclose(track.theta, [0.5, np.nan])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[[1, 2], [3, 4", "line 2, column 1: expected JSON"),
        ("[[1, 2], [3]]", "entry 2"),
        ('[[1, 2], ["a", "b"]]', "entry 2"),
        ("[[1, 2], [true, 1]]", "entry 2"),
        ("[[1, 2], 7]", "entry 2"),
    ],
)
def test_bad_json(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(FormatError, match=message):
        load(write(tmp_path, "points.json", text), **FRAMES)


def test_one_matrix_per_coordinate(tmp_path: Path) -> None:
    write(tmp_path, "x.csv", "0.1,0.2", "0.3,0.4")
    write(tmp_path, "y.csv", "1,2", "3,4")
    write(tmp_path, "theta.csv", "0.5,0.6", "0.7,0.8")
    matrices = {"y": "y.csv", "theta": "theta.csv", "frame_rate": 10.0}
    for dataset in (
        load(tmp_path, x="x.csv", **matrices),
        load(tmp_path / "x.csv", **matrices),
        load(tmp_path / "x.csv", x=tmp_path / "x.csv", **matrices),
    ):
        assert dataset.attrs["format"] == "matrices"
        np.testing.assert_array_equal(dataset["y"].values, [[1.0, 2.0], [3.0, 4.0]])
        np.testing.assert_array_equal(dataset["x"].values, [[0.1, 0.2], [0.3, 0.4]])
        np.testing.assert_allclose(dataset["theta"].values, [[0.5, 0.6], [0.7, 0.8]])
    write(tmp_path, "short.csv", "1,2")
    with pytest.raises(InputError, match="`x` has 2 rows and 2 columns, `y` has 1 rows"):
        load(tmp_path, x="x.csv", y="short.csv", frame_rate=10.0)
    with pytest.raises(InputError, match="`x` and `y`"):
        load(tmp_path, y="y.csv", frame_rate=10.0)


@pytest.mark.parametrize("plural", ["", "s"])
@pytest.mark.parametrize("unit", ["seconds", "frames"])
def test_movement(tmp_path: Path, plural: str, unit: str) -> None:
    values = np.arange(2 * 2 * 2 * 2, dtype=float).reshape(2, 2, 2, 2)
    path = tmp_path / "poses.nc"
    xr.Dataset(
        {"position": (("time", "space", f"keypoint{plural}", f"individual{plural}"), values)},
        coords={
            "time": [0.0, 0.5] if unit == "seconds" else [0.0, 5.0],
            "space": ["x", "y"],
            f"keypoint{plural}": ["nose", "tail"],
            f"individual{plural}": ["a", "b"],
        },
        attrs={"time_unit": unit, "fps": 10.0, "ds_type": "poses", "source_software": "synthetic"},
    ).to_netcdf(path, engine="h5netcdf")
    with pytest.raises(InputError, match="`keypoint`: nose, tail"):
        load(path, **PIXELS)
    dataset = load(path, keypoint="tail", **PIXELS)
    assert (dataset.attrs["format"], body_names(dataset)) == ("movement", ["a", "b"])
    np.testing.assert_allclose(dataset["time"].values, [0.0, 0.5])
    np.testing.assert_allclose(dataset["x"].values, values[:, 0, 1, :] * 0.01)
    np.testing.assert_allclose(dataset["y"].values, -values[:, 1, 1, :] * 0.01)


def test_a_damaged_or_foreign_netcdf(tmp_path: Path) -> None:
    damaged = tmp_path / "damaged.nc"
    damaged.write_bytes(b"\x89HDF\r\n\x1a\n" + b"junk" * 100)
    with pytest.raises(FormatError, match="not recognised"):
        load(damaged)
    with pytest.raises(FormatError, match="cannot be read as NetCDF"):
        load(damaged, format="driftwalk")
    with pytest.raises(FormatError, match="not a NetCDF"):
        load(write(tmp_path, "a.csv", "t,x,y", "0,1,2"), format="movement")
