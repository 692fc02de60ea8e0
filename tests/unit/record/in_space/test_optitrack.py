"""OptiTrack Motive CSV: rigid bodies by name, y up, units and rotation from its header."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from spatial import assert_spin, in_space, spin

from driftwalk.core.errors import InputError
from driftwalk.record import load
from driftwalk.schema import body_names, body_track

SAMPLE = "1blackTake 2024-04-10 03.24.49 PM.csv"


def take(
    folder: Path,
    *,
    rotation_type: str = "Quaternion",
    unit: str = "Millimeters",
    newer: bool = True,
    bodies: tuple[str, ...] = ("Block A", "Block B"),
) -> Path:
    """Write a synthetic take of bodies that follow each other on the floor."""
    time, x, y, angle = spin()
    scale = {"Meters": 1.0, "Millimeters": 1e3, "Centimeters": 1e2}[unit]
    axes = "XYZW" if rotation_type == "Quaternion" else "XYZ"
    rows: list[list[Any]] = [[f"{k}", f"{t:.6f}"] for k, t in enumerate(time)]
    for shift, _ in enumerate(bodies):
        position, rotation = in_space("y", x + shift, y, angle)
        turned = (
            rotation.as_quat()
            if axes == "XYZW"
            else rotation.as_euler(rotation_type, degrees=True)[
                :, [rotation_type.index(axis) for axis in "XYZ"]
            ]
        )
        for row, *values in zip(rows, turned, scale * position, strict=True):
            row += [f"{value:.9f}" for part in values for value in part] + ["0.0002"]
    width = len(axes) + 4
    names = [name for name in bodies for _ in range(width)]
    first = ["", "Type" if newer else ""]
    header = [
        [*("Format Version", "1.23" if newer else "1.21", "Take Name", "t"),
         *("Export Frame Rate", "10.000000", "Rotation Type", rotation_type),
         *("Length Units", unit, "Coordinate Space", "Global")],
        [],
        [*first, *["Rigid Body"] * len(names)],
        ["", "Name" if newer else "", *names],
        ["", "ID" if newer else "", *['"A1"'] * len(names)],
        ["", "", *([*["Rotation"] * len(axes), *["Position"] * 3, "Mean Marker Error"]
                   * len(bodies))],
        ["Frame", "Time (Seconds)" if newer else "Time", *([*axes, *"XYZ", ""] * len(bodies))],
    ]  # fmt: skip
    path = folder / "take.csv"
    path.write_text("\n".join(",".join(row) for row in [*header, *rows]) + "\n")
    return path


@pytest.mark.parametrize("newer", [True, False])
@pytest.mark.parametrize("unit", ["Meters", "Millimeters", "Centimeters"])
@pytest.mark.parametrize("rotation", ["Quaternion", "XYZ", "YZX", "ZYX"])
def test_rigid_bodies_by_name(tmp_path: Path, newer: bool, unit: str, rotation: str) -> None:
    dataset = load(take(tmp_path, rotation_type=rotation, unit=unit, newer=newer))
    assert dataset.attrs["format"] == "optitrack"
    assert body_names(dataset) == ["Block A", "Block B"]
    for shift, name in enumerate(body_names(dataset)):
        track = body_track(dataset, name)
        np.testing.assert_allclose(track.time, spin()[0], atol=1e-9)
        # Printed with nine digits, in degrees at best.
        assert_spin(track, shift=shift)


def test_the_real_take(shared_data: Callable[[str], Path]) -> None:
    path = shared_data("format-optitrack") / SAMPLE
    with path.open(newline="") as file:
        rows = list(csv.reader(file))[7:]
    table = np.array([[float(field) for field in row] for row in rows if row])
    track = body_track(load(path), "Rigid Body 1")
    np.testing.assert_array_equal(track.time, table[:, 1])
    np.testing.assert_array_equal(track.x, table[:, 5])
    np.testing.assert_array_equal(track.y, -table[:, 7])
    # The rotation of axes that makes z point up, and the yaw of what stands then.
    stand = Rotation.from_euler("x", 90, degrees=True)
    turned = stand * Rotation.from_euler("XYZ", table[:, 2:5], degrees=True) * stand.inv()
    np.testing.assert_allclose(track.theta, turned.as_euler("ZYX")[:, 0], atol=1e-12)


def test_another_axis_up(tmp_path: Path) -> None:
    track = body_track(load(take(tmp_path), up="z", body="Block A"))
    np.testing.assert_allclose(track.y, 0.2, atol=1e-9)


def test_a_body_that_is_not_seen_is_missing(tmp_path: Path) -> None:
    path = take(tmp_path, bodies=("a",))
    lines = path.read_text().split("\n")
    lines[9] = lines[9].split(",")[0] + "," + lines[9].split(",")[1] + "," * 8
    path.write_text("\n".join(lines))
    dataset = load(path)
    assert np.flatnonzero(~np.isfinite(dataset.x.values[:, 0])).tolist() == [2]
    assert np.flatnonzero(~np.isfinite(dataset.theta.values[:, 0])).tolist() == [2]


def test_markers_alone_are_bodies_without_orientation(tmp_path: Path) -> None:
    path = tmp_path / "markers.csv"
    path.write_text(
        "Format Version,1.23,Take Name,t,Rotation Type,Quaternion,Length Units,Meters\n\n"
        ",Type,Marker,Marker,Marker\n,Name,Unlabeled 1,Unlabeled 1,Unlabeled 1\n,ID,a,a,a\n"
        ",,Position,Position,Position\nFrame,Time (Seconds),X,Y,Z\n"
        "0,0.0,1,2,3\n1,0.1,1.5,2,3.5\n"
    )
    dataset = load(path)
    assert body_names(dataset) == ["Unlabeled 1"]
    np.testing.assert_array_equal(dataset.y.values[:, 0], [-3.0, -3.5])
    assert not np.isfinite(dataset.theta.values).any()
    assert "each marker is read as a body" in dataset.attrs["counts"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("Length Units,Millimeters", "Length Units,Furlongs", "the unit of length is 'Furlongs'"),
        (",Length Units,Millimeters", "", "does not name the unit of its positions"),
        ("Rotation Type,Quaternion", "Rotation Type,Matrix", "the rotation type is 'Matrix'"),
        ("Rotation Type,Quaternion", "Rotation Type,XYZ", "columns of rotation are X, Y, Z, W"),
        ("Position", "Place", "'Block A' has no columns X, Y, Z of its position"),
        ("Rigid Body", "Bone", "no rigid body and no marker"),
        ("Frame,", "Bild,", "export the take with its header"),
        ("\n5,0.500000,", "\n5,half,", "line 13, column 2: 'half' in column"),
        ("\n5,0.500000,", "\n5,", "line 13: expected 18 fields"),
    ],
)
def test_what_it_cannot_read(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = take(tmp_path)
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(InputError, match=message) as caught:
        load(path)
    assert "\n" not in str(caught.value)
