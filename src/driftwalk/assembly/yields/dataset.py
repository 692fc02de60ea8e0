"""The dataset of a maximised yield: settings, their standing, and the front of yield and time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from driftwalk.assembly.yields.arms import Arms, Runs
from driftwalk.assembly.yields.selection import Selection, Tally
from driftwalk.core.intervals import proportion_interval
from driftwalk.schema.check import build_dataset

if TYPE_CHECKING:
    import xarray as xr


class Found(NamedTuple):
    """The results of search, selection and fresh runs."""

    arms: Arms
    target: str
    by: float
    chosen: Runs
    tally: Tally
    reported: Runs
    judge: Tally
    selected: Selection
    rounds: dict[int, int]
    runs: int
    """Of halving, at most."""


def yield_dataset(found: Found, *, indifference: float, confidence: float) -> xr.Dataset:
    """Return the `yield` dataset; the settings in the order in which they were begun."""
    arms, tally, judge, selected = found.arms, found.tally, found.judge, found.selected
    kept = [arm for arm in range(len(arms.points)) if tally.size(arm)]
    runs, reached = (np.array([one(arm) for arm in kept]) for one in (tally.size, tally.reached))
    fresh, again = (np.array([one(arm) for arm in kept]) for one in (judge.size, judge.reached))
    low, high = proportion_interval(again, fresh, confidence=confidence)
    there = fresh > 0
    level = (1.0 - confidence) / 2 / max(len(kept) - 1, 1)
    apart = [tally.difference(selected.best, arm) for arm in kept]
    behind = np.array([one.mean for one in apart])
    radius = np.array([one.radius(level) for one in apart])
    radius[kept.index(selected.best)] = 0.0
    standing = ["worse"] * len(kept)
    for arm, word in ((selected.best, "best"), *((arm, "alike") for arm in selected.alike)):
        standing[kept.index(arm)] = word
    data: dict[str, Any] = {
        "runs": ("setting", runs),
        "reached": ("setting", reached),
        "rounds": ("setting", np.array([found.rounds.get(arm, 0) for arm in kept])),
        "difference": ("setting", behind),
        "difference_low": ("setting", behind - radius),
        "difference_high": ("setting", behind + radius),
        "standing": ("setting", np.array(standing, dtype=object)),
        "fresh_runs": ("setting", fresh),
        "fresh_yield": ("setting", np.where(there, again / np.maximum(fresh, 1), np.nan)),
        "fresh_yield_low": ("setting", np.where(there, low, np.nan)),
        "fresh_yield_high": ("setting", np.where(there, high, np.nan)),
        **_over_time(found, kept, confidence),
    }
    for name in arms.points[0]:
        values = [arms.points[arm][name] for arm in kept]
        kind = object if isinstance(values[0], str) else None
        data[name] = ("setting", np.array(values, dtype=kind))
    study = arms.axes.study
    attrs = {
        "target": found.target,
        "by_s": found.by,
        "best": kept.index(selected.best),
        "within": selected.within,
        "indifference": indifference,
        "confidence": confidence,
        "searched": ", ".join(arms.ranges),
        "selection_runs": found.runs,
        "chosen_runs": tally.runs,
        "reported_runs": judge.runs,
        "left_out": found.chosen.broken + found.reported.broken,
        "duration_s": float(found.chosen.times[-1]),
        "seed": study.sensitivity.seed,
        "study": study.to_toml(),
    }
    if "blocks" not in arms.points[0]:
        attrs["blocks"] = study.assembly.blocks
    return build_dataset("yield", data, {"time": ("time", found.chosen.times)}, attrs)


def _over_time(found: Found, kept: list[int], confidence: float) -> dict[str, Any]:
    """Return the shares over time, and the front: chosen by the first runs, from fresh ones."""
    fresh = [arm for arm in kept if found.judge.size(arm)]
    rows = [(found.reported if arm in fresh else found.chosen).share(arm) for arm in kept]
    best = found.selected.best
    # Where another is better by less than its standard error, the best for the named time stays.
    seen = [found.chosen.share(a) if a == best else found.chosen.cautious(a) for a in fresh]
    ahead = np.array(seen).argmax(axis=0)
    front = np.array([kept.index(arm) for arm in fresh])[ahead]
    share = np.array(rows)
    runs = found.judge.size(fresh[0])
    largest = share[front, np.arange(front.size)]
    low, high = proportion_interval(np.rint(largest * runs), runs, confidence=confidence)
    return {
        "share": (("setting", "time"), share),
        "front_setting": ("time", front),
        "front_yield": ("time", largest),
        "front_yield_low": ("time", low),
        "front_yield_high": ("time", high),
    }
