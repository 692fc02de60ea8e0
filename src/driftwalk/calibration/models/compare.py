"""Which motion model explains a recording? All searched alike, and judged on what none has seen."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar, Final

import numpy as np

from driftwalk.calibration.evolution import Budget
from driftwalk.calibration.models.contestants import (
    BLOCK,
    Chosen,
    Contestant,
    contestants,
    made_models,
    walks,
)
from driftwalk.calibration.models.judge import Judged, judge
from driftwalk.calibration.models.recorded import RecordedMotion, body_motion
from driftwalk.calibration.models.result import build_comparison
from driftwalk.conditions import study_in_arena
from driftwalk.core.processors import one_blas_thread
from driftwalk.core.run_stages import tell_nobody
from driftwalk.motion import MotionModel, ParticleModel
from driftwalk.sweep import Store, WorkUnit, grid, run_sweep, threads_of_unit

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study

DEFAULT_MODELS: Final = (
    BLOCK, "inertial", "active+wall", "run_tumble+wall", "run_rest+wall", "burst_coast+wall",
    "two_state+wall",
)  # fmt: skip
ALL_MODELS: Final = (
    *DEFAULT_MODELS, "run_tumble+wall+slow", "run_rest+wall+stroke", "run_rest+wall+reverse",
    "run_tumble+wall+follow+keep", "run_rest+wall+neighbours",
)  # fmt: skip
Tell = Callable[[int, int, str], None]


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
    store: Callable[[Mapping[str, Any]], Store] | None = None,
    tell: Tell | None = None,
) -> xr.Dataset:
    """Search several motion models on a recording, and say which is closest and which explains it.

    The recording is cut into 20 blocks of time. Every model is searched on the even ones: by the
    mean of six two-dimensional KS distances over the recording's own floors, with a Sobol' design
    and CMA-ES (`driftwalk.calibration.evolution`). All are judged on the odd ones, which none has
    seen, and so are two walks that only repeat recorded steps: independent draws of them, and a
    hidden Markov walk of three states. Models are ranked by their distance there.

    A model explains the recording where, in each aspect, it is no farther from the odd blocks than
    twice the distance of the recording's own parts, made of interleaved blocks, from each other,
    where no more than one of eight facts that are not fitted is far off, and where no other one is
    clearly closer.

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    models : sequence of str or MotionModel
        Names of the family with their parts, "block", or models.
    study : Study, optional
        Tank, camera, step interval and seed; default: the paper's, in the arena of the recording.
    flow : xarray.Dataset, optional
        The water's velocity. For the block it is extracted from the even blocks when left out.
    body : str, optional
        The body, where the recording has several.
    threads : int, optional
        Default: all processors. The result does not depend on it.
    executor : concurrent.futures.Executor, optional
        Searches and judges models elsewhere, see `driftwalk.sweep.run_sweep`: a work unit is one
        model. Each then has one thread if `threads` is left out. Workers of a Dask cluster need the
        same numpy and scipy.
    budget : Budget, optional
        How much each search may simulate.
    store : callable, optional
        Returns where finished models are kept, for what determines their numbers; memory when left
        out.
    tell : callable, optional
        Called with the settings done, all of them, and the model under way.

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
    entries, warnings = contestants(made_models(models, motion, chosen), motion, chosen)
    entries += walks(motion)
    work = _Comparison(entries, motion, chosen.calibration.seed, budget or Budget())
    judged = _judged_all(work, store, executor, tell)
    return build_comparison(entries, judged, motion, chosen, recording, warnings)


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
    made = made_models(models, motion, chosen)
    if len(made) == 1 and isinstance(made[0], ParticleModel):
        made[0].require_others(motion.like)
    return made


def _study(recording: xr.Dataset, study: Study | None) -> Study:
    """Return the given study, or the paper's in the arena of the recording."""
    from driftwalk.model import Study

    return study_in_arena(Study(), recording) if study is None else study


@dataclass(frozen=True, eq=False)
class _Comparison:
    """The function of the sweep: one model, searched and judged wherever it is sent."""

    entries: Sequence[Contestant]
    motion: RecordedMotion
    seed: int
    budget: Budget
    within: Callable[[int, int], None] | None = None
    """Called with the model and the settings done."""
    linear_algebra: ClassVar[bool] = True
    """Its results depend on numpy and scipy."""

    def __call__(self, unit: WorkUnit) -> dict[str, np.ndarray]:
        index = unit.start

        def say(done: int, _: int) -> None:
            if self.within is not None:
                self.within(index, done)

        say(0, 0)
        with one_blas_thread():
            found = judge(
                self.entries[index], self.motion, budget=self.budget, seed=self.seed, tell=say
            )
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
            "seed": self.seed,
            "budget": vars(self.budget),
            "aspects": list(self.motion.held.names),
        }


def _judged_all(
    work: _Comparison,
    store: Callable[[Mapping[str, Any]], Store] | None,
    executor: Executor | None,
    tell: Tell | None,
) -> list[Judged]:
    """Judge every model, one work unit each."""
    before = [0, *itertools.accumulate(work.costs())]
    say = tell if tell is not None else tell_nobody

    def within(index: int, done: int) -> None:
        say(before[index] + done, before[-1], work.entries[index].model.name)

    def finished(done: int, total: int) -> None:
        say(done, total, "models")

    units = grid(model=np.arange(len(work.entries))).units(1)
    kept = None if store is None else store(work.fingerprint())
    # Only work of this process can say how far it is within a model.
    arrays = (
        run_sweep(replace(work, within=within), units, store=kept)
        if executor is None
        else run_sweep(work, units, store=kept, executor=executor, progress=finished)
    )
    say(before[-1], before[-1], "figures")
    return [
        _unpacked({name: values[index] for name, values in arrays.items()}, entry)
        for index, entry in enumerate(work.entries)
    ]


def _packed(judged: Judged, most: int, searches: int) -> dict[str, np.ndarray]:
    """Return arrays of the same shapes for every model, with one entry each."""
    point = np.full(most, np.nan)
    point[: judged.point.size] = judged.point
    ends = np.full(searches, np.nan)
    ends[: judged.ends.size] = judged.ends
    arrays = {**judged._asdict(), "point": point, "ends": ends}
    return {name: np.asarray(values)[None] for name, values in arrays.items()}


def _unpacked(arrays: Mapping[str, np.ndarray], entry: Contestant) -> Judged:
    return Judged(
        point=arrays["point"][: len(entry.ranges)],
        trained=arrays["trained"],
        held=arrays["held"],
        score=float(arrays["score"]),
        without=arrays["without"],
        checks=arrays["checks"],
        ends=arrays["ends"][np.isfinite(arrays["ends"])],
        evaluations=int(arrays["evaluations"]),
    )
