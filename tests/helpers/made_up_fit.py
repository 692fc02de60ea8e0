"""A fit and its check for the tests of pages, made up: nothing was fitted."""

from __future__ import annotations

import numpy as np
import xarray as xr
from synthetic_calibration import ARENA, bundled_flow

from driftwalk.schema.answers.facts import fit_parts
from driftwalk.schema.answers.verdict import verdict_of, verdict_variables

LAGS, CELLS, PARTS, BINS = 5, 4, 4, 6


def made_up_fit(*, flows: tuple[str, ...] = ()) -> xr.Dataset:
    """Return a `fit`, with a flow for each name where names are given."""
    flow = bundled_flow()[["u", "v", "flag", "count"]]
    error = xr.full_like(flow["u"], 2e-3)
    fit = flow.assign(u_standard_error=error, v_standard_error=error)
    if flows:
        fit = fit.expand_dims(flow=np.array(flows, dtype=object))
    answer = {"drag_coefficient": 0.39, "force_std_N": 6e-4, "tracking_noise_m": 3e-4}
    answer["force_noise_intensity_N2_s"] = 6e-4**2 * 0.016
    numbers, names, _ = fit_parts(
        {
            **answer,
            **{f"{name}_interval": [0.9 * v, 1.1 * v] for name, v in answer.items()},
            "confidence": 0.9, "force_interval_s": 0.016, "samples": 1000, "samples_used": 990,
            "duration_s": 600.0, "recordings": 2, "wall_share": 0.01, "visited_share": 0.65,
            "chi_squared_per_dof": 1.02, "warnings": ["the block was rarely in the middle"],
        }
    )  # fmt: skip
    words = {"source": "recording.csv", "simulated_recording": "no", "arena": ARENA}
    return fit.assign(numbers).assign_coords(names).assign_attrs(words, kind="fit")


def made_up_check(*against: str) -> xr.Dataset:
    """Return a `model_check` of two recordings, with sentences against the model."""
    generator = np.random.default_rng(1)
    plane = ("y", "x")
    data = {
        "p_value": ("criterion", [0.5, 0.0001]),
        "failed": ("criterion", np.array([0, 1], np.int8)),
        "detectable": ("criterion", [0.09, 0.01]),
        "detectable_of": ("criterion", np.array(["autocorrelation at one lag", "relative change"])),
        "autocorrelation": (("component", "lag"), 0.01 * generator.normal(size=(2, LAGS))),
        "autocorrelation_expected": (("component", "lag"), np.full((2, LAGS), -0.002)),
        "autocorrelation_std": (("component", "lag"), np.full((2, LAGS), 0.01)),
        "residual_distance": (plane, generator.uniform(0.5, 5.0, (CELLS, CELLS)), {"limit": 3.8}),
        "noise_ratio": (plane, generator.uniform(0.9, 1.1, (CELLS, CELLS))),
        "noise_ratio_std": (plane, np.full((CELLS, CELLS), 0.05)),
        "flow_change": ("part", [0.01, -0.02, 0.03, 0.0]),
        "flow_change_std": ("part", np.full(PARTS, 0.01)),
        "part_noise_ratio": ("part", [1.0, 1.1, 0.9, 1.0]),
        "part_noise_ratio_std": ("part", np.full(PARTS, 0.02)),
        "drag_change": ("speed_range", [0.1, -0.1]),
        "drag_change_std": ("speed_range", [0.05, 0.05]),
    }
    coords = {
        "criterion": np.array(["autocorrelation", "flow_change"], dtype=object),
        "component": np.array(["x", "y"], dtype=object),
        "lag": np.arange(1, LAGS + 1),
        "x": ("x", 0.02 * np.arange(float(CELLS))),
        "y": ("y", 0.02 * np.arange(float(CELLS))),
        "part_recording": ("part", [0, 0, 1, 1]),
        "part_start": ("part", [0.0, 60.0, 0.0, 60.0]),
        "part_end": ("part", [60.0, 120.0, 60.0, 120.0]),
        "speed_low": ("speed_range", [0.0, 0.02]),
        "speed_high": ("speed_range", [0.02, 0.05]),
    }
    for name, top in (("step_length", 0.006), ("turning_angle", np.pi)):
        coords[f"{name}_edge"] = (f"{name}_edge", np.linspace(-top, top, BINS + 1))
        for part, factor in (("recording", 1.0), ("median", 1.2), ("low", 0.9), ("high", 1.4)):
            data[f"{name}_density_{part}"] = (f"{name}_bin", np.full(BINS, factor))
    facts = {"ks_distance": 0.05, "ks_noise_floor": 0.02, "level": 0.002, "band": 0.9}
    data |= verdict_variables(verdict_of(against, []))
    attrs = {"kind": "model_check", "arena": ARENA}
    return xr.Dataset(data, coords, attrs | facts)
