"""Plain tables: what columns mean, units, layouts, and what is refused."""

from __future__ import annotations

import gzip
import json
from pathlib import Path

import numpy as np
import pytest

from driftwalk.core.errors import FormatError, InputError
from driftwalk.record import load
from driftwalk.record.column_names import column_meaning
from driftwalk.schema import body_names, body_track


def write(folder: Path, text: str | bytes, name: str = "synthetic.csv") -> Path:
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


@pytest.mark.parametrize(
    ("name", "quantity", "unit", "body", "bare"),
    [
        ("t", "t", "", "", True),
        ("time_ms", "t", "ms", "", False),
        ("Time (s)", "t", "s", "", False),
        ("x", "x", "", "", True),
        ("x_mm", "x", "mm", "", True),
        ("X [cm]", "x", "cm", "", True),
        ("x (px)", "x", "px", "", True),
        ("y_m", "y", "m", "", True),
        ("pos_x", "x", "", "", False),
        ("x_pos", "x", "", "", False),
        ("theta_deg", "theta", "deg", "", True),
        ("heading", "theta", "", "", False),
        ("x1", "x", "", "1", True),
        ("robot2_y", "y", "", "robot2", True),
        ("robot_x", "x", "", "robot", True),
        ("frame", "frame", "", "", False),
        ("Frame Number", "frame", "", "", False),
        ("TrackId", "body", "", "", False),
        ("track id", "body", "", "", False),
    ],
)
def test_meaning_of_a_column_name(
    name: str, quantity: str, unit: str, body: str, bare: bool
) -> None:
    found = column_meaning(name)
    assert found is not None
    assert (found.quantity, found.unit, found.body, found.bare) == (quantity, unit, body, bare)


@pytest.mark.parametrize("name", ["", "area", "compactness", "ValueChanged", "frame x", "distance"])
def test_a_name_that_says_nothing_known(name: str) -> None:
    assert column_meaning(name) is None


def test_bare_names_are_si(tmp_path: Path) -> None:
    dataset = load(write(tmp_path, "t,x,y,theta\n0,0.1,0.2,0.5\n0.1,0.11,0.21,0.6\n"))
    track = body_track(dataset)
    np.testing.assert_array_equal(track.time, [0.0, 0.1])
    np.testing.assert_array_equal(track.x, [0.1, 0.11])
    np.testing.assert_array_equal(track.theta, [0.5, np.pi - np.mod(np.pi - 0.6, 2 * np.pi)])


def test_units_in_names_are_converted(tmp_path: Path) -> None:
    path = write(tmp_path, "time (ms);x_mm;y_mm;theta_deg\n1000;10;20;90\n1500;11;21;-270\n")
    track = body_track(load(path))
    np.testing.assert_allclose(track.time, [1.0, 1.5], rtol=1e-15)
    np.testing.assert_allclose(track.x, [0.010, 0.011], rtol=1e-15)
    np.testing.assert_allclose(track.y, [0.020, 0.021], rtol=1e-15)
    np.testing.assert_allclose(track.theta, [np.pi / 2, np.pi / 2], rtol=1e-12)


@pytest.mark.parametrize("delimiter", [",", "\t", ";", " "])
def test_delimiters_are_recognised(tmp_path: Path, delimiter: str) -> None:
    rows = [["t", "x", "y"], ["0", "1.5", "2.5"], ["1", "-3", "4e-1"]]
    path = write(tmp_path, "\n".join(delimiter.join(row) for row in rows) + "\n")
    track = body_track(load(path))
    np.testing.assert_array_equal(track.x, [1.5, -3.0])
    np.testing.assert_array_equal(track.y, [2.5, 0.4])


def test_bom_crlf_comments_quotes_blank_lines_and_no_newline_at_the_end(tmp_path: Path) -> None:
    text = b'\xef\xbb\xbf# a comment\r\n"t","x","y"\r\n0,1,2\r\n\r\n1,"3",4'
    track = body_track(load(write(tmp_path, text)))
    np.testing.assert_array_equal(track.x, [1.0, 3.0])


def test_gzip_is_read_as_it_is(tmp_path: Path) -> None:
    path = write(tmp_path, gzip.compress(b"t,x,y\n0,1,2\n1,3,4\n"), "synthetic.csv.gz")
    np.testing.assert_array_equal(body_track(load(path)).y, [2.0, 4.0])


def test_bodies_side_by_side(tmp_path: Path) -> None:
    path = write(tmp_path, "t,x_a,y_a,theta_a,x_b,y_b\n0,1,2,0.5,3,4\n1,5,6,0.6,,8\n")
    dataset = load(path)
    assert body_names(dataset) == ["a", "b"]
    np.testing.assert_array_equal(dataset["x"].values, [[1.0, 3.0], [5.0, np.nan]])
    assert np.isnan(dataset["y"].values[1, 1])  # half a position is none
    assert np.isnan(dataset["theta"].values[:, 1]).all()


def test_bodies_stacked_have_clocks_of_their_own(tmp_path: Path) -> None:
    path = write(tmp_path, "t,x,y,robot\n0,1,2,left\n0,3,4,right\n1,5,6,left\n1.5,7,8,right\n")
    dataset = load(path)
    assert body_names(dataset) == ["left", "right"]
    np.testing.assert_array_equal(dataset["time"].values, [0.0, 1.0, 1.5])
    np.testing.assert_array_equal(body_track(dataset, "right").x, [3.0, 7.0])
    assert body_names(load(path, body="right")) == ["right"]
    assert body_names(load(path, body="all")) == ["left", "right"]
    with pytest.raises(InputError, match=r"`body` 'middle'.*left, right"):
        load(path, body="middle")


def test_column_map_by_name_number_and_unit(tmp_path: Path) -> None:
    path = write(tmp_path, "stamp,east,north,id\n0,10,20,7\n500,30,40,7\n")
    columns = {"t": "stamp:ms", "x": "east:cm", "y": "3:cm", "body": "id"}
    track = body_track(load(path, columns=columns))
    np.testing.assert_allclose(track.time, [0.0, 0.5], rtol=1e-15)
    np.testing.assert_allclose(track.y, [0.2, 0.4], rtol=1e-15)


def test_without_a_header_the_columns_have_to_be_named(tmp_path: Path) -> None:
    path = write(tmp_path, "0,1,2\n1,3,4\n")
    with pytest.raises(FormatError, match=r'no header.*`columns=\{"t": "1"'):
        load(path)
    track = body_track(load(path, columns={"t": "1", "x": "2:m", "y": "3:m"}))
    np.testing.assert_array_equal(track.x, [1.0, 3.0])


def test_frames_need_a_rate_and_pixels_a_scale(tmp_path: Path) -> None:
    path = write(tmp_path, "frame,x_px,y_px\n0,100,200\n3,110,210\n")
    with pytest.raises(InputError, match="`metres_per_pixel`"):
        load(path, frame_rate=25.0)
    with pytest.raises(InputError, match="`frame_rate`"):
        load(path, metres_per_pixel=0.01)
    track = body_track(load(path, frame_rate=25.0, metres_per_pixel=0.01))
    np.testing.assert_allclose(track.time, [0.0, 3 / 25], rtol=1e-15)
    np.testing.assert_allclose(track.y, [-2.0, -2.1], rtol=1e-15)  # pixels are y-down


@pytest.mark.parametrize("header", ["frame,x,y", "t,pos_x,pos_y"])
def test_a_length_that_may_be_pixels_is_not_taken_for_metres(tmp_path: Path, header: str) -> None:
    path = write(tmp_path, f"{header}\n0,1,2\n1,3,4\n")
    rate = 1.0 if header.startswith("frame") else None
    with pytest.raises(InputError, match=r"`metres_per_pixel`.*`length_unit`"):
        load(path, frame_rate=rate)
    assert body_track(load(path, frame_rate=rate, length_unit="cm")).x[0] == pytest.approx(0.01)


def test_what_contradicts_the_file_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path, "t_s,x_m,y_m\n0,1,2\n1,3,4\n")
    with pytest.raises(InputError, match="leave it out"):
        load(path, metres_per_pixel=0.01)
    with pytest.raises(InputError, match="leave `frame_rate` out"):
        load(path, frame_rate=25.0)
    with pytest.raises(InputError, match="contradicts"):
        load(path, length_unit="mm")


@pytest.mark.parametrize(("y_axis", "sign"), [(None, -1.0), ("down", -1.0), ("up", 1.0)])
def test_direction_of_y(tmp_path: Path, y_axis: str | None, sign: float) -> None:
    path = write(tmp_path, "t,x_px,y_px,theta\n0,1,2,0.5\n1,3,4,0.5\n")
    dataset = load(path, metres_per_pixel=1.0, y_axis=y_axis)
    track = body_track(dataset)
    np.testing.assert_allclose(track.y, [2.0 * sign, 4.0 * sign], rtol=1e-15)
    np.testing.assert_allclose(track.theta, [0.5 * sign] * 2, rtol=1e-12)
    assert ("negated" in dataset.attrs["y_axis"]) == (sign < 0)


BAD = {
    "empty": (b"", "empty"),
    "blank": (b"\n\n", "empty"),
    "binary": (bytes(range(256)) * 4, "not recognised"),
    "zero bytes later": (b"t,x,y\n0,1,2\n1,\x00,3\n", "not a text|not recognised"),
    "no data": (b"t,x,y\n", "no rows"),
    "no positions": (b"time,height\n0,1\n", "no columns of x and y"),
    "word": (b"t,x,y\n0,1,2\n1,oops,4\n2,5,6\n", "line 3, column 2: 'oops' in column 'x'"),
    "bool": (b"t,x,y\n0,True,2\n1,True,4\n", "line 2, column 2: 'True'"),
    "underscore": (b"t,x,y\n0,1_000,2\n", "line 2, column 2: '1_000'"),
    "hexadecimal": (b"t,x,y\n0,0x10,2\n", "line 2, column 2: '0x10'"),
    "short row": (b"t,x,y\n0,1,2\n1,3\n2,4,5\n", "line 3: expected 3 fields .* got 2"),
    "cut off at the end": (b"t,x,y\n0,1,2\n1,3", "line 3: expected 3 fields .* got 2"),
    "long row": (b"t,x,y\n0,1,2\n1,3,4,5\n", "line 3: expected 3 fields .* got 4"),
    "long and short": (b"t,x,y\n0,1,2,9\n1,3\n", "line 2: expected 3 fields .* got 4"),
    "mixed delimiters": (b"t,x,y\n0,1,2\n1;3;4\n", "line 3: expected 3 fields .* got 1"),
    "comma decimals in CSV": (b"t,x,y\n0,0,1,5,2,5\n", "got 6 .*decimals .* comma"),
    "neither UTF-8 nor of Windows": (
        b"t,x,y\n0,\x81,2\n",
        r"line 2, column 3: is not UTF-8 text \(byte 0x81\)",
    ),
    "header the same": (b"t,x (\x81m),y\n0,1,2\n", "line 1, column 6: is not UTF-8"),
    "open quote": (b't,x,y\n0,1,"2\n1,3,4\n', "line 2"),
    "two columns of x": (b"t,x,pos_x,y\n0,1,2,3\n", "could both be x"),
    "a unit and none": (b"t,x_mm,y\n0,1,2\n", 'different units .*"x": "NAME:UNIT"'),
    "backwards": (b"t,x,y\n0,1,2\n2,3,4\n1,5,6\n", 'goes backwards.*`sort="sort"`'),
    "no time at all": (b"t,x,y\n,1,2\n", "no row with a time"),
    "damaged gzip": (gzip.compress(b"t,x,y\n" + b"0,1,2\n" * 999)[:-20], "is damaged: "),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_an_error_that_says_where(tmp_path: Path, case: str) -> None:
    content, message = BAD[case]
    path = write(tmp_path, content)
    with pytest.raises(InputError, match=message) as caught:
        load(path)
    assert str(path) in str(caught.value)


def test_missing_file_and_unknown_format(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="no such file"):
        load(tmp_path / "absent.csv")
    with pytest.raises(InputError, match=r"unknown `format` 'swisstrack'.*idtracker"):
        load(write(tmp_path, "t,x,y\n0,1,2\n"), format="swisstrack")


@pytest.mark.slow
def test_a_bad_row_far_into_a_large_file_is_located(tmp_path: Path) -> None:
    rows = [f"{index},{index % 7},{index % 5}" for index in range(600_000)]
    rows[555_555] = "555555,1,?"
    path = write(tmp_path, "t,x,y\n" + "\n".join(rows) + "\n")
    assert path.stat().st_size > 4 << 20  # beyond the first block
    with pytest.raises(FormatError, match="line 555557, column 3: '\\?'"):
        load(path)


def test_the_header_of_a_column_that_does_not_exist(tmp_path: Path) -> None:
    path = write(tmp_path, "t,x,y\n0,1,2\n")
    with pytest.raises(
        FormatError, match=r"`columns=\{\"x\": \"east\"\}`: no such column.*'t', 'x', 'y'"
    ):
        load(path, columns={"x": "east"})
    with pytest.raises(FormatError, match="unknown quantity"):
        load(path, columns={"v": "x"})


def test_one_row_constant_and_missing_positions_load_with_a_warning(tmp_path: Path) -> None:
    one = load(write(tmp_path, "t,x,y\n0,1,2\n"))
    assert one.sizes["time"] == 1
    still = load(write(tmp_path, "t,x,y\n0,1,2\n1,1,2\n"))
    assert json.loads(still.attrs["counts"])["warnings"] == ["the body never moves"]
    nowhere = load(write(tmp_path, "t,x,y\n0,nan,NaN\n1,,NA\n"))
    counts = json.loads(nowhere.attrs["counts"])
    assert counts["missing"] == 2
    assert counts["warnings"] == ["no row holds a position"]


def test_an_absurd_extent_is_pointed_out(tmp_path: Path) -> None:
    dataset = load(write(tmp_path, "t,x,y\n0,100,200\n1,400,500\n"))
    assert "span 300 m" in json.loads(dataset.attrs["counts"])["warnings"][0]


def test_resolution_of_the_file(tmp_path: Path) -> None:
    walk = np.cumsum(np.random.default_rng(3).integers(-3, 4, size=(2, 500)), axis=1)

    def quantum(scale: float, decimals: int, shift: float = 0.0) -> float:
        rows = [
            f"{index},{x * scale + shift:.{decimals}f},{y * scale + shift:.{decimals}f}"
            for index, (x, y) in enumerate(walk.T.tolist())
        ]
        path = write(tmp_path, "t,x,y\n" + "\n".join(rows) + "\n")
        return float(load(path).attrs["position_quantum_m"])

    assert quantum(0.0005, 4) == pytest.approx(0.0005)
    # Pixels of 0.75 mm, shifted and written with six decimals: the pixel is still found.
    assert quantum(0.00075, 6, shift=0.1234561) == pytest.approx(0.00075, rel=1e-3)
    assert quantum(0.0123456789012345, 17) == pytest.approx(0.0123456789, rel=1e-3)


def test_resolution_of_few_or_many_digits(tmp_path: Path) -> None:
    few = write(tmp_path, "t,x,y\n0,0.2,0.5\n1,0.4,0.5\n")
    assert load(few).attrs["position_quantum_m"] == pytest.approx(0.1)
    values = np.random.default_rng(4).normal(size=(300, 2))
    rows = "\n".join(f"{index},{x!r},{y!r}" for index, (x, y) in enumerate(values.tolist()))
    assert load(write(tmp_path, "t,x,y\n" + rows)).attrs["position_quantum_m"] == 0.0


# As a lab's program may write it: 25 Hz, the rows of frames 3 and 4 missing, in degrees.
FOREIGN = (
    "Aufnahme;x [mm];y [mm];Drehung [°]\n0;1;2;350\n1;2;3;355\n2;3;4;0\n"
    "5;4;5;5\n6;5;6;10\n7;6;7;15\n"
)


def test_a_clock_of_unknown_name_that_skips_rows_is_named(tmp_path: Path) -> None:
    """Counting its rows as frames would close the gaps."""
    path = write(tmp_path, FOREIGN)
    with pytest.raises(
        FormatError, match=r"'Aufnahme' counts up .*`columns=\{\"frame\": \"Aufnahme\"\}`"
    ):
        load(path, frame_rate=25.0)
    track = body_track(load(path, frame_rate=25.0, columns={"frame": "Aufnahme"}))
    np.testing.assert_allclose(track.time, np.array([0, 1, 2, 5, 6, 7]) / 25.0)


@pytest.mark.parametrize(
    "last",
    [
        pytest.param("0 1 2 3 4 5", id="every row has its frame"),
        pytest.param("0 1.3 1.9 5 5.1 7", id="a distance gone so far"),
        pytest.param("4 3 9 1 2 8", id="a measurement"),
        pytest.param("1 1 1 2 2 4", id="a trial"),
        pytest.param("a b c d e f", id="words"),
    ],
)
def test_what_is_no_clock_with_missing_rows_is_passed_over(tmp_path: Path, last: str) -> None:
    rows = "".join(f"{k},{k},{value}\n" for k, value in enumerate(last.split()))
    dataset = load(write(tmp_path, f"x_mm,y_mm,what\n{rows}"), frame_rate=10.0)
    np.testing.assert_allclose(dataset["time"], np.arange(6) / 10.0)


def test_a_table_without_a_clock_says_how_to_name_one(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"\"t\": \"NAME:s\".*\"frame\": \"NAME\".*`frame_rate`"):
        load(write(tmp_path, "x_mm,y_mm\n1,2\n3,4\n"))


def test_a_chosen_column_keeps_the_unit_in_its_name(tmp_path: Path) -> None:
    path = write(tmp_path, FOREIGN)
    columns = {"frame": "Aufnahme", "theta": "Drehung [°]"}
    track = body_track(load(path, frame_rate=25.0, columns=columns))
    np.testing.assert_allclose(track.theta, np.radians([-10, -5, 0, 5, 10, 15]), atol=1e-12)
    path = write(tmp_path, "Zeit [ms],x_m,y_m\n0,1,2\n40,1,3\n")
    np.testing.assert_allclose(load(path, columns={"t": "Zeit [ms]"})["time"], [0.0, 0.04])


def test_an_angle_of_unknown_name_is_pointed_out(tmp_path: Path) -> None:
    dataset = load(write(tmp_path, FOREIGN), frame_rate=25.0, columns={"frame": "Aufnahme"})
    (warning,) = json.loads(dataset.attrs["counts"])["warnings"]
    assert warning == (
        'no orientation is read: add `columns={"theta": "Drehung [°]"}` if that column holds it'
    )
