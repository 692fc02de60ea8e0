"""Plain tables with quaternions, a third axis, and a header further down."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from spatial import assert_spin, in_space, spin

from driftwalk.core.errors import InputError
from driftwalk.record import load
from driftwalk.schema import body_names, body_track

NAMES = ("t_s", "x_m", "y_m", "z_m", "qx", "qy", "qz", "qw")


def table(folder: Path, names: tuple[str, ...] = NAMES, *, up: str = "z", above: str = "") -> Path:
    time, x, y, angle = spin()
    position, rotation = in_space(up, x, y, angle)
    rows = np.column_stack([time, position, rotation.as_quat()])
    lines = [",".join(names), *(",".join(f"{value:.9f}" for value in row) for row in rows)]
    path = folder / "table.csv"
    path.write_text(above + "\n".join(lines) + "\n")
    return path


def check(path: Path, **options: Any) -> None:
    track = body_track(load(path, **options))
    np.testing.assert_allclose(track.time, spin()[0], atol=1e-9)
    assert_spin(track)


@pytest.mark.parametrize("up", ["z", "y", "-x"])
def test_an_axis_that_is_up(tmp_path: Path, up: str) -> None:
    check(table(tmp_path, up=up), up=up)


@pytest.mark.parametrize(
    "names",
    [
        ("q_x", "q_y", "q_z", "q_w"),
        ("quat x", "quat y", "quat z", "quat w"),
        ("orientation.x", "orientation.y", "orientation.z", "orientation.w"),
    ],
)
def test_names_of_quaternions(tmp_path: Path, names: tuple[str, ...]) -> None:
    check(table(tmp_path, (*NAMES[:4], *names)))


def test_poses_as_ros_tools_print_them(tmp_path: Path) -> None:
    place = tuple(f"pose.position.{axis}" for axis in "xyz")
    turn = tuple(f"pose.orientation.{axis}" for axis in "xyzw")
    check(table(tmp_path, ("time", *place, *turn)), length_unit="m")


def test_columns_by_number(tmp_path: Path) -> None:
    names = ("a", "b", "c", "d", "e", "f", "g", "h")
    columns = {"t": "1:s", "x": "2", "y": "3", "z": "4", "qx": "5", "qy": "6", "qz": "7", "qw": "8"}
    check(table(tmp_path, names, up="y"), columns=columns, up="y", length_unit="m")


def test_several_bodies_below_each_other(tmp_path: Path) -> None:
    path = tmp_path / "stacked.csv"
    path.write_text(
        "t,x,y,qx,qy,qz,qw,robot\n0,1,2,0,0,0,1,a\n0,3,4,0,0,1,0,b\n1,1,2,0,0,0,1,a\n"
        "1,3,5,0,0,0.6,0.8,b\n"
    )
    dataset = load(path)
    assert body_names(dataset) == ["a", "b"]
    expected = [[0.0, np.pi], [0.0, 2 * np.arctan2(0.6, 0.8)]]
    np.testing.assert_allclose(dataset.theta.values, expected, atol=1e-12)


@pytest.mark.parametrize("above", ["made by\nsomebody,else,1,2\n\n", "1,2,3,4,5,6,7,8\n2\n3\n"])
def test_a_header_further_down(tmp_path: Path, above: str) -> None:
    check(table(tmp_path, above=above), header_line=4)


def test_a_header_that_lacks_the_last_name(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("nothing\nX,Y,Z,X,Y,Z,\n0.0,0,0,1,2,3,0.5\n0.1,0,0,1,2,4,0.5\n")
    columns = {"t": "1:s", "x": "4", "y": "6"}
    dataset = load(path, header_line=2, columns=columns, length_unit="m")
    np.testing.assert_array_equal(dataset.y.values[:, 0], [3.0, 4.0])


def test_an_angle_wins_over_a_quaternion_and_z_is_not_read_unasked(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("t,x,y,z,z2,yaw,qx,qy,qz,qw\n0,1,2,3,a,0.5,9,9,9,9\n1,1,2,3,b,0.5,9,9,9,9\n")
    np.testing.assert_array_equal(load(path).theta.values[:, 0], [0.5, 0.5])


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        ("t,x,y\n0,1,2\n", {"up": "y"}, "`up` needs a third axis"),
        ("t,x,y,z\n0,1,2,3\n", {"up": "w"}, "`up` is one of"),
        ("t,x,y,a,b\n0,1,2,3,4\n", {"columns": {"qx": "a", "qy": "b"}}, "has four parts"),
        ("t,x,y,qx,qy,qz,qw\n0,1,2,3,4,5,6\n", {}, "length of 9.274 instead of 1"),
        ("t,x,y,z_mm\n0,1,2,3\n", {"up": "z"}, "name different units"),
        ("t,x,y\n0,1,2\n", {"header_line": 2}, "no rows of data below line 2"),
        ("t,x,y\n0,1,2\n", {"header_line": 9}, "no rows of data below line 9"),
        ("t,x,y\n0,1,2\n", {"topic": "/a"}, "`topic` is for ROS bags"),
    ],
)
def test_what_is_refused(tmp_path: Path, text: str, options: Any, message: str) -> None:
    path = tmp_path / "table.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        load(path, **options)
    assert "\n" not in str(caught.value)


def test_an_option_for_another_format(tmp_path: Path) -> None:
    path = tmp_path / "points.json"
    path.write_text("[[1, 2], [3, 4]]")
    for option, value in (("up", "y"), ("header_line", 2)):
        with pytest.raises(InputError, match=rf"`{option}`|leave `{option}` out"):
            load(path, frame_rate=1.0, metres_per_pixel=1.0, **{option: value})
