"""Which motion model explains a recording? All searched alike, and judged on what none has seen."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from typing import TYPE_CHECKING, Final

from driftwalk.calibration.evolution import Budget
from driftwalk.calibration.held_out.candidates import (
    BLOCK,
    Chosen,
    made_models,
    prepare_candidates,
    resampling_baselines,
)
from driftwalk.calibration.held_out.recorded import body_motion
from driftwalk.calibration.problem import Stores, in_memory
from driftwalk.calibration.ranking.comparison_stages import (
    Finished,
    Searches,
    Stages,
    Tell,
    thread_pool,
)
from driftwalk.calibration.ranking.result import build_comparison
from driftwalk.conditions import study_in_arena
from driftwalk.core.run_stages import tell_nobody
from driftwalk.motion import MotionModel, ParticleModel
from driftwalk.sweep import threads_of_unit

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
    finished: Finished = tell_nobody,
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
    where no more than one of eight facts that are not fitted is far off, where its misfit of the
    summaries is usual for it, and where no other one is clearly closer or likelier. Where a walk of
    recorded steps passes all of that as well, or the summaries were not matched, or the wall was
    hardly touched, the comparison cannot tell.

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
            work, motion.replicates, stores or in_memory, executor, tell or tell_nobody, pool,
            finished,
        )  # fmt: skip
        held_out = stages.held_out()
        evidence = stages.evidence(held_out)
    stages.course.begin("figures")
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
