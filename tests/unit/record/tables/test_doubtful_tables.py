"""Tables that were misread without a word: they are read right now, or doubted by name."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from driftwalk.core.errors import InputError
from driftwalk.record import load
from driftwalk.schema import body_names, body_track

PIXELS: Mapping[str, Any] = {"frame_rate": 25.0, "metres_per_pixel": 1e-3}
T = np.arange(40) / 25.0
ANGLE = 3 * T
X, Y = 0.08 * np.cos(ANGLE), 0.08 * np.sin(ANGLE)
PX, PY = 1e3 * (X + 0.2), 1e3 * (Y + 0.2)


def columns(folder: Path, values: Mapping[str, Any], *, name: str = "lab.csv") -> Path:
    rows = [",".join(map(str, row)) for row in zip(*values.values(), strict=True)]
    path = folder / name
    path.write_text("\n".join([",".join(values), *rows, ""]), encoding="utf-8")
    return path


def warnings_of(dataset: Any) -> str:
    return " ".join(json.loads(dataset.attrs["counts"])["warnings"])


def check(dataset: Any, *, x: Any = X) -> None:
    (body,) = body_names(dataset)
    track = body_track(dataset, body)
    np.testing.assert_allclose(track.x, x, atol=2e-5)
    np.testing.assert_allclose(np.diff(track.time), 0.04, atol=1e-9)


@pytest.mark.parametrize("form", ["{}_mm_filtered", "{}_mm_left", "Position_mm_{}"])
def test_a_unit_inside_a_name_counts(tmp_path: Path, form: str) -> None:
    names = [form.format(axis) for axis in "xy"]
    check(load(columns(tmp_path, {"t": T, names[0]: X * 1e3, names[1]: Y * 1e3})))


@pytest.mark.parametrize("unit", ["10um", "5mm"])
def test_a_unit_with_a_factor_is_refused(tmp_path: Path, unit: str) -> None:
    path = columns(tmp_path, {"t": T, f"x_{unit}": X, f"y_{unit}": Y})
    with pytest.raises(InputError, match=rf"'{unit}' in column 'x_{unit}' is not a known unit"):
        load(path)


@pytest.mark.parametrize("unit", ["mm_s", "m_per_s"])
def test_velocities_are_no_positions(tmp_path: Path, unit: str) -> None:
    path = columns(tmp_path, {"t": T, f"x_{unit}": X, f"y_{unit}": Y})
    with pytest.raises(InputError, match="no columns of x and y"):
        load(path)


def test_longitudes_next_to_positions_stay_out(tmp_path: Path) -> None:
    values = {"t": T, "x_m": X, "y_m": Y, "lon": 7 + X / 1e5, "lat": 46 + Y / 1e5}
    check(load(columns(tmp_path, values)))


def test_a_further_pair_of_an_unknown_name_is_doubted(tmp_path: Path) -> None:
    path = columns(tmp_path, {"t": T, "x": X, "y": Y, "x_home": Y, "y_home": X})
    assert "'x_home', 'y_home' are read as another body" in warnings_of(load(path))
    check(load(path, columns={"skip": "x_home+y_home"}))


@pytest.mark.parametrize("words", [("True", "False"), ("yes", "no"), ("OK", "LOST"), ("1", "0")])
def test_words_for_seen(tmp_path: Path, words: tuple[str, str]) -> None:
    seen = [words[1] if k in (3, 9) else words[0] for k in range(40)]
    path = columns(tmp_path, {"t": T, "x": X, "y": Y, "valid": seen})
    track = body_track(load(path, min_confidence=0.5), "0")
    assert np.flatnonzero(np.isnan(track.x)).tolist() == [3, 9] or track.time.size == 38
    check(load(path))


def test_confidences_of_another_scale_are_named(tmp_path: Path) -> None:
    seen = [10 if k in (3, 9) else 95 for k in range(40)]
    path = columns(tmp_path, {"t": T, "x": X, "y": Y, "conf": seen})
    assert "go up to 95" in warnings_of(load(path, min_confidence=0.6))
    assert "go up to 95" not in warnings_of(load(path, min_confidence=60.0))


@pytest.mark.parametrize(
    "names", [("tl_x", "tl_y", "br_x", "br_y"), ("x_ul", "y_ul", "x_lr", "y_lr")]
)
def test_named_corners_are_a_box(tmp_path: Path, names: tuple[str, ...]) -> None:
    sides = dict(zip(names, (PX - 15, PY - 15, PX + 15, PY + 15), strict=True))
    check(load(columns(tmp_path, {"frame": range(40), **sides}), **PIXELS), x=X + 0.2)


def test_corners_that_count_from_zero_are_asked_about(tmp_path: Path) -> None:
    values = {"frame": range(40), "x0": PX - 15, "y0": PY - 15, "x1": PX + 15, "y1": PY + 15}
    path = columns(tmp_path, values)
    with pytest.raises(InputError, match="may be the corners of a box"):
        load(path, **PIXELS)
    check(load(path, box="xyxy", **PIXELS), x=X + 0.2)
    assert len(body_names(load(path, box="none", **PIXELS))) == 2


def test_corners_of_a_marker_that_count_from_one(tmp_path: Path) -> None:
    around = ANGLE[:, None] + np.radians([225, 315, 45, 135])
    values: dict[str, Any] = {"frame": range(40), "marker_id": [5] * 40}
    for n in range(4):
        values[f"corner{n + 1}_x"] = PX + 15 * np.cos(around[:, n])
        values[f"corner{n + 1}_y"] = PY + 15 * np.sin(around[:, n])
    dataset = load(columns(tmp_path, values), **PIXELS)
    check(dataset, x=X + 0.2)
    turned = np.exp(1j * (-body_track(dataset, body_names(dataset)[0]).theta - ANGLE))
    np.testing.assert_allclose(turned, 1.0, atol=1e-6)


def test_angles_of_boxes_beyond_a_turn_need_a_unit(tmp_path: Path) -> None:
    values = {"cx": PX, "cy": PY, "w": [30] * 40, "h": [30] * 40}
    path = columns(
        tmp_path, {"frame": range(40), **values, "angle": np.degrees(ANGLE).round(6) % 90}
    )
    with pytest.raises(InputError, match="angles of the boxes name no unit"):
        load(path, **PIXELS)
    check(load(path, columns={"theta": "angle:deg"}, **PIXELS), x=X + 0.2)


def test_boxes_in_shares_of_the_image_are_refused(tmp_path: Path) -> None:
    values = {"x_center": X + 0.2, "y_center": Y + 0.2, "width": [0.03] * 40, "height": [0.03] * 40}
    with pytest.raises(InputError, match="shares of the image"):
        load(columns(tmp_path, {"frame": range(40), **values}), **PIXELS)


def test_degrees_in_large_steps_are_doubted(tmp_path: Path) -> None:
    path = columns(tmp_path, {"t": T, "x": X, "y": Y, "theta": np.degrees(ANGLE)})
    assert "if they are degrees" in warnings_of(load(path))


def test_centre_and_tail_are_one_body(tmp_path: Path) -> None:
    tail = {"Tail X": PX - 9 * np.cos(ANGLE), "Tail Y": PY - 9 * np.sin(ANGLE)}
    dataset = load(columns(tmp_path, {"Time": T, "X": PX, "Y": PY, **tail}), metres_per_pixel=1e-3)
    check(dataset, x=X + 0.2)
    turned = np.exp(1j * (-body_track(dataset, "0").theta - ANGLE))
    np.testing.assert_allclose(turned, 1.0, atol=1e-6)


def test_front_and_back_alone_are_doubted(tmp_path: Path) -> None:
    values = {"t": T, "front_x_m": X, "front_y_m": Y, "back_x_m": X - 0.02, "back_y_m": Y}
    assert "if they are parts of one" in warnings_of(load(columns(tmp_path, values)))


def test_minutes_next_to_seconds_name_no_body(tmp_path: Path) -> None:
    seconds = 59.0 + T
    path = columns(tmp_path, {"min": seconds // 60, "sec": seconds % 60, "x_m": X, "y_m": Y})
    with pytest.raises(InputError, match="the clock starts over"):
        load(path)


def test_rows_of_a_detector_say_how_they_are_named(tmp_path: Path) -> None:
    path = tmp_path / "gt.txt"
    row = "{},1,{:.3f},{:.3f},30,30,1,-1,-1,-1".format
    path.write_text("\n".join(row(k + 1, PX[k] - 15, PY[k] - 15) for k in range(40)) + "\n")
    with pytest.raises(InputError, match="those of MOT"):
        load(path, **PIXELS)
    named = {"frame": "1", "body": "2", "x": "3", "y": "4", "w": "5", "h": "6", "confidence": "7"}
    check(load(path, columns=named, box="xywh", **PIXELS), x=X + 0.2)
    path.write_text(
        "".join(f"0 {x:.6f} {y:.6f} 0.03 0.03\n" for x, y in zip(X + 0.2, Y + 0.2, strict=True))
    )
    with pytest.raises(InputError, match="those of YOLO"):
        load(path, **PIXELS)


def test_lists_of_numbers_in_json_lines(tmp_path: Path) -> None:
    path = tmp_path / "log.jsonl"
    entries = [{"t": t, "position": [x, y, 0.0]} for t, x, y in zip(T, X, Y, strict=True)]
    path.write_text("".join(json.dumps(one) + "\n" for one in entries))
    check(load(path, length_unit="m"))
    boxes = [{"frame": k, "bbox": [PX[k] - 15, PY[k] - 15, 30, 30]} for k in range(40)]
    path.write_text("".join(json.dumps(one) + "\n" for one in boxes))
    sides = {side: f"bbox.{at}" for at, side in enumerate("xywh")}
    check(load(path, columns=sides, box="xywh", **PIXELS), x=X + 0.2)


def test_units_in_the_attributes_of_arrays(tmp_path: Path) -> None:
    path = tmp_path / "lab.h5"
    with h5py.File(path, "w") as file:
        file["t"], file["x"], file["y"] = T, X * 1e3, Y * 1e3
        file["x"].attrs["units"] = file["y"].attrs["units"] = "mm"
    check(load(path))


@pytest.mark.parametrize("mark", ["na", "-NaN", "—", "*", "ND", "undefined"])
def test_further_marks_of_what_is_missing(tmp_path: Path, mark: str) -> None:
    x = [mark if k in (7, 8) else value for k, value in enumerate(X)]
    y = [mark if k in (7, 8) else value for k, value in enumerate(Y)]
    assert body_track(load(columns(tmp_path, {"t": T, "x": x, "y": y})), "0").time.size == 38


def test_a_blank_line_below_the_units(tmp_path: Path) -> None:
    path = tmp_path / "logger.txt"
    rows = "".join(f"{t}\t{x * 100}\t{y * 100}\n" for t, x, y in zip(T, X, Y, strict=True))
    path.write_text(f"Vernier Format 2\nLatest\nTime\tX\tY\nT\tX\tY\ns\tcm\tcm\n\n{rows}")
    check(load(path))


def test_a_column_called_by_a_unit_of_time_is_no_body(tmp_path: Path) -> None:
    ms, dev = np.repeat(40 * np.arange(40), 2), np.tile([0, 1], 40)
    x, y = np.repeat(X, 2), np.repeat(Y, 2) + 0.05 * dev
    path = columns(tmp_path, {"dev": dev, "ms": ms, "x_m": x, "y_m": y})
    with pytest.raises(InputError, match="'ms' may hold times") as caught:
        load(path)
    assert "ms:ms" in str(caught.value)
    assert len(body_names(load(path, columns={"t": "ms:ms", "body": "dev"}))) == 2


def test_a_clock_that_counts_frames_can_be_named(tmp_path: Path) -> None:
    path = columns(tmp_path, {"t": range(40), "x": X, "y": Y})
    with pytest.raises(InputError, match="name the column that counts frames"):
        load(path, frame_rate=25.0)
    check(load(path, frame_rate=25.0, length_unit="m", columns={"frame": "t"}))


@pytest.mark.parametrize("between", ["", "\n"])
def test_a_name_without_a_column_at_the_end(tmp_path: Path, between: str) -> None:
    path = tmp_path / "lab.lvm"
    rows = "".join(f"{t}\t{x}\t{y}\n" for t, x, y in zip(T, X, Y, strict=True))
    above = "LabVIEW Measurement\t\nOperator\tme\n\n"
    path.write_text(f"{above}Time\tx\ty\tComment\n{between}{rows}")
    check(load(path))


@pytest.mark.parametrize("above", ["", "% made by a program\n"])
def test_a_header_behind_a_percent_sign_and_a_blank(tmp_path: Path, above: str) -> None:
    rows = [f"{t} {x} {y}" for t, x, y in zip(T, X, Y, strict=True)]
    path = tmp_path / "lab.txt"
    path.write_text("\n".join([f"{above}% t_s x_m y_m", *rows, ""]))
    check(load(path))


@pytest.mark.parametrize("form", ["dir_{}", "rot_{}", "Euler.{}"])
def test_directions_are_no_body(tmp_path: Path, form: str) -> None:
    other = {form.format("x"): 0.6 + 0 * X, form.format("y"): 0.8 + 0 * X}
    check(load(columns(tmp_path, {"t": T, "x": X, "y": Y, **other})))


def test_a_rotation_of_four_parts_is_an_orientation(tmp_path: Path) -> None:
    parts = zip("xyzw", (0 * T, 0 * T, np.sin(ANGLE / 2), np.cos(ANGLE / 2)), strict=True)
    turns = {f"rotation.{axis}": values for axis, values in parts}
    dataset = load(columns(tmp_path, {"t": T, "x": X, "y": Y, **turns}))
    np.testing.assert_allclose(np.unwrap(dataset.theta.values[:, 0]), ANGLE, atol=1e-12)


def test_longitudes_with_a_height_lie_in_one_plane(tmp_path: Path) -> None:
    path = columns(tmp_path, {"t": T, "lon": 7 + X / 1e5, "lat": 46 + Y / 1e5, "z": X})
    assert load(path).sizes["body"] == 1
    with pytest.raises(InputError, match="`up` is for positions with three axes"):
        load(path, up="z")


def test_longitudes_in_radians_are_refused(tmp_path: Path) -> None:
    path = columns(tmp_path, {"t": T, "lon_rad": 0.2 + 1e-8 * X, "lat_rad": 0.8 + 1e-8 * Y})
    with pytest.raises(InputError, match="'rad' in column 'lon_rad' is not a known unit"):
        load(path)


def test_of_a_body_in_the_image_and_in_the_world_one_is_to_be_named(tmp_path: Path) -> None:
    values = {"t": T, "x_cam": PX, "y_cam": PY, "x_world": X, "y_world": Y}
    path = columns(tmp_path, values)
    with pytest.raises(InputError, match="'x_cam', 'x_world' may be one body several times"):
        load(path)
    check(load(path, columns={"x": "x_world:m", "y": "y_world:m"}))
