"""How far a likelihood fit is from a truth that is known, and whether its intervals say so."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError
from driftwalk.flow import bilinear
from driftwalk.flow.arena import outline_of
from driftwalk.likelihood.flow_of_fit import fitted_flow, require_fit
from driftwalk.likelihood.intervals import fitted_intervals
from driftwalk.likelihood.wall import MARGIN
from driftwalk.schema import FLAGS, body_track
from driftwalk.schema.answers.facts import facts_of

if TYPE_CHECKING:
    import xarray as xr

Floats = npt.NDArray[np.float64]

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
    fit = require_fit(fit)
    if "flow" in fit.dims and interval is None:
        raise InputError(
            f"the fit has {fit.sizes['flow']} flows: name the interval that the true flow belongs "
            f"to, 0 to {fit.sizes['flow_interval'] - 1}"
        )
    estimated = fitted_flow(fit, interval=interval)
    if "time" in flow.dims:
        raise InputError("the true flow has frames: a steady one is needed to score a fit")
    truth = dict(zip(SCORED, (drag_coefficient, force_std, tracking_noise), strict=True))
    score: dict[str, Any] = {}
    for name, value in truth.items():
        score.update(_parameter_score(fit, name, value))
    cells = _visited_cells(estimated, fit, recordings, interval=interval or 0)
    return {**score, **_flow_score(estimated, flow, cells, side=_side(fit))}


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


def _parameter_score(fit: xr.Dataset, name: str, truth: float) -> dict[str, Any]:
    from scipy.special import ndtri

    if not (math.isfinite(truth) and truth > 0.0):
        raise InputError(
            f"the true {name} is {truth!r}: a positive number is needed, errors are relative to it"
        )
    facts = facts_of(fit)
    value = float(facts[name])
    low, high = facts[f"{name}_interval"]
    reach = 2.0 * float(ndtri(0.5 + 0.5 * facts["confidence"]))
    sd = math.log(high / low) / reach
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


def _side(fit: xr.Dataset) -> float:
    from driftwalk.model import parse_study

    return parse_study(fit.attrs["study"], source="the study of the fit").block.side_m


def _visited_cells(
    flow: xr.Dataset,
    fit: xr.Dataset,
    recordings: xr.Dataset | Sequence[xr.Dataset] | None,
    *,
    interval: int,
) -> npt.NDArray[np.bool_]:
    """Return the cells around the nodes of a fitted flow in which the block has been."""
    import xarray as xr

    if recordings is None:
        return _surrounded(flow, radius=0.5 * _side(fit))
    many = [recordings] if isinstance(recordings, xr.Dataset) else list(recordings)
    outline = outline_of(fit.attrs["arena"])
    reach = _side(fit) / math.sqrt(2.0) + MARGIN
    intervals = fitted_intervals(fit)
    flows = np.array(intervals.flows)
    count = np.zeros(flow["flag"].shape)
    for one in many:
        track = body_track(one)
        known = np.isfinite(track.x) & np.isfinite(track.y)
        known &= flows[intervals.index_of(track.time)] == flows[interval]
        x, y = track.x[known], track.y[known]
        free = outline.depth(x, y) > reach
        edges = tuple(_edges(flow[axis].values) for axis in ("y", "x"))
        count += np.histogram2d(y[free], x[free], bins=edges)[0]
    return np.asarray(count >= 3)


def _edges(nodes: Floats) -> Floats:
    spacing = (nodes[-1] - nodes[0]) / (nodes.size - 1)
    return np.append(nodes - 0.5 * spacing, nodes[-1] + 0.5 * spacing)


def _surrounded(flow: xr.Dataset, *, radius: float) -> npt.NDArray[np.bool_]:
    """Return the measured nodes whose neighbours within a radius are all measured too."""
    from scipy.ndimage import binary_erosion

    spacing = float(flow["x"].values[1] - flow["x"].values[0])
    reach = np.arange(-math.floor(radius / spacing), math.floor(radius / spacing) + 1) * spacing
    disc = np.hypot(reach[:, None], reach) <= radius
    measured = flow["flag"].values == FLAGS["measured"]
    return np.asarray(binary_erosion(measured, structure=disc))


def _flow_score(
    estimated: xr.Dataset, truth: xr.Dataset, cells: npt.NDArray[np.bool_], *, side: float
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
