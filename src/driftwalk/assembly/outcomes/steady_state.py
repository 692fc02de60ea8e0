"""The steady state of runs whose bonds break: shares of time, lifetimes and rates of the classes.

Samples of one run are correlated, so that intervals come from the differences between runs, which
are independent. Of fewer than 20 runs each is cut into batches (batch means).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.assembly.lattice.joined_faces import JOINING, PARTING
from driftwalk.assembly.outcomes.bond_kinetics import PARTS, clustering, rate_variables
from driftwalk.assembly.outcomes.distribution import (
    attrs_of_runs,
    class_names,
    duration,
    require_assembly,
    runs_with_outcome,
    with_limits,
)
from driftwalk.assembly.outcomes.survival import survival_curve
from driftwalk.core.arrays import Bools, Floats, Integers
from driftwalk.core.intervals import check_confidence, proportion_interval
from driftwalk.schema.check import build_dataset
from driftwalk.schema.shapes import all_single

if TYPE_CHECKING:
    import xarray as xr


class SteadyPolicy(NamedTuple):
    """The part of a run that counts as the steady state, and the test of it."""

    first_share: float = 0.5
    """Share of a run that is left out as its approach; chosen by hand."""
    least_parts: int = 20
    """Independent parts that intervals come from at least; chosen by hand."""
    signs: int = 1999
    """Draws of the test; with them p is known to 0.005 at 0.05; in closed form."""
    false_alarms: float = 0.05
    """Share of steady states that the test calls none; chosen by hand."""
    most_parts: int = 50
    """Parts of the time, at most, that tell how joinings cluster; chosen by hand."""
    ages: int = 61
    """Ages at which the survival of a class is kept; chosen by hand."""


STEADY_POLICY: Final = SteadyPolicy()
METHOD: Final = (
    "share of time in the second half of the runs, Student's t over runs (batches of few runs); "
    "rates Poisson (Garwood), of joinings widened as far as they cluster; lifetimes Kaplan-Meier, "
    "censored at the end of a run"
)


def steady_state(assembly: xr.Dataset, *, confidence: float = 0.9) -> xr.Dataset:
    """Return the share of time, the lifetime and the rates of every class, and if they are steady.

    Parameters
    ----------
    assembly : xarray.Dataset
        An `assembly` of runs whose bonds break. Runs without an outcome are left out and counted.
    confidence : float
        Probability with which each interval holds on its own, in (0, 1).

    Returns
    -------
    xarray.Dataset
        Kind "steady_state", by ``class``: ``time_share`` of the second half of the runs;
        ``joining_rate`` and ``parting_rate`` [1/s]: events in a world of this class over the time
        in it; ``lifetime_median`` [s], NaN where not reached; each with ``_low``, ``_high``;
        ``joining_count``, ``parting_count``, ``class_time`` [s]; ``survival`` (age, class), the
        share of stays that last longer. ``attrs``: ``steady_p``, ``steady`` ("yes", or "no"),
        ``false_alarms``, ``from_s``.

    Raises
    ------
    InputError
        When it is no `assembly` dataset, its bonds do not break, or no run has an outcome.

    Notes
    -----
    The test compares the third quarter of the runs with the fourth. Its statistic is the largest
    of the classes' mean differences over their standard errors; its law under a steady state comes
    from random signs of the runs' differences. A class in which no run has been has the upper limit
    of the share of runs that visit it. The first stay of a run is left out of the lifetimes, since
    blocks that are placed at random are no class that formed.

    Examples
    --------
    >>> import driftwalk as dw
    >>> study = dw.Study(assembly={"bond_rate_per_s": 0.1})
    >>> runs = dw.assemble(study, dw.uniform_flow(0.0, 0.0), blocks=2, runs=3, duration=1.0)
    >>> dw.steady_state(runs)["time_share"].values.tolist()
    [0.0, 1.0]
    """
    check_confidence(confidence)
    require_assembly(assembly, "event_kind", "event_time", "event_class", "outcome", "end_time")
    names, sound = class_names(assembly), runs_with_outcome(assembly)
    stays = _stays(assembly, sound, names.index(all_single(int(assembly.attrs["blocks"]))))
    last = duration(assembly)
    begin = STEADY_POLICY.first_share * last
    runs = int(sound.sum())
    batches = 2 * max(1, -(-STEADY_POLICY.least_parts // (2 * runs)))
    shares = _shares(stays, np.linspace(begin, last, batches + 1), runs, len(names))
    joined = np.concatenate([shares[:, : batches // 2], shares[:, batches // 2 :]])
    parts = shares.mean(axis=1) if batches == 2 else shares.reshape(-1, len(names))
    half = joined.shape[0] // 2
    p = _stationarity_p_value((joined[half:] - joined[:half]).reshape(-1, len(names)))
    time = np.bincount(stays.state, weights=stays.lasts, minlength=len(names)).astype(np.float64)
    data: dict[str, Any] = {
        **with_limits("time_share", "class", *_mean_and_ends(parts, confidence)),
        "class_time": ("class", time),
    }
    for name, kind in (("joining", JOINING), ("parting", PARTING)):
        count = np.bincount(stays.state[stays.ends_by == kind], minlength=len(names))
        clusters = _clusters(stays, time, runs, confidence) if kind == JOINING else 1.0
        data |= rate_variables(name, count, time, confidence=confidence, clusters=clusters)
    age, curves = _lifetimes(stays, len(names), confidence)
    return build_dataset(
        "steady_state",
        data | curves,
        {"class": ("class", np.array(names, dtype=object)), "age": ("age", age)},
        {
            **attrs_of_runs(assembly, sound, confidence),
            "method": METHOD,
            "from_s": begin,
            "steady_p": p,
            "steady": "yes" if p >= STEADY_POLICY.false_alarms else "no",
            "false_alarms": STEADY_POLICY.false_alarms,
        },
    )


class _Stays(NamedTuple):
    """The stays of runs in classes, one after the other."""

    run: Integers
    state: Integers
    begin: Floats
    lasts: Floats
    ends_by: Integers
    """Kind of the event that ends it, -1 at the end of the run."""
    is_first: Bools


def _stays(assembly: xr.Dataset, sound: Bools, start: int) -> _Stays:
    time, kind, after, end = (
        assembly[name].values[sound]
        for name in ("event_time", "event_kind", "event_class", "end_time")
    )
    found = []
    for run in range(len(time)):
        changes = np.flatnonzero((kind[run] == JOINING) | (kind[run] == PARTING))
        edges = np.concatenate([[0.0], time[run][changes], [end[run]]])
        state = np.concatenate([[start], after[run][changes]])
        by = np.concatenate([kind[run][changes], [-1]])
        first = np.arange(state.size) == 0
        found.append((np.full(state.size, run), state, edges[:-1], np.diff(edges), by, first))
    return _Stays(*(np.concatenate(column) for column in zip(*found, strict=True)))


def _shares(stays: _Stays, edges: Floats, runs: int, classes: int) -> Floats:
    """Return the share of each class in each piece of time of each run, (run, piece, class)."""
    shares = np.zeros((runs, edges.size - 1, classes))
    low, high, begin = edges[:-1], edges[1:], stays.begin[:, None]
    within = np.minimum(begin + stays.lasts[:, None], high) - np.maximum(begin, low)
    place: Any = stays.run, slice(None), stays.state
    np.add.at(shares, place, np.maximum(within, 0.0) / (high - low))
    return shares


def _mean_and_ends(parts: Floats, confidence: float) -> tuple[Floats, Floats, Floats]:
    from scipy.special import stdtrit

    number = parts.shape[0]
    mean = parts.mean(axis=0)
    spread = parts.std(axis=0, ddof=1) / np.sqrt(number)
    reach = stdtrit(number - 1, (1 + confidence) / 2) * spread
    high = np.minimum(mean + reach, 1.0)
    never, always = (parts == 0.0).all(axis=0), (parts == 1.0).all(axis=0)
    seldom = proportion_interval(0, number, confidence=confidence)[1]
    low = np.where(always, 1.0 - seldom, np.maximum(mean - reach, 0.0))
    return mean, low, np.where(never, seldom, high)


def _stationarity_p_value(differences: Floats) -> float:
    """Return how often chance alone makes the classes' shares differ as much, or more."""
    generator = np.random.default_rng(1)
    varies = (differences != 0.0).any(axis=0)
    moved = differences[:, varies]
    if moved.shape[0] < 2 or not moved.shape[1]:
        return 1.0
    scale = np.sqrt((moved**2).sum(axis=0))
    found = np.abs(moved.sum(axis=0) / scale).max()
    signs = generator.choice([-1.0, 1.0], size=(STEADY_POLICY.signs, moved.shape[0]))
    by_chance = np.abs(signs @ moved / scale).max(axis=1)
    return float((1 + (by_chance >= found - 1e-12).sum()) / (1 + STEADY_POLICY.signs))


def _clusters(stays: _Stays, time: Floats, runs: int, confidence: float) -> Floats:
    """Return by how much the joinings of each class cluster, over the time in it of all runs."""
    parts = min(max(runs, PARTS), STEADY_POLICY.most_parts)
    found = np.ones(time.size)
    for state in np.unique(stays.state):
        own = stays.state == state
        moments = np.cumsum(stays.lasts[own])[stays.ends_by[own] == JOINING]
        # Sums of the same numbers in another order may differ in the last digit.
        within = np.minimum(moments, time[state])
        found[state] = clustering(within, time[state], parts=parts, confidence=confidence)
    return found


def _lifetimes(stays: _Stays, classes: int, confidence: float) -> tuple[Floats, dict[str, Any]]:
    """Return ages, and the survival and the median lifetime of each class."""
    # A stay that a joining and a parting of one step make has no duration.
    real = ~stays.is_first & (stays.lasts > 0)
    longest = stays.lasts[real].max(initial=0.0) or 1.0
    age = np.linspace(0.0, longest, STEADY_POLICY.ages)
    curve = np.full((3, age.size, classes), np.nan)
    median = np.full((3, classes), np.nan)
    for state in np.unique(stays.state[real]).tolist():
        own = real & (stays.state == state)
        over = np.where(stays.ends_by[own] >= 0, stays.lasts[own], np.nan)
        found = survival_curve(over, stays.lasts[own], times=age, confidence=confidence)
        curve[:, :, state], median[:, state] = found[:3], found[3:]
    curves = with_limits("survival", ("age", "class"), *curve)
    return age, curves | with_limits("lifetime_median", "class", *median)
