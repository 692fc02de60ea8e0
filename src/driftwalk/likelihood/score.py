"""How far fits are from a truth that is known: errors, coverage, and the length to record."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.calibration.recovery_study import Summary, summarise
from driftwalk.core.arrays import Bools, Floats
from driftwalk.core.errors import InputError
from driftwalk.flow import bilinear
from driftwalk.flow.arena import outline_of
from driftwalk.likelihood.filter.series import MARGIN
from driftwalk.likelihood.flow_intervals import fitted_flow, fitted_intervals, require_fit
from driftwalk.likelihood.preparation import as_list
from driftwalk.schema import FLAGS, body_track
from driftwalk.schema.answers.facts import facts_of
from driftwalk.schema.kinds.recovery import RECOVERED

if TYPE_CHECKING:
    import xarray as xr


SCORED: Final = ("drag_coefficient", "force_std_N", "tracking_noise_m")
"""The parameters that are scored, as the attributes of a fit name them."""


def score_fit(
    fit: xr.Dataset,
    *,
    drag_coefficient: float,
    force_std: float,
    tracking_noise: float,
    flow: xr.Dataset,
    recordings: xr.Dataset | Sequence[xr.Dataset] | None = None,
    interval: int | None = None,
) -> dict[str, Any]:
    """Compare a fit with the truth that made its recording.

    Parameters
    ----------
    fit : xarray.Dataset
        Result of `fit_motion`.
    drag_coefficient : float
        True C_d, positive.
    force_std : float
        True sigma_F [N] in the force interval of the fit (its ``force_interval_s``), positive.
    tracking_noise : float
        True position noise of the camera per axis [m], positive.
    flow : xarray.Dataset
        The true `flow_field`, without frames.
    recordings : xarray.Dataset or sequence of xarray.Dataset, optional
        The fitted recordings, which show where the block has been. Without them, it has been where
        all of the circle inside it lies over measured nodes, which is a little more.
    interval : int, optional
        With switching times: the interval, counted from 0, that the true flow belongs to.

    Returns
    -------
    dict
        For each parameter P of ``drag_coefficient``, ``force_std_N``, ``tracking_noise_m``:
        ``P`` the estimate, ``P_true``, ``P_low`` and ``P_high`` the ends of its interval, ``P_sd``
        the standard deviation of ln P that the interval states, ``P_error`` = estimate / truth - 1,
        ``P_z`` = ln(estimate / truth) / sd, ``P_covered`` whether the interval holds the truth.
        ``flow_error``: rms error over rms speed, both of the flow averaged over the block at four
        angles, in the ``flow_cells`` cells of the fit's grid with at least 3 samples from which no
        corner reaches within 2 mm of the wall; ``flow_point_error`` the same without the average,
        ``flow_z_rms`` the rms of the point error over its standard error. NaN without such cells.

    Raises
    ------
    InputError
        When a truth is not positive, or a dataset is no fit or no flow field without frames, or
        the fit has several flows and no interval is given.

    Examples
    --------
    >>> import driftwalk as dw
    >>> truth = dw.tank30_truth()
    >>> score = dw.score_fit(  # doctest: +SKIP
    ...     dw.fit_motion(dw.tank30_recording()),
    ...     drag_coefficient=truth["drag_coefficient"],
    ...     force_std=truth["force_std_N"],
    ...     tracking_noise=truth["tracking_noise_m"],
    ...     flow=dw.tank30_flow(),
    ... )
    >>> round(score["drag_coefficient_error"], 2)  # doctest: +SKIP
    -0.03
    """
    from driftwalk.model import parse_study

    fit = require_fit(fit)
    if "flow" in fit.dims and interval is None:
        raise InputError(
            f"the fit has {fit.sizes['flow']} flows: name the interval that the true flow belongs "
            f"to, 0 to {fit.sizes['flow_interval'] - 1}"
        )
    # Of a flow that changes its strength or its shape, the mean is compared.
    estimated = fitted_flow(fit, interval=interval or 0)
    if "time" in flow.dims:
        raise InputError("the true flow has frames: a steady one is needed to score a fit")
    truth = dict(zip(SCORED, (drag_coefficient, force_std, tracking_noise), strict=True))
    score: dict[str, Any] = {}
    for name, value in truth.items():
        score.update(_parameter_score(fit, name, value, interval or 0))
    side = parse_study(fit.attrs["study"], source="the study of the fit").block.side_m
    if recordings is None:
        cells = _surrounded(estimated, radius=0.5 * side)
    else:
        cells = _visited_cells(estimated, fit, as_list(recordings), interval or 0, side)
    return {**score, **_flow_score(estimated, flow, cells, side=side)}


def block_flow(flow: xr.Dataset, x: npt.ArrayLike, y: npt.ArrayLike, *, side: float) -> Floats:
    """Return the velocity of the water averaged over a square block, and over its orientations.

    Examples
    --------
    >>> from driftwalk.flow import shear_flow
    >>> block_flow(shear_flow(0.5), [0.0], [0.02], side=0.03).round(9).tolist()
    [[0.01, 0.0]]
    """
    steps = side * ((np.arange(6) + 0.5) / 6 - 0.5)
    along, across = (part.ravel() for part in np.meshgrid(steps, steps))
    # A square turns into itself by pi / 2.
    angles = 0.5 * np.pi / 4 * np.arange(4)[:, None]
    dx = (np.cos(angles) * along - np.sin(angles) * across).ravel()
    dy = (np.sin(angles) * along + np.cos(angles) * across).ravel()
    at_x = np.asarray(x, dtype=np.float64)[:, None] + dx
    at_y = np.asarray(y, dtype=np.float64)[:, None] + dy
    return np.stack([part.mean(axis=1) for part in bilinear(flow, at_x, at_y)], axis=-1)


def _parameter_score(fit: xr.Dataset, name: str, truth: float, interval: int) -> dict[str, Any]:
    from scipy.special import ndtri

    if not (math.isfinite(truth) and truth > 0.0):
        raise InputError(
            f"the true {name} is {truth!r}: a positive number is needed, errors are relative to it"
        )
    facts = facts_of(fit)
    value, (low, high) = float(facts[name]), facts[f"{name}_interval"]
    if name == "force_std_N" and "flow_force_std" in fit:
        flow = fitted_intervals(fit).flows[interval]
        value, low, high = (
            float(fit[f"flow_force_std{end}"][flow]) for end in ("", "_low", "_high")
        )
    # The lower end of C_d holds the error of the strips besides.
    sd = math.log(high / value) / float(ndtri(0.5 + 0.5 * facts["confidence"]))
    return {
        name: value,
        f"{name}_true": truth,
        f"{name}_low": low,
        f"{name}_high": high,
        f"{name}_sd": sd,
        f"{name}_error": value / truth - 1.0,
        f"{name}_z": math.log(value / truth) / sd,
        f"{name}_covered": low <= truth <= high,
    }


def _visited_cells(
    flow: xr.Dataset, fit: xr.Dataset, recordings: list[xr.Dataset], interval: int, side: float
) -> Bools:
    """Return the cells around the nodes of a fitted flow in which the block has been."""
    outline = outline_of(fit.attrs["arena"])
    reach = side / math.sqrt(2.0) + MARGIN
    intervals = fitted_intervals(fit)
    flows = np.array(intervals.flows)
    edges = [_edges(flow[axis].values) for axis in ("y", "x")]
    count = np.zeros(flow["flag"].shape)
    for one in recordings:
        track = body_track(one)
        known = np.isfinite(track.x) & np.isfinite(track.y)
        known &= flows[intervals.index_of(track.time)] == flows[interval]
        x, y = track.x[known], track.y[known]
        free = outline.depth(x, y) > reach
        count += np.histogram2d(y[free], x[free], bins=edges)[0]
    return np.asarray(count >= 3)


def _edges(nodes: Floats) -> Floats:
    spacing = (nodes[-1] - nodes[0]) / (nodes.size - 1)
    return np.append(nodes - 0.5 * spacing, nodes[-1] + 0.5 * spacing)


def _surrounded(flow: xr.Dataset, *, radius: float) -> Bools:
    """Return the measured nodes whose neighbours within a radius are all measured too."""
    from scipy.ndimage import binary_erosion

    spacing = float(flow["x"].values[1] - flow["x"].values[0])
    reach = np.arange(-math.floor(radius / spacing), math.floor(radius / spacing) + 1) * spacing
    disc = np.hypot(reach[:, None], reach) <= radius
    measured = flow["flag"].values == FLAGS["measured"]
    return np.asarray(binary_erosion(measured, structure=disc))


def _flow_score(
    estimated: xr.Dataset, truth: xr.Dataset, cells: Bools, *, side: float
) -> dict[str, Any]:
    rows, columns = np.nonzero(cells)
    if rows.size == 0:
        nothing = dict.fromkeys(("flow_error", "flow_point_error", "flow_z_rms"), math.nan)
        return {**nothing, "flow_cells": 0}
    x, y = estimated["x"].values[columns], estimated["y"].values[rows]
    found, true = (block_flow(one, x, y, side=side) for one in (estimated, truth))
    at = np.stack([estimated[name].values[cells] for name in ("u", "v")], axis=-1)
    errors = [estimated[f"{name}_standard_error"].values[cells] for name in ("u", "v")]
    true_at = np.stack(bilinear(truth, x, y), axis=-1)
    ratios = (at - true_at) / np.stack(errors, axis=-1)
    return {
        "flow_error": _relative(found, true),
        "flow_point_error": _relative(at, true_at),
        "flow_z_rms": math.sqrt(float(np.nanmean(ratios**2))),
        "flow_cells": int(rows.size),
    }


def _relative(found: Floats, truth: Floats) -> float:
    """Return the rms of the error over the rms of the truth."""
    return math.sqrt(float(((found - truth) ** 2).sum() / (truth**2).sum()))


NEEDED_CONFIDENCE: Final = 0.9
"""Confidence of the interval of the time that one must record; by convention."""


class Scale(NamedTuple):
    """How the error of C_d falls with the length T of a recording: scale / sqrt(T)."""

    value: float
    """Root mean square of ln(estimate / truth), times sqrt(T) [s^0.5]."""
    low: float
    high: float

    def needed(self, precision: float) -> tuple[float, float, float]:
        """Return the length [s] at which the error is `precision`, and its interval."""
        time, low, high = ((part / precision) ** 2 for part in self)
        return time, low, high


def error_scale(duration: Floats, rms_error: Floats, count: Floats) -> Scale:
    """Fit error = scale / sqrt(T) to the lengths of a study, in logarithms.

    Examples
    --------
    >>> round(error_scale(np.array([100.0]), np.array([0.2]), np.array([20])).value, 12)
    2.0
    """
    from scipy.special import chdtri

    enough = count >= 2  # one recording has no spread
    if not enough.any():
        return Scale(np.nan, np.nan, np.nan)
    logs = np.log(rms_error[enough]) + 0.5 * np.log(duration[enough])
    value = float(np.exp(np.average(logs, weights=count[enough])))
    tail, freedom = 0.5 * (1.0 - NEEDED_CONFIDENCE), float(count.max())
    # n rms^2 / sigma^2 is chi-squared with n degrees of freedom.
    low, high = (value * float(np.sqrt(freedom / chdtri(freedom, p))) for p in (tail, 1.0 - tail))
    return Scale(value, low, high)


def add_summary(recovery: xr.Dataset) -> xr.Dataset:
    """Return the dataset of a study with its summary by duration and use of the angle."""
    used = recovery["used"].values == 1
    cells = list(np.ndindex(used.shape[:2]))
    rows = []
    for name in RECOVERED:
        columns = [recovery[f"{name}_{part}"].values for part in ("error", "z", "covered")]
        rows += [summarise(*(one[cell][used[cell]] for one in columns)) for cell in cells]
    summaries = np.array(rows).reshape(len(RECOVERED), *used.shape[:2], -1)
    flow = np.full((*used.shape[:2], 2), np.nan)
    for cell in cells:
        errors = recovery["flow_error"].values[cell][used[cell]]
        errors = errors[np.isfinite(errors)]
        if errors.size:
            flow[cell] = np.median(errors), np.quantile(errors, 0.9)
    rms, count = summaries[0, ..., Summary._fields.index("rms_error")], used.sum(axis=-1)
    duration = recovery["duration"].values
    scales = [error_scale(duration, *one) for one in zip(rms.T, count.T, strict=True)]
    # NaN where no precision is asked.
    needed = [scale.needed(recovery.attrs["drag_coefficient_precision"]) for scale in scales]
    by_angle = {"drag_coefficient_error_scale": np.array(scales), "needed_duration": needed}
    summary: dict[str, Any] = {
        name: (("parameter", "duration", "angle"), summaries[..., index])
        for index, name in enumerate(Summary._fields)
    }
    for index, name in enumerate(("median_flow_error", "flow_error_90")):
        summary[name] = (("duration", "angle"), flow[..., index])
    for name, values in by_angle.items():
        for column, end in enumerate(("", "_low", "_high")):
            summary[f"{name}{end}"] = (("angle",), np.array(values)[:, column])
    names = np.array(list(RECOVERED), dtype=object)
    return recovery.assign(summary).assign_coords(parameter=names)
