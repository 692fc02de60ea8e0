"""The recovery study: how well a set-up gives back a truth that is known."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import nullcontext
from typing import TYPE_CHECKING

import numpy as np

from driftwalk.likelihood.recover.result import build_recovery
from driftwalk.likelihood.recover.truth import FitRecovery
from driftwalk.sweep import Store, grid, run_sweep
from driftwalk.sweep.processes import single_threaded_processes

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study

Tell = Callable[[int, int], None]


def recovery_study(
    study: Study,
    flow: xr.Dataset | None = None,
    *,
    store: Store | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    tell: Tell | None = None,
) -> xr.Dataset:
    """Simulate recordings of known truth, fit them, and measure how well the fits recover it.

    Parameters
    ----------
    study : Study
        The truth ([forces], [observation], block, tank), how it is recorded ([recover]) and how it
        is fitted ([fit]).
    flow : xarray.Dataset, optional
        The true `flow_field`, steady. It may be left out where ``[recover] flow`` is "random".
    store : Store, optional
        Where finished recordings are kept; memory when left out.
    threads : int, optional
        Processes that fit recordings at the same time; one after the other in this one when left
        out. The numbers are the same to the rounding of the linear algebra library, and the same
        bits for any number of processes.
    executor : concurrent.futures.Executor, optional
        Fits recordings elsewhere, see `driftwalk.sweep.run_sweep`, in place of processes of this
        machine. Workers of a Dask cluster need the same numpy and scipy, and linear algebra of one
        thread.
    tell : callable, optional
        Called with the number of finished fits and the total.

    Returns
    -------
    xarray.Dataset
        Kind "recovery". On (duration, angle, recording): estimates, their intervals and errors,
        flow error, wall share and what became of the recording; on (parameter, duration, angle)
        their summary over the recordings that were fitted with at most 30 % of the intervals at the
        wall (``used``); on (angle) how the error of C_d falls with the length of a recording, and
        the length that the asked precision needs.

    Raises
    ------
    InputError
        When a true value is missing, a recording is shorter than the fit needs, or the flow does
        not cover the tank.

    Examples
    --------
    >>> import driftwalk as dw
    >>> noise = {"position_noise_m": "0.3mm", "orientation_noise_rad": "0.5deg"}
    >>> study = dw.Study(observation=noise)
    >>> found = dw.recovery_study(study, dw.tank30_flow())  # doctest: +SKIP
    >>> float(found["rms_error"].sel(parameter="drag_coefficient").squeeze())  # doctest: +SKIP
    0.04
    """
    method = FitRecovery(study, flow)
    method.check()
    settings = study.recover
    # Recordings vary slowest, so that finished work predicts the remaining time.
    design = grid(
        recording=np.arange(settings.recordings),
        duration=np.array(settings.durations_s),
        angle=np.arange(len(method.angles)),
    )
    with (
        nullcontext(executor)
        if executor or threads is None
        else single_threaded_processes(threads) as workers
    ):
        found = run_sweep(method, design.units(1), store=store, executor=workers, progress=tell)
    return build_recovery(method, design.unstack(found))


def check_recovery(study: Study, flow: xr.Dataset | None = None) -> None:
    """Raise the errors that `recovery_study` would raise; takes almost no time.

    Parameters
    ----------
    study, flow
        As of `recovery_study`.

    Raises
    ------
    InputError
        When a true value is missing, a recording is shorter than the fit needs, or the flow does
        not cover the tank.

    Examples
    --------
    >>> import driftwalk as dw
    >>> dw.likelihood.check_recovery(dw.Study(), dw.tank30_flow())
    Traceback (most recent call last):
        ...
    driftwalk.core.errors.InputError: the truth lacks [observation] position_noise_m: ...
    """
    FitRecovery(study, flow).check()
