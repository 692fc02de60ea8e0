"""Which motion model explains a recording? All searched alike, and judged on what none has seen."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

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
from driftwalk.motion import MotionModel
from driftwalk.sweep import Store, WorkUnit, grid, run_sweep

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study

DEFAULT_MODELS: Final = (
    BLOCK, "inertial", "active+wall", "run_tumble+wall", "run_rest+wall", "burst_coast+wall",
    "two_state+wall",
)  # fmt: skip
ALL_MODELS: Final = (
    *DEFAULT_MODELS, "run_tumble+wall+slow", "run_rest+wall+stroke", "run_rest+wall+reverse",
    "run_tumble+wall+follow+keep",
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
    motion = body_motion(recording, chosen, flow=flow, body=body, threads=threads)
    entries, warnings = contestants(made_models(models, motion, chosen), motion, chosen)
    entries += walks(motion)
    seed = chosen.calibration.seed
    judged = _judged_all(entries, motion, seed, budget or Budget(), store, tell)
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
    return made_models(models, motion, chosen)


def _study(recording: xr.Dataset, study: Study | None) -> Study:
    """Return the given study, or the paper's in the arena of the recording."""
    from driftwalk.model import Study

    return study_in_arena(Study(), recording) if study is None else study


def _judged_all(
    entries: Sequence[Contestant],
    motion: RecordedMotion,
    seed: int,
    budget: Budget,
    store: Callable[[Mapping[str, Any]], Store] | None,
    tell: Tell | None,
) -> list[Judged]:
    """Judge every model, one work unit each."""
    most = max(len(entry.ranges) for entry in entries)
    costs = [budget.evaluations(len(one.ranges)) if one.ranges else 0 for one in entries]
    before = [0, *itertools.accumulate(costs)]

    def compute(unit: WorkUnit) -> dict[str, np.ndarray]:
        index = unit.start
        entry = entries[index]

        def say(done: int, _: int) -> None:
            if tell is not None:
                tell(before[index] + done, before[-1], entry.model.name)

        say(0, 0)
        found = judge(entry, motion, budget=budget, seed=seed, tell=say)
        return _packed(found, most, budget.starts + 1)

    units = grid(model=np.arange(len(entries))).units(1)
    kept = None if store is None else store(_fingerprint(entries, motion, seed, budget))
    arrays = run_sweep(compute, units, store=kept)
    if tell is not None:
        tell(before[-1], before[-1], "figures")
    return [
        _unpacked({name: values[index] for name, values in arrays.items()}, entry)
        for index, entry in enumerate(entries)
    ]


def _fingerprint(
    entries: Sequence[Contestant], motion: RecordedMotion, seed: int, budget: Budget
) -> dict[str, Any]:
    """Return what determines the numbers of all models, for the store of a run."""
    return {
        "models": [entry.model.describe() for entry in entries],
        "ranges": [[one.describe() for one in entry.ranges] for entry in entries],
        "seed": seed,
        "budget": vars(budget),
        "aspects": list(motion.held.names),
    }


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
