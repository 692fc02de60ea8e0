"""Facts of a motion that no model is fitted to: how far it gets, how long its speed lasts."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from driftwalk.comparison.aspects import AspectPlan, WallDistance, resampled
from driftwalk.core.arrays import Bools, Floats, Integers

LAGS: Final = (1, 3, 10, 30, 100)
"""Of the mean squared displacement, in step intervals."""
CHECKS: Final = (*(f"displacement_{lag}" for lag in LAGS), "speed_time", "wall_share", "rest_share")
UNITS: Final = (*("m2" for _ in LAGS), "s", "1", "1")


def motion_checks(
    plan: AspectPlan,
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    *,
    wall: WallDistance,
    depth: float,
    usual_step: float,
) -> Floats:
    """Return facts of a motion, shape (checks,); NaN where it is too short for one."""
    px, py = resampled(plan.short, x), resampled(plan.short, y)
    there = np.zeros(px.size - 1, dtype=bool)
    there[plan.step] = True
    there &= np.isfinite(np.diff(px)) & np.isfinite(np.diff(py))
    broken = np.concatenate([[0], np.cumsum(~there)])
    length = np.hypot(np.diff(px), np.diff(py))
    found = [_squared_displacement(px, py, broken, lag) for lag in LAGS]
    found.append(_memory(length, there) * plan.short.step_interval)
    steps = length[there]
    if not steps.size:
        return np.full(len(CHECKS), np.nan)
    near = wall(px, py)[:-1][there] < 0.2 * depth
    found += [float(near.mean()), float((steps < 0.2 * usual_step).mean())]
    return np.array(found)


def _squared_displacement(x: Floats, y: Floats, broken: Integers, lag: int) -> float:
    """Return the mean over all stretches without a gap."""
    whole = broken[lag:] == broken[:-lag]
    if not whole.any():
        return float("nan")
    squares = (x[lag:] - x[:-lag]) ** 2 + (y[lag:] - y[:-lag]) ** 2
    return float(squares[whole].mean())


def _memory(length: Floats, there: Bools) -> float:
    """Return after how many intervals the autocorrelation of the step lengths falls below 1/e."""
    if np.count_nonzero(there) < LAGS[-1]:
        return float("nan")
    apart = np.where(there, length, 0.0)
    apart = np.where(there, apart - apart[there].mean(), 0.0)
    variance = float((apart**2).sum()) / np.count_nonzero(there)
    # A speed that is the same all along differs by rounding alone.
    if variance <= (1e-9 * float(length[there].mean())) ** 2:
        return float("nan")
    before, longest = 1.0, 500
    for lag in range(1, min(longest, length.size // 4)):
        pairs = int(np.count_nonzero(there[lag:] & there[:-lag]))
        if not pairs:
            break
        now = float((apart[lag:] * apart[:-lag]).sum()) / pairs / variance
        if now < np.exp(-1.0):
            return float(lag - 1 + (before - np.exp(-1.0)) / (before - now))
        before = now
    return float(min(longest, length.size // 4))
