"""Vicon CSV: names, rate and units from its five lines, rotations as axis times angle."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from spatial import assert_spin, in_space, spin

from driftwalk.core.errors import InputError
from driftwalk.record import load
from driftwalk.schema import body_names, body_track

SAMPLE = "QBii_Square_2m_cw.csv"


def capture(
    folder: Path,
    *,
    unit: str = "rad",
    quaternion: bool = False,
    section: str = "Objects",
    bodies: tuple[str, ...] = ("Block:Block", "Boat:Hull"),
) -> Path:
    """Write a synthetic capture of bodies that follow each other on the floor."""
    _, x, y, angle = spin()
    rows = [[str(k + 1), "0"] for k in range(x.size)]
    for shift, _ in enumerate(bodies):
        position, rotation = in_space("z", x + shift, y, angle)
        turned = rotation.as_quat() if quaternion else rotation.as_rotvec(degrees=unit == "deg")
        for row, *values in zip(rows, turned, 1e3 * position, strict=True):
            row += [f"{value:.9f}" for part in values for value in part]
    axes = [*(["RX", "RY", "RZ"] + ["RW"] * quaternion), "TX", "TY", "TZ"]
    units = [*([""] * 4 if quaternion else [unit] * 3), "mm", "mm", "mm"]
    blank = [""] * (len(axes) - 1)
    header = [
        [section],
        ["10"],
        ["", "", *(cell for name in bodies for cell in (f"Global Angle {name}", *blank))],
        ["Frame", "Sub Frame", *axes * len(bodies)],
        ["", "", *units * len(bodies)],
    ]  # fmt: skip
    path = folder / "capture.csv"
    text = "\n".join(",".join(row) for row in [*header, *rows]) + "\n"
    path.write_bytes(b"\xef\xbb\xbf" + text.encode())
    return path


@pytest.mark.parametrize("section", ["Objects", "Segments"])
@pytest.mark.parametrize(("unit", "quaternion"), [("rad", False), ("deg", False), ("", True)])
def test_objects_by_name(tmp_path: Path, unit: str, quaternion: bool, section: str) -> None:
    dataset = load(capture(tmp_path, unit=unit, quaternion=quaternion, section=section))
    assert dataset.attrs["format"] == "vicon"
    assert body_names(dataset) == ["Block", "Boat:Hull"]
    for shift, name in enumerate(body_names(dataset)):
        track = body_track(dataset, name)
        np.testing.assert_allclose(track.time, spin()[0] + 0.1, atol=1e-12)
        assert_spin(track, shift=shift, digits=1e-11)


def test_the_real_capture(shared_data: Callable[[str], Path]) -> None:
    path = shared_data("format-vicon") / SAMPLE
    with path.open(newline="", encoding="utf-8-sig") as file:
        rows = list(csv.reader(file))[5:]
    table = np.array([[float(field) for field in row] for row in rows if row])
    track = body_track(load(path), "QBii")
    np.testing.assert_allclose(track.time, table[:, 0] / 100.0, rtol=1e-15)
    np.testing.assert_allclose(track.x, table[:, 5] / 1e3, rtol=1e-15)
    np.testing.assert_allclose(track.y, table[:, 6] / 1e3, rtol=1e-15)
    rotation = Rotation.from_rotvec(table[:, 2:5])
    np.testing.assert_allclose(track.theta, rotation.as_euler("ZYX")[:, 0], atol=1e-12)
    # The robot stands on its wheels: read as Euler angles, the same numbers would topple it.
    lean = np.degrees(np.arccos(rotation.apply([0.0, 0.0, 1.0])[:, 2]))
    assert lean.max() < 2.0
    euler = Rotation.from_euler("XYZ", table[:, 2:5]).apply([0.0, 0.0, 1.0])[:, 2]
    assert np.degrees(np.arccos(euler)).max() > 90.0


def test_markers(tmp_path: Path) -> None:
    path = tmp_path / "markers.csv"
    path.write_text(
        "Trajectories\n100\n,,Block:A,,,Block:B,,\nFrame,Sub Frame,X,Y,Z,X,Y,Z\n"
        ",,mm,mm,mm,mm,mm,mm\n1,0,10,20,30,40,50,60\n2,0,11,21,30,,,\n"
    )
    dataset = load(path)
    assert body_names(dataset) == ["Block:A", "Block:B"]
    np.testing.assert_allclose(dataset.x.values, [[0.01, 0.04], [0.011, np.nan]])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("Objects", "Devices", "line 1: begins with the section 'Devices': export Objects"),
        ("\n10\n", "\nfast\n", "line 2: the frame rate is 'fast', and no rate of frames"),
        ("TX", "Tx", "'Block' has no columns TX, TY, TZ"),
        ("mm,mm,mm", "mm,m,mm", "units of the positions are m, mm"),
        ("mm", "furlong", "units of the positions are furlong"),
        ("rad", "turns", "the unit of the angles is 'turns'"),
        ("\n5,0,", "\n5,0,0,", "line 10: expected 14 fields"),
        ("\n5,0,", "\n5,0,x", "line 10, column 3: 'x"),
        ("\n5,0,", "\n\nTrajectories\n100\n5,0,", "line 11: another section begins here"),
    ],
)
def test_what_it_cannot_read(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = capture(tmp_path)
    path.write_text(path.read_text(encoding="utf-8-sig").replace(old, new))
    with pytest.raises(InputError, match=message) as caught:
        load(path)
    assert "\n" not in str(caught.value)
