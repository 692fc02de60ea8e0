"""Which motion model explains a recording? All searched alike, and judged on what none has seen.

A comparison has two stages: distances of all models, then summaries of the closest.

Models are searched at the same time in threads of this process. The simulations and distances of
one model leave Python now and then only, so two threads in one model keep 1.2 processors busy, and
two models with one thread each 1.8.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from threading import Lock
from typing import TYPE_CHECKING, Any, ClassVar, Final

import numpy as np

from driftwalk.calibration.evolution import Budget
from driftwalk.calibration.held_out.candidates import (
    BLOCK,
    Candidate,
    Chosen,
    made_models,
    prepare_candidates,
    resampling_baselines,
)
from driftwalk.calibration.held_out.held_out_score import (
    HeldOutScore,
    held_out_differences,
    score_candidate,
)
from driftwalk.calibration.held_out.recorded import RecordedMotion, body_motion
from driftwalk.calibration.problem import Stores, in_memory
from driftwalk.calibration.ranking.model_evidence import (
    Evidence,
    estimate_evidence,
    most_settings,
    shortlist_models,
)
from driftwalk.calibration.ranking.result import build_comparison
from driftwalk.conditions import study_in_arena
from driftwalk.core.files.shards import Arrays
from driftwalk.core.processors import CancelOnError, one_blas_thread
from driftwalk.core.progress import StagedProgress, ignore_progress
from driftwalk.motion import BlockModel, MotionModel, ParticleModel
from driftwalk.sweep import MemoryStore, Store, WorkUnit, collect, grid, run_sweep, threads_of_unit

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


Tell = Callable[[int, int, str], None]


def runs_in_threads(entry: Candidate) -> bool:
    """Return whether several threads may simulate a model: of a user's own that is unknown."""
    return entry.baseline or isinstance(entry.model, BlockModel | ParticleModel)


@contextmanager
def thread_pool(count: int) -> Iterator[ThreadPoolExecutor | None]:
    """Give threads for several models; none where there is one processor.

    Left by an error, also by Ctrl-C, they are not waited for.
    """
    if count < 2:
        yield None
        return
    pool = ThreadPoolExecutor(count, thread_name_prefix="model")
    try:
        yield pool
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


class SearchProgress:
    """How far several searches are.

    Parameters
    ----------
    names : sequence of str
        Of the models.
    costs : sequence of int
        Settings that each simulates at most.
    done : list of int
        Settings of each that are done already.
    tell : callable
        Called with the settings done, all of them, and the models under way.

    Attributes
    ----------
    cancellation : CancelOnError
        The block that waits for the searches; they end with it.
    """

    def __init__(
        self, names: Sequence[str], costs: Sequence[int], done: list[int], tell: Tell
    ) -> None:
        self._names, self._costs, self._done, self._tell = names, costs, done, tell
        self._under_way: set[int] = set()
        self._lock = Lock()
        self.cancellation = CancelOnError()

    def __call__(self, index: int, done: int) -> None:
        """Hear how many settings of a model are done; all of them when it is finished."""
        self.cancellation.raise_if_cancelled()
        with self._lock:
            self._done[index] = done
            if done < self._costs[index]:
                self._under_way.add(index)
            else:
                self._under_way.discard(index)
            names = ", ".join(self._names[k] for k in sorted(self._under_way))
            self._tell(sum(self._done), sum(self._costs), names or self._names[index])


Finished = Callable[[str, float, float, int], None]
"""Hears of a model that was judged: its name, its score, the standard error of that, and how many
models there are."""


@dataclass(frozen=True, eq=False)
class Searches:
    """The function of the sweep: one model, searched and judged wherever it is sent."""

    entries: Sequence[Candidate]
    motion: RecordedMotion
    budget: Budget
    within: Callable[[int, int], None] | None = None
    """Called with the model and the settings done; with all of them when it is finished."""
    linear_algebra: ClassVar[bool] = True
    """Its results depend on numpy and scipy."""

    def __call__(self, unit: WorkUnit) -> dict[str, np.ndarray]:
        """Search and judge the model of a unit."""
        index = unit.start

        def say(done: int, _: int) -> None:
            if self.within is not None:
                self.within(index, done)

        say(0, 0)
        with one_blas_thread():
            found = score_candidate(self.entries[index], self.motion, budget=self.budget, tell=say)
        say(self.costs()[index], 0)
        most = max(len(entry.ranges) for entry in self.entries)
        return _packed(found, most, self.budget.starts + 1)

    def costs(self) -> list[int]:
        """Return the settings that each model's search simulates at most."""
        numbers = [len(entry.ranges) for entry in self.entries]
        return [self.budget.evaluations(one) if one else 0 for one in numbers]

    def fingerprint(self) -> dict[str, Any]:
        """Return what determines the numbers of all models, for the store of a run."""
        return {
            "models": [entry.model.describe() for entry in self.entries],
            "ranges": [[one.describe() for one in entry.ranges] for entry in self.entries],
            "seed": self.motion.seed,
            "budget": vars(self.budget),
            "aspects": list(self.motion.held.names),
        }


@dataclass(frozen=True, eq=False)
class Stages:
    """The two stages, and how far they are together."""

    work: Searches
    replicates: int
    """Recordings by which a discrepancy is judged; below 2 the second stage is left out."""
    stores: Stores
    executor: Executor | None
    """Elsewhere."""
    tell: Tell
    pool: Executor | None = None
    """Threads of this process, where there is no executor."""
    finished: Finished = ignore_progress
    """Hears of each model that was searched and judged."""

    def held_out(self) -> list[HeldOutScore]:
        """Judge every model, one work unit each."""
        entries = self.work.entries
        units = grid(model=np.arange(len(entries))).units(1)
        retained = self.stores("models", self.work.fingerprint())
        retained = MemoryStore() if retained is None else retained
        searched = self._searched_here if self.executor is None else self._searched_elsewhere
        arrays = searched(units, retained, self._each_once(units, retained))
        return [
            _unpacked({name: values[index] for name, values in arrays.items()}, entry)
            for index, entry in enumerate(entries)
        ]

    def evidence(self, held_out: Sequence[HeldOutScore]) -> dict[int, Evidence]:
        """Match the summaries with those that tie, and with others while none reproduces them.

        A model that does is no answer before those with fewer numbers were asked. Where one does,
        so is each walk of recorded steps that the distances do not reject: whether it passes all
        tests is their power.
        """
        if self.replicates < 2:
            return {}
        entries = self.work.entries
        shortlist = shortlist_models(entries, held_out)
        found: dict[int, Evidence] = {}
        for number, index in enumerate(shortlist.models):
            numbers = [entries[k].numbers for k, one in found.items() if one.discrepancy.usual]
            if number < shortlist.tied or entries[index].numbers < min(numbers, default=math.inf):
                planned = max(shortlist.tied, 1)
                found[index] = self._matched(len(found), index, held_out[index].point, planned)
        if any(one.discrepancy.usual for one in found.values()):
            for index, entry in enumerate(entries):
                if entry.baseline and not held_out_differences(held_out[index], self.work.motion):
                    found[index] = self._matched(len(found), index, np.empty(0), len(found) + 1)
        return found

    @cached_property
    def staged_progress(self) -> StagedProgress:
        """How far all stages are together."""
        able = [one for one in self.work.entries if not one.baseline]
        asks = self.replicates > 1
        # Most searches are given up after a few rounds, or find their optimum soon.
        usual = sorted(most_settings(len(one.ranges), self.replicates) // 4 for one in able)
        # A setting takes three times as long as one of the first stage (5 minutes of the bundled
        # recording): all blocks of time are simulated.
        # Three models are usually matched.
        summaries = 3.0 * sum(usual[-3:]) if asks else 0.0
        parts = {"models": sum(self.work.costs()), "summaries": summaries}
        return StagedProgress(self.tell, {**parts, "figures": 0.0})

    def _each_once(self, units: Sequence[WorkUnit], retained: Store) -> Callable[[int, int], None]:
        """Return what a sweep tells its progress, which hears of each finished model once."""
        reported: set[int] = set()

        def look(_done: int, _total: int) -> None:
            missing = {unit.start for unit in retained.missing(units)}
            for unit in units:
                index = unit.start
                if index in missing or index in reported:
                    continue
                reported.add(index)
                entry = self.work.entries[index]
                arrays = {name: values[0] for name, values in retained.read(unit).items()}
                one = _unpacked(arrays, entry)
                self.finished(entry.model.name, one.score, one.score_std, len(units))

        return look

    def _searched_here(
        self, units: Sequence[WorkUnit], retained: Store, look: Callable[[int, int], None]
    ) -> Arrays:
        """Search a user's own models, one by one, then those of driftwalk at the same time.

        A user's model may fail: that is said before the others take minutes.
        """
        entries, costs = self.work.entries, self.work.costs()
        missing = [unit.start for unit in retained.missing(units)]
        together = SearchProgress(
            [one.model.name for one in entries],
            costs,
            [0 if index in missing else cost for index, cost in enumerate(costs)],
            self.staged_progress.stage("models"),
        )
        threaded = [k for k in missing if self.pool is not None and runs_in_threads(entries[k])]
        others = [k for k in missing if k not in threaded]
        alone = replace(self.work, within=together)
        share = max(len(threaded), 1)
        sharing = [
            one._replace(like=replace(one.like, threads=max(one.like.threads // share, 1)))
            for one in entries
        ]
        # The block takes more steps of time than the others, which take the longer the more they
        # have to search: so none is left over for one processor at the end.
        threaded.sort(
            key=lambda k: (not isinstance(entries[k].model, BlockModel), -len(entries[k].ranges))
        )
        with together.cancellation:
            if others:
                run_sweep(alone, [units[k] for k in others], store=retained, progress=look)
            if threaded:
                first = [units[k] for k in threaded]
                shared = replace(alone, entries=sharing)
                run_sweep(shared, first, store=retained, executor=self.pool, progress=look)
        return collect(retained, units)

    def _searched_elsewhere(
        self, units: Sequence[WorkUnit], retained: Store, look: Callable[[int, int], None]
    ) -> Arrays:
        """Search models where an executor puts them: only whole ones are heard of."""

        def finished(done: int, total: int) -> None:
            self.staged_progress.stage("models")(done, total)
            look(done, total)

        executor = self.executor
        return run_sweep(self.work, units, store=retained, executor=executor, progress=finished)

    def _matched(self, number: int, index: int, answer: np.ndarray, planned: int) -> Evidence:
        """Match the summaries with one model: units of 16 settings, the rest in this process.

        So many models as `planned` are asked, or some more.
        """
        entry = self.work.entries[index]

        def say(done: int, most: int) -> None:
            # Most end at a quarter of the most, some there: the root gives half to either.
            inside = math.sqrt(done / most)
            self.staged_progress.stage("summaries")(
                number + inside, planned, f"summaries of {entry.model.name}"
            )

        fingerprint = {
            **self.work.fingerprint(), "asked": index, "answer": answer.tolist(),
            "worlds": self.replicates,
        }  # fmt: skip
        return estimate_evidence(
            entry,
            self.work.motion,
            answer,
            executor=self.executor or (self.pool if runs_in_threads(entry) else None),
            store=self.stores(f"summaries-{number}", fingerprint),
            tell=say,
        )


def _packed(held_out: HeldOutScore, most: int, searches: int) -> dict[str, np.ndarray]:
    """Return arrays of the same shapes for every model, with one entry each."""
    point = np.full(most, np.nan)
    point[: held_out.point.size] = held_out.point
    optimum_scores = np.full(searches, np.nan)
    optimum_scores[: held_out.optimum_scores.size] = held_out.optimum_scores
    arrays = {**held_out._asdict(), "point": point, "optimum_scores": optimum_scores}
    return {name: np.asarray(values)[None] for name, values in arrays.items()}


def _unpacked(arrays: Mapping[str, np.ndarray], entry: Candidate) -> HeldOutScore:
    optimum_scores = arrays["optimum_scores"]
    found = {
        **arrays,
        "point": arrays["point"][: len(entry.ranges)],
        "score": float(arrays["score"]),
        "optimum_scores": optimum_scores[np.isfinite(optimum_scores)],
        "evaluations": int(arrays["evaluations"]),
    }
    return HeldOutScore(**found)


DEFAULT_MODELS: Final = (
    BLOCK, "inertial", "active+wall", "run_tumble+wall", "run_rest+wall", "burst_coast+wall",
    "two_state+wall",
)  # fmt: skip
ALL_MODELS: Final = (
    *DEFAULT_MODELS, "run_tumble+wall+slow", "run_rest+wall+stroke", "run_rest+wall+reverse",
    "run_tumble+wall+follow+keep", "run_rest+wall+neighbours",
)  # fmt: skip


def compare_models(
    recording: xr.Dataset,
    models: Sequence[Chosen] = DEFAULT_MODELS,
    *,
    study: Study | None = None,
    flow: xr.Dataset | None = None,
    body: str | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    budget: Budget | None = None,
    stores: Stores | None = None,
    tell: Tell | None = None,
    finished: Finished = ignore_progress,
) -> xr.Dataset:
    """Search several motion models on a recording, and say which is closest and which explains it.

    The recording is cut into 20 blocks of time. Every model is searched on the even ones: by the
    mean of six two-dimensional KS distances over the recording's own floors, with a Sobol' design
    and CMA-ES (`driftwalk.calibration.evolution`). All are judged on the odd ones, which none has
    seen, and so are two walks that only repeat recorded steps: independent draws of them, and a
    hidden Markov walk of three states. Models are ranked by their distance there.

    The closest model, and those about as close, are matched with the recording by a hundred
    summaries of the motion, as in a calibration (`driftwalk.calibration.estimation`), and compared
    by their evidence. A model counts there if the recording's summaries are like those of its own
    simulated recordings. While none with as few parameters is, models farther off are asked as
    well, five in all at most.

    A model explains the recording where, in each aspect, it is no farther from the odd blocks than
    twice the distance of the recording's own parts, made of interleaved blocks, from each other,
    where no more than one of eight facts that are not fitted is far off, where its discrepancy of
    the summaries is usual for it, and where no other one is clearly closer or likelier. Where a
    walk of recorded steps passes all of that as well, or the summaries were not matched, or the
    wall was hardly touched, the comparison cannot tell.

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    models : sequence of str or MotionModel
        Names of the family with their parts, "block", or models.
    study : Study, optional
        Tank, camera, step interval and seed; default: the paper's, in the arena of the recording.
        ``bootstrap`` is the number of simulated recordings by which a discrepancy of the summaries
        is judged; below 2 leaves the summaries out.
    flow : xarray.Dataset, optional
        The water's velocity. For the block it is extracted from the even blocks when left out.
    body : str, optional
        The body, where the recording has several.
    threads : int, optional
        Default: all processors. The result does not depend on it. Models of driftwalk are searched
        at the same time, a user's own one after the other.
    executor : concurrent.futures.Executor, optional
        Searches and judges models elsewhere, see `driftwalk.sweep.run_sweep`: a work unit is one
        model, or 16 settings of which summaries are matched. Each then has one thread if `threads`
        is left out. Workers of a Dask cluster need the same numpy and scipy.
    budget : Budget, optional
        How much each search may simulate.
    stores : callable, optional
        Returns where finished models of a stage are kept, for what determines their numbers; memory
        when left out.
    tell : callable, optional
        Called with the thousandths of the work that are done, 1000, and the models under way; from
        several threads, one at a time.
    finished : callable, optional
        Called with each model's name, its distance, the standard error of that and the number of
        models, as soon as it is judged.

    Returns
    -------
    xarray.Dataset
        A `model_comparison`, the closest model first.

    Raises
    ------
    InputError
        When the recording is too short or does not move, or the block is asked for and no flow can
        be extracted.
    ConfigurationError
        When a model is named twice, or there is none of that name.

    Examples
    --------
    >>> import driftwalk as dw
    >>> recording = dw.tank30_recording()
    >>> found = dw.compare_models(recording, ["block", "inertial"])  # doctest: +SKIP
    """
    chosen = _study(recording, study)
    motion = body_motion(
        recording, chosen, flow=flow, body=body, threads=threads_of_unit(threads, executor)
    )
    entries, warnings = prepare_candidates(made_models(models, motion), motion)
    entries += resampling_baselines(motion)
    work = Searches(entries, motion, budget or Budget())
    with thread_pool(motion.like.threads if executor is None else 1) as pool:
        stages = Stages(
            work, motion.replicates, stores or in_memory, executor, tell or ignore_progress, pool,
            finished,
        )  # fmt: skip
        held_out = stages.held_out()
        evidence = stages.evidence(held_out)
    stages.staged_progress.begin("figures")
    return build_comparison(entries, held_out, motion, warnings, evidence)


def check_models(
    recording: xr.Dataset,
    models: Sequence[Chosen],
    *,
    study: Study | None = None,
    flow: xr.Dataset | None = None,
    body: str | None = None,
) -> list[MotionModel]:
    """Return the models that `compare_models` would compare; refuse what it would refuse.

    Simulates nothing.

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    models : sequence of str or MotionModel
        Names of the family with their parts, "block", or models.
    study : Study, optional
        As in `compare_models`.
    flow : xarray.Dataset, optional
        The water's velocity.
    body : str, optional
        The body, where the recording has several.

    Raises
    ------
    InputError
        When the recording is too short or does not move.
    ConfigurationError
        When a model is named twice, or there is none of that name.

    Examples
    --------
    >>> import driftwalk as dw
    >>> models = check_models(dw.tank30_recording(), ["block", "run-rest"])
    >>> [model.name for model in models]
    ['block', 'run_rest']
    """
    chosen = _study(recording, study)
    motion = body_motion(recording, chosen, flow=flow, body=body)
    made = made_models(models, motion)
    if len(made) == 1 and isinstance(made[0], ParticleModel):
        made[0].require_others(motion.like)
    return made


def _study(recording: xr.Dataset, study: Study | None) -> Study:
    """Return the given study, or the paper's in the arena of the recording."""
    from driftwalk.model import Study

    return study_in_arena(Study(), recording) if study is None else study
