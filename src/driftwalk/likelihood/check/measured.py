"""Whether a measured flow agrees with the motion, and how it differs from the one that does."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Bools, Floats, Integers
from driftwalk.likelihood.check.power import POWER, detectable_sigmas
from driftwalk.likelihood.flow_intervals import fitted_flow
from driftwalk.likelihood.measured_flow import MEASURED, MeasuredFlow
from driftwalk.likelihood.prior import Prior, Weights
from driftwalk.schema import FLAGS
from driftwalk.schema.answers.facts import fitted_value

if TYPE_CHECKING:
    import xarray as xr


class PlacementPolicy(NamedTuple):
    """Where a measured flow is looked for in the fitted one."""

    farthest_m: float = 0.04
    """Largest shift along an axis. Chosen by hand: a length of the usual block and more."""
    step_m: float = 0.005
    """Between shifts. Chosen by hand: a quarter of the usual distance between knots."""
    agrees: float = 0.9
    """Correlation of two flows from which on they are the same. With errors of 5 % that of a
    measured flow with the fitted one is 0.99. Chosen by hand."""
    covers: float = 0.5
    """Share of the fitted nodes that a placement has to cover for its correlation to count. Chosen
    by hand."""


PLACEMENT: Final = PlacementPolicy()


class Placement(NamedTuple):
    """How a measured flow is turned, mirrored and shifted, in words, and how well it fits then."""

    words: str
    correlation: float


def best_placement(measured: MeasuredFlow, free: xr.Dataset) -> Placement:
    """Return where the measured flow fits a flow that was fitted without it best."""
    flow = fitted_flow(free, interval=0)
    known = flow["flag"].values == FLAGS["measured"]
    x, y = flow["x"].values, flow["y"].values
    want = np.stack([flow[name].values for name in ("u", "v")])
    enough = PLACEMENT.covers * np.count_nonzero(known)
    return max(
        (
            Placement(words, _correlation(moved, want, known & there, enough))
            for words, moved, there in _moved(measured, x, y)
        ),
        key=lambda one: one.correlation,
    )


def _moved(measured: MeasuredFlow, x: Floats, y: Floats) -> Iterator[tuple[str, Floats, Bools]]:
    """Yield the flow turned, mirrored and shifted: words, velocities, where it was measured."""
    spline = measured.spline
    own = measured.own[:2].reshape(2, spline.rows, spline.columns)
    count = round(PLACEMENT.farthest_m / PLACEMENT.step_m)
    shifts = PLACEMENT.step_m * np.arange(-count, count + 1)
    known = np.pad(np.isfinite(measured.velocity[0]), 1)
    for mirrored, (sign_x, sign_y) in _SIGNS.items():
        for shift_x in shifts:
            for shift_y in shifts:
                at_x, at_y = sign_x * x + shift_x, sign_y * y + shift_y
                there = known[np.ix_(_nearest(measured.y, at_y), _nearest(measured.x, at_x))]
                moved = spline.values(own, at_x, at_y)
                words = mirrored
                if shift_x or shift_y:
                    words = (
                        f"{mirrored}{' and ' if mirrored else ''}shifted by "
                        f"{-1e3 * sign_x * shift_x:.0f} mm in x and "
                        f"{-1e3 * sign_y * shift_y:.0f} mm in y"
                    ).replace("-0 mm", "0 mm")
                yield words, np.stack([sign_x * moved[0], sign_y * moved[1]]), there


def _nearest(nodes: Floats, places: Floats) -> Integers:
    """Return the nodes nearest to places, counted from 1; 0 or one more beyond the ends."""
    found = np.rint((places - nodes[0]) / (nodes[1] - nodes[0])).astype(np.intp) + 1
    return np.asarray(np.clip(found, 0, nodes.size + 1))


_SIGNS: Final = {
    "": (1.0, 1.0),
    "mirrored in x": (-1.0, 1.0),
    "mirrored in y": (1.0, -1.0),
    "turned by 180°": (-1.0, -1.0),
}
"""Factors of the axes."""


def _correlation(moved: Floats, want: Floats, known: Bools, enough: float) -> float:
    """Return the correlation of two flows where both are known; -1 where that is too little."""
    if np.count_nonzero(known) < enough:
        return -1.0
    one, other = moved[:, known], want[:, known]
    size = math.sqrt(float((one**2).sum() * (other**2).sum()))
    return float((one * other).sum()) / size if size > 0.0 else -1.0


def left_out_sentence(measured: MeasuredFlow, free: xr.Dataset) -> str:
    """Return what is said where the recording alone is explained: C_d, and how the flows differ."""
    found = best_placement(measured, free)
    drag = fitted_value(free, "drag_coefficient")
    low, high = free["interval"].sel(parameter="drag_coefficient").values
    how = "it is another flow than the one that moves the block"
    if found.correlation > PLACEMENT.agrees and found.words:
        how = (
            f"{found.words} it is the one that moves the block (correlation "
            f"{found.correlation:.2f})"
        )
    return (
        "the measured flow contradicts the motion: nothing contradicts the model without it, "
        f"with a C_d of {drag:.3g} ({low:.3g} to {high:.3g}); {how}"
    )


def agreement_facts(
    prior: Prior, weights: Weights, coefficients: Floats, information: Floats, confidence: float
) -> dict[str, Any]:
    """Return how far the motion pulls the flow away from the measured one.

    The fitted flow is compared with that of the vectors and the prior of smoothness alone, in
    errors of the vectors. `information` is that of the motion on the coefficients.
    """
    measured = prior.measured
    assert measured is not None
    from scipy.linalg import block_diag
    from scipy.optimize import brentq
    from scipy.special import ndtri
    from scipy.stats import norm

    flow, determined = coefficients.reshape(len(measured.own), -1), weights.determined
    smoothness, factors = prior.matrix(weights), prior.factors(weights, len(flow))
    k, precision = measured.scale(coefficients, determined)
    _, score, precise = measured.deviance(coefficients, determined)
    score = score - ((factors[:, None] * flow) @ smoothness).ravel()
    precise = precise + block_diag(*(factor * smoothness for factor in factors))
    alone, covariance = np.linalg.inv(precise), np.linalg.inv(precise + information)
    off = -alone @ score
    form = _of_difference(measured, flow, k, precision)
    squares = float(off @ form @ off)
    # Two estimates of which one knows more: their difference has the difference of the covariances.
    less = alone - covariance
    spread = form @ less
    mean = max(float(np.trace(spread)), 1e-6)
    half_variance = max(float((spread * spread.T).sum()), 1e-12)
    # A chi squared with the same mean and variance (Satterthwaite).
    unit, dof = half_variance / mean, mean**2 / half_variance
    # A random difference of the flows, as detailed as the knots, by which the sum grows by 1.
    shift = float(((less @ form) * (form @ less @ form).T).sum())
    along = np.einsum("kab,kb->ka", measured.normal, flow).ravel()
    along_x, along_y = measured.spline.design(measured.x, measured.y)
    there = np.isfinite(measured.velocity[0])
    bases = np.outer((along_y**2).sum(axis=1), (along_x**2).sum(axis=1))[there].mean()
    one = math.sqrt(unit * float(bases) / max(shift, 1e-300))
    size = math.sqrt(float(np.mean(measured.velocity[:, there] ** 2)))
    more = (MEASURED.tolerated * size / one) ** 2
    least, most = more, 4.0 * (dof + more) + 1e3
    limit = brentq(lambda sum_: _tail(sum_, dof, more) - MEASURED.level, 0.0, 10.0 * most)
    detectable = brentq(lambda shift: _tail(limit, dof, shift) - POWER.share, least, most)
    *farthest, difference = _farthest(measured, k * off)
    found: dict[str, Any] = {
        "measured_flow_chi_squared": squares / unit,
        "measured_flow_expected": dof + more,
        "measured_flow_expected_std": math.sqrt(2.0 * (dof + 2.0 * more)),
        "measured_flow_p_value": _tail(squares / unit, dof, more),
        "measured_flow_determined": determined,
        "measured_flow_detectable_m_s": one * math.sqrt(detectable),
        "measured_flow_farthest_m": farthest,
        "measured_flow_difference_m_s": difference,
    }
    if measured.scale_std > 0.0:
        variance = 1.0 / precision + (k / precision) ** 2 * float(along @ covariance @ along)
        free = max(measured.scale_std**2 - variance, 0.0)
        std = math.sqrt(variance)
        reach = float(ndtri(0.5 + 0.5 * confidence)) * std
        chance = 2.0 * float(norm.sf(abs(k - 1.0) / math.sqrt(free))) if free > 0.0 else 1.0
        sigmas = detectable_sigmas(0.5 * MEASURED.level)
        found |= {
            "measured_flow_scale": k,
            "measured_flow_scale_interval": [k - reach, k + reach],
            "measured_flow_scale_std": std,
            "measured_flow_scale_p_value": chance,
            "measured_flow_scale_detectable": sigmas * math.sqrt(free),
        }
    return found


def _tail(value: float, dof: float, shift: float) -> float:
    """Return the chance of a noncentral chi squared above a value."""
    from scipy.stats import ncx2, norm

    # Where its noncentrality is large it is normal, and its series takes long.
    if shift > 1e4:
        return float(norm.sf((value - dof - shift) / math.sqrt(2.0 * (dof + 2.0 * shift))))
    return float(ncx2.sf(value, dof, shift))


def _of_difference(measured: MeasuredFlow, flow: Floats, k: float, precision: float) -> Floats:
    """Return the quadratic form of a change of the flow in the sum of squares of the vectors."""
    along = np.einsum("kab,kb->ka", measured.normal, flow).ravel()
    power = float(along @ flow.ravel())
    found = measured.curvature(flow, k, math.inf)
    share = 2.0 / precision - power / precision**2
    return np.asarray(found - k**2 * share * np.outer(along, along))


def _farthest(measured: MeasuredFlow, off: Floats) -> tuple[float, float, float]:
    """Return where two flows differ most among the measured nodes, and by how much."""
    spline = measured.spline
    values = spline.values(off.reshape(-1, spline.rows, spline.columns), measured.x, measured.y)
    # Of a flow that changes, the rms over time: the modes have amplitudes of unit rms.
    size = np.where(np.isfinite(measured.velocity[0]), np.hypot.reduce(values), -1.0)
    row, column = np.unravel_index(int(size.argmax()), size.shape)
    return float(measured.x[column]), float(measured.y[row]), float(size[row, column])
