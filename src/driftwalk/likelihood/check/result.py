"""The `model_check` dataset: what the check of a fit looked at, and what it concludes."""

from __future__ import annotations

from typing import Any

import numpy as np

from driftwalk.likelihood.check.motion import BAND, Density, MotionComparison
from driftwalk.likelihood.check.place import LocalMeans, Residuals
from driftwalk.likelihood.check.verdict import Criterion, components_of, distance_limit

Parts = tuple[dict[str, Any], dict[str, Any]]


def white_variables(found: Residuals) -> Parts:
    """Return the variables of whiteness and their coordinates."""
    white = found.white
    by_lag, by_component = ("component", "lag"), ("component",)
    data = {
        "autocorrelation": (by_lag, white.autocorrelation),
        "autocorrelation_expected": (by_lag, white.expected),
        "autocorrelation_std": (by_lag, white.std),
        "chi_squared_per_dof": (by_component, white.chi_squared),
        "chi_squared_expected": (by_component, white.expected_chi_squared),
        "excess_kurtosis": (by_component, white.excess_kurtosis),
        "tail_share": (by_component, white.tail_share),
    }
    names = np.array(components_of(len(white.chi_squared)), dtype=object)
    lags = np.arange(1, white.autocorrelation.shape[1] + 1)
    return data, {"component": ("component", names), "lag": ("lag", lags)}


def place_variables(found: Residuals) -> Parts:
    """Return the variables by cell, by part of the recording and by speed."""
    layout = found.layout
    shape = (layout.y.size, layout.x.size)
    plane = ("y", "x")
    place, part = found.place, found.part
    table = part.chi_squared.reshape(layout.parts, -1)
    known = np.isfinite(table)
    count = part.samples.reshape(layout.parts, -1)
    sums = (part.mean * part.samples[:, None]).reshape(layout.parts, layout.cells, -1).sum(axis=1)
    mean = np.where(place.samples[:, None] > 0, place.mean, np.nan).T.reshape(-1, *shape)
    data = {
        "residual": (("component", *plane), mean),
        "residual_count": (plane, place.samples.reshape(shape)),
        "residual_distance": (
            plane,
            np.sqrt(place.chi_squared).reshape(shape),
            {"limit": _limit(place)},
        ),
        "noise_ratio": (plane, found.noise_by_place.ratio.reshape(shape)),
        "noise_ratio_std": (plane, found.noise_by_place.std.reshape(shape)),
        "part_residual": (
            ("part", "component"),
            sums / np.maximum(count.sum(axis=1), 1.0)[:, None],
        ),
        "part_count": ("part", count.sum(axis=1)),
        "part_chi_squared": ("part", np.nansum(table, axis=1)),
        "part_dof": ("part", place.mean.shape[1] * known.sum(axis=1)),
        "part_noise_ratio": ("part", found.noise_by_part.ratio),
        "part_noise_ratio_std": ("part", found.noise_by_part.std),
        "flow_change": ("part", np.where(found.strength.visible, found.strength.change, np.nan)),
        "flow_change_std": ("part", np.where(found.strength.visible, found.strength.std, np.nan)),
        "drag_change": ("speed_range", found.drag.change),
        "drag_change_std": ("speed_range", found.drag.std),
    }
    edges = layout.speed if layout.speed.size > 1 else np.array([np.nan, np.nan])
    coords = {
        "x": ("x", layout.x),
        "y": ("y", layout.y),
        "part_recording": ("part", [layout.recording(part) for part in range(layout.parts)]),
        "part_start": ("part", layout.start),
        "part_end": ("part", layout.end),
        "speed_low": ("speed_range", edges[:-1]),
        "speed_high": ("speed_range", edges[1:]),
    }
    return data, coords


def _limit(place: LocalMeans) -> float:
    """Return what the largest distance of all cells exceeds once in twenty."""
    cells = int(np.isfinite(place.chi_squared).sum())
    return distance_limit(max(cells, 1), place.mean.shape[1])


def motion_variables(
    motion: MotionComparison,
) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """Return distances and densities, their coordinates, and attributes."""
    data: dict[str, Any] = {
        "ks_to_estimate": ("replicate", motion.distance),
        "ks_floor": ("pair", motion.floor),
        "ks_to_drawn": ("drawn_replicate", motion.drawn_distance),
        "ks_between_drawn": ("drawn_replicate", motion.drawn_between),
    }
    coords: dict[str, Any] = {}
    for name, density in (
        ("step_length", motion.step_length),
        ("turning_angle", motion.turning_angle),
    ):
        _add_density(data, coords, name, density)
    low, high = np.quantile(motion.distance, [0.5 * (1 - BAND), 0.5 * (1 + BAND)])
    attrs = {
        "ks_distance": float(np.median(motion.distance)),
        "ks_distance_interval": [float(low), float(high)],
        "ks_noise_floor": float(np.median(motion.floor)),
        "ks_noise_floor_upper": float(np.quantile(motion.floor, 0.95)),
        "ks_p_value": motion.p_value,
        "ks_rank_p_value": motion.rank_p_value,
        "band": BAND,
    }
    return data, coords, attrs


def _add_density(data: dict[str, Any], coords: dict[str, Any], name: str, density: Density) -> None:
    for part in ("recording", "median", "low", "high"):
        data[f"{name}_density_{part}"] = (f"{name}_bin", getattr(density, part))
    coords[f"{name}_edge"] = (f"{name}_edge", density.edge)


def criterion_variables(criteria: list[Criterion]) -> Parts:
    """Return the p values of the criteria and which of them failed."""
    data = {
        "p_value": ("criterion", [one.p_value for one in criteria]),
        "failed": ("criterion", np.array([one.failed for one in criteria], dtype=np.int8)),
    }
    names = np.array([one.name for one in criteria], dtype=object)
    return data, {"criterion": ("criterion", names)}
