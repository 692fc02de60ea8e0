"""The fit of tracked poses, beside that of the true poses with noise as large."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from commands import driftwalk_json
from scenes import Scene
from score import poses_of

from driftwalk.record import save_trajectory
from driftwalk.schema import build_trajectory

if TYPE_CHECKING:
    import xarray as xr

TANK: Final = ("--tank", "30cm")
ANGLES: Final = ("auto", "given")
PARAMETERS: Final = ("drag_coefficient", "force_std_N")
KEPT: Final = (
    *PARAMETERS, "drag_coefficient_interval", "force_std_N_interval", "tracking_noise_m",
    "tracking_noise_m_interval", "angle", "wall_share", "autocorrelation", "warnings",
)  # fmt: skip
NOISES: Final = 2
"""Drawings of noise for the true poses: how far they are apart is what noise alone makes."""


def close_loop(
    scene: Scene, motion: xr.Dataset, recording: Path, found: dict[str, Any]
) -> dict[str, Any]:
    """Fit the tracked and the true poses, and say how they differ."""
    sizes = found["position_sd_per_axis_mm"] * 1e-3, np.radians(found["angle_sd_deg"])
    twins = []
    for number in range(NOISES):
        twin = recording.with_name(f"{scene.name}-noise-{number}.nc")
        noisy = with_noise(motion, *sizes, seed=1000 * scene.seed + number)
        twins.append(save_trajectory(noisy, twin, existing="replace"))
    fits = {}
    for angle in ANGLES:
        tracked = fit(recording, angle)
        true = [fit(twin, angle) for twin in twins]
        fits[angle] = beside(tracked, true, found["position_sd_per_axis_mm"])
    return {"fits": fits}


def with_noise(motion: xr.Dataset, position: float, angle: float, *, seed: int) -> xr.Dataset:
    """Return the true poses with Gaussian noise [m], [rad]."""
    poses = poses_of(motion)
    noise = np.random.default_rng(seed).normal(size=poses.shape) * (position, position, angle)
    x, y, theta = np.moveaxis(poses + noise, -1, 0)
    return build_trajectory(motion["time"].values, x, y, theta, attrs=dict(motion.attrs))


def fit(recording: Path, angle: str) -> dict[str, Any]:
    """Fit a recording on the command line."""
    folder = recording.with_name(f"{recording.stem}-fit-{angle}")
    words = (recording, *TANK, "--angle", angle, "-o", folder, "--overwrite")
    said, seconds = driftwalk_json("fit", *words)
    verdict = {key: said[key] for key in said if key.startswith("model_")}
    return {key: said[key] for key in KEPT} | verdict | {"seconds": round(seconds, 1)}


def beside(tracked: dict[str, Any], true: list[dict[str, Any]], noise_mm: float) -> dict[str, Any]:
    """Return both fits, and how far the tracked one is from the first of the true ones."""
    line: dict[str, Any] = {"tracked": tracked, "true": true}
    for name in PARAMETERS:
        line[f"{name}_difference"] = tracked[name] / true[0][name] - 1.0
        line[f"{name}_difference_of_true"] = true[1][name] / true[0][name] - 1.0
    found_mm = 1e3 * tracked["tracking_noise_m"]
    line["tracking_noise_difference_mm"] = found_mm - noise_mm
    line["tracking_noise_difference"] = found_mm / noise_mm - 1.0
    return line
