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

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Bools, Floats
from driftwalk.flow.arena import outline_of
from driftwalk.flow.cell_means import flags_of
from driftwalk.flow.grid import Grid, make_grid
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.filter.series import Series
from driftwalk.likelihood.fitted_modes import mode_variables, strength_variables
from driftwalk.likelihood.interval_inflation import open_where_undetermined, parameter_covariance
from driftwalk.likelihood.law.candidate_laws import DRAG_SHAPES
from driftwalk.likelihood.law.force_law import Assumptions
from driftwalk.likelihood.law.forward_selection import LawResult
from driftwalk.likelihood.preparation import PreparedRecordings, spline_of
from driftwalk.likelihood.reml import Restricted
from driftwalk.schema import FLAGS
from driftwalk.schema.answers.facts import fit_parts
from driftwalk.schema.kinds import KINDS

if TYPE_CHECKING:
    import xarray as xr


PARAMETERS: Final = (
    "ln_drag_coefficient",
    "ln_noise_intensity",
    "ln_tracking_noise",
    "ln_force_lever",
    "ln_orientation_noise",
)
"""The last two with the angle in the state only."""


class Whiteness(NamedTuple):
    """How far the innovations are what the model says: independent, of the stated covariance."""

    chi_squared_per_dof: float
    """Mean square of the whitened innovations; 1 if the model is right."""
    autocorrelation: float
    """Correlation of whitened innovations one sample apart; 0 if the model is right."""
    autocorrelation_std: float
    """Its standard deviation if the model is right."""


def whiteness_of(innovations: list[tuple[Floats, Bools]]) -> Whiteness:
    """Return the check of whitened innovations (n, D), given with which of them were used.

    An innovation of exactly 0 means a missing angle and does not count.

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


def build_fit(
    ready: PreparedRecordings, law: LawResult, restricted: Restricted, facts: dict[str, Any]
) -> xr.Dataset:
    """Assemble the dataset of a fit, without warnings and the share of the tank that was visited.

    For `facts` see `fit_parts`.
    """
    import xarray as xr

    mode, study, intervals = law.mode, ready.study, ready.intervals
    outline, spline = outline_of(study.tank.to_arena()), spline_of(study)
    grid = make_grid(outline, cells=study.flow.cells, cell_size=study.flow.cell_size_m)
    plane, knots = ("y", "x"), ("component", "knot_y", "knot_x")
    flows = []
    for flow in range(len(intervals.labels)):
        in_flow = [one for one in ready.series if one.flow == flow]
        count = footprint_count(
            grid, in_flow, side=study.block.side_m, oriented=ready.angle != "none"
        )
        # Where the coefficients of this flow are among all parameters.
        own = slice(flow * 2 * spline.size, (flow + 1) * 2 * spline.size)
        coefficients = restricted.point.in_flow(flow).mean_coefficients
        u, v = spline.values(coefficients, grid.x, grid.y)
        errors = spline.standard_errors(mode.covariance[own, own], grid.x, grid.y)
        flows.append(
            {
                "u": (plane, u),
                "v": (plane, v),
                "u_standard_error": (plane, errors[0]),
                "v_standard_error": (plane, errors[1]),
                "count": (plane, count),
                "flag": (plane, flags_of(grid, outline, count >= 3)),
                "coefficient": (knots, coefficients),
            }
        )
    profiles = restricted.profiles
    # Only differences of a profile mean anything: it begins at zero.
    least = min(one.deviance for one in profiles)
    flat = profiles[0].half_log_determinant
    determinant = [one.half_log_determinant - flat for one in profiles]
    uncertainty = parameter_covariance(mode, restricted)
    # The stored covariance stays finite where C_d is known from its prior alone, as the check draws
    # from it; a search that was given up has none.
    if mode.diverged:
        uncertainty = open_where_undetermined(uncertainty, mode, restricted)
    noises = 1 + len(mode.point.noises)
    names = np.array([*PARAMETERS[:noises], *mode.point.opened], dtype=object)
    # A variable that is named like its dimension is a coordinate.
    data: dict[str, Any] = {
        **(flows[0] if intervals.steady else _stacked(flows)),
        "covariance": (("log_parameter", "other_log_parameter"), uncertainty),
        "profile_deviance": ("profile", [one.deviance - least for one in profiles]),
        "profile_half_log_determinant": ("profile", determinant),
        "y": ("y", grid.y),
        "x": ("x", grid.x),
        "component": ("component", np.array(["u", "v"], dtype=object)),
        "log_parameter": ("log_parameter", names),
        "other_log_parameter": ("other_log_parameter", names),
        "profile": ("profile", [math.exp(one.log_drag) for one in profiles]),
        **number_variables(restricted.point, law),
    }
    facts = {
        **facts,
        "spline_origin_m": [spline.origin_x, spline.origin_y],
        "spline_spacing_m": spline.spacing,
        "cell_size_m": grid.cell_size,
    }
    if not intervals.steady:
        data["flow"] = ("flow", np.array(intervals.labels, dtype=object))
        data["interval_flow"] = ("flow_interval", np.array(intervals.flows, dtype=np.int32))
        facts["switching_times_s"] = list(intervals.times)
        facts["recording_start_s"] = float(ready.tracks[0].time[0])
    if restricted.point.layers > 1:
        count = flows[0]["count"][1]
        data |= mode_variables(restricted.point, ready.series[0], spline, grid, count)
    strength, words = strength_variables(restricted.point, ready.series[0])
    data |= strength
    if ready.measured is not None:
        measured, of_measured = ready.measured.stored()
        data, words = data | measured, words | of_measured
    numbers, coords, _ = fit_parts(facts)
    attrs: dict[str, Any] = {
        "kind": "fit",
        "schema_version": KINDS["fit"].version,
        "arena": study.tank.to_arena_json(),
        **{one.name: facts[one.name] for one in KINDS["fit"].attributes if one.name in facts},
        "study": study.to_toml(),
        **words,
    }
    return xr.Dataset(data | numbers, coords, attrs)


def law_facts(law: LawResult, assumptions: Assumptions) -> dict[str, Any]:
    """Return the law, whether it was stated, and by how much the recording supports it."""
    point = law.mode.point
    searched = bool(set(DRAG_SHAPES) & set(assumptions.tried))
    if "drag_power" in {**point.opened, **point.fixed}:
        drag = "power"
    elif "linear_share" in point.opened:
        drag = "mixed"
    else:
        drag = "linear" if point.number("linear_share") == 1.0 else "quadratic"
    facts: dict[str, Any] = {
        "force_law": "floating body" if law.floating else "paper",
        "force_law_stated": "no" if assumptions.pressure_gradient == "auto" else "yes",
        "drag_law": drag,
        "drag_law_stated": "no" if searched else "yes",
    }
    if law.unsettled:
        facts["law_unsettled"] = "; ".join(law.unsettled)
    if math.isfinite(law.settled_by):
        facts["law_settled_by"] = law.settled_by
    return facts


def number_variables(point: Point, law: LawResult) -> dict[str, Any]:
    """Return variables with the numbers of the law, and what was tested."""
    values = {**point.fixed, **point.opened}
    data: dict[str, Any] = {
        "number_value": ("number", np.array(list(values.values()), dtype=np.float64)),
        "number_opened": ("number", np.array([name in point.opened for name in values], bool)),
        "number": ("number", np.array(list(values), dtype=np.str_)),
        "filter_drag_coefficient": ((), np.float64(math.exp(point.log_drag))),
        "law_log_evidence": ("law", np.array(list(law.evidence.values()), dtype=np.float64)),
        "law": ("law", np.array(list(law.evidence), dtype=np.str_)),
    }
    if law.tests is not None:
        data["departure_estimate"] = ("departure", law.tests.estimate)
        data["departure_std"] = ("departure", law.tests.std)
        data["departure"] = ("departure", np.array(law.tests.names, dtype=np.str_))
    return data


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


def footprint_count(grid: Grid, series: list[Series], *, side: float, oriented: bool) -> Floats:
    """Return for each node how many samples have the block over it.

    Without orientations the circle inside the block is used; samples that lack one among
    others that have are left out.
    """
    half = 0.5 * side
    reach = math.ceil(half * (math.sqrt(2.0) if oriented else 1.0) / grid.cell_size)
    offsets = np.arange(-reach, reach + 1)
    total = np.zeros(grid.size)
    for one in series:
        retained = (one.excluded == 0) & np.isfinite(one.x) & np.isfinite(one.theta)
        x, y, theta = one.x[retained], one.y[retained], one.theta[retained]
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
