"""The flow estimator on the simulated tank with known flow, and on every real recording."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from driftwalk.flow import extract_flow, load_flow
from driftwalk.record import load
from driftwalk.schema import FLAGS, check_flow_field

BLOCK = {"mass": 0.0116, "side": 0.03}
Data = Callable[[str], Path]


def relative_error(flow: xr.Dataset, truth: xr.Dataset, *, min_count: int = 3) -> float:
    """Return rms(flow - truth) / rms(truth) over the cells with enough samples."""
    chosen = flow["count"].values >= min_count
    difference = np.stack([flow[name].values - truth[name].values for name in ("u", "v")])
    exact = np.stack([truth[name].values for name in ("u", "v")])
    return float(np.sqrt(np.sum(difference[:, chosen] ** 2) / np.sum(exact[:, chosen] ** 2)))


@pytest.fixture(scope="module")
def truth() -> xr.Dataset:
    return load_flow(bundled("flow_true.csv"))


def bundled(name: str) -> str:
    from importlib.resources import files

    return str(files("driftwalk.datasets") / "tank30_ode_a" / name)


def test_error_on_the_tank_with_known_flow(truth: xr.Dataset) -> None:
    """17.4 % as measured; without the correction 54 %."""
    xr.testing.assert_identical(truth.x.drop_attrs(), truth.x.round(3).drop_attrs())
    track = load(bundled("recording.csv"), tank="circle:0.3")
    flow = extract_flow(track, **BLOCK)
    assert 0.15 < relative_error(flow, truth) < 0.185
    assert np.count_nonzero(flow["count"] >= 3) > 550
    assert 0.5 < relative_error(extract_flow(track, inertia="none"), truth) < 0.6


def test_noise_costs_little_with_smoothing_and_much_without(truth: xr.Dataset) -> None:
    noisy, clean = (
        load(bundled(name), tank="circle:0.3")
        for name in ("recording.csv", "without_tracking_noise.csv")
    )
    smoothed = [relative_error(extract_flow(track, **BLOCK), truth) for track in (noisy, clean)]
    assert abs(smoothed[0] - smoothed[1]) < 0.01
    # 5 samples, the shortest window that has a fit.
    short = relative_error(extract_flow(noisy, window=0.4, **BLOCK), truth)
    assert short > smoothed[0] + 0.005


def test_standard_errors_are_of_the_size_of_the_scatter() -> None:
    """Two realisations differ by noise alone: z of their difference is about standard normal."""
    one, two = (
        extract_flow(load(bundled(name), tank="circle:0.3"), **BLOCK)
        for name in ("recording.csv", "recording_second_seed.csv")
    )
    spread = np.hypot(one.u_standard_error, two.u_standard_error)
    chosen = ((one["count"] >= 20) & (two["count"] >= 20) & np.isfinite(spread)).values
    z = ((one.u - two.u) / spread).values[chosen]
    assert chosen.sum() > 100
    assert 0.7 < np.sqrt(np.median(z**2) / 0.4549) < 1.4


REAL: list[tuple[str, str, dict[str, Any], dict[str, Any]]] = [
    (
        "rummynose-single-epfl",
        "rummy_single_seven_trajectories.txt",
        {"frame_rate": 25.0, "metres_per_pixel": 0.00075, "tank": "fit", "max_speed": 2.0},
        {"inertia": "none"},
    ),
    (
        "hexbug-gatech",
        "training_video1-centroid_data",
        {"frame_rate": 30.0, "metres_per_pixel": 0.001, "tank": "rect:0.9x0.42@0.422,-0.268"},
        {"inertia": "none"},
    ),
    (
        "smarticles-rattling",
        "destab_driveA_100pc_0_noisevar_10_randdur_600.csv",
        {"metres_per_pixel": 0.001, "tank": "fit"},
        {"inertia": "none", "body": "all"},
    ),
    (
        "tracktor-mouse-termite",
        "mouse_video_tracked.csv",
        {"frame_rate": 30.0, "metres_per_pixel": 0.001, "tank": "fit"},
        {"inertia": "none"},
    ),
    (
        "tracktor-mouse-termite",
        "termite_video_tracked.csv",
        {"frame_rate": 60.0, "metres_per_pixel": 0.0001, "tank": "fit"},
        {"inertia": "none", "body": "all"},
    ),
]


@pytest.mark.parametrize(("folder", "name", "how", "options"), REAL, ids=[r[1][:20] for r in REAL])
def test_real_recordings_give_a_field(
    folder: str, name: str, how: dict[str, Any], options: dict[str, Any], shared_data: Data
) -> None:
    track = load(shared_data(folder) / name, **how)
    flow = check_flow_field(extract_flow(track, cells=30, **options))
    measured = flow.flag.values == FLAGS["measured"]
    assert measured.sum() > 50
    total = flow.attrs["samples_used"] + flow.attrs["samples_outside_tank"]
    assert flow["count"].sum() == flow.attrs["samples_used"]
    present = int(np.isfinite(track.x).sum())
    assert total + flow.attrs["samples_without_derivative"] == present
    assert flow.attrs["samples_used"] > 0.8 * present
    speed = np.hypot(flow.u, flow.v).values
    assert speed.max() <= speed[measured].max() * (1 + 1e-6)
