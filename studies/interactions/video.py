"""Rates of joinings and partings, from videos of blocks whose bonds break: python video.py OUT.

Each of 40 recordings is simulated (four blocks, 240 s, the bundled flow, sigma_F 1.2 mN, bonds that
break at 0.05 /s), drawn as a video (240 x 180 pixels, 5 frames a second, the level moderate),
tracked by `driftwalk track`, and classified by `driftwalk classify`. The truth is the rate of 1000
other runs. OUT keeps the tracks: a study that was stopped goes on where it was. Results are in
results/video.json; with --again they come from the tracks of OUT alone.
"""

from __future__ import annotations

import contextlib
import io
import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr

import driftwalk as dw
from driftwalk.assembly.lattice.joined_faces import JOINING, PARTING
from driftwalk.assembly.outcomes.bond_kinetics import bridges_of
from driftwalk.cli.main import main as driftwalk

RECORDINGS: Final = 40
RUNS_OF_TRUTH: Final = 1000
DURATION_S: Final = 240.0
INTERVAL_S: Final = 0.2
SIDE: Final = "3cm"
LEAST_EVENTS: Final = 1.0
"""Rates with fewer true events in a recording, on average, are left out."""
STUDY: Final = dw.apply_overrides(
    dw.Study(),
    {"forces.force_std_N": 1.2e-3, "assembly.bond_rate_per_s": 0.05, "assembly.blocks": 4},
)
RESULTS: Final = Path(__file__).with_name("results") / "video.json"


def film(run: int, out: Path) -> Path:
    """Draw the video of a run, track it, and return the track."""
    track = out / f"track-{run}.nc"
    if track.exists():
        return track
    path = dw.assembly_path(
        STUDY, dw.tank30_flow(), runs=[run], duration=DURATION_S, sample_interval=INTERVAL_S, seed=1
    )
    level = dw.video_settings("moderate", seed=run)
    small = replace(level, width_px=240, height_px=180, px_per_m=560.0, blur_px=0.4)
    video = dw.write_video(out / f"{run}.mkv", dw.path_recording(path, run=run), small)
    markers = out / "markers.toml"
    if not markers.exists():
        command("markers", "teach", video, "--tank", "30cm", "--side", SIDE, "-o", markers)
    words = ("--markers", markers, "--tank", "30cm", "--bodies", 4, "-o", out / "part.nc")
    command("track", video, *words, "--overwrite")
    video.unlink()
    return (out / "part.nc").rename(track)


def command(*words: object) -> None:
    """Run a command of driftwalk, without what it prints on stdout."""
    with contextlib.redirect_stdout(io.StringIO()):
        code = driftwalk([str(word) for word in words])
    if code:
        raise SystemExit(f"driftwalk {words[0]} failed")


def compare(tracks: list[Path], out: Path) -> dict[str, Any]:
    """Return how often the intervals hold the truth, by class, and the events found and true."""
    flow = dw.tank30_flow()
    told = dw.assemble(STUDY, flow, runs=len(tracks), duration=DURATION_S, seed=1)
    many = dw.assemble(STUDY, flow, runs=RUNS_OF_TRUTH, duration=DURATION_S, seed=2)
    truth = dw.steady_state(many)
    found = []
    for track in tracks:
        words = ("--side", SIDE, "-o", out / "classes.nc", "--overwrite")
        command("classify", track, *words)
        found.append(xr.load_dataset(out / "classes.nc"))
    counted = (("joining", "event", JOINING), ("parting", "split", PARTING))
    totals = {
        kind: {
            "true": int((told["event_kind"] == number).sum()),
            "found": sum(int(one[f"{name}_count"]) for one in found),
        }
        for kind, name, number in counted
    }
    rows = []
    for kind, _, _ in counted:
        for name, count in zip(truth["class"].values, truth[f"{kind}_count"].values, strict=True):
            if count >= LEAST_EVENTS * RUNS_OF_TRUTH:
                at = {"class": name}
                rows.append(_row(kind, name, float(truth[f"{kind}_rate"].sel(at)), found))
    bond = STUDY.assembly.bond_rate_per_s
    rates = [one.attrs["bond_rate_per_s"] for one in found]
    partings = [_bridge_partings(one) for one in found]
    time = sum(count / rate for count, rate in zip(partings, rates, strict=True) if count)
    ends = [(one.attrs["bond_rate_low_per_s"], one.attrs["bond_rate_high_per_s"]) for one in found]
    return {
        "recordings": len(tracks),
        "events": totals,
        "bond_rate": {
            "true_per_s": bond,
            "of_all_per_s": round(sum(partings) / time, 5),
            "events_per_recording": round(float(np.mean(partings)), 2),
            "hold": sum(bool(low <= bond <= high) for low, high in ends),
        },
        "rates": rows,
    }


def _bridge_partings(found: xr.Dataset) -> int:
    """Return the partings in classes without loops."""
    sizes = [bridges_of(str(name)) > 0 for name in found["class"].values]
    return int(found["parting_count"].values[sizes].sum())


def _row(kind: str, name: str, rate: float, found: list[xr.Dataset]) -> dict[str, Any]:
    """Return how a rate was found; a class that a recording never had has no interval."""
    names = [f"{kind}_{what}" for what in ("rate_low", "rate_high", "count")]
    ends = np.array([[float(one[key].sel({"class": name})) for key in names] for one in found])
    seen = np.isfinite(ends[:, 1])
    low, high, count = ends[seen].T
    return {
        "kind": kind,
        "class": str(name),
        "true_per_s": round(rate, 5),
        "events_per_recording": round(float(count.mean()), 2),
        "intervals": int(seen.sum()),
        "hold": int(((low <= rate) & (rate <= high)).sum()),
    }


def main() -> None:
    """Film what is not filmed yet, and write the table."""
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    if "--again" not in sys.argv:
        for run in range(RECORDINGS):
            film(run, out)
    tracks = [out / f"track-{run}.nc" for run in range(RECORDINGS)]
    found = compare([track for track in tracks if track.exists()], out)
    RESULTS.parent.mkdir(exist_ok=True)
    RESULTS.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
