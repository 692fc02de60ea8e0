"""A recovery study of a motion model: simulated recordings of known truth, all calibrated."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from driftwalk.calibration.recover.result import build_model_recovery
from driftwalk.calibration.recover.truth import ModelRecovery, Noise, model_recovery
from driftwalk.conditions import study_in_arena
from driftwalk.core.run_stages import CALIBRATION_STAGES, tell_nobody
from driftwalk.motion import MotionModel
from driftwalk.sweep import Store, grid, run_sweep, threads_of_unit

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study

Tell = Callable[[int, int, str], None]
WHOLE = 100
"""Parts of a recording in which progress is counted."""


def recover_model(
    model: MotionModel,
    truth: Mapping[str, float],
    study: Study | None = None,
    *,
    flow: xr.Dataset | None = None,
    like: xr.Dataset | None = None,
    body: str | None = None,
    noise: Noise = "estimated",
    threads: int | None = None,
    executor: Executor | None = None,
    store: Store | None = None,
    tell: Tell | None = None,
) -> xr.Dataset:
    """Simulate recordings of a motion model of known truth, calibrate them, and compare.

    Each recording is calibrated as `calibrate` does it for a recording of one's own: the parameters
    of the model are searched, and the noise of the camera is estimated unless it is known. A value
    that the model was made with is known to the simulation and to the calibration.

    Parameters
    ----------
    model : MotionModel
        The model, as `motion_model` returns it, with at least one parameter left open.
    truth : mapping of str to float
        The true value of each of its parameters, in its unit.
    study : Study, optional
        Tank, [observation] of the camera, and the search; ``[recover]`` has the number of
        recordings, their length (one), clock and gaps, and the seed. Default: the paper's, in the
        tank of `like`.
    flow : xarray.Dataset, optional
        The water's velocity, for a model that has a use for it. It is known to the calibration.
    like : xarray.Dataset, optional
        A `trajectory` that gives start, time stamps, gaps and camera in place of the study.
    body : str, optional
        Its body, where there are several.
    noise : {"estimated", "known"}
        Whether a calibration estimates the noise of the camera from its recording, or knows it.
    threads : int, optional
        Default: all processors. The result does not depend on it.
    executor : concurrent.futures.Executor, optional
        Calibrates recordings elsewhere, see `driftwalk.sweep.run_sweep`; each then has one thread
        if `threads` is left out. Workers of a Dask cluster need the same numpy and scipy.
    store : Store, optional
        Where finished recordings are kept; memory when left out.
    tell : callable, optional
        Called with the hundredths of recordings that are done, all of them, and the work under way.

    Returns
    -------
    xarray.Dataset
        A `model_recovery`: estimate, interval, and whether it is determined, by recording and
        parameter; median error, share determined and coverage by parameter.

    Raises
    ------
    ConfigurationError
        When a true value is missing, is none, or belongs to no parameter.
    InputError
        When the recordings would be too short or motionless, several lengths are given, or the
        model is the block.

    Examples
    --------
    >>> import driftwalk as dw
    >>> model = dw.motion_model("active", turn_rate=0.0)
    >>> truth = {"speed": 0.03, "rotational_diffusion": 0.5}
    >>> found = dw.calibration.recover_model(model, truth)  # doctest: +SKIP
    >>> found["median_error"].sel(parameter="speed").item()  # doctest: +SKIP
    0.01
    """
    known = _checked(model, truth, study, flow, like, body, noise)
    count = known.study.recover.recordings
    say = tell if tell is not None else tell_nobody
    # Only work of this process can say how far it is within a recording.
    within = partial(_tell_stage, say, count) if executor is None else None
    method = replace(known, threads=threads_of_unit(threads, executor), within=within)

    def said(done: int, total: int) -> None:
        say(WHOLE * done, WHOLE * total, "recordings")

    units = grid(recording=np.arange(count)).units(1)
    found = run_sweep(method, units, store=store, executor=executor, progress=said)
    return build_model_recovery(known, found)


def check_model_recovery(
    model: MotionModel,
    truth: Mapping[str, float],
    study: Study | None = None,
    *,
    flow: xr.Dataset | None = None,
    like: xr.Dataset | None = None,
    body: str | None = None,
    noise: Noise = "estimated",
) -> None:
    """Raise the errors that `recover_model` would raise; simulates one recording.

    Parameters
    ----------
    model, truth, study, flow, like, body, noise
        As of `recover_model`.

    Raises
    ------
    ConfigurationError
        When a true value is missing, is none, or belongs to no parameter.
    InputError
        When the recordings would be too short or motionless, several lengths are given, or the
        model is the block.

    Examples
    --------
    >>> import driftwalk as dw
    >>> model = dw.motion_model("active", turn_rate=0.0)
    >>> dw.calibration.check_model_recovery(model, {"speed": 0.03, "rotational_diffusion": 0.5})
    """
    _checked(model, truth, study, flow, like, body, noise)


def _checked(
    model: MotionModel,
    truth: Mapping[str, float],
    study: Study | None,
    flow: xr.Dataset | None,
    like: xr.Dataset | None,
    body: str | None,
    noise: Noise,
) -> ModelRecovery:
    from driftwalk.model import Study

    chosen = study if study is not None else Study()
    if study is None and like is not None:
        chosen = study_in_arena(chosen, like)
    known = model_recovery(model, truth, chosen, flow=flow, like=like, body=body, noise=noise)
    known.check()
    return known


def _tell_stage(tell: Tell, recording: int, count: int, stage: str, done: int, total: int) -> None:
    """Say how far the calibration of a recording is."""
    known = CALIBRATION_STAGES[stage]
    percent = known.percent(done / total if total else 1.0)
    tell(
        WHOLE * recording + round(0.01 * WHOLE * percent),
        WHOLE * count,
        f"recording {recording + 1} of {count}: {known.words}",
    )
