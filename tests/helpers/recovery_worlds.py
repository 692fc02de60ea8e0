"""Recovery studies for tests: a small real one, and a synthetic dataset without any fit."""

from __future__ import annotations

import numpy as np
import xarray as xr

from driftwalk.likelihood.recovery import FACTS, FLOW_PARTS, PARTS
from driftwalk.likelihood.score import add_summary
from driftwalk.model import Study
from driftwalk.schema.kinds.recovery import RECOVERED

TRUTH = {"drag_coefficient": 0.4, "force_std_N": 6e-4, "tracking_noise_m": 3e-4}
SD = 0.1


def small_study(**recover: object) -> Study:
    """Return a study of one-minute recordings with knots 3 cm apart: a fit takes half a second."""
    return Study(
        forces={"drag_coefficient": 0.4, "force_std_N": 6e-4, "force_interval_s": 0.01},
        observation={"position_noise_m": "0.3mm", "orientation_noise_rad": "0.5deg"},
        fit={"spline_spacing_m": 0.03, "angle": "given"},
        recover={"recordings": 2, "durations_s": [60.0], **recover},
    )


def synthetic_recovery(
    *, recordings: int = 30, durations: tuple[float, ...] = (600.0, 2400.0), seed: int = 1
) -> xr.Dataset:
    """Return a study whose estimates are drawn: C_d with spread 3 / sqrt(T), 10 % stated."""
    generator = np.random.default_rng(seed)
    angles = ("given", "none")
    dims = ("duration", "angle", "recording")
    shape = (len(durations), len(angles), recordings)
    length = np.array(durations)[:, None, None]
    data: dict[str, tuple[tuple[str, ...], np.ndarray]] = {}
    for name, truth in zip(RECOVERED, TRUTH.values(), strict=True):
        off = generator.normal(size=shape) * 3.0 / np.sqrt(length)
        value = truth * np.exp(off)
        ends = [value * np.exp(side * 1.645 * SD) for side in (-1, 1)]
        parts = (
            *(value, *ends, np.full(shape, SD), value / truth - 1.0, off / SD),
            ((ends[0] <= truth) & (truth <= ends[1])).astype(float),
        )
        data |= {f"{name}{part}": (dims, array) for part, array in zip(PARTS, parts, strict=True)}
    for name in (*FLOW_PARTS, *FACTS):
        data[name] = (dims, generator.uniform(0.01, 0.1, shape))
    used = np.ones(shape, np.int8)
    used[:, :, 0] = 0
    data["used"] = (dims, used)
    data["wall_share"][1][:, :, 0] = 0.5
    data["status"] = (dims, np.zeros(shape, np.int32))
    data["message"] = (dims, np.full(shape, "", dtype=object))
    coords = {
        "duration": np.array(durations),
        "angle": np.array(angles, dtype=object),
        "recording": np.arange(recordings),
    }
    attrs = {
        **TRUTH,
        **{"kind": "recovery", "confidence": 0.9, "force_interval_s": 0.01, "flow": "drawn"},
        **{"needed_confidence": 0.9, "most_wall_share": 0.3, "coverage_confidence": 0.95},
        **{"drag_coefficient_precision": 0.05, "sample_interval_s": 0.1, "seed": 1},
        **{"recordings_per_fit": 1, "missing_share": 0.0},
    }
    return add_summary(xr.Dataset(data, coords=coords, attrs=attrs))
