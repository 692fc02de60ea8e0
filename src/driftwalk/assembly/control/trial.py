"""Test a policy in fresh worlds, against the best constant mode and random switching."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.assembly.control.plan import (
    CONTROL_POLICY,
    stored_modes,
    stored_rules,
    stored_wanted,
)
from driftwalk.assembly.control.worlds import Wanted, Worlds
from driftwalk.assembly.outcomes.distribution import is_complete, with_limits
from driftwalk.assembly.runs.dataset import build_path
from driftwalk.assembly.runs.plan import make_plan
from driftwalk.assembly.tank_batch import TankBatch
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.core.files.shards import Arrays
from driftwalk.core.intervals import difference_interval, proportion_interval
from driftwalk.schema.check import build_dataset
from driftwalk.sweep import Store, grid
from driftwalk.sweep.run import SweepSeries

if TYPE_CHECKING:
    import xarray as xr

ARMS = ("policy", "best constant mode", "random switching")
SAMPLE_S = 0.5
"""Time between two pictures of a film [s]; chosen by hand."""
CONSTANTS = 5
"""Constant modes that the best is chosen from, those with the largest shares in the plan; with
three, one plan of `studies/control` missed the best of 12."""


def try_control(
    policy: xr.Dataset,
    *,
    worlds: int = 2000,
    latency: float | None = None,
    missed: float | None = None,
    force_factor: float = 1.0,
    store: Callable[[str], Store] | None = None,
    executor: Executor | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Return how often a policy reaches its target in worlds that no plan has seen.

    Parameters
    ----------
    policy : xarray.Dataset
        A `control_policy`.
    worlds : int
        Worlds of each arm, from 20. The arms share starts and forces. The best constant mode is
        chosen in as many other worlds.
    latency, missed : float, optional
        Over the policy's, see `plan_control`.
    force_factor : float
        Factor on sigma_F of the worlds, above 0: what if the model is wrong?
    store, executor, progress
        As in `plan_control`.

    Returns
    -------
    xarray.Dataset
        Kind "control_test": ``reached`` with its exact interval and the paired ``gain`` on (arm),
        ``usage`` on (arm, mode).

    Raises
    ------
    InputError
        When the dataset is no policy, or a number is out of range.

    Notes
    -----
    The verdict is "not as stated" where the interval of the achieved share less the stated one does
    not hold 0. A policy that reaches what its plan states gets it in one of ten tests.

    Examples
    --------
    ``try_control(policy, worlds=2000)["reached"]``
    """
    from scipy.stats import norm

    rules, modes = stored_rules(policy), stored_modes(policy)
    wanted = trial_setting(policy, worlds, latency, missed, force_factor)
    classes = tuple(str(name) for name in policy["class"].values)
    target, seed = classes.index(wanted.target), int(policy.attrs["seed"])
    # Behind all worlds of the plan; the best constant mode is chosen in the worlds after them.
    first = int(policy.attrs["worlds_used"])
    best = np.argsort(-policy["constant_reached"].values, kind="stable")[:CONSTANTS].tolist()
    sweeps = SweepSeries(worlds * (3 + len(best)), store, executor, progress)

    def ran(name: str, arm: Any, only: int | None = None, begin: int = first) -> Arrays:
        work = Worlds(
            modes, classes, wanted, rules, seed, arm=arm, only=only, force_factor=force_factor
        )
        units = grid(world=np.arange(begin, begin + worlds)).units(CONTROL_POLICY.unit)
        return sweeps.run(name, work, units)

    policys = ran("policy", "policy")
    alone = [
        (ran(f"chosen_{mode}", "constant", mode, first + worlds)["after"][:, -1] == target).sum()
        for mode in best
    ]
    constant = best[int(np.argmax(alone))]
    found = [policys, ran("constant", "constant", constant), ran("random", "random")]
    hits = np.stack([one["after"] == target for one in found]).astype(np.float64)
    share = CONTROL_POLICY.confidence
    reached = hits[:, :, -1]
    low, high = proportion_interval(reached.sum(axis=1), worlds, confidence=share)
    # The arms run in the same worlds: what counts is the spread of their differences.
    ahead = reached[0] - reached
    gain = ahead.mean(axis=1)
    half = norm.ppf(0.5 + 0.5 * share) * (ahead.std(axis=1, ddof=1) / np.sqrt(worlds))
    whole, apart = is_complete(classes), ~np.eye(len(classes), dtype=bool)
    example = _example(policys, target)
    stated, planned = float(policy.attrs["reached"]), int(policy.attrs["worlds"])
    counts = [reached[0].sum(), round(stated * planned)]
    less, more = difference_interval(counts, [worlds, planned], confidence=share)
    data = {
        **with_limits("reached", "arm", reached.mean(axis=1), low, high),
        **with_limits("gain", "arm", gain, gain - half, gain + half),
        "share": (("arm", "time"), np.pad(hits.mean(axis=1), ((0, 0), (1, 0)))),
        "usage": (("arm", "mode"), np.stack([_usage(one, whole, modes.size) for one in found])),
        "class_usage": (
            ("class", "mode"), np.stack([_usage(policys, others, modes.size) for others in apart])
        ),
        "film_class": ("time", np.r_[policys["seen"][example], policys["after"][example, -1]]),
        "film_mode": ("time", np.r_[policys["mode"][example], -1]),
    }  # fmt: skip
    coords = {
        "arm": ("arm", np.array(ARMS, dtype=object)),
        "time": ("time", wanted.every_s * np.arange(wanted.periods + 1.0)),
        "mode": ("mode", np.array(modes.name, dtype=object)),
        "class": ("class", np.array(classes, dtype=object)),
    }
    return build_dataset("control_test", data, coords, {
        "target": wanted.target, "by_s": wanted.by_s, "every_s": wanted.every_s,
        "latency_s": wanted.latency_s, "missed": wanted.missed, "force_factor": force_factor,
        "stated": stated, "stated_worlds": planned, "difference_low": float(less),
        "difference_high": float(more),
        "verdict": "as stated" if less <= 0.0 <= more else "not as stated",
        "worlds": worlds, "confidence": share, "constant_mode": modes.name[constant],
        "film_world": first + example, "seed": seed,
    })  # fmt: skip


def control_path(policy: xr.Dataset, test: xr.Dataset) -> xr.Dataset:
    """Return the path of the blocks in the run that a test shows, simulated again.

    Parameters
    ----------
    policy : xarray.Dataset
        A `control_policy`.
    test : xarray.Dataset
        Its `control_test`.

    Returns
    -------
    xarray.Dataset
        Kind "assembly_path", for a film.

    Examples
    --------
    ``write_animation(control_path(policy, test), "run.gif")``
    """
    modes, facts = stored_modes(policy), test.attrs
    world = np.array([int(facts["film_world"])])
    plan = make_plan(
        modes.study, modes.flows[0], settings={"seed": int(facts["seed"])}, index=world,
        threads=1, ends=False,
    )  # fmt: skip
    every = max(round(SAMPLE_S / plan.study.time_step_s), 1)
    sample, latency = every * plan.study.time_step_s, float(facts["latency_s"])
    begins, began = test["time"].values.copy(), test["film_mode"].values
    begins[1:] += latency
    changes = {float(at): mode for at, mode in zip(begins, began, strict=True) if mode >= 0}
    samples = sample * np.arange(int(float(facts["by_s"]) / sample) + 1)
    batch = TankBatch(
        modes.study, modes.flows, worlds=1, seed=int(facts["seed"]), first=int(world[0]), workers=1
    )
    poses, joined, now = [], [], 0.0
    for time in sorted({*changes, *samples.tolist()}):
        batch.advance(time - now)
        now = time
        if time in changes:
            mode = np.array([changes[time]])
            factor = float(facts["force_factor"])
            batch.set(**modes.settings(mode, world, force_factor=factor))
        if time in samples:
            state = batch.state()
            poses.append(state["pose"])
            joined.append(state["assembly"])
    found = {"sample_pose": np.stack(poses, axis=1), "sample_assembly": np.stack(joined, axis=1)}
    return build_path(plan, found, every=every)


def trial_setting(
    policy: xr.Dataset,
    worlds: int,
    latency: float | None,
    missed: float | None,
    force_factor: float,
) -> Wanted:
    """Return what a test has of its policy and options; refuse numbers that are out of range.

    Parameters
    ----------
    policy, worlds, latency, missed, force_factor
        As in `try_control`.

    Raises
    ------
    InputError
        When a number is out of range.
    """
    given = {"latency_s": latency, "missed": missed}
    over: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    wanted = replace(stored_wanted(policy), **over)
    if worlds < 20:
        raise InputError(f"at least 20 worlds are needed, got {worlds}")
    wanted.require_in_range()
    if not 0.0 < force_factor < np.inf:
        raise InputError(f"the factor on sigma_F has to be above 0, got {force_factor:g}")
    return wanted


def _usage(found: Arrays, left_out: Any, modes: int) -> Floats:
    """Return the shares of the periods in each mode, but for those in classes left out."""
    kept = (found["seen"] >= 0) & ~left_out[np.maximum(found["seen"], 0)]
    count = np.bincount(found["mode"][kept], minlength=modes).astype(np.float64)
    return count / count.sum() if count.sum() else np.full(modes, np.nan)


def _example(found: Arrays, target: int) -> int:
    """Return the first world that reached the target in many steps; the first of all else."""
    reached = found["after"][:, -1] == target
    steps = found["entered"].sum(axis=1)
    return int(np.argmax(reached & (steps >= np.median(steps))))
