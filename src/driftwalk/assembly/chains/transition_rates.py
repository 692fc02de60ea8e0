"""Kinetics of self-assembly: rates between the outcome classes, judged on held-out runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from driftwalk.assembly.chains.hidden import (
    FORMS,
    Form,
    Model,
    bin_edges,
    counts_and_times,
    fit,
    log_likelihood,
    passage,
    shares,
)
from driftwalk.assembly.chains.histories import Histories, blocks_of, datasets_of, histories
from driftwalk.assembly.chains.mixing import WELL_MIXED, equal_rates, judge_mixing, needed_events
from driftwalk.assembly.outcomes.bond_kinetics import PARTS, clustering, rate_interval
from driftwalk.assembly.outcomes.distribution import is_complete, with_limits
from driftwalk.assembly.outcomes.outcome_classes import sort_classes
from driftwalk.core.arrays import Floats, Integers
from driftwalk.core.errors import InputError
from driftwalk.core.files.shards import Arrays
from driftwalk.schema.answers.facts import texts
from driftwalk.schema.check import build_dataset
from driftwalk.sweep import WorkUnit, grid
from driftwalk.sweep.run import SweepSeries

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.sweep import Store


class KineticsPolicy(NamedTuple):
    """How models are chosen and their errors found."""

    folds: int = 5
    """Parts of the runs, each held out once; 10 chose the same models (`studies/kinetics`)."""
    least_runs: int = 20
    """Runs without which no model is chosen; chosen by hand, four in each part."""
    replicates: int = 50
    """Bootstrap samples of the runs: their standard deviation is known within a tenth, in closed
    form 1 / sqrt(2 n)."""
    reached: int = 5
    """Samples that reach the target without which its time has no error; chosen by hand."""
    iterations: int = 30
    """Iterations of a replicate, which begins at the estimate; chosen by hand."""
    runs_per_part: int = 5
    """Runs for each part of a class's time; the parts tell how events cluster. With 20 and 60 runs
    the intervals of each transition held in 89 % or more (three settings of `studies/kinetics`)."""
    most_parts: int = 50
    """Such parts, at most: Student's quantile is that of the normal law within 2 %; in closed
    form."""
    stored: int = 120
    """Steps of the stored curves; chosen by hand."""
    confidence: float = 0.9
    """Of the intervals and bands; by convention the same in all of driftwalk."""


KINETICS_POLICY = KineticsPolicy()
NAMES = ("first", "second")


def kinetics(
    runs: xr.Dataset | Sequence[xr.Dataset],
    other: xr.Dataset | Sequence[xr.Dataset] | None = None,
    *,
    target: str | None = None,
    blocks: int | None = None,
    seed: int = 1,
    store: Callable[[str], Store] | None = None,
    executor: Executor | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Return how fast blocks assemble and by which steps: rates between the outcome classes.

    Fits a continuous-time Markov chain, a semi-Markov chain and chains with hidden states to the
    histories of the runs, and chooses one on runs that were held out.

    Parameters
    ----------
    runs : xarray.Dataset or sequence of xarray.Dataset
        An `assembly`, a `classification` of a recording, or several of one number of blocks.
    other : xarray.Dataset or sequence of xarray.Dataset, optional
        The same of other runs, such as real ones: are the rates equal?
    target : str, optional
        Outcome class to be reached, such as "T"; without it there is no committor.
    blocks : int, optional
        Another number of blocks, for which the rate of the first joining is extrapolated where the
        tank is well mixed; at least 2.
    seed : int
        Seed of the bootstrap, at least 0.
    store : callable, optional
        Returns the store of a sweep by its name, for example of a run directory, to be continued.
    executor : concurrent.futures.Executor, optional
        Computes work units elsewhere; the result does not depend on it.
    progress : callable, optional
        Called as ``progress(done, total)``.

    Returns
    -------
    xarray.Dataset
        Kind "kinetics". ``rate`` [1/s] on (source, transition) with Poisson intervals,
        widened as far as events cluster; ``share`` on (time, class), predicted, with ``empirical``;
        ``score`` on (model), mean held-out log likelihood of a run; ``p_corrected`` on (test); with
        `target` ``committor`` and ``passage_time`` [s] on (class); with `other` ``equal_p`` on
        (transition). The verdict is ``attrs["verdict"]``.

    Raises
    ------
    InputError
        When a dataset holds no outcome classes, numbers of blocks differ, the target is no class
        of these blocks, or there are too few runs to tell.

    Notes
    -----
    The rates are q_ij = N_ij / T_i with the transitions N_ij and the time T_i in class i; standard
    error q_ij / √N_ij. See docs/how-to/kinetics.md.

    Examples
    --------
    >>> import driftwalk as dw
    >>> runs = dw.assemble(dw.Study(), dw.tank30_flow(), blocks=2, runs=400, duration="60s")
    >>> found = dw.kinetics(runs, target="2")
    >>> found["transition"].values.tolist()
    ['1+1 -> 2']
    """
    given = [datasets_of(runs), *([] if other is None else [datasets_of(other)])]
    sets, own_target = check_kinetics(*given, target=target, blocks=blocks)
    found = sets[0]
    mixing = judge_mixing(found)
    folds, replicates = KINETICS_POLICY.folds, KINETICS_POLICY.replicates
    sweeps = SweepSeries(len(FORMS) * folds + replicates, store, executor, progress)
    models = grid(model=np.arange(len(FORMS)), fold=np.arange(folds))
    scored = sweeps.run("held_out", partial(_held_out, found), models.units(1))
    scores = np.nansum(scored["score"].reshape(len(FORMS), folds, -1), axis=1)
    best = int(scores.mean(axis=1).argmax())
    behind = scores - scores[best]
    error = behind.std(axis=1, ddof=1) / np.sqrt(found.runs)
    # Forms stand with the simplest first: of those within a standard error of the best, the first
    # is taken, as the runs do not show that they need more.
    chosen = int(np.flatnonzero(behind.mean(axis=1) >= -error)[0])
    model = fit(found, FORMS[chosen])
    pairs = np.argwhere(np.sum([counts_and_times(one)[0] for one in sets], axis=0) > 0)
    again = Replicate(found, model, pairs, own_target, seed)
    bands = sweeps.run("bootstrap", again, grid(replicate=np.arange(replicates)).units(1))
    data, coords, attrs = _rates(sets, pairs, seed)
    statistics = np.array([(one.statistic, one.low, one.high) for one in mixing.tests])
    statistics = statistics.reshape(-1, 3).T
    data |= {
        "score": ("model", scores.mean(axis=1)),
        "score_behind": ("model", behind.mean(axis=1)),
        "score_behind_standard_error": ("model", error),
        **_over_time(sets, model, bands["share"]),
        **_chosen(model, pairs, bands["hazard"]),
        **with_limits("statistic", "test", *statistics),
        "events": ("test", np.array([one.events for one in mixing.tests], dtype=np.int64)),
        "p": ("test", np.array([one.p for one in mixing.tests])),
        "p_corrected": ("test", mixing.corrected),
        "reason": ("reason", texts(mixing.reasons)),
    }
    if own_target is not None:
        way = passage(model, own_target)
        for name, value in way._asdict().items():
            data[name] = ("class", value)
            data[f"{name}_standard_error"] = ("class", spread_of_known(bands[name]))
        attrs["target"] = str(target)
    duration = found.recorded_s()
    coords |= {
        "model": ("model", np.array([form.name for form in FORMS], dtype=object)),
        "test": ("test", np.array([one.name for one in mixing.tests], dtype=object)),
        "time": ("time", np.linspace(0.0, duration, KINETICS_POLICY.stored + 1)),
        "class": ("class", np.array(found.classes, dtype=object)),
    }
    attrs |= {
        "verdict": mixing.word,
        "chosen": FORMS[chosen].name,
        "blocks": blocks_of(found.classes[0]),
        "runs": found.runs,
        "joins": found.joins,
        "duration_s": duration,
        "confidence": KINETICS_POLICY.confidence,
        "seed": seed,
        **completion(found, model),
        **({} if blocks is None else _other_blocks(found, mixing.word, blocks)),
    }
    return build_dataset("kinetics", data, coords, attrs)


def check_kinetics(
    *given: Sequence[xr.Dataset], target: str | None, blocks: int | None
) -> tuple[list[Histories], int | None]:
    """Return the histories of data sets with common classes, and the index of the target.

    Parameters
    ----------
    *given : sequence of xarray.Dataset
        One or two data sets.
    target : str or None
        Outcome class to be reached.
    blocks : int or None
        Another number of blocks.

    Returns
    -------
    list of Histories
        One for each data set.
    int or None
        Index of the target.

    Raises
    ------
    InputError
        As `kinetics` does.

    Examples
    --------
    >>> check_kinetics([], target=None, blocks=1)
    Traceback (most recent call last):
    driftwalk.core.errors.InputError: blocks must be at least 2 to join, got 1
    """
    if blocks is not None and blocks < 2:
        raise InputError(f"blocks must be at least 2 to join, got {blocks}")
    names = [histories(one).classes for one in given]
    sizes = [blocks_of(one[0]) for one in names]
    if len({*sizes}) > 1:
        raise InputError(
            f"the data sets have {sizes[0]} and {sizes[1]} blocks: give only data sets with one "
            "number of blocks"
        )
    known = sort_classes([name for one in names for name in one])
    sets = [histories(one, classes=known) for one in given]
    _enough(sets[0])
    return sets, _target(target, sets[0])


def _target(target: str | None, found: Histories) -> int | None:
    """Return the index of the target; refuse one that the runs cannot or did not reach."""
    if target is None:
        return None
    if target in found.classes:
        return found.classes.index(target)
    blocks = blocks_of(found.classes[0])
    try:
        own = blocks_of(target)
    except InputError as error:
        raise InputError(f"target {target}: {error}") from error
    if own != blocks:
        raise InputError(f"target {target} has {own} blocks, and the runs have {blocks}")
    raise InputError(
        f"no run was ever in the target {target}: the runs were in {', '.join(found.classes)}"
    )


def _enough(found: Histories) -> None:
    least = KINETICS_POLICY.least_runs
    if found.runs >= least and found.joins >= least:
        return
    needed = max(needed_events(1), least)
    more = max(needed, -(-needed * found.runs // max(found.joins, 1)))
    raise InputError(
        f"cannot tell: {found.runs} runs with {found.joins} changes of class; record {more} runs"
    )


def _held_out(found: Histories, unit: WorkUnit) -> Arrays:
    """Return the held-out log likelihoods of a model and fold, (1, run); NaN of other folds."""
    [at], [fold] = (unit.settings[name] for name in ("model", "fold"))
    out = np.arange(found.runs) % KINETICS_POLICY.folds == int(fold)
    score = np.full((1, found.runs), np.nan)
    score[0, out] = log_likelihood(found.of(out), _trained(found, FORMS[int(at)], ~out))
    return {"score": score}


def _trained(found: Histories, form: Form, kept: Any) -> Model:
    """Return a model of some runs; of a transition that only others made it has half an event."""
    counts, times = counts_and_times(found)
    missing = (counts > 0) & (counts_and_times(found, kept.astype(np.float64))[0] == 0)
    model = fit(found.of(kept), form, edges=bin_edges(found.of(kept), form.bins))
    rate = 0.5 * missing / np.where(times > 0, times, 1.0)[:, None]
    return model._replace(hazard=model.hazard + rate[:, None, :, None])


@dataclass(frozen=True)
class Replicate:
    """The predictions of a model fitted again to a bootstrap sample of the runs."""

    found: Histories
    model: Model
    pairs: Integers
    """Transitions whose hazards are returned, shape (transition, 2)."""
    target: int | None
    seed: int

    def __call__(self, unit: WorkUnit) -> dict[str, Floats]:
        """Return hazards, shares, committors and passage times of a unit, of one replicate."""
        [number] = unit.settings["replicate"]
        random = np.random.default_rng([self.seed, int(number)])
        runs = self.found.runs
        again = fit(
            self.found, self.model.form, edges=self.model.edges, begin=self.model,
            weight=random.multinomial(runs, np.full(runs, 1.0 / runs)).astype(np.float64),
            iterations=KINETICS_POLICY.iterations,
        )  # fmt: skip
        start, end = self.pairs.T
        made = {
            "hazard": again.hazard[start, :, end],
            "share": shares(again, self.found.recorded_s(), steps=KINETICS_POLICY.stored)[1],
        }
        if self.target is not None:
            made |= passage(again, self.target)._asdict()
        return {name: values[None] for name, values in made.items()}


def _rates(
    sets: Sequence[Histories], places: Integers, seed: int
) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """Return N_ij, T_i, q_ij with Poisson intervals, and whether two sets have equal rates."""
    counted = [counts_and_times(one) for one in sets]
    names = sets[0].classes
    pairs = [(int(i), int(j)) for i, j in places]
    number = np.array([[counts[pair] for pair in pairs] for counts, _ in counted])
    spent = np.array([[times[i] for i, _ in pairs] for _, times in counted])
    # Events of a run go together where the tank is not well mixed: they count as fewer.
    fewer = 1.0 / np.array([[_clustering(one, *pair) for pair in pairs] for one in sets])
    confidence = KINETICS_POLICY.confidence
    low, high = rate_interval(number * fewer, spent * fewer, confidence=confidence)
    with np.errstate(divide="ignore", invalid="ignore"):
        rate, error = number / spent, np.sqrt(number) / spent
    dims = ("source", "transition")
    data: dict[str, Any] = {
        "count": (dims, number.astype(np.int64)),
        "time_in_class": (("source", "class"), np.array([times for _, times in counted])),
        "rate": (dims, rate),
        "rate_standard_error": (dims, error),
        "rate_low": (dims, low),
        "rate_high": (dims, high),
    }
    coords = {
        "transition": (
            "transition", np.array([f"{names[i]} -> {names[j]}" for i, j in pairs], dtype=object)
        ),
        "source": ("source", np.array(NAMES[: len(sets)], dtype=object)),
    }  # fmt: skip
    attrs: dict[str, Any] = {}
    if len(sets) > 1:
        p, corrected = equal_rates(sets[0], sets[1], pairs, seed=seed)
        data |= {"equal_p": ("transition", p), "equal_p_corrected": ("transition", corrected)}
        joint = float(np.nanmin(corrected)) if np.isfinite(p).any() else np.nan
        attrs = {"equal_p": joint, "other_runs": sets[1].runs}
    return data, coords, attrs


def _clustering(found: Histories, state: int, target: int) -> float:
    """Return by how much the transitions of a class cluster over the time that runs spent in it."""
    own = found.state == state
    if not own.any():
        return 1.0
    clock = np.cumsum(found.duration[own])
    parts = np.clip(found.runs // KINETICS_POLICY.runs_per_part, PARTS, KINETICS_POLICY.most_parts)
    return clustering(
        clock[found.target[own] == target], float(clock[-1]), parts=int(parts),
        confidence=KINETICS_POLICY.confidence,
    )  # fmt: skip


def _chosen(model: Model, pairs: Integers, again: Floats) -> dict[str, Any]:
    """Return the hazards of the chosen model with their errors, and its hidden states."""
    start, end = pairs.T
    dims = ("transition", "bin", "hidden")
    low = np.pad(model.edges, ((0, 0), (1, 0)))
    return {
        "hazard": (dims, model.hazard[start, :, end]),
        "hazard_standard_error": (dims, again.std(axis=0, ddof=1)),
        "bin_start": (("class", "bin"), np.where(np.isfinite(low), low, np.nan)),
        "hidden_start": (("class", "hidden"), model.start),
        "hidden_change": (("class", "hidden", "hidden_after"), model.switch),
    }


def spread_of_known(values: Floats) -> Floats:
    """Return the standard deviation over the samples that have a number; NaN where few have."""
    known = np.isfinite(values).sum(axis=0) >= KINETICS_POLICY.reached
    spread = np.nanstd(np.where(known, values, 0.0), axis=0, ddof=1)
    return np.where(known, spread, np.nan)


def _over_time(sets: Sequence[Histories], model: Model, band: Floats) -> dict[str, Any]:
    """Return predicted shares with their band, and the shares of runs still watched."""
    from scipy.stats import norm

    duration, stored = sets[0].recorded_s(), KINETICS_POLICY.stored
    course = shares(model, duration, steps=5 * stored)[1][::5]
    wide = norm.ppf(0.5 + 0.5 * KINETICS_POLICY.confidence) * band.std(axis=0, ddof=1)
    low, high = (np.clip(one, 0.0, 1.0) for one in (course - wide, course + wide))
    time = np.linspace(0.0, duration, stored + 1)
    seen = np.stack([empirical_shares(one, time) for one in sets])
    return {
        **with_limits("share", ("time", "class"), course, low, high),
        "empirical": (("source", "time", "class"), seen),
    }


def empirical_shares(found: Histories, time: Floats) -> Floats:
    """Return the share of runs in each class at each time, of those that are still watched.

    A run that ended in a class that no run ever left stays in it. NaN after the last run that ended
    in another one: those that stay would be all.
    """
    entry = found.entry
    left = np.bincount(found.state[found.target >= 0], minlength=len(found.classes)) > 0
    end = entry + found.duration
    end[(found.target < 0) & ~left[found.state]] = np.inf
    # A run is still watched at its very end.
    end[found.target < 0] *= 1.0 + 1e-9
    cut = (found.target < 0) & np.isfinite(end)
    watched = time <= (end[cut].max() if cut.any() else np.inf)
    count = np.empty((time.size, len(found.classes)))
    for state in range(len(found.classes)):
        own = found.state == state
        count[:, state] = np.searchsorted(np.sort(entry[own]), time, side="right")
        count[:, state] -= np.searchsorted(np.sort(end[own]), time, side="right")
    total = count.sum(axis=1, keepdims=True)
    return np.where((total > 0) & watched[:, None], count / np.maximum(total, 1.0), np.nan)


def completion(found: Histories, model: Model) -> dict[str, Any]:
    """Return the KS distance of the completion times and its 95 % floor, where runs complete."""
    whole = is_complete(found.classes)
    complete = whole[found.state]
    # Where blocks part, a run is complete several times: the first counts.
    happened = np.sort(found.entry[complete][np.unique(found.run[complete], return_index=True)[1]])
    if not happened.size:
        return {}
    once = model._replace(hazard=np.where(whole[:, None, None, None], 0.0, model.hazard))
    time, course = shares(once, found.recorded_s())
    seen = np.searchsorted(happened, time, side="right") / found.runs
    distance = float(np.abs(course[:, whole].sum(axis=1) - seen).max())
    return {"completion_ks": distance, "completion_ks_floor": 1.358 / np.sqrt(found.runs)}


def _other_blocks(found: Histories, verdict: str, blocks: int) -> dict[str, Any]:
    """Return the rate of the first joining of another number of blocks, or why there is none."""
    own = blocks_of(found.classes[0])
    apart = found.first & np.array([set(n.split("+")) == {"1"} for n in found.classes])[found.state]
    if verdict != WELL_MIXED or not apart.any():
        why = verdict if verdict != WELL_MIXED else "no run starts with single blocks"
        return {
            "other_blocks": blocks,
            "other_blocks_refused": f"no rate for {blocks} blocks is extrapolated: {why}",
        }
    joins, spent = (found.target[apart] >= 0).sum(), found.duration[apart].sum()
    pairs = blocks * (blocks - 1) / (own * (own - 1))
    rate = float(pairs * joins / spent)
    return {
        "other_blocks": blocks,
        "other_blocks_rate_per_s": rate,
        "other_blocks_rate_standard_error_per_s": rate / float(np.sqrt(max(joins, 1))),
    }
