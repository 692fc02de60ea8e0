"""The resolution of a file's numbers."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from driftwalk.record.raw import Array


def detect_quantum(values: Array) -> float:
    """Return the spacing that all values are multiples of, apart from rounding; 0 when unknown.

    First the decimal places: values written with six decimals are multiples of 1e-6. Then a coarser
    lattice: pixels that were scaled to metres before they were written leave the differences of
    neighbouring distinct values at multiples of the pixel.

    Parameters
    ----------
    values : array, shape (n,)
        Positions in the file's own unit; NaN is left out.

    Examples
    --------
    >>> detect_quantum(np.arange(100) % 7 * 0.25)
    0.25
    """
    known = _some_known(values)
    if known.size < 2:
        return 0.0
    decimal = _decimal_quantum(known)
    coarse = _lattice_quantum(known, decimal)
    return coarse if coarse > 0.0 else decimal


def _some_known(values: Array) -> Array:
    """Return the finite values, of many every second, third, ... one."""
    present = np.isfinite(values)
    count = int(present.sum())
    if count <= 50_000:
        return values[present]
    every = count // 50_000 + 1
    return values[::every] if count == values.size else values[np.flatnonzero(present)[::every]]


def common_quantum(series: Iterable[Array]) -> float:
    """Return the finest resolution among coordinates that vary, 0 when one has none."""
    found = [detect_quantum(values) for values in series if _varies(values)]
    return min(found, default=0.0)


def _varies(values: Array) -> bool:
    known = np.isfinite(values)
    least = float(np.min(values, where=known, initial=np.inf))
    return float(np.max(values, where=known, initial=-np.inf)) > least


def _decimal_quantum(values: Array) -> float:
    """Return the spacing of values with few decimals, 0 for more than nine.

    The greatest common divisor of their differences; of few values, which may have a common divisor
    by chance, the last decimal place.
    """
    for decimals in range(10):
        scaled = values * 10.0**decimals
        whole = np.round(scaled)
        if np.abs(whole).max() > 2.0**52:
            return 0.0
        # One unit in the last place of the value, scaled, is all that rounding may leave.
        if (np.abs(scaled - whole) <= 4.0 * np.spacing(np.abs(scaled) + 1.0)).all():
            steps = (whole - whole[0]).astype(np.int64)
            divisor = int(np.gcd.reduce(steps)) if values.size >= 30 else 1
            return float(divisor) / 10.0**decimals
    return 0.0


def _lattice_quantum(values: Array, decimal: float) -> float:
    """Return a lattice spacing well above the decimal one, 0 when there is none."""
    distinct = np.unique(values)
    if distinct.size < 8:
        return 0.0
    steps = np.diff(distinct)
    steps = steps[steps > 3.0 * decimal + 1e-9 * np.ptp(distinct)]
    if steps.size < 8:
        return 0.0
    spacing = float(np.median(steps[steps < 1.5 * np.percentile(steps, 10)]))
    multiples = np.round(steps / spacing)
    tolerance = decimal + 1e-3 * spacing * np.sqrt(multiples)
    regular = float((np.abs(steps - multiples * spacing) <= tolerance).mean())
    # Every recording has a smallest step; a lattice has hardly any other, and far more samples
    # than sites.
    few_sites = (
        distinct.size < 0.5 * values.size or np.ptp(distinct) / spacing < 4.0 * distinct.size
    )
    return spacing if regular > 0.99 and few_sites and spacing > 3.0 * decimal else 0.0
