"""Survival analysis: times to first contact and completion, and the classes over time.

A run ends before its blocks have met or joined: then the time is not known, only that it is longer
than the run (right censoring), and a mean over the runs that got there would be too short.
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.outcomes.distribution import (
    attrs_of_runs,
    check_times,
    class_names,
    duration,
    require_assembly,
    runs_with_outcome,
    with_limits,
)
from driftwalk.core.arrays import Floats, Integers
from driftwalk.core.errors import InputError
from driftwalk.core.intervals import proportion_interval
from driftwalk.schema.check import build_dataset
from driftwalk.schema.shapes import all_single

if TYPE_CHECKING:
    import xarray as xr


EVENTS = ("first_contact", "completion")


class SurvivalCurve(NamedTuple):
    """Result of `survival_curve`."""

    survival: Floats
    """Share of runs in which it has not happened yet, at each time."""
    low: Floats
    high: Floats
    """Limits of its pointwise confidence interval."""
    median: float
    """Time at which it has happened in half of the runs [s], NaN when not reached."""
    median_low: float
    median_high: float
    """Limits of the confidence interval of the median [s], NaN when not reached."""


def class_times(
    assembly: xr.Dataset, *, times: npt.ArrayLike | None = None, confidence: float = 0.9
) -> xr.Dataset:
    """Return how the outcome classes, first contact and completion develop over time.

    Parameters
    ----------
    assembly : xarray.Dataset
        An `assembly` dataset. Runs without an outcome (-1) are left out and counted.
    times : array_like, shape (time,), optional
        Times from the start of the runs [s], increasing, within their duration; default: 201 from 0
        to the duration.
    confidence : float
        Probability with which an interval holds at its time (pointwise, not for the whole curve),
        in (0, 1).

    Returns
    -------
    xarray.Dataset
        Kind "class_times". ``proportion`` (time, class) with ``proportion_low``,
        ``proportion_high`` (Clopper-Pearson); ``first_contact`` and ``completion`` (time), the
        share of runs in which it has NOT happened yet, with ``_low`` and ``_high``, see
        `survival_curve`. ``attrs``: the assembly's, ``runs``, ``left_out``, ``confidence``,
        and ``first_contact_median_s``, ``completion_median_s``, each with ``_low_s`` and
        ``_high_s`` (NaN when not reached).

    Raises
    ------
    InputError
        When it is no `assembly` dataset, has no run with an outcome, or an option is out of range.

    Examples
    --------
    >>> import xarray as xr
    >>> two_blocks = xr.Dataset(
    ...     {
    ...         "event_time": (("run", "event"), [[20.0], [np.nan]]),
    ...         "event_class": (("run", "event"), [[0], [-1]]),
    ...         "outcome": ("run", [0, 1]),
    ...         "first_contact_time": ("run", [20.0, np.nan]),
    ...         "completion_time": ("run", [20.0, np.nan]),
    ...         "end_time": ("run", [20.0, 60.0]),
    ...     },
    ...     coords={"class": ["2", "1+1"]},
    ...     attrs={"kind": "assembly", "blocks": 2, "duration_s": 60.0},
    ... )
    >>> found = class_times(two_blocks, times=[10.0, 30.0])
    >>> found["completion"].values.tolist(), found.attrs["completion_median_s"]
    ([1.0, 0.5], 20.0)
    """
    require_assembly(
        assembly,
        *("outcome", "event_time", "event_class", "end_time"),
        *(f"{event}_time" for event in EVENTS),
    )
    time = checked_times(times, duration(assembly))
    names = class_names(assembly)
    # Runs that failed have no outcome and count neither as events nor as censored.
    sound = runs_with_outcome(assembly)
    runs = int(sound.sum())
    count = class_counts(
        assembly["event_time"].values[sound],
        assembly["event_class"].values[sound],
        start=names.index(all_single(int(assembly.attrs["blocks"]))),
        time=time,
        classes=len(names),
    )
    limits = proportion_interval(count, runs, confidence=confidence)
    data = with_limits("proportion", ("time", "class"), count / runs, *limits)
    attrs = attrs_of_runs(assembly, sound, confidence)
    end_time = assembly["end_time"].values[sound]
    for event in EVENTS:
        curve = survival_curve(
            assembly[f"{event}_time"].values[sound], end_time, times=time, confidence=confidence
        )
        data |= with_limits(event, "time", *curve[:3])
        medians = (f"{event}_median{end}_s" for end in ("", "_low", "_high"))
        attrs |= dict(zip(medians, curve[3:], strict=True))
    return build_dataset(
        "class_times",
        data,
        {"time": ("time", time), "class": ("class", np.array(names, dtype=object))},
        attrs,
    )


def survival_curve(
    event_time: npt.ArrayLike,
    end_time: npt.ArrayLike,
    *,
    times: npt.ArrayLike,
    confidence: float = 0.9,
) -> SurvivalCurve:
    """Return the Kaplan-Meier curve of an event that did not occur in some runs.

    Parameters
    ----------
    event_time : array_like, shape (run,)
        When it happened [s], NaN where it did not.
    end_time : array_like, shape (run,)
        When the run ended [s], >= 0: a run without the event is censored there.
    times : array_like, shape (time,)
        Times at which to read the curve [s].
    confidence : float
        Probability with which an interval holds at its time, in (0, 1).

    Returns
    -------
    SurvivalCurve
        The share of runs in which it has not happened at or before each time, its interval, and
        the median time with its interval.

    Raises
    ------
    InputError
        When there are no runs, shapes disagree, or an event lies after the end of its run.

    Notes
    -----
    The interval is Greenwood's on the scale of log(-log S). It is not defined while S is 1 and
    where S is 0; there the exact binomial limit stands, of the runs still watched, or of those in
    which it happened. The interval of the median holds the times at which the interval of the
    curve holds one half (Brookmeyer and Crowley, Biometrics 38, 29, 1982).

    Examples
    --------
    >>> curve = survival_curve([1.0, 3.0, np.nan, np.nan], [4.0, 4.0, 2.0, 4.0], times=[0, 1, 3])
    >>> curve.survival.tolist(), curve.median
    ([1.0, 0.75, 0.375], 3.0)
    """
    happened, ended = _checked_runs(event_time, end_time)
    at = np.asarray(times, dtype=np.float64)
    if at.ndim != 1 or not np.isfinite(at).all():
        raise InputError("times: expected a row of finite numbers")
    knot, survival, low, high = _kaplan_meier(happened, ended, confidence)
    step = np.searchsorted(knot, at, side="right") - 1
    before = step < 0
    step = np.maximum(step, 0)
    last_seen = np.sort(np.where(np.isfinite(happened), happened, ended))
    watched = last_seen.size - np.searchsorted(last_seen, at, side="left")
    low_of_all, _ = proportion_interval(watched, watched, confidence=confidence)
    unscathed = before | (survival[step] == 1.0)
    return SurvivalCurve(
        survival=np.where(before, 1.0, survival[step]),
        low=np.where(unscathed, low_of_all, low[step]),
        high=np.where(unscathed, 1.0, high[step]),
        median=_reached(knot, survival),
        median_low=_reached(knot, low),
        median_high=_reached(knot, high),
    )


def _checked_runs(event_time: npt.ArrayLike, end_time: npt.ArrayLike) -> tuple[Floats, Floats]:
    happened = np.asarray(event_time, dtype=np.float64)
    ended = np.asarray(end_time, dtype=np.float64)
    if happened.ndim != 1 or happened.shape != ended.shape:
        raise InputError(
            f"event_time {happened.shape} and end_time {ended.shape} are not of the same runs"
        )
    if happened.size == 0:
        raise InputError("a survival curve needs at least one run")
    if not (np.isfinite(ended) & (ended >= 0)).all():
        raise InputError("end_time: a run has no end, or one before its start")
    if (np.isinf(happened) | (happened < 0) | (happened > ended)).any():
        raise InputError("event_time: an event lies outside its run")
    return happened, ended


def _kaplan_meier(
    happened: Floats, ended: Floats, confidence: float
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return the times of the steps, the curve after each, and its interval.

    Where the curve is still 1 the interval depends on the time, not on the step; the caller fills
    it in, and here it is the interval from 1 to 1.
    """
    from scipy.stats import CensoredData, ecdf

    known = np.isfinite(happened)
    curve = ecdf(CensoredData(uncensored=happened[known], right=ended[~known])).sf
    with warnings.catch_warnings():
        # It is not defined where the curve is 1 or 0; those places are filled below.
        warnings.simplefilter("ignore", RuntimeWarning)
        interval: Any = curve.confidence_interval(confidence, method="log-log")
    survival = np.asarray(curve.probabilities, dtype=np.float64)
    low, high = interval.low.probabilities.copy(), interval.high.probabilities.copy()
    low[survival == 1.0] = high[survival == 1.0] = 1.0
    over = survival == 0.0
    low[over] = 0.0
    high[over] = proportion_interval(0, int(known.sum()), confidence=confidence)[1]
    return np.asarray(curve.quantiles, dtype=np.float64), survival, low, high


def _reached(knot: Floats, curve: Floats) -> float:
    """Return the first time at which the curve is down to one half, NaN when it never is."""
    # A half, but for rounding.
    down = np.flatnonzero(curve <= 0.5 + 1e-12)
    return float(knot[down[0]]) if down.size else float("nan")


def class_counts(
    event_time: Floats, event_class: Integers, *, start: int, time: Floats, classes: int
) -> Integers:
    """Return how many runs are in each class at each time, shape (time, class).

    Every event moves one run from a class to another at the first time that is not before it.
    """
    runs = event_time.shape[0]
    before = np.concatenate(
        [np.full((runs, 1), start, dtype=event_class.dtype), event_class[:, :-1]], axis=1
    )
    real = np.isfinite(event_time)
    index = np.searchsorted(time, event_time[real], side="left") * classes
    # One row more than there are times, for the events after the last.
    size = (time.size + 1) * classes
    change = np.bincount(index + event_class[real], minlength=size)
    change -= np.bincount(index + before[real], minlength=size)
    count = change.reshape(-1, classes).cumsum(axis=0)[: time.size]
    count[:, start] += runs
    return count.astype(np.int64)


def checked_times(times: npt.ArrayLike | None, longest: float) -> Floats:
    """Return the times of a course, 201 where none are given; refuse those outside the runs."""
    if times is None:
        return np.linspace(0.0, longest, 201)
    time = np.asarray(times, dtype=np.float64)
    if time.ndim != 1 or time.size == 0 or (np.diff(time) <= 0).any():
        raise InputError("times: expected a row of increasing numbers")
    check_times(time, longest)
    return time
