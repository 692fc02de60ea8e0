"""Tables as labs and trackers export them: what each column is taken for, or why it is refused.

All hold the same circle of 8 cm, at 3 rad/s and 25 Hz, in their own names, units and layouts.
"""

from __future__ import annotations

import json
import tomllib
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from driftwalk.core.errors import InputError
from driftwalk.record import describe, load, unit_and_column_words
from driftwalk.schema import body_names, body_track

FILES = Path(__file__).parents[3] / "data" / "foreign"
PIXELS: Mapping[str, Any] = {"frame_rate": 25.0, "metres_per_pixel": 1e-3}
T = np.arange(40) / 25.0
X, Y = 0.08 * np.cos(3 * T), 0.08 * np.sin(3 * T)
ANGLE = 3 * T
Row = Callable[[int], str]


def table(folder: Path, head: str, row: Row, *, rows: int = 40, name: str = "lab.csv") -> Path:
    path = folder / name
    path.write_text("\n".join([head, *(row(k) for k in range(rows)), ""]), encoding="utf-8")
    return path


def warnings_of(dataset: Any) -> str:
    return " ".join(json.loads(dataset.attrs["counts"])["warnings"])


def check(dataset: Any, *, x: Any = X, bodies: int = 1, atol: float = 2e-5) -> None:
    assert len(body_names(dataset)) == bodies
    track = body_track(dataset, body_names(dataset)[0])
    np.testing.assert_allclose(track.x, x, atol=atol)
    np.testing.assert_allclose(np.diff(track.time), 0.04, atol=1e-9)


# Files: what to say, bodies, samples, and the extent of x [m].
CASES: dict[str, tuple[Mapping[str, Any], int, int, float, float]] = {
    "boxes.csv": (PIXELS, 1, 40, 0.12, 0.28),
    "mot.csv": ({**PIXELS, "box": "xywh"}, 1, 40, 0.12, 0.28),
    "ethovision.txt": ({}, 1, 38, -0.08, 0.08),
    "log.csv": ({"columns": {"t": "1:s", "x": "3:m", "y": "4:m"}}, 1, 40, -0.08, 0.08),
    "simba.csv": ({**PIXELS, "min_confidence": 0.6}, 1, 37, 0.12, 0.28),
    "zeros.csv": ({**PIXELS, "missing": "0,0"}, 1, 35, 0.12, 0.28),
    "setpoint.csv": ({}, 1, 40, -0.08, 0.08),
    "wrap.csv": ({"frame_rate": 25.0, "sort": "sort"}, 1, 40, -0.08, 0.08),
    "spuren.csv": (PIXELS, 3, 40, 0.12, 0.28),
    "feet.csv": ({}, 1, 40, -0.08, 0.08),
}


@pytest.mark.parametrize("file", CASES)
def test_files_in_foreign_layouts(file: str) -> None:
    options, bodies, samples, low, high = CASES[file]
    dataset = load(FILES / file, **options)
    assert len(body_names(dataset)) == bodies
    for body in body_names(dataset):
        track = body_track(dataset, body)
        assert track.time.size == samples
        assert track.x.max() == pytest.approx(high, abs=3e-4)
        if bodies == 1:  # others begin somewhere else on the circle
            assert track.x.min() == pytest.approx(low, abs=3e-4)
        assert track.time[-1] - track.time[0] == pytest.approx(1.56)


def test_what_was_taken_for_what_is_said() -> None:
    columns = describe(load(FILES / "ethovision.txt", columns={"theta": "Direction"}))["columns"]
    known = {one["column"]: (one["meaning"], one["unit"]) for one in columns}
    assert known["X center"] == ("x", "cm")
    assert known["Direction"] == ("orientation", "deg")
    assert known["Recording time"][0] == "not read"
    assert all(one["why"] for one in columns)


UNITS = {
    "ft": 0.3048,
    "in": 0.0254,
    "yd": 0.9144,
    "dm": 0.1,
    "µm": 1e-6,
    "nm": 1e-9,
    "feet": 0.3048,
}


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("form", ["x_{}", "x ({})", "x.{}"])
def test_units_of_length(tmp_path: Path, unit: str, form: str) -> None:
    x, y = form.format(unit), form.replace("x", "y", 1).format(unit)
    factor = UNITS[unit]
    row: Row = lambda k: f"{T[k]},{X[k] / factor:.17g},{Y[k] / factor:.17g}"  # noqa: E731
    check(load(table(tmp_path, f"t,{x},{y}", row)), atol=1e-12)


@pytest.mark.parametrize("unit", ["bl", "norm", "grid", "furlong", "cells", "foo", "mi", "%"])
def test_what_is_no_unit_is_refused_by_its_name(tmp_path: Path, unit: str) -> None:
    path = table(tmp_path, f"t,x_{unit},y_{unit}", lambda k: f"{T[k]},{X[k]},{Y[k]}")
    with pytest.raises(InputError, match=rf"'{unit}' in column '[xy]_{unit}' is not a known unit"):
        load(path)
    columns = {"x": f"x_{unit}:cm", "y": f"y_{unit}:cm"}
    check(load(path, columns=columns), x=X / 100)
    several = f"t,x_a_{unit},y_a_{unit},x_b_{unit},y_b_{unit}"
    path = table(tmp_path, several, lambda k: f"{T[k]},{X[k]},{Y[k]},{X[k] + 1},{Y[k]}")
    with pytest.raises(InputError, match=f"'{unit}' in column"):
        load(path)


@pytest.mark.parametrize(
    ("name", "factor"),
    [
        ("theta_gon", np.pi / 200),
        ("theta_turns", 2 * np.pi),
        ("yaw_ddeg", np.pi / 1800),
        ("heading [mrad]", 1e-3),
        ("angle (deg/10)", np.pi / 1800),
        ("Winkel_cdeg", np.pi / 18000),
    ],
)
def test_units_of_angle(tmp_path: Path, name: str, factor: float) -> None:
    row: Row = lambda k: f"{T[k]},{X[k]},{Y[k]},{ANGLE[k] / factor:.17g}"  # noqa: E731
    track = body_track(load(table(tmp_path, f"t,x,y,{name}", row)))
    np.testing.assert_allclose(np.unwrap(track.theta), ANGLE, atol=1e-9)


@pytest.mark.parametrize("name", ["theta_foo", "yaw_norm", "winkel (grad)", "heading_camera"])
def test_an_angle_of_no_known_unit_is_refused(tmp_path: Path, name: str) -> None:
    path = table(tmp_path, f"t,x,y,{name}", lambda k: f"{T[k]},{X[k]},{Y[k]},{ANGLE[k]}")
    with pytest.raises(InputError, match="is not a known unit"):
        load(path)
    check(load(path, columns={"theta": f"{name}:rad"}))
    assert not body_track(load(path, columns={"skip": name})).has_orientation


STACKED: dict[str, Callable[[int, int], str]] = {
    "Trajectory,Frame,x,y": lambda b, k: f"{b + 1},{k},{X[k] + b},{Y[k]}",
    "Piste;Trame;x_m;y_m": lambda b, k: f"{b + 1};{k};{X[k] + b};{Y[k]}",
    "traccia,fotogramma,x,y": lambda b, k: f"r{b},{k},{X[k] + b},{Y[k]}",
    "Track n°,Slice n°,X,Y": lambda b, k: f"{b + 1},{k + 1},{X[k] + b},{Y[k]}",
    "x,y,cuerpo,cuadro": lambda b, k: f"{X[k] + b},{Y[k]},{b},{k}",
}


@pytest.mark.parametrize("head", STACKED)
def test_stacked_tracks_in_other_languages(tmp_path: Path, head: str) -> None:
    rows = [STACKED[head](b, k) for b in range(3) for k in range(40)]
    path = table(tmp_path, head, lambda k: rows[k], rows=120)
    check(load(path, frame_rate=25.0, length_unit="m"), bodies=3)


UNKNOWN: dict[str, tuple[Callable[[int, int], str], str]] = {
    "Ścieżka,Klatka,x_m,y_m": (lambda b, k: f"{b},{k},{X[k]},{Y[k]}", "Klatka.*Ścieżka"),
    "Foo,Bar,x_m,y_m": (lambda b, k: f"{b},{k + 7 * b},{X[k]},{Y[k]}", "'Bar'.*'Foo'"),
    "trial,x_m,y_m": (lambda b, k: f"{b},{X[k] + b},{Y[k]}", "'trial'"),
    "kind,x_m,y_m": (lambda b, k: f"k{b},{X[k]},{Y[k]}", "'kind'"),
    "Bar,x_m,y_m": (lambda b, k: f"{k},{X[k] + b},{Y[k]}", "'Bar' counts frames"),
}


@pytest.mark.parametrize("turns", [False, True])
@pytest.mark.parametrize("head", UNKNOWN)
def test_stacked_tracks_of_unknown_names_are_refused(
    tmp_path: Path, head: str, turns: bool
) -> None:
    row, message = UNKNOWN[head]
    order = [(b, k) for b in range(3) for k in range(40)]
    rows = [row(b, k) for b, k in (sorted(order, key=lambda one: one[1]) if turns else order)]
    path = table(tmp_path, head, lambda k: rows[k], rows=120)
    with pytest.raises(InputError, match=message):
        load(path, frame_rate=25.0)


def test_frames_that_repeat_where_a_second_body_comes_later_are_refused(tmp_path: Path) -> None:
    rows = sorted([(k, X[k], Y[k]) for k in range(40)] + [(k, -X[k], 0.1) for k in range(12, 40)])
    path = table(tmp_path, "Bar,x_m,y_m", lambda k: "{},{},{}".format(*rows[k]), rows=68)
    with pytest.raises(InputError, match="'Bar' counts frames"):
        load(path, frame_rate=25.0)
    # A number that goes up every few rows of one body counts no frames.
    path = table(tmp_path, "Bar,x_m,y_m", lambda k: f"{int(k**1.3) // 4},{X[k]},{Y[k]}")
    check(load(path, frame_rate=25.0))


def test_rows_of_known_bodies_without_a_clock_count_for_each(tmp_path: Path) -> None:
    rows = [f"{b},{X[k] + b},{Y[k]}" for k in range(40) for b in range(2)]
    path = table(tmp_path, "id,x_m,y_m", lambda k: rows[k], rows=80)
    check(load(path, frame_rate=25.0), bodies=2)


BOXES: dict[str, tuple[Callable[[float, float], str], dict[str, Any]]] = {
    "frame,xmin,ymin,xmax,ymax": (lambda x, y: f"{x - 15},{y - 15},{x + 15},{y + 15}", {}),
    "frame,left,top,width,height": (lambda x, y: f"{x - 15},{y - 9},30,18", {}),
    "frame,bb_left,bb_top,bb_width,bb_height": (lambda x, y: f"{x - 9},{y - 15},18,30", {}),
    "frame,cx,cy,w,h": (lambda x, y: f"{x},{y},30,30", {}),
    "frame,x1,y1,x2,y2": (lambda x, y: f"{x - 15},{y - 15},{x + 15},{y + 15}", {"box": "xyxy"}),
    "frame,x,y,w,h": (lambda x, y: f"{x},{y},30,30", {"box": "cxcywh"}),
    "frame,bbox_x1,bbox_y1,bbox_x2,bbox_y2,score": (
        lambda x, y: f"{x - 15},{y - 15},{x + 15},{y + 15},0.9", {},
    ),
    "frame,x1,y1,x2,y2,cx,cy,tracking_id": (
        lambda x, y: f"{x - 15},{y - 15},{x + 15},{y + 15},{x},{y},7", {},
    ),
    "frame,c0x,c0y,c1x,c1y,c2x,c2y,c3x,c3y": (
        lambda x, y: f"{x - 9},{y - 9},{x + 9},{y - 9},{x + 9},{y + 9},{x - 9},{y + 9}", {},
    ),
    "frame,centroid_x,centroid_y,bbox_x,bbox_y,bbox_w,bbox_h": (
        lambda x, y: f"{x},{y},{x - 9},{y - 9},18,18", {},
    ),
}  # fmt: skip


@pytest.mark.parametrize("head", BOXES)
def test_boxes_are_bodies_at_their_centres(tmp_path: Path, head: str) -> None:
    row, options = BOXES[head]
    path = table(tmp_path, head, lambda k: f"{k},{row(200 + 1e3 * X[k], 200 + 1e3 * Y[k])}")
    check(load(path, **PIXELS, **options), x=0.2 + X)


@pytest.mark.parametrize(
    "head", ["frame,x,y,w,h", "frame,x1,y1,x2,y2", "frame,id,x,y,width,height"]
)
def test_a_box_that_is_not_clear_is_refused(tmp_path: Path, head: str) -> None:
    first = "1," if "id" in head else ""
    path = table(tmp_path, head, lambda k: f"{k},{first}{X[k]},{Y[k]},{X[k] + 0.1},{Y[k] + 0.1}")
    with pytest.raises(InputError, match=r'add `box="xy'):
        load(path, **PIXELS)
    assert len(body_names(load(path, **PIXELS, box="none"))) == (2 if "x1" in head else 1)


def test_a_box_next_to_several_bodies_is_refused(tmp_path: Path) -> None:
    row: Row = lambda k: f"{k},{X[k]},{Y[k]},{Y[k]},{X[k]},1,1"  # noqa: E731
    path = table(tmp_path, "frame,cx,cy,b_x,b_y,w,h", row)
    with pytest.raises(InputError, match="next to several bodies, '', 'b'"):
        load(path, **PIXELS)


def test_two_bodies_are_no_corners(tmp_path: Path) -> None:
    row: Row = lambda k: f"{T[k]},{X[k]},{Y[k]},{1 - X[k]},{1 + Y[k]}"  # noqa: E731
    check(load(table(tmp_path, "t,x1,y1,x2,y2", row)), bodies=2)


@pytest.mark.parametrize(("w", "h", "period"), [(30, 30, 90.0), (60, 20, 180.0)])
def test_the_angle_of_a_box_is_that_of_an_axis(
    tmp_path: Path, w: int, h: int, period: float
) -> None:
    def row(k: int) -> str:
        return f"{k},{1e3 * X[k]},{1e3 * Y[k]},{w},{h},{np.degrees(ANGLE[k]) % period}"

    path = table(tmp_path, "frame,cx,cy,w,h,angle_deg", row)
    track = body_track(load(path, **PIXELS, y_axis="up"))
    np.testing.assert_allclose(np.unwrap(track.theta), ANGLE, atol=1e-9)


def test_the_sides_of_an_upright_rectangle_change_places(tmp_path: Path) -> None:
    """As OpenCV's smallest rectangle has it: an angle up to 90 degrees, and sides that swap."""
    turned = np.degrees(ANGLE)
    swap = (turned // 90).astype(int) % 2 == 1
    sides = ["20,60" if one else "60,20" for one in swap]
    path = table(
        tmp_path, "frame,cx,cy,w,h,angle_deg",
        lambda k: f"{k},{1e3 * X[k]},{1e3 * Y[k]},{sides[k]},{turned[k] % 90.0}",
    )  # fmt: skip
    track = body_track(load(path, **PIXELS, y_axis="up"))
    np.testing.assert_allclose(np.unwrap(track.theta), ANGLE, atol=1e-9)


WRAPS: dict[str, tuple[Callable[[int], float], dict[str, Any]]] = {
    "frame": (lambda k: (250 + k) % 256, {"frame_rate": 25.0}),
    "frame_id": (lambda k: (65_530 + k) % 65_536, {"frame_rate": 25.0}),
    "t_us": (lambda k: (4_294_000_000 + 40_000 * k) % 2**32, {}),
    "t_ms": (lambda k: (4_294_967_000 + 40 * k) % 2**32, {}),
    "time_s": (lambda k: (4294.2 + 0.04 * k) % (2**32 / 1e6), {}),
    "Frame Number": (lambda k: (32_750 + k + 32_768) % 65_536 - 32_768, {"frame_rate": 25.0}),
}


@pytest.mark.parametrize("name", WRAPS)
@pytest.mark.parametrize("sort", ["error", "sort"])
def test_counters_that_run_over(tmp_path: Path, name: str, sort: str) -> None:
    clock, options = WRAPS[name]
    path = table(tmp_path, f"{name},x_m,y_m", lambda k: f"{clock(k)},{X[k]},{Y[k]}")
    dataset = load(path, sort=sort, **options)
    check(dataset)
    assert "rolls over" in warnings_of(dataset)


@pytest.mark.parametrize("sort", ["error", "sort"])
def test_a_clock_that_starts_over_is_not_to_be_sorted(tmp_path: Path, sort: str) -> None:
    clock = [*(100 + np.arange(20) * 3), *(101 + np.arange(20) * 3)]
    path = table(tmp_path, "frame,x_m,y_m", lambda k: f"{clock[k]},{X[k]},{Y[k]}")
    with pytest.raises(InputError, match=r"starts over there.*split the file") as caught:
        load(path, frame_rate=25.0, sort=sort)
    assert "`sort" not in str(caught.value)


FIRST: dict[str, tuple[Row, dict[str, str]]] = {
    "ros": (lambda k: f"{17 + k // 25},{k % 25 * 40_000_000},map,{X[k]},{Y[k]}",
            {"t": "1:s+2:ns", "x": "4:m", "y": "5:m"}),
    "name first": (lambda k: f"block,{T[k]},{X[k]},{Y[k]}", {"t": "2:s", "x": "3:m", "y": "4:m"}),
    "region last": (lambda k: f"{T[k]} {X[k]} {Y[k]} left", {"t": "1:s", "x": "2:m", "y": "3:m"}),
    "with commas": (lambda k: f"{T[k]};{X[k]};{Y[k]};a".replace(".", ","),
                    {"t": "1:s", "x": "2:m", "y": "3:m"}),
    "stamps": (lambda k: f"a,2024-05-01T12:00:{T[k]:06.3f},{X[k]},{Y[k]}",
               {"t": "2", "x": "3:m", "y": "4:m"}),
}  # fmt: skip


@pytest.mark.parametrize("kind", FIRST)
def test_the_first_row_is_data(tmp_path: Path, kind: str) -> None:
    row, columns = FIRST[kind]
    path = table(tmp_path, row(0), lambda k: row(k + 1), rows=39)
    check(load(path, columns=columns))
    if kind != "ros":
        with pytest.raises(InputError, match="no header: name them"):
            load(path)


NANO = 1_700_000_000_000_000_000
STAMPS: dict[str, Row] = {
    "sec,nanosec,x,y": lambda k: f"{NANO // 10**9 + k // 25},{k % 25 * 40_000_000}",
    "header.stamp.sec,header.stamp.nanosec,x,y": lambda k: f"{5 + k // 25},{k % 25 * 40_000_000}",
    "stamp_secs,stamp_nsecs,x,y": lambda k: f"{5 + k // 25},{k % 25 * 40_000_000}",
    "%time,field.header.stamp,x,y": lambda k: f"{NANO + k * k},{NANO + 40_000_000 * k}",
    "time,header.stamp,x,y": lambda k: f"{k * 1.1},{NANO + 40_000_000 * k}",
}


@pytest.mark.parametrize("head", STAMPS)
def test_stamps_of_messages(tmp_path: Path, head: str) -> None:
    check(load(table(tmp_path, head, lambda k: f"{STAMPS[head](k)},{X[k]},{Y[k]}")))


@pytest.mark.parametrize(
    "pair",
    ["x_cmd,y_cmd", "goal_x,goal_y", "x_dot,y_dot", "gyro_x,gyro_y", "mag_x,mag_y", "x_raw,y_raw",
     "wind_x,wind_y", "x_setpoint,y_setpoint", "x_filt,y_filt", "current_x,current_y"],
)  # fmt: skip
def test_pairs_that_are_no_body(tmp_path: Path, pair: str) -> None:
    path = table(tmp_path, f"t,x,y,{pair}", lambda k: f"{T[k]},{X[k]},{Y[k]},{k},{-k}")
    check(load(path))


@pytest.mark.parametrize("pairs", ["x_raw,y_raw,x_filt,y_filt", "x_true,y_true,x_est,y_est"])
def test_of_one_body_twice_the_one_is_to_be_named(tmp_path: Path, pairs: str) -> None:
    path = table(tmp_path, f"t,{pairs}", lambda k: f"{T[k]},{X[k]},{Y[k]},{X[k] + 1},{Y[k]}")
    with pytest.raises(InputError, match=r'may be one body several times.*columns={"x": "x_'):
        load(path)
    x, y = pairs.split(",")[:2]
    check(load(path, columns={"x": f"{x}:m", "y": f"{y}:m"}))


@pytest.mark.parametrize(
    ("mark", "x"), [("-1,-1", "-1,-1"), ("-9999", "-9999,-9999"), ("0,0", "0,0")]
)
def test_marks_of_what_was_not_seen_are_named(tmp_path: Path, mark: str, x: str) -> None:
    lost = {8, 9, 20, 21, 22}
    row: Row = lambda k: f"{k},{x}" if k in lost else f"{k},{200 + 1e3 * X[k]},{200 + 1e3 * Y[k]}"  # noqa: E731
    path = table(tmp_path, "frame,x_px,y_px", row)
    named = x
    assert f'add `missing="{named}"`' in warnings_of(load(path, **PIXELS))
    track = body_track(load(path, **PIXELS, missing=mark))
    np.testing.assert_allclose(track.x, 0.2 + np.delete(X, sorted(lost)), atol=1e-5)


def test_an_origin_that_the_body_goes_round_is_named(tmp_path: Path) -> None:
    row: Row = lambda k: f"{T[k]},0,0" if k in (8, 9, 20) else f"{T[k]},{X[k]},{Y[k]}"  # noqa: E731
    assert 'add `missing="0,0"`' in warnings_of(load(table(tmp_path, "t,x,y", row)))


def test_the_last_place_held_is_named(tmp_path: Path) -> None:
    at = [8 if 8 <= k < 13 else 25 if 25 <= k < 30 else k for k in range(40)]
    path = table(tmp_path, "t,x,y", lambda k: f"{T[k]},{X[at[k]]},{Y[at[k]]}")
    assert 'add `missing="held"`' in warnings_of(load(path))
    assert body_track(load(path, missing="held")).time.size == 32


def test_a_body_that_rests_holds_no_mark(tmp_path: Path) -> None:
    at = [min(k, 20) if k < 30 else k - 9 for k in range(40)]
    path = table(tmp_path, "t,x,y", lambda k: f"{T[k]},{X[at[k]]},{Y[at[k]]}")
    assert "missing" not in warnings_of(load(path))
    with pytest.raises(InputError, match="`missing` is a place such as"):
        load(path, missing="never")


@pytest.mark.parametrize(
    "mark", ["-", "--", ".", "n/a", "missing", "1.#QNAN", "-nan(ind)", "#DIV/0!", "<NA>", "#NV"]
)
def test_words_for_what_is_missing(tmp_path: Path, mark: str) -> None:
    path = table(
        tmp_path, "t,x,y", lambda k: f"{T[k]},{mark},{mark}" if k == 5 else f"{T[k]},{X[k]},{Y[k]}"
    )
    assert body_track(load(path)).time.size == 39


@pytest.mark.parametrize(
    "name", ["p", "conf", "likelihood", "score", "valid", "visible", "is_tracked"]
)
def test_confidences(tmp_path: Path, name: str) -> None:
    row: Row = lambda k: f"{T[k]},{X[k]},{Y[k]},{0 if k % 10 == 0 else 1}"  # noqa: E731
    path = table(tmp_path, f"t,x,y,{name}", row)
    assert body_track(load(path)).time.size == 40
    assert body_track(load(path, min_confidence=0.5)).time.size == 36


CLOCKS: dict[str, Row] = {
    "t_h": lambda k: f"{T[k] / 3600:.17g}",
    "time [min]": lambda k: f"{T[k] / 60:.17g}",
    "Zeit (d)": lambda k: f"{T[k] / 86_400:.17g}",
    "Time": lambda k: f"{1 + k // 25 // 60}:00:{T[k]:06.3f} PM",
    "timestamp": lambda k: f"2024-05-01 11:59:{59 + 0 * k}.{k * 20:03d} AM",
}


@pytest.mark.parametrize("name", CLOCKS)
def test_units_of_time(tmp_path: Path, name: str) -> None:
    path = table(tmp_path, f"{name},x,y", lambda k: f"{CLOCKS[name](k)},{X[k]},{Y[k]}")
    time = load(path)["time"].values
    step = 0.02 if name == "timestamp" else 0.04
    np.testing.assert_allclose(np.diff(time), step, atol=1e-9)


def test_longitude_and_latitude_are_projected(tmp_path: Path) -> None:
    east, north = np.radians(1) * 6_378_137 * np.cos(np.radians(47)), np.radians(1) * 6_369_000
    row: Row = lambda k: f"{T[k]},{8 + 100 * X[k] / east:.17g},{47 + 100 * Y[k] / north:.17g}"  # noqa: E731
    dataset = load(table(tmp_path, "time_s,longitude,latitude", row))
    track = body_track(dataset)
    np.testing.assert_allclose(track.x, 100 * (X - X[0]), rtol=3e-3, atol=1e-6)
    np.testing.assert_allclose(track.y, 100 * (Y - Y[0]), rtol=3e-3, atol=1e-6)
    assert "projected" in warnings_of(dataset)


def test_longitudes_and_latitudes_that_are_all_missing(tmp_path: Path) -> None:
    """As of other tables without a position: a warning, and not a `StopIteration`."""
    dataset = load(table(tmp_path, "time_s,longitude,latitude", lambda k: f"{T[k]},,"))
    assert np.isnan(dataset["x"]).all()
    assert "longitude and latitude are missing in every row" in warnings_of(dataset)
    assert "no row holds a position" in warnings_of(dataset)


@pytest.mark.parametrize(
    "head",
    ["Time,Centre position X,Centre position Y,Head position X,Head position Y",
     "Time,x_center,y_center,x_nose,y_nose", "Time,x,y,head_x,head_y"],
)  # fmt: skip
def test_centre_and_head_are_one_body(tmp_path: Path, head: str) -> None:
    def row(k: int) -> str:
        return f"{T[k]},{X[k]},{Y[k]},{X[k] + np.cos(ANGLE[k])},{Y[k] + np.sin(ANGLE[k])}"

    dataset = load(table(tmp_path, head, row), length_unit="m")
    check(dataset)
    np.testing.assert_allclose(np.unwrap(body_track(dataset).theta), ANGLE, atol=1e-9)


@pytest.mark.parametrize("table", ["quantities", "units", "sides_of_a_box"])
def test_a_word_has_one_meaning(table: str) -> None:
    text = (Path(unit_and_column_words.__file__).with_suffix(".toml")).read_text(encoding="utf-8")
    found = [word for words in tomllib.loads(text)[table].values() for word in words.split()]
    assert found == [word.lower() for word in found]
    assert [word for word, times in Counter(found).items() if times > 1] == []
