"""A real video: one dark mouse in a bright round arena, beside its published track."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr
from commands import driftwalk_json

PX_PER_M: Final = 500.0
"""8 cm for a mouse of 40 px without its tail, as in studies/real/mouse.toml: not in the video."""
SIZE_PX: Final = (640, 480)
FRAMES_PER_S: Final = 30.0
FAR_PX: Final = 20.0
"""Half a mouse."""
TRACK: Final = ("--markers", "blob", "--scale", f"{PX_PER_M:g}px/m", "--bodies", "1")
STUDY: Final = ("--study", Path(__file__).with_suffix(".toml"))


def track_mouse(out: Path, video: Path, published: Path) -> dict[str, Any]:
    """Track the mouse, and let the other commands run on the result as it is."""
    recording = out / "recordings" / "mouse.nc"
    recording.parent.mkdir(exist_ok=True)
    said, seconds = driftwalk_json("track", video, *TRACK, "-o", recording, "--overwrite")
    tracked = {
        "counts": said["counts"],
        "frames_per_s": said["frames_per_s"],
        "seconds": round(seconds, 1),
    }
    return beside_published(recording, published) | tracked | then(recording)


def then(recording: Path) -> dict[str, Any]:
    """Run what comes after tracking on a recording, unedited."""
    flow, run = recording.with_name("mouse-flow.nc"), recording.with_name("mouse-calibration")
    commands = {
        "info": ("info", recording),
        "flow": ("flow", recording, *STUDY, "-o", flow, "--overwrite"),
        "calibrate": ("calibrate", recording, *STUDY, "-o", run, "--overwrite"),
    }
    found = {}
    for name, words in commands.items():
        said, seconds = driftwalk_json(*words)
        said = {key: value for key, value in said.items() if key not in ("out", "path")}
        found[name] = said | {"seconds": round(seconds, 1)}
    return found


def beside_published(recording: Path, published: Path) -> dict[str, Any]:
    """Return how far a track is from the published one, in pixels of the video.

    A stale frame, the same picture as the one before, has no sample and is counted as such.
    """
    found = xr.load_dataset(recording)
    frame = np.rint(found["time"].values * FRAMES_PER_S).astype(int)
    x, y = np.loadtxt(published, delimiter=",", skiprows=1)[:, 2:].T
    column = (SIZE_PX[0] - 1) / 2 + found["x"].values[:, 0] * PX_PER_M - x[frame]
    row = (SIZE_PX[1] - 1) / 2 - found["y"].values[:, 0] * PX_PER_M - y[frame]
    seen = np.isfinite(column)
    away = np.hypot(column, row)[seen]
    return {
        "frames_published": int(x.size),
        "frames": int(seen.size),
        "lost": int((~seen).sum()),
        "far": int((away > FAR_PX).sum()),
        "columns": int(found.sizes["body"]),
        "median_px": float(np.median(away)),
        "ninety_px": float(np.quantile(away, 0.9)),
        "worst_px": float(away.max()),
        "column_bias_px": float(np.median(column[seen])),
        "row_bias_px": float(np.median(row[seen])),
    }
