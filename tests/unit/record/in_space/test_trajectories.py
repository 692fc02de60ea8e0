"""TUM and EuRoC trajectories: quaternions, and a clock of nanoseconds that stays exact."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from spatial import assert_spin, in_space, spin

from driftwalk.core.errors import InputError
from driftwalk.record import load
from driftwalk.schema import body_track

EUROC = (
    "#timestamp{unit}, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [],"
    " q_RS_z [], v_RS_R_x [m s^-1]"
)
ORIGIN = 1403636580838555649
"""Nanoseconds since 1970, beyond the whole numbers that float64 holds, as are the steps."""
STEP = 100_000_001


def tum(folder: Path, up: str = "z", comment: str = "# timestamp tx ty tz qx qy qz qw\n") -> Path:
    time, x, y, angle = spin()
    position, rotation = in_space(up, x, y, angle)
    rows = np.column_stack([1305031102.25 + time, position, rotation.as_quat()])
    path = folder / "trajectory.txt"
    path.write_text(
        comment + "".join(" ".join(f"{value:.9f}" for value in row) + "\n" for row in rows)
    )
    return path


def euroc(folder: Path, unit: str = " [ns]") -> Path:
    _, x, y, angle = spin()
    position, rotation = in_space("z", x, y, angle)
    quaternion = rotation.as_quat()[:, [3, 0, 1, 2]]
    lines = [EUROC.format(unit=unit)]
    for k, (place, turn) in enumerate(zip(position, quaternion, strict=True)):
        values = [*place, *turn, 0.25]
        lines.append(f"{ORIGIN + STEP * k}," + ",".join(f"{v:.9f}" for v in values))
    path = folder / "data.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize("comment", ["", "# made by a test\n# timestamp tx ty tz qx qy qz qw\n"])
def test_tum(tmp_path: Path, comment: str) -> None:
    dataset = load(tum(tmp_path, comment=comment))
    assert dataset.attrs["format"] == "tum"
    track = body_track(dataset)
    assert dataset.attrs["time_origin_unix_s"] == 1305031102.25
    np.testing.assert_allclose(track.time, spin()[0], atol=3e-7)  # a digit of 1.3e9 in float64
    assert_spin(track)


@pytest.mark.parametrize("up", ["-y", "x"])
def test_another_axis_of_a_tum_trajectory(tmp_path: Path, up: str) -> None:
    assert_spin(body_track(load(tum(tmp_path, up=up), up=up)))


def test_eight_numbers_without_a_quaternion_are_a_plain_table(tmp_path: Path) -> None:
    path = tmp_path / "table.txt"
    path.write_text("0.0 1 2 3 4 5 6 7\n0.1 1 2 3 4 5 6 7\n")
    with pytest.raises(InputError, match="8 columns and no header"):
        load(path)


@pytest.mark.parametrize("unit", [" [ns]", ""])
def test_euroc(tmp_path: Path, unit: str) -> None:
    dataset = load(euroc(tmp_path, unit=unit))
    assert dataset.attrs["format"] == "euroc"
    assert dataset.attrs["time_origin_unix_s"] == pytest.approx(ORIGIN / 1e9, abs=1e-6)
    track = body_track(dataset)
    stamps = 1e-9 * STEP * np.arange(track.time.size)
    np.testing.assert_allclose(track.time, stamps, rtol=0, atol=1e-12)
    assert_spin(track)


def test_euroc_positions_alone(tmp_path: Path) -> None:
    path = tmp_path / "leica.csv"
    path.write_text(
        "#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m]\n"
        f"{ORIGIN},1,2,3\n{ORIGIN + 10**8},1.5,2.5,3\n"
    )
    dataset = load(path)
    np.testing.assert_array_equal(dataset.x.values[:, 0], [1.0, 1.5])
    assert not np.isfinite(dataset.theta.values).any()


@pytest.mark.parametrize(
    ("make", "old", "new", "message"),
    [
        (tum, "\n1305031102.750000000 ", "\n1305031102.75,", "line 7: expected 8 fields"),
        (tum, "\n1305031102.750000000 ", "\nhalf ", "line 7, column 1: 'half'"),
        (euroc, "p_RS_R_z", "p_RS_R_y", "names no column of p_…_z"),
        (euroc, f"{ORIGIN + 5 * STEP},", "", "line 7: expected 9 fields"),
        (euroc, ",0.250000000", ",0.25,1", "line 2: expected 9 fields"),
    ],
)
def test_what_they_cannot_read(
    tmp_path: Path, make: object, old: str, new: str, message: str
) -> None:
    path = make(tmp_path)  # type: ignore[operator]
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(InputError, match=message) as caught:
        load(path)
    assert "\n" not in str(caught.value)
