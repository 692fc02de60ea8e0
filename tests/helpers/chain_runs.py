"""Runs of four blocks that follow a chain of known rates: the truth of tests of the kinetics."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import xarray as xr

RATES = {
    ("1+1+1+1", "2+1+1"): 0.03,
    ("2+1+1", "2+2"): 0.006,
    ("2+1+1", "L3+1"): 0.012,
    ("2+2", "O"): 0.005,
    ("2+2", "L"): 0.01,
    ("L3+1", "O"): 0.008,
    ("L3+1", "T"): 0.02,
}
CLASSES = ("O", "T", "L", "L3+1", "2+2", "2+1+1", "1+1+1+1")


def rate_matrix(rates: dict[tuple[str, str], float] = RATES) -> np.ndarray:
    """Return the generator Q of the chain [1/s], shape (class, class)."""
    matrix = np.zeros((len(CLASSES), len(CLASSES)))
    for (start, end), rate in rates.items():
        matrix[CLASSES.index(start), CLASSES.index(end)] = rate
    return matrix - np.diag(matrix.sum(axis=1))


def chain_runs(
    runs: int,
    seed: int,
    *,
    shape: float = 1.0,
    memory: float = 1.0,
    duration: float = 300.0,
    rates: dict[tuple[str, str], float] = RATES,
) -> xr.Dataset:
    """Return runs; the sojourns are Weibull of the same mean, half of the runs `memory` as fast."""
    random = np.random.default_rng([seed, runs])
    matrix = np.maximum(rate_matrix(rates), 0.0)
    now = np.full(runs, CLASSES.index("1+1+1+1"))
    clock = np.zeros(runs)
    speed = np.where(random.random(runs) < 0.5, 1.0, memory)
    time, after = np.full((runs, 3), np.nan), np.full((runs, 3), -1)
    for event in range(3):
        total = matrix[now].sum(axis=1)
        with np.errstate(divide="ignore"):
            lasted = random.weibull(shape, runs) / math.gamma(1.0 + 1.0 / shape) / (total * speed)
        clock = clock + lasted
        share = np.cumsum(matrix[now], axis=1) / np.where(total > 0, total, 1.0)[:, None]
        following = (random.random(runs)[:, None] >= share).sum(axis=1)
        real = (clock <= duration) & (total > 0)
        time[real, event], after[real, event] = clock[real], following[real]
        now = np.where(real, following, now)
        clock[~real] = np.inf
    whole = np.array(["+" not in name for name in CLASSES])
    last = np.nanmax(np.where(np.isnan(time), -1.0, time), axis=1)
    data: dict[str, Any] = {
        "outcome": ("run", now.astype(np.int32)),
        "event_time": (("run", "event"), time),
        "event_class": (("run", "event"), after.astype(np.int32)),
        "end_time": ("run", np.where(whole[now], last, duration)),
    }
    return xr.Dataset(
        data,
        {"class": ("class", np.array(CLASSES, dtype=object))},
        {"kind": "assembly", "schema_version": 1, "blocks": 4, "duration_s": duration},
    )
