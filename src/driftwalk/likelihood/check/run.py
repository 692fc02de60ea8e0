"""Does the model explain the recording? The check of a likelihood fit, and its `model_check`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from driftwalk.core.errors import InputError, reason_of
from driftwalk.core.processors import one_blas_thread
from driftwalk.likelihood.angle_consistency import log_evidence
from driftwalk.likelihood.check.criteria import (
    MODEL_CHECK,
    components_of,
    criteria_of,
    distance_limit,
)
from driftwalk.likelihood.check.errors import innovations_of
from driftwalk.likelihood.check.measured import left_out_sentence
from driftwalk.likelihood.check.place import Layout, Residuals, residuals_of
from driftwalk.likelihood.check.posterior_predictive import (
    BAND,
    FEWEST_REPLICATES,
    MotionComparison,
    compare_motion,
    distances_at_estimate,
)
from driftwalk.likelihood.check.replicates import (
    filtered_states,
    posterior_replicates,
    problems_of,
    recorded_steps,
    replicates_at_estimate,
    restarted,
)
from driftwalk.likelihood.check.restarts import RESTART, further_apart
from driftwalk.likelihood.check.scan import scan_of
from driftwalk.likelihood.check.verdict import verdict_on
from driftwalk.likelihood.fit import fit_motion
from driftwalk.likelihood.flow_intervals import require_fit
from driftwalk.likelihood.measured_flow import measured_flow
from driftwalk.likelihood.measured_series import stored_flow
from driftwalk.likelihood.preparation import as_list, estimate_of, spline_of
from driftwalk.likelihood.refuse import BREAKDOWN
from driftwalk.likelihood.warnings import against_water, is_against_water
from driftwalk.schema.answers.facts import facts_of, fitted_value, sentences, texts
from driftwalk.schema.answers.fit import with_verdict
from driftwalk.schema.answers.force_law import FORWARD_SELECTION
from driftwalk.schema.answers.verdict import (
    DOES_NOT_EXPLAIN,
    EXPLAINS,
    stored_verdict,
    verdict_of,
    verdict_variables,
)
from driftwalk.schema.check import build_dataset, described

if TYPE_CHECKING:
    import xarray as xr


def white_variables(found: Residuals) -> dict[str, Any]:
    """Return the variables of whiteness."""
    white, by_lag = found.white, ("component", "lag")
    return {
        "component": ("component", np.array(components_of(len(white.chi_squared)), dtype=object)),
        "lag": ("lag", np.arange(1, white.autocorrelation.shape[1] + 1)),
        "autocorrelation": (by_lag, white.autocorrelation),
        "autocorrelation_expected": (by_lag, white.expected),
        "autocorrelation_std": (by_lag, white.std),
        "chi_squared_per_dof": ("component", white.chi_squared),
        "chi_squared_expected": ("component", white.expected_chi_squared),
        "excess_kurtosis": ("component", white.excess_kurtosis),
        "tail_share": ("component", white.tail_share),
    }


def place_variables(found: Residuals) -> dict[str, Any]:
    """Return the variables by cell, by part of the recording and by speed."""
    layout = found.layout
    shape = (layout.y.size, layout.x.size)
    plane = ("y", "x")
    place, part = found.place, found.part
    table = part.chi_squared.reshape(layout.parts, -1)
    known = np.isfinite(table)
    samples = part.samples.reshape(layout.parts, -1).sum(axis=1)
    sums = (part.mean * part.samples[:, None]).reshape(layout.parts, layout.cells, -1).sum(axis=1)
    mean = np.where(place.samples[:, None] > 0, place.mean, np.nan).T.reshape(-1, *shape)
    # What the largest distance of all cells exceeds once in twenty.
    cells = int(np.isfinite(place.chi_squared).sum())
    limit = {"limit": distance_limit(max(cells, 1), place.mean.shape[1])}
    return {
        "x": ("x", layout.x),
        "y": ("y", layout.y),
        "residual": (("component", *plane), mean),
        "residual_count": (plane, place.samples.reshape(shape)),
        "residual_distance": (plane, np.sqrt(place.chi_squared).reshape(shape), limit),
        "noise_ratio": (plane, found.noise_by_place.ratio.reshape(shape)),
        "noise_ratio_std": (plane, found.noise_by_place.std.reshape(shape)),
        "part_residual": (("part", "component"), sums / np.maximum(samples, 1.0)[:, None]),
        "part_count": ("part", samples),
        "part_chi_squared": ("part", np.nansum(table, axis=1)),
        "part_dof": ("part", place.mean.shape[1] * known.sum(axis=1)),
        "part_noise_ratio": ("part", found.noise_by_part.ratio),
        "part_noise_ratio_std": ("part", found.noise_by_part.std),
        "flow_change": ("part", np.where(found.strength.visible, found.strength.change, np.nan)),
        "flow_change_std": ("part", np.where(found.strength.visible, found.strength.std, np.nan)),
        "drag_change": ("speed_range", found.drag.change),
        "drag_change_std": ("speed_range", found.drag.std),
    }


def layout_coordinates(layout: Layout) -> dict[str, Any]:
    """Return where the parts of the recording and the ranges of speed begin and end."""
    edges = layout.speed if layout.speed.size > 1 else np.array([np.nan, np.nan])
    return {
        "part_recording": ("part", [layout.recording(part) for part in range(layout.parts)]),
        "part_start": ("part", layout.start),
        "part_end": ("part", layout.end),
        "speed_low": ("speed_range", edges[:-1]),
        "speed_high": ("speed_range", edges[1:]),
    }


def motion_variables(motion: MotionComparison) -> dict[str, Any]:
    """Return distances and densities."""
    data: dict[str, Any] = {
        "ks_to_estimate": ("replicate", motion.distance),
        "ks_floor": ("pair", motion.floor),
        "ks_to_drawn": ("drawn_replicate", motion.drawn_distance),
        "ks_between_drawn": ("drawn_replicate", motion.drawn_between),
    }
    for name in ("step_length", "turning_angle"):
        density = getattr(motion, name)
        data[f"{name}_edge"] = (f"{name}_edge", density.edge)
        for part in ("recording", "median", "low", "high"):
            data[f"{name}_density_{part}"] = (f"{name}_bin", getattr(density, part))
    return data


def motion_facts(motion: MotionComparison) -> dict[str, Any]:
    """Return the numbers of the comparison."""
    low, high = np.quantile(motion.distance, [0.5 * (1 - BAND), 0.5 * (1 + BAND)])
    return {
        "ks_distance": float(np.median(motion.distance)),
        "ks_distance_interval": [float(low), float(high)],
        "ks_noise_floor": float(np.median(motion.floor)),
        "ks_noise_floor_upper": float(np.quantile(motion.floor, 0.95)),
        "ks_p_value": motion.p_value,
        "ks_rank_p_value": motion.rank_p_value,
        "band": BAND,
    }


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
        A `model_check`: ``verdict`` ("explains", "does not explain", "cannot tell") and
        ``verdict_reason`` (sentences: statistic, value, expected, place or time); in its attributes
        ``ks_distance``, ``ks_noise_floor``, ``effective_parameters``. By criterion ``p_value``;
        whiteness by component and lag; residuals by cell, by part of the recording and by speed;
        densities of steps with bands.

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
    >>> str(check["verdict"].values)  # doctest: +SKIP
    'explains'
    """
    if replicates < FEWEST_REPLICATES:
        raise InputError(f"replicates must be at least {FEWEST_REPLICATES}, got {replicates}")
    fit, many = require_fit(fit), as_list(recordings)
    estimate = estimate_of(fit, many, body=body)
    errors = innovations_of(estimate)
    used = sum(int(one.used.sum()) for one in errors)
    if used < MODEL_CHECK.fewest_used:
        intervals = sum(one.used.size - 1 for one in errors)
        raise InputError(
            f"the model cannot be checked: the fit used {used} of {intervals} intervals between "
            f"samples, and the check needs {MODEL_CHECK.fewest_used} at least"
        )
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
        "samples_used": used,
        "outliers": sum(int(one.outlier.sum()) for one in errors),
        "portmanteau": found.white.portmanteau,
        "portmanteau_dof": found.white.portmanteau_dof,
        "cell_size_m": found.layout.size,
        "replicates": replicates,
        "seed": seed,
        "level": MODEL_CHECK.level,
        "arena": fit.attrs["arena"],
        "source": fit.attrs["source"],
        "simulated_recording": fit.attrs["simulated_recording"],
    }
    variables = white_variables(found) | place_variables(found)
    try:
        seen = further_apart(estimate)
        problems = problems_of(fit, seen, many)
        states = filtered_states(seen)
        series, longer = (
            restarted(problems, seen, states, every=every)
            for every in (RESTART.steps_s, RESTART.change_s)
        )
        real = recorded_steps(series, seen)
        near = distances_at_estimate(
            real, replicates_at_estimate(fit, seen, series, count=replicates, seed=seed)
        )
        spread = found.leverage.spread
        drawn = posterior_replicates(fit, seen, series, spread, count=replicates, seed=seed)
        motion = compare_motion(real, near, drawn)
        free = posterior_replicates(
            fit, seen, longer, spread, count=replicates, seed=seed, with_path=True
        )
        paths = [(one.time, one.x, one.y) for one in seen.passes.series]
        scan = scan_of(paths, free.paths, found.layout, level=MODEL_CHECK.level)
        variables |= motion_variables(motion)
        attrs |= motion_facts(motion)
    except InputError as error:
        # If the steps of a recording cannot be compared, the check still tests whether its errors
        # are white.
        motion, scan = None, None
        attrs |= {"ks_distance": np.nan, "ks_noise_floor": np.nan, "ks_left_out": str(error)}
    criteria = criteria_of(errors, found, motion, scan, fit=fit)
    verdict = verdict_on(fit, criteria, study=estimate.study)
    variables |= {
        "criterion": ("criterion", np.array([one.name for one in criteria], dtype=object)),
        "p_value": ("criterion", [one.p_value for one in criteria]),
        "failed": ("criterion", np.array([one.failed for one in criteria], dtype=np.int8)),
        "detectable": ("criterion", [one.detectable for one in criteria]),
        "detectable_of": ("criterion", texts([one.words for one in criteria])),
        **verdict_variables(verdict),
    }
    notes = [one.note for one in criteria if one.note]
    variables |= {"note": ("note", texts(notes))} if notes else {}
    return build_dataset("model_check", variables, layout_coordinates(found.layout), attrs)


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
        error: its verdict is "cannot tell", and its attribute ``check_left_out`` says why.

    Examples
    --------
    >>> import driftwalk as dw
    >>> recording = dw.tank30_recording()
    >>> found = judge_fit(dw.fit_motion(recording), [recording])  # doctest: +SKIP
    >>> str(found.fit["verdict"].values)  # doctest: +SKIP
    'explains'
    """
    try:
        check = check_model(fit, recordings, body=body)
    except (InputError, *BREAKDOWN) as error:
        broken = f"the model cannot be checked: the check broke down ({reason_of(error)})"
        why = str(error) if isinstance(error, InputError) else broken
        unknown = verdict_variables(verdict_of([], [why]))
        return Judged(described(fit.assign(unknown).assign_attrs(check_left_out=why)), None)
    if is_against_water(facts_of(fit)):
        fit, check = _with_angle_tried(fit, check, recordings, body=body)
    check = _with_flow_left_out(fit, check, recordings, body=body)
    return Judged(with_verdict(fit, check), check)


def _with_angle_tried(
    fit: xr.Dataset, check: xr.Dataset, recordings: Sequence[xr.Dataset], *, body: str | None
) -> tuple[xr.Dataset, xr.Dataset]:
    """Fit with the orientation negated, and return fit and check with what came of it."""
    from driftwalk.model import parse_study

    seen, gain = against_water(facts_of(fit)), 0.0
    other = [one.assign(theta=-one["theta"]) for one in recordings]
    try:
        study = parse_study(fit.attrs["study"])
        alternative = fit_motion(
            other, study, angle=fit.attrs["angle"], body=body, flow=stored_flow(fit)
        )
        before, after = (
            log_evidence(estimate_of(one, many, body=body))
            for one, many in ((fit, recordings), (alternative, other))
        )
        gain = after - before
        helps = (
            gain > FORWARD_SELECTION.least_evidence
            and check_model(alternative, other, body=body)["verdict"] == EXPLAINS
        )
    except (InputError, *BREAKDOWN):
        helps = False
    said = f"{seen}; the fit was repeated with the angle negated, and that is no better"
    if helps:
        said = (
            f"{seen}: with the angle negated the model explains the recording, C_d is "
            f"{fitted_value(alternative, 'drag_coefficient'):.3g}, and the likelihood is higher by "
            f"e^{gain:.0f}: negate the angle, or turn y upwards"
        )
        found = stored_verdict(check)
        assert found is not None
        verdict = verdict_variables(found.and_also([], [said]))
        check = check.drop_dims("verdict_reason").assign(verdict)
    warnings = [said if text == seen else text for text in sentences(fit, "warning")]
    return fit.assign_coords(warning=("warning", texts(warnings))), described(check)


def _with_flow_left_out(
    fit: xr.Dataset, check: xr.Dataset, recordings: Sequence[xr.Dataset], *, body: str | None
) -> xr.Dataset:
    """Fit without the measured flow where the check fails, and return it with what came of it."""
    from driftwalk.model import parse_study

    flow, verdict = stored_flow(fit), stored_verdict(check)
    failed = check["criterion"].values[check["failed"].values != 0].tolist()
    if flow is None or verdict is None or verdict.word != DOES_NOT_EXPLAIN:
        return check
    if failed == ["measured scale"]:
        return check
    study = parse_study(fit.attrs["study"])
    try:
        free = fit_motion(recordings, study, angle=fit.attrs["angle"], body=body)
        against = check_model(free, recordings, body=body)["verdict"] == DOES_NOT_EXPLAIN
    except (InputError, *BREAKDOWN):
        return check
    if against:
        return check
    measured = measured_flow(flow, study, spline_of(study))
    said = left_out_sentence(measured, free)
    found = verdict_of([said, *verdict.reasons], [])
    return described(check.drop_dims("verdict_reason").assign(verdict_variables(found)))
