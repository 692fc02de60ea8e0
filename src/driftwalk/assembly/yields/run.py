"""Maximisation of the yield of self-assembly: search, selection, and fresh runs that report.

The dataset holds the settings, their standing, and the front of yield and time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.assembly.outcomes.distribution import with_limits
from driftwalk.assembly.outcomes.outcome_classes import target_class
from driftwalk.assembly.runs.plan import stream_keys
from driftwalk.assembly.runs.start import place_blocks
from driftwalk.assembly.sensitivity.settings import FIRST_TRIALS, KEYS, Axes, make_axes
from driftwalk.assembly.yields.arms import Arms, Ranges, Runs, Stores
from driftwalk.assembly.yields.selection import (
    COMPASS,
    HALVING,
    Selection,
    compass_search,
    halving,
    tell_apart,
)
from driftwalk.core.errors import InputError
from driftwalk.core.intervals import proportion_interval
from driftwalk.core.progress import Progress, ignore_progress
from driftwalk.schema.check import build_dataset
from driftwalk.sweep import threads_of_unit

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


class YieldPolicy(NamedTuple):
    """How the result is reported."""

    on_front: int = 3
    """Settings of the front of yield and time that get fresh runs; chosen by hand."""
    alike: int = 4
    """Settings that cannot be distinguished from the best and get fresh runs; chosen by hand."""
    most_arms: int = 2000
    """Settings that are compared at most; chosen by hand."""


YIELD_POLICY: Final = YieldPolicy()
WORDS_OR_COUNTS: Final = (
    "blocks", "flow", "glued", "latching", "faces", "hidden_face_drag", "magnets",
)  # fmt: skip
"""Axes that are no continuous numbers."""


def maximise_yield(
    study: Study,
    flow: xr.Dataset,
    *,
    target: str,
    by: float | None = None,
    axes: Mapping[str, Any] | None = None,
    ranges: Ranges | None = None,
    runs: int = 6000,
    fresh_runs: int = 2000,
    indifference: float = 0.02,
    store: Stores | None = None,
    progress: Progress | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
) -> xr.Dataset:
    """Find the setting in which most runs assemble into a target by a time.

    Successive halving chooses among the settings, a local search refines the ones of `ranges`, and
    further runs distinguish what is near the best. Run k of every setting has the same random
    numbers. The yield is reported from fresh runs, which chose nothing.

    Parameters
    ----------
    study : Study
        Model, blocks, length of the runs and confidence ([assembly]); the seed stands in
        [sensitivity].
    flow : xarray.Dataset
        The water's velocity, a `flow_field` that covers every tank.
    target : str
        Outcome class, such as "T". Where ``blocks`` varies, a run has reached it when its class
        has these assemblies among others.
    by : float, optional
        When it is to be reached [s]; default: at the end of the runs.
    axes : mapping, optional
        Values to compare by the names of `sensitivity_map`, ``flow_scale`` and ``glued`` among
        them; every combination is a setting. Default: the lists of [sensitivity].
    ranges : mapping of str to (float, float), optional
        Lowest and highest value of continuous settings, which are searched in between.
    runs : int
        Runs that choose by halving; the search has as many again, distinguishing up to four times
        as many.
    fresh_runs : int
        Runs of each reported setting, >= 1.
    indifference : float
        Difference of yields that does not matter, in (0, 1).
    store : callable, optional
        Returns the store of a sweep by its name and settings, for example of a run directory.
    progress : callable, optional
        Called with the number of finished runs and of all that may be needed.
    threads : int, optional
        Default: all processors. The result does not depend on it.
    executor : concurrent.futures.Executor, optional
        Computes the work units elsewhere; the result does not depend on it.

    Returns
    -------
    xarray.Dataset
        Kind "yield". On (setting) ``reached`` and ``runs``, those that chose, ``difference`` to the
        best with its limits, ``standing``; ``fresh_yield`` with the exact ``fresh_yield_low`` and
        ``fresh_yield_high`` where there are fresh runs; on (setting, time) ``share``; on (time)
        ``front_setting`` and ``front_yield``. The values of a setting are variables by the names
        of the axes.

    Raises
    ------
    InputError
        When the target is no class of these blocks, `by` lies outside the runs, an axis is not
        known or named twice, nothing varies, or there are too few runs for so many settings.

    Notes
    -----
    Successive halving: Karnin, Koren and Somekh 2013. Indifference zone: Kim and Nelson 2001.
    See docs/how-to/yield.md.

    Examples
    --------
    >>> import driftwalk as dw
    >>> few = dw.Study(assembly={"blocks": 2, "duration_s": 20.0})
    >>> found = dw.maximise_yield(
    ...     few, dw.tank30_flow(), target="2", axes={"force_std": [2e-4, 1e-3]},
    ...     runs=200, fresh_runs=100,
    ... )
    >>> found["force_std"].values[found.attrs["best"]] in (2e-4, 1e-3)
    True
    """
    confidence = study.assembly.confidence
    arms, name, moment = _prepared(
        study, flow, target=target, by=by, axes=axes, ranges=ranges,
        threads=threads_of_unit(threads, executor), numbers=(runs, fresh_runs),
        indifference=indifference,
    )  # fmt: skip
    searched = runs if arms.ranges else 0
    reported_arms = 1 + YIELD_POLICY.alike + YIELD_POLICY.on_front
    whole = runs + searched + HALVING.most * runs + reported_arms * fresh_runs
    before = 0

    def told(done: int) -> None:
        (progress or ignore_progress)(min(before + done, whole), whole)

    how: dict[str, Any] = {"store": store, "executor": executor, "progress": told}
    chosen = Runs(arms, name, moment, trial=FIRST_TRIALS.choice, name="choose", **how)
    tally = chosen.tally
    stayed = halving(tally, range(len(arms.points)), runs)
    winner = max(stayed, key=lambda arm: stayed[arm])
    if arms.ranges:
        listed = {name: arms.points[winner][name] for name in arms.axes.values}
        compass_search(
            tally, arms.place(winner), lambda place: arms.at(listed, place), budget=searched
        )
    known = [arm for arm in range(len(arms.points)) if tally.size(arm)]
    selected = tell_apart(
        tally, known, indifference=indifference, confidence=confidence,
        budget=HALVING.most * runs,
    )  # fmt: skip
    before = tally.runs
    # A setting that was chosen for its runs was lucky in them: its yield comes from others.
    reported = Runs(arms, name, moment, trial=FIRST_TRIALS.fresh, name="fresh", **how)
    some = [selected.best, *selected.alike[: YIELD_POLICY.alike], *_front(chosen, known)]
    reported.tally.extend(list(dict.fromkeys(some)), fresh_runs)
    told(whole)
    return yield_dataset(
        chosen, reported, selected, stayed, runs=runs, indifference=indifference,
        confidence=confidence,
    )  # fmt: skip


def check_yield(
    study: Study,
    flow: xr.Dataset,
    *,
    target: str,
    by: float | None = None,
    axes: Mapping[str, Any] | None = None,
    ranges: Ranges | None = None,
    runs: int = 6000,
    fresh_runs: int = 2000,
    indifference: float = 0.02,
    threads: int | None = None,
) -> int:
    """Raise the errors that `maximise_yield` would raise, before any run is simulated.

    Parameters
    ----------
    study, flow, target, by, axes, ranges, runs, fresh_runs, indifference, threads
        As in `maximise_yield`.

    Returns
    -------
    int
        Number of settings that begin.

    Raises
    ------
    InputError
        As `maximise_yield`.

    Examples
    --------
    >>> import driftwalk as dw
    >>> still = dw.uniform_flow(0.0, 0.0)
    >>> dw.assembly.check_yield(dw.Study(), still, target="T", axes={"blocks": [4, 5]})
    2
    """
    arms, *_ = _prepared(
        study, flow, target=target, by=by, axes=axes, ranges=ranges, threads=threads,
        numbers=(runs, fresh_runs), indifference=indifference,
    )  # fmt: skip
    trial = FIRST_TRIALS.choice
    for world in {id(one): one for one in map(arms.world, range(len(arms.points)))}.values():
        keys = stream_keys("run", seed=world.study.assembly.seed, trial=trial, index=range(8))
        place_blocks(world.study, world.model(), keys, threads=world.threads)
    return len(arms.points)


def _prepared(
    study: Study, flow: xr.Dataset, *, target: str, by: float | None,
    axes: Mapping[str, Any] | None, ranges: Ranges | None, threads: int | None,
    numbers: tuple[int, int], indifference: float,
) -> tuple[Arms, str, float]:  # fmt: skip
    """Return the settings that begin, the target as the runs name it, and the time."""
    if not 0 < indifference < 1:
        raise InputError(f"indifference must lie between 0 and 1, got {indifference:g} (within)")
    for word, number in zip(("runs", "fresh_runs"), numbers, strict=True):
        if number < 1:
            raise InputError(f"{word} must be at least 1, got {number}")
    arms = _arms(study, flow, axes, dict(ranges or {}), threads)
    duration = study.assembly.duration_s
    moment = duration if by is None else float(by)
    if not 0 < moment <= duration:
        raise InputError(
            f"by: {moment:g} s does not lie within the runs, which last {duration:g} s (duration)"
        )
    worlds = [arms.world(arm) for arm in range(len(arms.points))]
    name = target_class(
        target, {one.study.assembly.blocks for one in worlds}, chirality=worlds[0].chirality,
        vary_blocks="blocks" in arms.axes.values,
    )  # fmt: skip
    many = len(arms.points)
    needed = HALVING.least_runs * many * max(math.ceil(math.log2(many)), 1)
    if numbers[0] < needed:
        raise InputError(
            f"{many} settings need at least {needed} runs, got {numbers[0]} (runs): give more runs "
            "or fewer values"
        )
    return arms, name, moment


def _arms(
    study: Study,
    flow: xr.Dataset,
    axes: Mapping[str, Any] | None,
    ranges: dict[str, tuple[float, float]],
    threads: int | None,
) -> Arms:
    """Return the settings that begin."""
    if axes is None:
        axes = study.sensitivity.lists
    listed = make_axes(study, axes) if axes else Axes(study, {}, {})
    for name, (low, high) in ranges.items():
        if name not in KEYS or name in WORDS_OR_COUNTS:
            known = ", ".join(one for one in KEYS if one not in WORDS_OR_COUNTS)
            raise InputError(f"ranges: '{name}' has no range; choose from {known}")
        if name in listed.values:
            raise InputError(f"{name} has values and a range: give one")
        if not 0 <= low < high < math.inf:
            raise InputError(f"ranges: {name} needs two numbers from 0 on, the lower one first")
        least = COMPASS.points * 10.0 ** (math.floor(math.log10(high)) + 1 - COMPASS.digits)
        if high - low < least:
            raise InputError(
                f"ranges: {name} from {low:.9g} to {high:.9g} is too narrow, as settings have "
                f"{COMPASS.digits} digits: make it at least {least:g} wide"
            )
    if not listed.values and not ranges:
        raise InputError(f"nothing varies: name settings to compare, out of {', '.join(KEYS)}")
    arms = Arms(listed, ranges, flow, threads)
    size = math.prod(listed.shape)
    if size > YIELD_POLICY.most_arms:
        raise InputError(f"{size} settings are more than {YIELD_POLICY.most_arms}: name fewer")
    arms.begin()
    return arms


def _front(chosen: Runs, arms: Sequence[int]) -> list[int]:
    """Return the settings that are the best at some time, those that are so longest first."""
    low = np.array([chosen.cautious(arm) for arm in arms])
    best = low[:, low.max(axis=0) > 0].argmax(axis=0)
    times = np.bincount(best, minlength=len(arms))
    ranked = np.argsort(-times, kind="stable")
    return [arms[at] for at in ranked[: YIELD_POLICY.on_front] if times[at]]


def yield_dataset(
    chosen: Runs, reported: Runs, selected: Selection, rounds: Mapping[int, int], *,
    runs: int, indifference: float, confidence: float,
) -> xr.Dataset:  # fmt: skip
    """Return the `yield` dataset; the settings in the order in which they were begun.

    `rounds` are those that each arm stayed in halving, of which there were `runs` at most.
    """
    arms, tally, judge = chosen.arms, chosen.tally, reported.tally
    kept = [arm for arm in range(len(arms.points)) if tally.size(arm)]
    sizes, reached = (np.array([one(arm) for arm in kept]) for one in (tally.size, tally.reached))
    fresh, again = (np.array([one(arm) for arm in kept]) for one in (judge.size, judge.reached))
    shown = again / np.maximum(fresh, 1), *proportion_interval(again, fresh, confidence=confidence)
    # All settings are compared with the best one: the intervals share one error (Bonferroni).
    level = (1.0 - confidence) / 2 / max(len(kept) - 1, 1)
    apart = [tally.difference(selected.best, arm) for arm in kept]
    behind = np.array([one.mean for one in apart])
    radius = np.array([one.radius(level) for one in apart])
    radius[kept.index(selected.best)] = 0.0
    standing = ["worse"] * len(kept)
    for arm, word in ((selected.best, "best"), *((arm, "alike") for arm in selected.alike)):
        standing[kept.index(arm)] = word
    data: dict[str, Any] = {
        "runs": ("setting", sizes),
        "reached": ("setting", reached),
        "rounds": ("setting", np.array([rounds.get(arm, 0) for arm in kept])),
        **with_limits("difference", "setting", behind, behind - radius, behind + radius),
        "standing": ("setting", np.array(standing, dtype=object)),
        "fresh_runs": ("setting", fresh),
        **with_limits("fresh_yield", "setting", *np.where(fresh > 0, shown, np.nan)),
        **_over_time(chosen, reported, selected.best, kept, confidence),
    }
    for name in arms.points[0]:
        values = [arms.points[arm][name] for arm in kept]
        kind = object if isinstance(values[0], str) else None
        data[name] = ("setting", np.array(values, dtype=kind))
    study = arms.axes.study
    attrs = {
        "target": chosen.target,
        "by_s": chosen.by,
        "best": kept.index(selected.best),
        "within": selected.within,
        "indifference": indifference,
        "confidence": confidence,
        "searched": ", ".join(arms.ranges),
        "selection_runs": runs,
        "chosen_runs": tally.runs,
        "reported_runs": judge.runs,
        "left_out": chosen.broken + reported.broken,
        "duration_s": float(chosen.times[-1]),
        "seed": study.sensitivity.seed,
        "study": study.to_toml(),
    }
    if "blocks" not in arms.points[0]:
        attrs["blocks"] = study.assembly.blocks
    return build_dataset("yield", data, {"time": ("time", chosen.times)}, attrs)


def _over_time(
    chosen: Runs, reported: Runs, best: int, kept: list[int], confidence: float
) -> dict[str, Any]:
    """Return the shares over time, and the front: chosen by the first runs, from fresh ones."""
    fresh = [arm for arm in kept if reported.tally.size(arm)]
    rows = [(reported if arm in fresh else chosen).share(arm) for arm in kept]
    # Where another is better by less than its standard error, the best for the named time stays.
    seen = [chosen.share(arm) if arm == best else chosen.cautious(arm) for arm in fresh]
    ahead = np.array(seen).argmax(axis=0)
    front = np.array([kept.index(arm) for arm in fresh])[ahead]
    share = np.array(rows)
    runs = reported.tally.size(fresh[0])
    largest = share[front, np.arange(front.size)]
    limits = proportion_interval(np.rint(largest * runs), runs, confidence=confidence)
    return {
        "share": (("setting", "time"), share),
        "front_setting": ("time", front),
        **with_limits("front_yield", "time", largest, *limits),
    }
