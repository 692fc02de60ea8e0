"""Does the model explain the recording? The check of a likelihood fit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from driftwalk.core.errors import InputError, reason_of
from driftwalk.core.processors import one_blas_thread
from driftwalk.likelihood.check.errors import Innovations, innovations_of
from driftwalk.likelihood.check.motion import FEWEST_REPLICATES, compare_motion
from driftwalk.likelihood.check.place import residuals_of
from driftwalk.likelihood.check.posterior_predictive import (
    posterior_replicates,
    problems_of,
    replicates_at_estimate,
)
from driftwalk.likelihood.check.result import (
    criterion_variables,
    motion_variables,
    place_variables,
    white_variables,
)
from driftwalk.likelihood.check.scan import scan_of
from driftwalk.likelihood.check.verdict import VERDICT, criteria_of, findings_of
from driftwalk.likelihood.estimate import estimate_of
from driftwalk.likelihood.flow_of_fit import require_fit
from driftwalk.likelihood.preparation import as_list
from driftwalk.likelihood.solution import BREAKDOWN
from driftwalk.schema.answers.facts import texts
from driftwalk.schema.answers.fit import with_verdict
from driftwalk.schema.check import build_dataset

if TYPE_CHECKING:
    import xarray as xr


@one_blas_thread()
def check_model(
    fit: xr.Dataset,
    recordings: xr.Dataset | Sequence[xr.Dataset],
    *,
    body: str | None = None,
    replicates: int = 16,
    seed: int = 0,
) -> xr.Dataset:
    """Say whether the model explains the recordings that it was fitted to, and where it does not.

    Ten criteria with a p value, for the errors of prediction and the motion of simulated
    recordings, and a largest share of outliers; the model explains the recording unless a p value
    is below 0.0005. A recording of the model itself fails once in 200 times by that count
    (Bonferroni; measured: docs/explanation/likelihood.md). The check corrects for the errors that
    fitting hundreds of coefficients absorbs: their covariance at the estimate is ``I - J C J'``.

    Parameters
    ----------
    fit : xarray.Dataset
        Result of `fit_motion`.
    recordings : xarray.Dataset or sequence of xarray.Dataset
        The fitted recordings, in the same order.
    body : str, optional
        The body, where a recording has several.
    replicates : int
        Simulated recordings of either set, at least 4.
    seed : int
        Their seed, >= 0.

    Returns
    -------
    xarray.Dataset
        A `model_check`: ``explained`` (true, false) and ``finding`` (sentences: statistic, value,
        expected, place or time); in its attributes ``ks_distance``, ``ks_noise_floor``,
        ``effective_parameters``. By criterion ``p_value``; whiteness by
        component and lag; residuals by cell, by part of the recording and by speed; densities of
        steps with bands.

    Raises
    ------
    InputError
        When the first dataset is no fit, or was made of other recordings, there are fewer than
        four replicates, or the fit used too few intervals to tell anything from their errors.

    Examples
    --------
    >>> import driftwalk as dw
    >>> recording = dw.tank30_recording()
    >>> check = dw.check_model(dw.fit_motion(recording), recording)  # doctest: +SKIP
    >>> bool(check["explained"])  # doctest: +SKIP
    True
    """
    if replicates < FEWEST_REPLICATES:
        raise InputError(f"replicates must be at least {FEWEST_REPLICATES}, got {replicates}")
    fit, many = require_fit(fit), as_list(recordings)
    estimate = estimate_of(fit, many, body=body)
    errors = innovations_of(estimate)
    _require_used(errors)
    try:
        found = residuals_of(estimate, errors)
    except np.linalg.LinAlgError as error:
        raise InputError(
            "the model cannot be checked: the uncertainty of the fit is infinite; "
            "the motion says next to nothing about the flow"
        ) from error
    attrs: dict[str, Any] = {
        "effective_parameters": found.leverage.parameters,
        "samples": sum(one.used.size for one in errors),
        "samples_used": sum(int(one.used.sum()) for one in errors),
        "outliers": sum(int(one.outlier.sum()) for one in errors),
        "portmanteau": found.white.portmanteau,
        "portmanteau_dof": found.white.portmanteau_dof,
        "cell_size_m": found.layout.size,
        "replicates": replicates,
        "seed": seed,
        "level": VERDICT.level,
        "arena": fit.attrs["arena"],
        "source": fit.attrs["source"],
        "simulated_recording": fit.attrs["simulated_recording"],
    }
    data, coords = white_variables(found)
    parts = [place_variables(found)]
    try:
        problems = problems_of(fit, estimate, many)
        drawn = posterior_replicates(
            fit, estimate, problems, found.leverage.spread, count=replicates, seed=seed
        )
        motion = compare_motion(
            np.concatenate([problem.steps for problem in problems]),
            replicates_at_estimate(fit, problems, count=replicates, seed=seed),
            drawn,
            threads=problems[0].like.threads,
        )
        paths = [(one.series.time, one.series.x, one.series.y) for one in errors]
        scan = scan_of(paths, drawn.paths, found.layout)
        more, at, facts = motion_variables(motion)
        parts.append((more, at))
        attrs |= facts
    except InputError as error:
        # If the steps of a recording cannot be compared, the check still tests whether its errors
        # are white.
        motion, scan = None, None
        attrs |= {"ks_distance": np.nan, "ks_noise_floor": np.nan, "ks_left_out": str(error)}
    criteria = criteria_of(
        errors,
        found,
        motion,
        scan,
        angle=fit.attrs["angle"],
        mistakes=int(fit["mistakes"]),
    )
    parts.append(criterion_variables(criteria))
    for more, at in parts:
        data |= more
        coords |= at
    findings = findings_of(criteria)
    data["explained"] = ((), np.bool_(not findings))
    coords["finding"] = ("finding", texts(findings))
    return build_dataset("model_check", data, coords, attrs)


def _require_used(errors: Sequence[Innovations]) -> None:
    """Refuse a check of so few errors that the tests of them mean nothing."""
    used = sum(int(one.used.sum()) for one in errors)
    if used < VERDICT.fewest_used:
        intervals = sum(one.used.size - 1 for one in errors)
        raise InputError(
            f"the model cannot be checked: the fit used {used} of {intervals} intervals between "
            f"samples, and the check needs {VERDICT.fewest_used} at least"
        )


class Judged(NamedTuple):
    """A fit that was checked."""

    fit: xr.Dataset
    """A `fit`, with the verdict in it; where no check could be made, its attribute
    ``check_left_out`` says why."""
    check: xr.Dataset | None
    """The `model_check`; None where it could not be made."""


def judge_fit(
    fit: xr.Dataset, recordings: Sequence[xr.Dataset], *, body: str | None = None
) -> Judged:
    """Check a fit and keep the verdict in it.

    Parameters
    ----------
    fit : xarray.Dataset
        Result of `fit_motion`.
    recordings : sequence of xarray.Dataset
        The fitted recordings, in the same order.
    body : str, optional
        The body, where a recording has several.

    Returns
    -------
    Judged
        The `fit` with the verdict, and the `model_check`. A fit that cannot be checked is no
        error: its attribute ``check_left_out`` says why.

    Examples
    --------
    >>> import driftwalk as dw
    >>> recording = dw.tank30_recording()
    >>> found = judge_fit(dw.fit_motion(recording), [recording])  # doctest: +SKIP
    >>> bool(found.fit["explained"])  # doctest: +SKIP
    True
    """
    try:
        check = check_model(fit, recordings, body=body)
    except InputError as error:
        return Judged(fit.assign_attrs(check_left_out=str(error)), None)
    except BREAKDOWN as error:
        why = f"the model cannot be checked: the check broke down ({reason_of(error)})"
        return Judged(fit.assign_attrs(check_left_out=why), None)
    return Judged(with_verdict(fit, check), check)
