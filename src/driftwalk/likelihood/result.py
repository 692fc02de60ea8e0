"""The `fit` dataset: the parameters with their intervals, and the flow with its errors.

``estimate`` by parameter and ``interval`` by parameter and bound; every other number of the search
is a variable of its own. On (y, x), the nodes of a flow field: ``u``, ``v`` and their standard
errors [m/s] at every node, ``flag`` and ``count`` (samples with the block over the node); on
(component, knot_y, knot_x) the coefficients of the spline; ``covariance`` of (ln C_d, ln q, ln r);
the profile of the likelihood along C_d. With switching times all that belongs to a flow has the
dimension ``flow`` in front, and ``interval_flow`` on (flow_interval) says which flow each interval
has.
"""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError
from driftwalk.flow.arena import Outline, outline_of
from driftwalk.flow.grid import Grid, make_grid
from driftwalk.likelihood.filter_pass import Point, Series
from driftwalk.likelihood.interval_inflation import widened
from driftwalk.likelihood.intervals import Intervals, fitted_intervals, switched_frames
from driftwalk.likelihood.law.facts import (
    inertia_facts,
    inertia_of,
    number_facts,
    number_variables,
)
from driftwalk.likelihood.law.found import LawFound
from driftwalk.likelihood.newton import PRIOR_LOG_DRAG_STD, Mode, known_numbers_variance
from driftwalk.likelihood.reml import Restricted
from driftwalk.likelihood.spline import Floats, Spline
from driftwalk.schema import FLAGS, build_flow_field
from driftwalk.schema.answers.fit_facts import fit_variables
from driftwalk.schema.check import require_kind
from driftwalk.schema.earlier import current_form
from driftwalk.schema.kinds import KINDS

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study

LEAST_QUADRATIC = 1e-6
"""Share of the quadratic drag below which nothing is known of its C_d."""
MOST_LOG_WIDTH: Final = 300.0
"""Beyond this an interval has no upper end: exp would not fit a double for long."""
PRIOR_ALONE: Final = math.sqrt(0.5)
"""Share of the prior's standard deviation of ln C_d above which the data tell less than it does."""
LEAST_COUNT: Final = 3
"""Samples with the block over a node that make the node a measured one."""
PARAMETERS: Final = (
    "ln_drag_coefficient",
    "ln_noise_intensity",
    "ln_tracking_noise",
    "ln_force_lever",
    "ln_orientation_noise",
)
"""The last two with the angle in the state only."""

WORDS: Final = (
    *("angle", "source", "simulated_recording"),
    *("force_law", "force_law_stated", "drag_law", "drag_law_stated"),
)
"""Facts in words, which are attributes."""


class Whiteness(NamedTuple):
    """How far the innovations are what the model says: independent, of the stated covariance."""

    chi_squared_per_dof: float
    """Mean square of the whitened innovations; 1 if the model is right."""
    autocorrelation: float
    """Correlation of whitened innovations one sample apart; 0 if the model is right."""
    autocorrelation_std: float
    """Its standard deviation if the model is right."""


def whiteness_of(innovations: list[tuple[Floats, npt.NDArray[np.bool_]]]) -> Whiteness:
    """Return the check of whitened innovations (n, D), given with which of them were used.

    Innovations of exactly 0 are those of missing angles, and do not count.

    Examples
    --------
    >>> noise = np.random.default_rng(1).normal(size=(10000, 2))
    >>> found = whiteness_of([(noise, np.ones(10000, dtype=bool))])
    >>> abs(found.autocorrelation) < 3 * found.autocorrelation_std
    True
    """
    squares, products, samples, pairs = 0.0, 0.0, 0, 0
    for white, used in innovations:
        there = used[:, None] & (white != 0.0)
        squares += float((white[there] ** 2).sum())
        samples += int(there.sum())
        both = there[1:] & there[:-1]
        products += float((white[1:][both] * white[:-1][both]).sum())
        pairs += int(both.sum())
    variance = squares / max(samples, 1)
    count = max(pairs, 1)
    return Whiteness(variance, products / count / max(variance, 1e-300), 1.0 / math.sqrt(count))


def parameter_covariance(mode: Mode, restricted: Restricted) -> Floats:
    """Return the covariance of ln C_d, the noises and opened numbers.

    C_d's variance comes from its own criterion, in which the numbers are known; it is made larger
    by the share that they add to it. The rest is that of theory, with the factors that were
    measured.
    """
    drag = mode.point.coefficients.size
    covariance = mode.covariance[drag:, drag:].copy()
    scale = np.ones(len(covariance))
    scale[0] = restricted.log_drag_std / math.sqrt(known_numbers_variance(mode))
    return widened(covariance * np.outer(scale, scale), mode.point)


def open_where_undetermined(covariance: Floats, mode: Mode, restricted: Restricted) -> Floats:
    """Return the covariance, infinite for parameters of which the recording tells nothing.

    Parameters
    ----------
    covariance : ndarray
        As of `parameter_covariance`.
    mode, restricted : Mode, Restricted
        Where the search has come to, and C_d: where the data say less of it than its weak prior,
        the estimate is the prior's.
    """
    if mode.lost:
        return np.asarray(np.diag(np.full(len(covariance), math.inf)))
    found = covariance.copy()
    if restricted.log_drag_std > PRIOR_ALONE * PRIOR_LOG_DRAG_STD:
        found[0, 0] = math.inf
    return found


def parameter_facts(
    point: Point, covariance: Floats, study: Study, *, by_side: tuple[float, float] = (0.0, 0.0)
) -> dict[str, Any]:
    """Return the parameters with their intervals, units in the keys.

    `by_side` holds the derivatives of ln C_d and ln σ_F by the logarithm of the block's side.
    """
    from scipy.special import ndtri

    confidence = study.fit.confidence
    interval = study.forces.force_interval_s
    mass = study.block.mass_kg
    intensity = mass**2 * math.exp(point.log_intensity)
    normal = float(ndtri(0.5 + 0.5 * confidence))
    reach = normal * np.sqrt(np.diag(covariance))
    reach_of_drag = normal * _log_drag_std(point, covariance)
    heavier = inertia_of(study, floating=point.number("water_acceleration") != 0.0)
    side = normal * study.fit.side_std_m / study.block.side_m
    of_drag, of_force = (
        math.hypot(one, normal * heavier.log_std, side * slope)
        for one, slope in zip((reach_of_drag, 0.5 * reach[1]), by_side, strict=True)
    )
    total = heavier.share**2 * intensity
    drag = (1.0 - point.number("linear_share")) * math.exp(point.log_drag)
    values = {
        "drag_coefficient": (heavier.share * drag, of_drag),
        "force_std_N": (math.sqrt(total / interval), of_force),
        "force_noise_intensity_N2_s": (total, 2.0 * of_force),
        "tracking_noise_m": (math.exp(point.log_noise), reach[2]),
    }
    if point.log_lever is not None and point.log_angle_noise is not None:
        values["force_lever_m"] = (math.exp(point.log_lever), reach[3])
        values["orientation_noise_rad"] = (math.exp(point.log_angle_noise), reach[4])
    if heavier.share != 1.0 or heavier.log_std > 0.0:
        values["effective_drag_coefficient"] = (drag, reach_of_drag)
        values["effective_force_std_N"] = (math.sqrt(intensity / interval), 0.5 * reach[1])
    facts: dict[str, Any] = {"force_interval_s": interval, "confidence": confidence}
    for name, (value, width) in values.items():
        facts[name] = value
        facts[f"{name}_interval"] = [value * math.exp(-width), _upper(value, width)]
    return {**facts, **inertia_facts(heavier, facts, normal), **number_facts(point, reach, study)}


def _log_drag_std(point: Point, covariance: Floats) -> float:
    """Return the standard deviation of ln C_d of the quadratic part of the drag."""
    if math.isinf(covariance[0, 0]):
        return math.inf
    slopes = np.zeros(len(covariance))
    slopes[0] = 1.0
    if "linear_share" in point.opened:
        at = 1 + list(point.extras).index("linear_share")
        slopes[at] = -1.0 / max(1.0 - point.opened["linear_share"], LEAST_QUADRATIC)
    return math.sqrt(float(slopes @ covariance @ slopes))


def _upper(value: float, log_width: float) -> float:
    """Return the upper end of an interval; infinity where the data leave it open."""
    return value * math.exp(log_width) if log_width < MOST_LOG_WIDTH else math.inf


def build_fit(
    spline: Spline,
    mode: Mode,
    restricted: Restricted,
    series: list[Series],
    *,
    study: Study,
    oriented: bool,
    intervals: Intervals,
    first: float,
    law: LawFound,
    facts: dict[str, Any],
) -> xr.Dataset:
    """Assemble the dataset of a fit, without warnings and the share of the tank that was visited.

    `first` is the first recording's first time stamp [s]; for `facts` see `fit_variables`.
    """
    import xarray as xr

    outline = outline_of(study.tank.to_arena())
    grid = make_grid(outline, cells=study.flow.cells, cell_size=study.flow.cell_size_m)
    flows = [
        _flow_variables(
            spline,
            restricted.point.in_flow(flow).coefficients,
            mode.covariance[_block(spline, flow), _block(spline, flow)],
            [one for one in series if one.flow == flow],
            grid=grid,
            outline=outline,
            study=study,
            oriented=oriented,
        )
        for flow in range(len(intervals.labels))
    ]
    profiles = restricted.profiles
    least = min(one.deviance for one in profiles)
    flat = profiles[0].half_log_determinant
    uncertainty = parameter_covariance(mode, restricted)
    if mode.lost:
        uncertainty = open_where_undetermined(uncertainty, mode, restricted)
    noises = 1 + len(mode.point.noises)
    names = np.array([*PARAMETERS[:noises], *mode.point.opened], dtype=object)
    data: dict[str, Any] = {
        **(flows[0] if intervals.steady else _stacked(flows)),
        "covariance": (
            ("log_parameter", "other_log_parameter"),
            uncertainty,
        ),
        "profile_deviance": ("profile", [one.deviance - least for one in profiles]),
        "profile_half_log_determinant": (
            "profile",
            [one.half_log_determinant - flat for one in profiles],
        ),
    }
    coords: dict[str, Any] = {
        "y": ("y", grid.y),
        "x": ("x", grid.x),
        "component": ("component", np.array(["u", "v"], dtype=object)),
        "log_parameter": ("log_parameter", names),
        "other_log_parameter": ("other_log_parameter", names),
        "profile": ("profile", [math.exp(one.log_drag) for one in profiles]),
    }
    facts = {
        **facts,
        "spline_origin_m": [spline.origin_x, spline.origin_y],
        "spline_spacing_m": spline.spacing,
        "cell_size_m": grid.cell_size,
    }
    if not intervals.steady:
        coords["flow"] = ("flow", np.array(intervals.labels, dtype=object))
        data["interval_flow"] = (
            "flow_interval",
            np.array(intervals.flows, dtype=np.int32),
        )
        facts["switching_times_s"] = list(intervals.times)
        facts["recording_start_s"] = first
    numbers, names_of = fit_variables(facts)
    found, names_found = number_variables(restricted.point, law)
    data, coords = data | found, coords | names_found
    attrs = {
        "kind": "fit",
        "schema_version": KINDS["fit"].version,
        "arena": json.dumps(study.tank.to_arena()),
        **{name: facts[name] for name in WORDS},
        "study": study.to_toml(),
    }
    return xr.Dataset(data | numbers, coords | names_of, attrs)


def _block(spline: Spline, flow: int) -> slice:
    """Return where the coefficients of a flow are among all parameters."""
    count = 2 * spline.size
    return slice(flow * count, (flow + 1) * count)


def _flow_variables(
    spline: Spline,
    coefficients: Floats,
    covariance: Floats,
    series: list[Series],
    *,
    grid: Grid,
    outline: Outline,
    study: Study,
    oriented: bool,
) -> dict[str, Any]:
    """Return the variables of one flow, with their dimensions."""
    count = footprint_count(grid, series, side=study.block.side_m, oriented=oriented)
    values = spline.values(coefficients, grid.x, grid.y)
    errors = spline.standard_errors(covariance, grid.x, grid.y)
    plane, knots = ("y", "x"), ("component", "knot_y", "knot_x")
    return {
        "u": (plane, values[0]),
        "v": (plane, values[1]),
        "u_standard_error": (plane, errors[0]),
        "v_standard_error": (plane, errors[1]),
        "count": (plane, count),
        "flag": (plane, _flags(grid, outline, count)),
        "coefficient": (knots, coefficients),
    }


def _stacked(flows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the variables of several flows along a dimension of their own."""
    return {
        name: (("flow", *dims), np.stack([one[name][1] for one in flows]))
        for name, (dims, _) in flows[0].items()
    }


def visited_shares(fit: xr.Dataset) -> list[float]:
    """Return for each flow of a fit the share of the tank's nodes that the block has been over."""
    flags = fit["flag"].values.reshape(-1, *fit["flag"].shape[-2:])
    return [
        float((one == FLAGS["measured"]).sum() / max((one != FLAGS["outside"]).sum(), 1))
        for one in flags
    ]


def require_fit(dataset: xr.Dataset) -> xr.Dataset:
    """Return a fit, one of an earlier schema version in its current form.

    Raises
    ------
    InputError
        When it is no fit.
    """
    return current_form(require_kind(dataset, "fit", "fit_motion makes one"))


def fitted_flow(fit: xr.Dataset, *, interval: int | None = None) -> xr.Dataset:
    """Return the flow of a fit as a flow field, for everything that takes one.

    Parameters
    ----------
    fit : xarray.Dataset
        Result of `fit_motion`.
    interval : int, optional
        With switching times: the interval, counted from 0, whose steady flow is wanted. Without
        it the flow that changes is returned: its frames are a microsecond before and after each
        switch, as fields are linear in time between frames; times count from the first sample of
        the first recording, as those of a simulation do.

    Returns
    -------
    xarray.Dataset
        A `flow_field`. Nodes that the block has been over are *measured*, the others of the tank
        *filled*: there the spline is continued smoothly. Standard errors stand at measured nodes
        (those of all nodes are in the fit); they are correlated over about the distance of knots.

    Raises
    ------
    InputError
        When the dataset is no fit, or has no such interval.

    Examples
    --------
    >>> import driftwalk as dw
    >>> flow = dw.fitted_flow(dw.fit_motion(dw.tank30_recording()))  # doctest: +SKIP
    """
    fit = require_fit(fit)
    intervals = fitted_intervals(fit)
    if interval is not None and not 0 <= interval < len(intervals.flows):
        raise InputError(
            f"no interval {interval}: the fit has {len(intervals.flows)}, counted from 0"
        )
    attrs: dict[str, Any] = {
        "method": "bicubic spline, fitted with drag and noise by the innovations' likelihood",
        "cell_size_m": float(fit["cell_size"]),
        **{key: fit.attrs[key] for key in ("arena", "source")},
    }
    if intervals.steady:
        return build_flow_field(
            fit["x"].values, fit["y"].values, attrs=attrs, **_field_variables(fit)
        )
    fields = [_field_variables(fit.isel(flow=index)) for index in range(fit.sizes["flow"])]
    if interval is not None:
        flow = intervals.flows[interval]
        attrs["flow_label"] = intervals.labels[flow]
        attrs["intervals"] = ", ".join(intervals.describe(one) for one in intervals.of_flow(flow))
        return build_flow_field(fit["x"].values, fit["y"].values, attrs=attrs, **fields[flow])
    attrs["repeat"] = "hold"  # before the first switch and after the last the flow is steady
    by_name = {name: [one[name] for one in fields] for name in fields[0]}
    time, frames = switched_frames(intervals, by_name, first=float(fit["recording_start"]))
    return build_flow_field(fit["x"].values, fit["y"].values, time=time, attrs=attrs, **frames)


def _field_variables(fit: xr.Dataset) -> dict[str, Any]:
    """Return the variables of a flow field: standard errors at measured nodes only."""
    measured = fit["flag"].values == FLAGS["measured"]
    errors = {
        name: np.where(measured, fit[name].values, np.nan)
        for name in ("u_standard_error", "v_standard_error")
    }
    return {**{name: fit[name].values for name in ("u", "v", "flag", "count")}, **errors}


def footprint_count(
    grid: Grid, series: list[Series], *, side: float, oriented: bool
) -> npt.NDArray[np.float64]:
    """Return for each node how many samples have the block over it.

    Without orientations the circle inside the block is used; samples that lack one among
    others that have are left out.
    """
    half = 0.5 * side
    reach = math.ceil(half * (math.sqrt(2.0) if oriented else 1.0) / grid.cell_size)
    offsets = np.arange(-reach, reach + 1)
    total = np.zeros(grid.size)
    for one in series:
        kept = (one.excluded == 0) & np.isfinite(one.x) & np.isfinite(one.theta)
        x, y, theta = one.x[kept], one.y[kept], one.theta[kept]
        column = np.round((x - grid.x[0]) / grid.cell_size).astype(np.intp)
        row = np.round((y - grid.y[0]) / grid.cell_size).astype(np.intp)
        cosine, sine = np.cos(theta), np.sin(theta)
        for dj in offsets:
            for di in offsets:
                i, j = column + di, row + dj
                inside = (i >= 0) & (i < grid.x.size) & (j >= 0) & (j < grid.y.size)
                away_x = grid.x[np.where(inside, i, 0)] - x
                away_y = grid.y[np.where(inside, j, 0)] - y
                if oriented:
                    along, across = cosine * away_x + sine * away_y, cosine * away_y - sine * away_x
                    inside &= np.maximum(np.abs(along), np.abs(across)) <= half
                else:
                    inside &= np.hypot(away_x, away_y) <= half
                total += np.bincount((j * grid.x.size + i)[inside], minlength=grid.size)
    return total.reshape(grid.shape)


def _flags(grid: Grid, outline: Outline, count: Floats) -> npt.NDArray[np.int8]:
    x, y = (part.ravel() for part in grid.nodes())
    flag = np.full(grid.shape, FLAGS["filled"], dtype=np.int8)
    flag[(outline.depth(x, y) < 0.0).reshape(grid.shape)] = FLAGS["outside"]
    flag[count >= LEAST_COUNT] = FLAGS["measured"]
    return flag
