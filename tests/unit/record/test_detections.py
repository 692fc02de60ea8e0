"""Boxes of detectors, tracks of Kinovea, and clocks and lengths of unusual units."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from driftwalk.core.errors import InputError
from driftwalk.record import load
from driftwalk.schema import body_names, body_track

N, WIDTH, HEIGHT = 12, 1000, 500
PX, PY = 300.0 + 10.0 * np.arange(N), 100.0 + 5.0 * np.arange(N)
PIXELS: dict[str, Any] = {"frame_rate": 10.0, "metres_per_pixel": 1e-3}
SHARES = {**PIXELS, "box": f"cxcywh@{WIDTH}x{HEIGHT}"}


def check(recording: Any, *, bodies: int = 1, step: float = 0.1, places: Any = slice(None)) -> None:
    """Compare with the paths that were written, in pixels of 1 mm, y down."""
    assert recording.sizes["body"] == bodies
    for at, name in enumerate(body_names(recording)):
        track = body_track(recording, name)
        np.testing.assert_allclose(track.x, 1e-3 * PX[places] + 0.1 * at, atol=1e-6)
        np.testing.assert_allclose(track.y, -1e-3 * PY[places], atol=1e-6)
        np.testing.assert_allclose(np.diff(track.time), step, atol=1e-9)


def yolo(folder: Path, *, extra: str = "", several: bool = False) -> Path:
    """Write frames 1 to N without leading zeros, so that their names sort otherwise."""
    for frame in range(N):
        lines = []
        for body in range(1 + several):
            x, y = (PX[frame] + 100 * body) / WIDTH, PY[frame] / HEIGHT
            lines.append(f"0 {x:.6f} {y:.6f} 0.03 0.06 {extra.format(body + 1)}\n")
        (folder / f"video_{frame + 1}.txt").write_text("".join(lines))
    return folder


def coco(path: Path, *, whole: bool) -> Path:
    boxes = [
        {"image_id": 90 - k, "category_id": 1, "bbox": [PX[k] - 15, PY[k] - 10, 30, 20]}
        for k in range(N)
    ]
    images = [{"id": 90 - k, "file_name": f"im_{k:04d}.png"} for k in range(N)]
    if not whole:
        boxes = [{**box, "image_id": 90 - int(box["image_id"]), "score": 0.9} for box in boxes]
    content = {"images": images, "annotations": boxes, "categories": []} if whole else boxes
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


@pytest.mark.parametrize("extra", ["", "0.9"])
def test_a_folder_of_yolo(tmp_path: Path, extra: str) -> None:
    check(load(yolo(tmp_path, extra=extra), **SHARES))


@pytest.mark.parametrize("extra", ["{}", "0.9 {}"])
def test_tracked_boxes_of_yolo(tmp_path: Path, extra: str) -> None:
    check(load(yolo(tmp_path, extra=extra, several=True), **SHARES), bodies=2)


def test_what_yolo_leaves_open_is_asked(tmp_path: Path) -> None:
    yolo(tmp_path, several=True)
    with pytest.raises(InputError, match=r'size.*`box="cxcywh@1920x1080"`'):
        load(tmp_path, **PIXELS)
    with pytest.raises(InputError, match="several places"):
        load(tmp_path, **SHARES)
    (tmp_path / "video_3.txt").write_text("0 0.5 0.5 0.1\n")
    with pytest.raises(InputError, match=r"video_3.txt, line 1: expected class"):
        load(tmp_path, **SHARES)
    (tmp_path / "video_3.txt").unlink()
    (tmp_path / "classes.txt").write_text("block\n")
    (tmp_path / "last.txt").write_text("0 0.5 0.5 0.1 0.1\n")
    with pytest.raises(InputError, match="do not end in numbers"):
        load(tmp_path, **SHARES)


def test_a_frame_without_a_box_is_a_gap(tmp_path: Path) -> None:
    (yolo(tmp_path) / "video_12.txt").write_text("")
    check(load(tmp_path, **SHARES), places=slice(11))


def test_shares_in_one_table(tmp_path: Path) -> None:
    rows = [f"{k},{PX[k] / WIDTH},{PY[k] / HEIGHT},0.03,0.06" for k in range(N)]
    path = tmp_path / "boxes.csv"
    path.write_text("\n".join(["frame,cx,cy,w,h", *rows, ""]))
    check(load(path, **SHARES))
    with pytest.raises(InputError, match="state its size"):
        load(path, **PIXELS)
    path.write_text("frame,cx,cy,w,h\n" + "".join(f"{k},{5000 + k},30,4,4\n" for k in range(N)))
    with pytest.raises(InputError, match="no shares of an image"):
        load(path, **SHARES)
    with pytest.raises(InputError, match="got 'xywh@0x3'"):
        load(path, **PIXELS, box="xywh@0x3")


@pytest.mark.parametrize("whole", [True, False])
def test_coco(tmp_path: Path, whole: bool) -> None:
    check(load(coco(tmp_path / "boxes.json", whole=whole), **PIXELS))


def test_other_json_is_no_coco(tmp_path: Path) -> None:
    path = tmp_path / "boxes.json"
    path.write_text('[{"image_id": 1, "bbox": [1, 2, 3]}]')
    with pytest.raises(InputError, match="no boxes of four numbers"):
        load(path, **PIXELS)
    path.write_text('[{"bbox": [1, 2, 3, 4]}]')
    with pytest.raises(InputError, match="no COCO JSON of boxes: KeyError"):
        load(path, **PIXELS)


@pytest.mark.parametrize(("form", "step"), [("0:00:00:{:02d}", 0.04), ("0:00:00:{:03d}", 0.004)])
def test_the_clock_of_kinovea(tmp_path: Path, form: str, step: float) -> None:
    path = tmp_path / "kinovea.txt"
    lines = ["#Kinovea Trajectory data export", "#T X Y"]
    for body in range(2):
        lines += ["", "# Label"]
        times = (form.format(4 * k) for k in range(N))
        places = zip(times, PX + 100 * body, -PY, strict=True)
        lines += [f"{t} {x:.2f} {y:.2f} " for t, x, y in places]
    path.write_text("\n".join([*lines, ""]))
    recording = load(path, length_unit="mm")
    assert body_names(recording) == ["Label", "Label 2"]
    check(recording, bodies=2, step=step)
    with pytest.raises(InputError, match="does not name the unit of its positions"):
        load(path)
    path.write_text("time,x_mm,y_mm\n0:00:00:04,1,2\n0:00:00:08,2,2\n")
    with pytest.raises(InputError, match=r"frames, hundredths or thousandths, so write it as"):
        load(path)


@pytest.mark.parametrize(("unit", "ticks"), [("ds", 1), ("cs", 10)])
def test_tenths_and_hundredths_of_a_second(tmp_path: Path, unit: str, ticks: int) -> None:
    rows = [f"{ticks * k},{PX[k]},{-PY[k] / 10}" for k in range(N)]
    path = tmp_path / "clock.csv"
    path.write_text("\n".join([f"t_{unit},x_mm,y_cm", *rows, ""]))
    check(load(path))  # x and y in different units too
