"""Write a sample page to look at while developing: ``python sample.py RUN [ASSEMBLY] -o page.html``.

For development only. RUN is a folder with a finished calibration; ASSEMBLY one of an assembly study.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from driftwalk.report.page_arrays import encode_array, plain_list
from driftwalk.schema import FLAGS

ORIGIN = {FLAGS["measured"]: 0, FLAGS["filled"]: 1, FLAGS["outside"]: 2}
STATIC = Path(__file__).parents[2] / "src/driftwalk/report/static"
Section = dict[str, Any]


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser()
    parser.add_argument("run", type=Path)
    parser.add_argument("assembly", type=Path, nargs="?")
    parser.add_argument("-o", type=Path, default=Path("page.html"))
    given = parser.parse_args()
    sections = calibration_sections(given.run)
    if given.assembly is not None:
        import sample_assembly

        sections += sample_assembly.assembly_sections(given.assembly)
    page = {
        "format": "driftwalk page",
        "version": 1,
        "view": "report",
        "title": "Calibration of recording.csv",
        "subtitle": "tank of 30 cm, one block of 3 cm",
        "state": {"finished": True, "progress": None, "words": None},
        "driftwalk_version": "0.1.0",
        "created_utc": "2026-01-01T00:00:00Z",
        "sections": sections,
    }
    given.o.write_text(document(page), encoding="utf-8")


def document(page: dict[str, Any]) -> str:
    """Return the HTML with everything inline."""
    data = json.dumps(page, allow_nan=False, default=float)
    for letter in "<>&\u2028\u2029":
        data = data.replace(letter, f"\\u{ord(letter):04x}")
    css, js = ((STATIC / f"driftwalk.{kind}").read_text() for kind in ("css", "js"))
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; "
        "script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:\">"
        f"<title>driftwalk</title><style>{css}</style></head><body>"
        f'<script type="application/json" id="driftwalk-page">{data}</script>'
        f"<script>{js}</script></body></html>"
    )


def calibration_sections(run: Path) -> list[Section]:
    """Return the sections of a calibration."""
    calibration = xr.load_dataset(run / "calibration.nc")
    flow = xr.load_dataset(run / "flow.nc")
    recording = xr.load_dataset(run / "recording.nc")
    return [
        summary_section(calibration),
        {
            "id": "warnings", "kind": "warnings", "title": "Warnings", "note": None,
            "items": ["The distance is 1.5 times the noise floor: C_d and σ_F explain most, not all."],
        },
        trajectory_section(recording),
        flow_section(flow),
        map_section(calibration, recording),
    ]  # fmt: skip


def summary_section(calibration: xr.Dataset) -> Section:
    """Return the summary."""
    a = calibration.attrs
    interval = {"confidence": 0.9, "note": None}
    drag, force = a["drag_coefficient_interval"], a["force_std_N_interval"]
    return {
        "id": "summary", "kind": "summary", "title": "Summary", "note": None,
        "paragraphs": [
            "One block of 3 cm drifted for 1800 s in a round tank of 30 cm. Its motion was simulated "
            "with 81 settings of the drag coefficient C_d and the stochastic force σ_F, and each "
            "compared with the recording by the two-dimensional Kolmogorov-Smirnov distance D of step "
            "lengths and turning angles."
        ],
        "numbers": [
            {"label": "drag coefficient", "symbol": "C_d", "value": a["drag_coefficient"], "unit": "1",
             "low": drag[0], "high": drag[1], **interval},
            {"label": "stochastic force", "symbol": "σ_F", "value": a["force_std_N"], "unit": "N",
             "low": force[0], "high": force[1], "confidence": 0.9, "note": "drawn anew every 16 ms"},
            {"label": "distance of the best model", "symbol": "D", "value": a["ks_distance"],
             "unit": "1", "low": None, "high": None, "confidence": None, "note": "± 0.0028"},
            {"label": "noise floor", "symbol": "", "value": a["noise_floor"], "unit": "1",
             "low": None, "high": None, "confidence": None,
             "note": "distance between two runs of one model"},
            {"label": "noise of the tracking", "symbol": "", "value": a["position_noise_m"],
             "unit": "m", "low": None, "high": None, "confidence": None, "note": None},
            {"label": "steps compared", "symbol": "", "value": a["recording_pairs"], "unit": "1",
             "low": None, "high": None, "confidence": None, "note": None},
        ],
    }  # fmt: skip


def trajectory_section(recording: xr.Dataset) -> Section:
    """Return the recording, with a gap that is not in it."""
    time, x, y = (recording[name].values.reshape(-1).copy() for name in ("time", "x", "y"))
    x[6000:6400] = y[6000:6400] = np.nan
    speed = np.hypot(np.diff(x), np.diff(y)) / np.diff(time)
    density, edges = np.histogram(speed[np.isfinite(speed)], bins=40, density=True)
    return {
        "id": "recording", "kind": "trajectory", "title": "The recording",
        "note": "Positions of the block's centre, 10 a second.",
        "arena": json.loads(recording.attrs["arena"]),
        "time": encode_array(time, dtype="i4", resolution=1e-4, delta=True),
        "x": encode_array(x, dtype="i2", resolution=1e-5, delta=True),
        "y": encode_array(y, dtype="i2", resolution=1e-5, delta=True),
        "theta": None,
        "gaps": [[600.0, 640.0]],
        "speed": {"edges": plain_list(edges), "density": plain_list(density)},
        "facts": [
            {"label": "positions", "value": 18001, "unit": "1"},
            {"label": "duration", "value": 1800.0, "unit": "s"},
            {"label": "rate", "value": 10.0, "unit": "Hz"},
            {"label": "gaps", "value": 1, "unit": "1"},
            {"label": "mean speed", "value": float(np.nanmean(speed)), "unit": "m/s"},
            {"label": "tracking noise", "value": 0.0003, "unit": "m", "low": 0.00029,
             "high": 0.00031, "note": "estimated from the recording, ± standard error"},
        ],
    }  # fmt: skip


def flow_section(flow: xr.Dataset) -> Section:
    """Return the flow."""
    return {
        "id": "flow", "kind": "flow", "title": "The flow",
        "note": "65.2 % of the nodes in the tank are measured, the others filled.",
        "arena": json.loads(flow.attrs["arena"]),
        "x": plain_list(flow["x"].values), "y": plain_list(flow["y"].values),
        "u": encode_array(flow["u"].values), "v": encode_array(flow["v"].values),
        "origin": encode_array(np.array([ORIGIN[f] for f in flow["flag"].values.flat]).reshape(flow["flag"].shape), dtype="u1"),
        "count": encode_array(flow["count"].values),
        "standard_error": encode_array(flow["u_standard_error"].values),
    }  # fmt: skip


def map_section(calibration: xr.Dataset, recording: xr.Dataset) -> Section:
    """Return the map, with two failures that are not in it."""
    order = ("drag_coefficient", "force_std")
    c = calibration.transpose(*order, ...)
    status = c["status"].values.astype(float)
    value = c["ks_distance"].values.copy()
    status[0, :2], value[0, :2] = 1, 1.0
    status[8, 0], value[8, 0] = 2, np.nan
    best = np.unravel_index(np.nanargmin(value), value.shape)
    r = {"refined_drag_coefficient": "y", "refined_force_std": "x"}
    n = c.sizes["excerpt_sample"]
    return {
        "id": "map", "kind": "map", "title": "How well each setting fits",
        "note": "Score 1 − D of every setting. The force is drawn anew every 16 ms.",
        "x": {"name": "force_std", "label": "stochastic force σ_F", "unit": "N",
              "values": c["force_std"].values.tolist()},
        "y": {"name": "drag_coefficient", "label": "drag coefficient C_d", "unit": "1",
              "values": c["drag_coefficient"].values.tolist()},
        "value": encode_array(value),
        "standard_error": encode_array(c["ks_distance_standard_error"].values),
        "status": encode_array(status, dtype="i2"),
        "statuses": {"1": "no motion", "2": "not finite"},
        "best": {"x": float(c["force_std"][best[1]]), "y": float(c["drag_coefficient"][best[0]]),
                 "value": float(value[best])},
        "found": {"x": c.attrs["force_std_N"], "y": c.attrs["drag_coefficient"]},
        "noise_floor": c.attrs["noise_floor"],
        "noise_floor_upper": c.attrs["noise_floor_upper"],
        "region": {"x": c["region_force_std"].values.tolist(),
                   "y": c["region_drag_coefficient"].values.tolist(), "confidence": 0.9},
        "refined": {
            "x": c["refined_force_std"].values.tolist(),
            "y": c["refined_drag_coefficient"].values.tolist(),
            "value": encode_array(c["refined_ks_distance"].transpose(*r).values),
        },
        "cells": {
            "excerpt_time": encode_array(c["excerpt_time"].values),
            "excerpt_x": encode_array(c["excerpt_x"].values, dtype="i2", resolution=1e-5, delta=True),
            "excerpt_y": encode_array(c["excerpt_y"].values, dtype="i2", resolution=1e-5, delta=True),
            "density": encode_array(c["step_density"].values, dtype="i2", resolution=4e-5),
            "ks_step_length": encode_array(c["ks_step_length"].values.mean(axis=-1)),
            "ks_turning_angle": encode_array(c["ks_turning_angle"].values.mean(axis=-1)),
        },
        "recording": {
            "density": encode_array(c["recording_step_density"].values),
            "step_length_edges": c["step_length_edge"].values.tolist(),
            "turning_angle_edges": c["turning_angle_edge"].values.tolist(),
            "excerpt_x": encode_array(recording["x"].values[:n, 0]),
            "excerpt_y": encode_array(recording["y"].values[:n, 0]),
        },
        "arena": json.loads(recording.attrs["arena"]),
    }  # fmt: skip


if __name__ == "__main__":
    main()
