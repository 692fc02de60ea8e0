"""Readers never fail with anything but an `InputError`, and what is written is read back."""

from __future__ import annotations

import csv
import io
import json
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st

from driftwalk.core.errors import InputError
from driftwalk.record import describe, load, save_trajectory
from driftwalk.record.arena import place_arena
from driftwalk.record.registry import loaders
from driftwalk.record.text import _field_counts
from driftwalk.schema import body_names, body_track, build_trajectory, check_trajectory

OPTIONS = {"frame_rate": 25.0, "metres_per_pixel": 0.001}
POSE = {**OPTIONS, "keypoint": "a", "min_confidence": 0.5}
NPY = (
    b"\x93NUMPY\x01\x00v\x00"
    + b"{'descr': '|O', 'fortran_order': False, 'shape': (), }".ljust(117)
    + b"\n"
)
HEADERS = [
    b"",
    b"t,x,y,theta\n",
    b"frame\tx_px\ty_px\n",
    b"t;x_mm;y_mm;id\n",
    b"X1\tY1\tProbId1\t\n",
    b",frame,pos_x,pos_y,id\n",
    b"pt1_cam1_X,pt1_cam1_Y\n",
    b"% Frame number, x, y\n",
    b"% Frame number, Time, X (image), Y (image), X (world), Y (world), Area, Orientation, C\t\n",
    b"$FRAMENUMBER,1\n",
    b'\'list(Areas=matrix(c(1,2,3,4),4,1,dimname=list(c("W"),c("05"))))\'\n'
    b"Area,Territory,X,Y,time,L\n",
    b"Format Version,1.23,Take Name,a,Rotation Type,XYZ,Length Units,Meters\n\n,Type,Rigid Body\n"
    b",Name,A\n,,Position\nFrame,Time,X\n",
    b"Objects\n100\n,,A:A,,,,,\nFrame,Sub Frame,RX,RY,RZ,TX,TY,TZ\n,,rad,rad,rad,mm,mm,mm\n",
    b"#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y []\n",
    b"# timestamp tx ty tz qx qy qz qw\n0 1 2 3 0 0 0 1\n",
    b"t,x,y,z,qx,qy,qz,qw\n",
    b"\x89MCAP0\r\n",
    b"SQLite format 3\0",
    b"[[1, 2], ",
    b"scorer,net,net,net\nbodyparts,a,a,a\ncoords,x,y,likelihood\n",
    b"track,frame_idx,instance.score,a.x,a.y,a.score\n",
    b"y,x,mass,ecc,frame,particle\n",
    b"LABEL,ID,TRACK_ID,POSITION_X,POSITION_Y,POSITION_T,FRAME\n,,,(mm),(mm),(sec),\n",
    b'<?xml version="1.0"?>\n<TrackMate><Model spatialunits="mm" timeunits="sec">',
    b"Frame;Time;X_Arena0_Ind0;Y_Arena0_Ind0\n",
    b"Frame;Time;Arena;Ind;X;Y\n",
    b"Time (sec)\tArena\tTrack\tPos. X (mm)\tPos. Y (mm)\tLabel\n",
    b"Frame,Time,TrackId,x,y,ValueChanged\n",
    b"v2,6\na,,2\n1,1,1\n\n\n\n",
    b"frame,X#wcentroid (cm),Y#wcentroid (cm)\n",
    b"frame,time,individual,x,y,probability\n",
    NPY + b"\x80\x04",
    b"\x80\x04}\x8c\x0ctrajectories",
    b"PK\x03\x04",
    b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM",
    b"MATLAB 7.3 MAT-file".ljust(512) + b"\x89HDF\r\n\x1a\n",
    b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1",
    b"\xff\xfet\x00,\x00x\x00,\x00y\x00\n\x00",
    b"date;time;x;y\n2024-05-01;12:00:00,5;1,5;2\n",
    b"time,x,y,id\n23:59:59,1,2,a\n",
    b"\x89HDF\r\n\x1a\n",
    b"CDF\x01",
    b"\x1f\x8b",
]
FIELDS = st.sampled_from(
    [
        *(b"0", b"1.5", b"-2", b"1e5", b"1e999", b"NaN", b"", b" ", b"inf", b"x", b'"', b"\xff"),
        *(b"1,2", b"$PARTICLE", b"[", b"]", b"null", b"\r", b"05", b"2022-05-01T12:00:00.000"),
    ]
)
ROWS = st.lists(
    st.tuples(st.sampled_from([b",", b"\t", b";", b" "]), st.lists(FIELDS, max_size=9)).map(
        lambda row: row[0].join(row[1])
    ),
    max_size=8,
).map(b"\n".join)
# Positions that are all nearer to the origin than an atom are refused, as no camera sees them.
FINITE = st.floats(-1e3, 1e3, allow_nan=False).map(lambda x: x if abs(x) > 1e-6 else 0.0)


def load_or_refuse(path: Path, name: str | None) -> None:
    for options in (OPTIONS, {}, {"frame_rate": 25.0}, POSE):
        try:
            dataset = load(path, format=name, sort="sort", **options)
        except InputError:
            continue
        else:
            check_trajectory(dataset)
            json.loads(dataset.attrs["counts"])


@pytest.mark.slow
@settings(deadline=None, max_examples=60)
@given(
    head=st.sampled_from(HEADERS),
    body=st.one_of(st.binary(max_size=200), ROWS),
    name=st.sampled_from([None, *loaders()]),
)
@example(head=b",frame,pos_x,pos_y,id\n", body=b"\n", name=None)
@example(head=b"", body=b"0,", name="tracktor")
@example(head=b"\x1f\x8b", body=b"", name="swistrack-nmea")
@example(head=b"\x1f\x8b\x08\x00\x00\x00\x00\x00\x00\x03", body=b"\xff\xff\xff", name="json")
@example(head=b"\x1f\x8b\x08\x00\x00\x00\x00\x00\x00\x03", body=b"\xff\xff\xff", name=None)
def test_arbitrary_bytes_are_read_or_refused(head: bytes, body: bytes, name: str | None) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "synthetic.bin"
        path.write_bytes(head + body)
        load_or_refuse(path, name)


@pytest.mark.slow
@settings(deadline=None, max_examples=40)
@given(body=ROWS, head=st.sampled_from([head for head in HEADERS if b"," in head or b"\t" in head]))
def test_what_looks_like_a_table_is_read_or_refused(body: bytes, head: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "synthetic.csv"
        path.write_bytes(head + body)
        load_or_refuse(path, None)


def _fields_of(line: bytes, separator: bytes | None) -> int:
    """Return how many fields a line has; a delimiter between closed quotation marks parts none."""
    parts = line.split(b'"')
    outside = b"".join(parts[::2]) if len(parts) % 2 else line
    return len(line.split()) if separator is None else outside.count(separator) + 1


@pytest.mark.slow
@settings(deadline=None, max_examples=100)
@given(ROWS, st.sampled_from([",", "\t", ";", " "]))
def test_fields_are_counted_as_by_splitting(text: bytes, delimiter: str) -> None:
    block = text + b"\n"
    lines = block.split(b"\n")[:-1]
    separator = None if delimiter == " " else delimiter.encode()
    # `\r` is a blank here and at the end of a line only in real files.
    lines = [line.replace(b"\r", b" ") for line in lines]
    expected = [_fields_of(line, separator) if line.strip() else 0 for line in lines]
    assert _field_counts(b"\n".join(lines) + b"\n", delimiter).tolist() == expected


@settings(deadline=None, max_examples=50)
@given(
    st.lists(st.lists(st.text("a,;\t\"' "), min_size=1, max_size=5), min_size=1, max_size=4),
    st.sampled_from([",", "\t", ";"]),
)
def test_quoted_fields_are_counted_as_they_were_written(
    rows: list[list[str]], delimiter: str
) -> None:
    """Python's own writer puts marks around every field, and doubles those within."""
    text = io.StringIO()
    csv.writer(text, delimiter=delimiter, quoting=csv.QUOTE_ALL, lineterminator="\n").writerows(
        rows
    )
    counted = _field_counts(text.getvalue().encode(), delimiter).tolist()
    assert counted == [len(row) for row in rows]


@pytest.mark.slow
@settings(deadline=None, max_examples=8)
@given(data=st.data(), bodies=st.integers(1, 3), count=st.integers(1, 12))
def test_round_trip_through_both_formats_is_exact(
    data: st.DataObject, bodies: int, count: int
) -> None:
    values = st.lists(
        st.one_of(FINITE, st.just(float("nan"))), min_size=count * bodies, max_size=count * bodies
    )
    x, y, theta = (np.array(data.draw(values)).reshape(count, bodies) for _ in range(3))
    steps = data.draw(st.lists(st.floats(1e-3, 10.0), min_size=count, max_size=count))
    lost = np.isnan(x) | np.isnan(y)
    x[lost] = y[lost] = theta[lost] = np.nan
    names = [f"robot {index}" for index in range(bodies)]
    dataset = build_trajectory(np.cumsum(steps), x, y, theta, body=names)
    with tempfile.TemporaryDirectory() as folder:
        netcdf = load(save_trajectory(dataset, Path(folder) / "a.nc"))
        table = load(save_trajectory(netcdf, Path(folder) / "a.csv"))
        again = load(save_trajectory(table, Path(folder) / "b.nc"))
    assert body_names(netcdf) == names
    for name in ("time", "x", "y", "theta"):
        np.testing.assert_array_equal(netcdf[name].values, dataset[name].values)
    for back in (table, again):
        for name in body_names(back):
            for found, expected in zip(
                body_track(back, name), body_track(dataset, name), strict=True
            ):
                np.testing.assert_array_equal(found, expected)
        assert {n for n in names if np.isfinite(dataset["x"].sel(body=n)).any()} <= set(
            body_names(back)
        )


@settings(deadline=None, max_examples=30)
@given(st.lists(st.tuples(FINITE, FINITE, st.one_of(FINITE, st.none())), min_size=1, max_size=80))
def test_describe_is_valid_json_for_any_recording(points: list[tuple[float, ...]]) -> None:
    x, y, theta = (np.array([p[i] for p in points], dtype=float) for i in range(3))
    dataset = build_trajectory(np.arange(x.size) * 0.1, x, y, theta)
    json.dumps(describe(dataset), allow_nan=False)


@pytest.mark.slow
@settings(deadline=None, max_examples=60)
@given(st.one_of(st.text(max_size=20), st.from_regex(r"(circle|rect|polygon|fit):[-0-9x.@,cm]*")))
def test_an_arena_is_read_or_refused(text: str) -> None:
    angle = np.linspace(0.0, 6.0, 50)
    try:
        placed = place_arena(text, np.cos(angle), np.sin(angle))
    except InputError:
        return
    assert placed.arena["shape"] in ("circle", "rectangle", "polygon")


@pytest.mark.parametrize("name", list(loaders()))
def test_every_format_refuses_an_empty_file_and_a_folder(tmp_path: Path, name: str) -> None:
    empty = tmp_path / "empty"
    empty.write_bytes(b"")
    for path in (empty, tmp_path):
        with pytest.raises(InputError):
            load(path, format=name, frame_rate=1.0)
