"""Describe a recording: bodies, clock, gaps, extent, speed, noise."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from driftwalk.core.arrays import Bools
from driftwalk.core.errors import FormatError, InputError
from driftwalk.core.text_files import json_value, parse_json
from driftwalk.record.arena import fit_circle
from driftwalk.record.raw import Array
from driftwalk.schema import Track, body_names, body_track, check_trajectory
from driftwalk.schema.tracking_noise import estimate_tracking_noise

if TYPE_CHECKING:
    import xarray as xr


_STATED: Final = ("arena", "arena_found", "origin_shift_m")
_NUMBERS: Final = ("position_quantum_m", "metres_per_pixel")


def describe(trajectory: xr.Dataset) -> dict[str, Any]:
    """Describe every body of a recording.

    Parameters
    ----------
    trajectory : xarray.Dataset
        A `trajectory`, as from `load`.

    Returns
    -------
    dict
        JSON-ready, with units in the keys: ``source``, ``format``, ``y_axis``, ``time_origin``
        (the date and time of t = 0, where the file has one), ``arena``,
        ``position_quantum_m``, ``columns`` (what each column of a table was taken for: column,
        meaning, unit, why), ``counts``, ``warnings``, and ``bodies``: name to samples, missing
        rows, duration_s, rate_Hz, jitter, gaps, extent, the circle of the centres, speed, the
        estimated tracking noise, and of a tracked recording the ``ambiguous_share``. ``tracking``
        is what tracking counted, None of other recordings. A number that cannot be had is None.

    Examples
    --------
    >>> from driftwalk.schema import build_trajectory
    >>> describe(build_trajectory([0.0, 0.1], [0.0, 0.01], [0.0, 0.0]))["bodies"]["0"]["samples"]
    2
    """
    check_trajectory(trajectory)
    attrs = trajectory.attrs
    counts = _json_attribute(attrs, "counts", {})
    warnings = counts.pop("warnings", [])
    return {
        **{name: attrs.get(name) for name in ("source", "format", "y_axis", "time_origin")},
        **{name: _json_attribute(attrs, name, None) for name in _STATED},
        **{name: json_value(float(attrs.get(name, math.nan))) for name in _NUMBERS},
        "tracking": _tracking(attrs),
        "columns": _json_attribute(attrs, "columns_read", []),
        "counts": counts,
        "warnings": warnings,
        "bodies": {name: _describe_body(trajectory, name) for name in body_names(trajectory)},
    }


def _tracking(attrs: dict[Any, Any]) -> dict[str, Any] | None:
    """Return what tracking counted, from what, and whether it came to its end."""
    counts = _json_attribute(attrs, "tracking_counts", None)
    if counts is None:
        return None
    return {
        "tracked_from": attrs.get("tracked_from"),
        "complete": attrs.get("complete") == "yes",
        "interrupted": attrs.get("interrupted"),
        **counts,
    }


def _json_attribute(attrs: dict[Any, Any], name: str, default: Any) -> Any:
    text = attrs.get(name)
    if text is None:
        return default
    try:
        return parse_json(str(text))
    except FormatError as error:
        raise InputError(f"the attribute '{name}' of the dataset is not JSON: {error}") from error


def _describe_body(trajectory: xr.Dataset, name: str) -> dict[str, Any]:
    track = body_track(trajectory, name)
    described: dict[str, Any] = {
        "samples": int(track.time.size),
        "has_orientation": track.has_orientation,
        **_clock(track),
        **{
            f"{axis}_{side}_m": float(getattr(np, side)(getattr(track, axis)))
            for axis in ("x", "y")
            for side in ("min", "max")
            if track.time.size
        },
        **_speed(track),
        **estimate_tracking_noise(track)._asdict(),
        "circle_of_centers": _circle(track),
    }
    if "ambiguous" in trajectory:
        scores = trajectory["ambiguous"].sel(body=name).values
        described["ambiguous_share"] = float((scores > 0).mean())
    return {key: json_value(value) for key, value in described.items()}


def _clock(track: Track) -> dict[str, Any]:
    if track.time.size < 2:
        start = float(track.time[0]) if track.time.size else math.nan
        return {"start_s": start, "stop_s": start, "duration_s": 0.0, "rate_Hz": math.nan}
    interval = np.diff(track.time)
    usual = float(np.median(interval))
    gaps = interval > 1.5 * usual
    low, high = np.percentile(interval, [5.0, 95.0]).tolist()
    duration = float(track.time[-1] - track.time[0])
    return {
        "start_s": float(track.time[0]),
        "stop_s": float(track.time[-1]),
        "duration_s": duration,
        "rate_Hz": 1.0 / usual,
        "interval_median_s": usual,
        "interval_5_percent_s": low,
        "interval_95_percent_s": high,
        # An interval that differs by up to 5 % counts as even; chosen by hand.
        "uneven_intervals_share": float((np.abs(interval - usual) > 0.05 * usual).mean()),
        "gaps": int(gaps.sum()),
        "longest_gap_s": float(interval[gaps].max()) if gaps.any() else 0.0,
        "gap_time_share": float((interval[gaps] - usual).sum()) / duration,
    }


def _circle(track: Track) -> dict[str, Any] | None:
    """Return the circle of the centres, None when there is none to fit."""
    names = ("radius_m", "sectors_visited_share", "residual_m", "samples_astray")
    try:
        x, y, *rest = fit_circle(track.x, track.y)
    except InputError:
        return None
    return {"center_m": [x, y], **dict(zip(names, rest, strict=True))}


def _speed(track: Track) -> dict[str, Any]:
    """Return quantiles of the speed between neighbours that no gap separates."""
    if track.time.size < 2:
        return {}
    interval = np.diff(track.time)
    near = interval <= 1.5 * np.median(interval)
    speed = np.hypot(np.diff(track.x), np.diff(track.y))[near] / interval[near]
    return {
        "speed_mean_m_s": float(speed.mean()),
        "speed_median_m_s": float(np.median(speed)),
        "speed_99_percent_m_s": float(np.percentile(speed, 99.0)),
        "speed_max_m_s": float(speed.max()),
        **(_turn_rate(track.theta, interval, near) if track.has_orientation else {}),
    }


def _turn_rate(theta: Array, interval: Array, near: Bools) -> dict[str, float]:
    turned = (np.diff(theta) + np.pi) % (2.0 * np.pi) - np.pi
    rate = (turned[near] / interval[near])[np.isfinite(turned[near])]
    if not rate.size:
        return {}
    return {"turn_rate_mean_rad_s": float(rate.mean()), "turn_rate_std_rad_s": float(rate.std())}
