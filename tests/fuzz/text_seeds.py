"""One small valid recording of every format of plain text, and the options that it needs."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

PIXELS = ("--scale", "0.001")
FRAMES = ("--fps", "10", *PIXELS)


def text_files() -> Iterator[tuple[str, dict[str, str], tuple[str, ...]]]:
    """Yield kind, files by name, of which the first is the recording, and options."""
    time = 0.1 * np.arange(40)
    x, y = 0.1 * np.cos(0.3 * time), 0.1 * np.sin(0.5 * time)
    rows = [*zip(range(40), time, x, y, strict=True)]
    texts: dict[str, tuple[str, str, tuple[str, ...]]] = {
        "plain": ("a.csv", "t_s,x_m,y_m,theta_rad\n", ()),
        "bodies": ("b.csv", "t_s;x_m;y_m;id\n", ()),
        "headless": ("c.txt", "", ("--columns", "t=1,x=2,y=3", "--length-unit", "m")),
        "tracks": ("track_00000003.txt", "%Frame Number\tx (image)\ty (image)\tx (world)\ty (world)"
                   "\tArea\tOrientation\tCompactness\tTimeStamp (ms)\n", ()),
        "tracks-new": ("track00000003.csv", "% Frame number, x, y\n", FRAMES),
        "particles": ("particles.csv", "% Frame number, Time, X (image), Y (image), X (world), Y "
                      "(world), Area, Orientation, Compactness\t\n", ()),
        "nmea": ("log.txt", "", FRAMES),
        "idtracker": ("trajectories.txt", "X1\tY1\tProbId1\tX2\tY2\tProbId2\t\n", FRAMES),
        "toxtrac": ("tracking.txt", "", FRAMES),
        "ubitrail": ("tracks.csv", "'list(Global=c(Date=\"2013\"),Areas=matrix(c(200,190,407,252,"
                     "100,197,212,242),4,2,dimname=list(c(\"W\",\"H\",\"X\",\"Y\"),c(\"05\",\"04\""
                     "))))'\nArea,Territory,X,Y,time,L\n", PIXELS),
        "smarticles": ("robots.csv", "", PIXELS),
        "tracktor": ("tracked.csv", ",frame,pos_x,pos_y,id\n", FRAMES),
        "dltdv": ("xypts.csv", "pt1_cam1_X,pt1_cam1_Y\n", FRAMES),
        "points": ("points.json", "", FRAMES),
        "timed-points": ("points.json", "", ("--length-unit", "cm")),
        "kinovea": ("paths.txt", "#Kinovea Trajectory data export\n#T X Y\n\n# Label\n",
                    ("--length-unit", "mm")),
        "coco": ("boxes.json", "", FRAMES),
        "matrix": ("x.csv", "", ("--y", "@/y.csv", "--fps", "10")),
    }  # fmt: skip
    lines: dict[str, Callable[..., str]] = {
        "plain": lambda k, t, x, y: f"{t:.1f},{x:.5f},{y:.5f},{t:.3f}",
        "bodies": lambda k, t, x, y: f"{t:.1f};{x:.5f};{y:.5f};a\n{t:.1f};{y:.5f};{x:.5f};b",
        "headless": lambda k, t, x, y: f"{t:.1f} {x:.5f} {y:.5f}",
        "tracks": lambda k, t, x, y: f"{k}\t1\t2\t{x:.5f}\t{y:.5f}\t9\t{t:.2f}\t1e-05\t{k * 100}",
        "tracks-new": lambda k, t, x, y: f"{k}\t{1e3 * x:.2f}\t{1e3 * y:.2f}",
        "particles": lambda k, t, x, y: (
            f"{k}\t2022-05-01T12:00:{k:02}.000\t1\t2\t{x:.5f}\t{y:.5f}\t9\t0.5\t0.1"
        ),
        "nmea": lambda k, t, x, y: f"$FRAMENUMBER,{k}\n$PARTICLE,4,1,2,{t:.2f},{x:.5f},{y:.5f}",
        "idtracker": lambda k, t, x, y: f"{1e3 * x:.2f}\t{1e3 * y:.2f}\tNaN\t{k}\t7\t1",
        "toxtrac": lambda k, t, x, y: f"{k}\t0\t1\t{1e3 * x:.1f}\t{1e3 * y:.1f}\t1",
        "ubitrail": lambda k, t, x, y: f"05,255,{0.5 + x:.4f},{0.5 + y:.4f},{100 * k},-11",
        "smarticles": lambda k, t, x, y: f"{t:.1f},{k},511,{k + 9},0.7,530,462,2.7,596,414,5.9",
        "tracktor": lambda k, t, x, y: f"{k},{k}.0,{1e3 * x:.1f},{1e3 * y:.1f},A",
        "dltdv": lambda k, t, x, y: f"{1e3 * x:.2f},{1e3 * y:.2f}",
        "kinovea": lambda k, t, x, y: f"0:00:{k:02}:{k:02} {1e3 * x:.2f} {1e3 * y:.2f} ",
        "matrix": lambda k, t, x, y: f"{x:.5f},{y:.5f}",
    }
    for kind, (name, head, options) in texts.items():
        if kind == "points":
            content = "[" + ", ".join(f"[{100 * a:.3f}, {100 * b:.3f}]" for *_, a, b in rows) + "]"
        elif kind == "timed-points":
            points = (f'{{"t": {t:.1f}, "x": {a:.4f}, "y": {b:.4f}}}' for _, t, a, b in rows)
            content = "[" + ",\n".join(points) + "]"
        elif kind == "coco":
            sides = (f"[{500 + 1e3 * a:.2f}, {500 + 1e3 * b:.2f}, 9, 9]" for *_, a, b in rows)
            boxes = (f'{{"image_id": {k}, "bbox": {box}}}' for k, box in enumerate(sides))
            content = "[" + ",\n".join(boxes) + "]"
        else:
            content = head + "".join(lines[kind](*row) + "\n" for row in rows)
        yield kind, {name: content} | ({"y.csv": content} if kind == "matrix" else {}), options
