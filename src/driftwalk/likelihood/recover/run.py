"""The recovery study: how well a set-up gives back a truth that is known."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Final

import numpy as np

from driftwalk.core.errors import InputError
from driftwalk.core.processors import one_blas_thread
from driftwalk.flow.arena import outline_of
from driftwalk.likelihood.recover.one import (
    FACTS,
    FLOW_PARTS,
    MESSAGE,
    PARTS,
    STATUS,
    Truth,
    recover_one,
)
from driftwalk.likelihood.recover.score import SCORED
from driftwalk.likelihood.recover.summary import COVERAGE_CONFIDENCE, NEEDED_CONFIDENCE, add_summary
from driftwalk.likelihood.refuse import LIMIT
from driftwalk.model.recover import RANDOM
from driftwalk.schema import FLAGS, check_flow_field
from driftwalk.schema.check import described
from driftwalk.schema.kinds import KINDS
from driftwalk.sweep import Store, WorkUnit, grid, run_sweep
from driftwalk.sweep.processes import single_threaded_processes

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study

Tell = Callable[[int, int], None]

_NAMES: Final = dict(zip(SCORED, ("drag_coefficient", "force_std", "tracking_noise"), strict=True))
"""From a parameter as a score names it to the variable."""


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
    check_recovery(study, flow)
    settings = study.recover
    angles = angles_of(study)
    # Recordings vary slowest, so that finished work predicts the remaining time.
    design = grid(
        recording=np.arange(settings.recordings),
        duration=np.array(settings.durations_s),
        angle=np.arange(len(angles)),
    )
    function = _Recoveries(Truth(study, flow), angles)
    units = design.units(1)
    with (
        nullcontext(executor)
        if executor or threads is None
        else single_threaded_processes(threads) as workers
    ):
        found = run_sweep(function, units, store=store, executor=workers, progress=tell)
    return _dataset(study, angles, design.unstack(found), flow)


@dataclass(frozen=True)
class _Recoveries:
    """The function of the sweep: one setting, simulated and fitted wherever it is sent."""

    truth: Truth
    angles: tuple[str, ...]
    linear_algebra: ClassVar[bool] = True
    """Its results depend on numpy and scipy."""

    def __call__(self, unit: WorkUnit) -> dict[str, Any]:
        with one_blas_thread():
            return _compute(self.truth, self.angles, unit)


def _compute(truth: Truth, angles: tuple[str, ...], unit: WorkUnit) -> dict[str, Any]:
    """Return what one setting gives, as arrays of one entry."""
    one = {name: values[0] for name, values in unit.settings.items()}
    found = recover_one(
        truth,
        recording=int(one["recording"]),
        duration=float(one["duration"]),
        angle=angles[int(one["angle"])],
    )
    text = np.array([found.pop("message")], dtype=f"U{MESSAGE}")
    status = np.array([found.pop("status")], dtype=np.int32)
    return {**{key: np.array([value]) for key, value in found.items()}, "status": status} | {
        "message": text
    }


def _dataset(
    study: Study, angles: tuple[str, ...], found: dict[str, Any], flow: xr.Dataset | None
) -> xr.Dataset:
    import xarray as xr

    dims = ("duration", "angle", "recording")
    tables = {key: np.moveaxis(values, 0, -1) for key, values in found.items()}
    data: dict[str, Any] = {}
    for key, name in _NAMES.items():
        for part in PARTS:
            data[f"{name}{part}"] = (dims, tables[f"{key}{part}"])
    for key in (*FLOW_PARTS, *FACTS):
        data[key] = (dims, tables[key])
    data["status"] = (dims, tables["status"])
    data["message"] = (dims, tables["message"].astype(object))
    fitted = tables["status"] == STATUS["fitted"]
    used = fitted & (np.where(fitted, tables["wall_share"], 1.0) <= LIMIT.most_wall_share)
    data["used"] = (dims, used.astype(np.int8))
    coords = {
        "duration": ("duration", np.array(study.recover.durations_s)),
        "angle": ("angle", np.array(angles, dtype=object)),
        "recording": ("recording", np.arange(study.recover.recordings)),
    }
    facts = {"kind": "recovery", "schema_version": KINDS["recovery"].version, **_attrs(study, flow)}
    dataset = xr.Dataset(data, coords=coords, attrs=facts)
    precision = study.recover.drag_coefficient_precision
    return described(add_summary(dataset, precision=precision))


def _attrs(study: Study, flow: xr.Dataset | None) -> dict[str, Any]:
    settings, forces = study.recover, study.forces
    asked = settings.drag_coefficient_precision
    return {
        "drag_coefficient": forces.drag_coefficient,
        "force_std_N": forces.force_std_N,
        "force_interval_s": forces.force_interval_s,
        "tracking_noise_m": Truth(study, flow).tracking_noise,
        "flow": _flow_name(study, flow),
        "sample_interval_s": settings.sample_interval_s,
        "recordings_per_fit": settings.recordings_per_fit,
        "missing_share": settings.missing_share,
        "seed": settings.seed,
        "confidence": study.fit.confidence,
        "coverage_confidence": COVERAGE_CONFIDENCE,
        "needed_confidence": NEEDED_CONFIDENCE,
        "most_wall_share": LIMIT.most_wall_share,
        "drag_coefficient_precision": np.nan if asked is None else asked,
        "study": study.to_toml(),
    }


def _flow_name(study: Study, flow: xr.Dataset | None) -> str:
    if flow is None:
        return f"random, {study.recover.flow_family}"
    named = study.recover.flow
    return str(flow.attrs.get("source", "given")) if named in (None, RANDOM) else str(named)


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
    _require_truth(study)
    _require_length(study)
    if flow is not None:
        _require_cover(study, flow)
    elif study.recover.flow != RANDOM:
        named = study.recover.flow
        raise InputError(
            "the flow of the water is missing: name the file of a flow field "
            '([recover] flow), or flow = "random"'
            if named is None
            else f"the flow {named} ([recover] flow) has to be loaded and passed as an argument"
        )


def angles_of(study: Study) -> tuple[str, ...]:
    """Return the uses of the orientation that a study compares."""
    return study.recover.angle or (study.fit.angle,)


def _require_truth(study: Study) -> None:
    seen, forces = study.observation, study.forces
    positive: dict[str, Any] = {
        "[forces] drag_coefficient": forces.drag_coefficient,
        "[forces] force_std_N": forces.force_std_N,
        "[observation] position_noise_m": seen.position_noise_m,
    }
    for key, value in positive.items():
        if isinstance(value, str) or not value > 0.0:
            raise InputError(
                f"the truth lacks {key}: a number above 0 is needed for the "
                f"simulation and the comparison with the fit, got {value!r}"
            )
    if isinstance(seen.orientation_noise_rad, str) and set(angles_of(study)) != {"none"}:
        raise InputError(
            "the truth lacks [observation] orientation_noise_rad: a number is needed where the "
            f"fit uses the orientation, got {seen.orientation_noise_rad!r}"
        )


def _require_length(study: Study) -> None:
    settings = study.recover
    shortest = min(settings.durations_s)
    samples = math.floor(shortest / settings.sample_interval_s + 1e-6) + 1
    # Five standard deviations: chance shall not stop a study half-way.
    retained = 1.0 - settings.missing_share
    expected = samples * retained - 5.0 * math.sqrt(samples * retained * settings.missing_share)
    if expected < LIMIT.fewest_samples:
        raise InputError(
            f"[recover] durations_s: {shortest:g} s at a sample every "
            f"{settings.sample_interval_s:g} s, {settings.missing_share:.0%} of them missing, are "
            f"about {samples * retained:.0f} positions; the fit needs {LIMIT.fewest_samples} at "
            "least, and some minutes to be of use"
        )


def _require_cover(study: Study, flow: xr.Dataset) -> None:
    check_flow_field(flow)
    if "time" in flow.dims:
        raise InputError("the true flow has frames: a recovery study needs a steady one")
    outline = outline_of(study.tank.to_arena())
    low_x, low_y, high_x, high_y = outline.bounds
    x, y = flow["x"].values, flow["y"].values
    cell = float(x[1] - x[0]), float(y[1] - y[0])
    ends = ((x, cell[0], low_x, high_x), (y, cell[1], low_y, high_y))
    tank = study.tank.describe()
    for nodes, size, low, high in ends:
        if nodes[0] - size > low + 1e-9 or nodes[-1] + size < high - 1e-9:
            raise InputError(
                f"the flow field does not cover the tank, a {tank}: it spans x from {x[0]:.4g} to "
                f"{x[-1]:.4g} m, y from {y[0]:.4g} to {y[-1]:.4g} m; give the field of this tank, "
                "or the tank of this field ([tank])"
            )
    depth = outline.depth(*(part.ravel() for part in np.meshgrid(x, y)))
    inner = (depth > math.hypot(*cell)).reshape(y.size, x.size)
    lacking = int(np.count_nonzero(inner & (flow["flag"].values == FLAGS["outside"])))
    if lacking:
        raise InputError(
            f"the flow field does not cover the tank, a {tank}: {lacking} of its nodes in there "
            "are flagged as outside of the tank that it was made for; give the field of this tank"
        )
