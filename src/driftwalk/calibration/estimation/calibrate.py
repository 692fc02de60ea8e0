"""Calibrate a model with more parameters than a map can show."""

from __future__ import annotations

from concurrent.futures import Executor
from typing import TYPE_CHECKING

from driftwalk.calibration.estimation.result import build_model_calibration
from driftwalk.calibration.estimation.run import Stores, Tell, estimate
from driftwalk.calibration.held_out.candidates import prepare_candidates, with_contact_clearance
from driftwalk.calibration.held_out.recorded import body_motion
from driftwalk.conditions import jump_warnings
from driftwalk.motion import MotionModel

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


def calibrate_many(
    recording: xr.Dataset,
    model: MotionModel,
    study: Study,
    *,
    flow: xr.Dataset | None,
    body: str | None,
    threads: int | None,
    executor: Executor | None,
    stores: Stores,
    tell: Tell,
) -> xr.Dataset:
    """Return the `model_calibration` of a model with any number of parameters.

    Parameters
    ----------
    recording : xarray.Dataset
        A `trajectory`.
    model : MotionModel
        What is calibrated. A self-propelled body without a clearance has that of the recording.
    study : Study
        Tank, camera, step interval, seed, confidence; ``bootstrap`` is the number of simulated
        recordings by which the discrepancy is judged, 0 leaves the second stage out.
    flow : xarray.Dataset or None
        The water's velocity.
    body : str or None
        The body, where the recording has several.
    threads : int or None
        None: all processors. The result does not depend on it.
    executor : concurrent.futures.Executor or None
        Computes the summaries' work units elsewhere; the search runs here.
    stores : callable
        Where each stage keeps finished work.
    tell : callable
        Called with the stage and its progress.

    Raises
    ------
    InputError
        When the recording is too short or does not move, or the model gives no numbers.
    """
    motion = body_motion(recording, study, flow=flow, body=body, threads=threads)
    entries, warnings = prepare_candidates([with_contact_clearance(model, motion)], motion, study)
    warnings += jump_warnings(recording, body)
    search = study.calibration
    found = estimate(
        entries[0],
        motion,
        seed=search.seed,
        replicates=search.bootstrap if search.refine == "auto" else 0,
        confidence=search.confidence,
        executor=executor,
        stores=stores,
        tell=tell,
    )
    return build_model_calibration(found, entries[0], motion, study, recording, warnings)
