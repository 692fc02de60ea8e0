"""Intervals of the parameters: intervals of theory, inflated by calibrated factors.

Theory takes the filter's innovations for independent normals and the smoothness of the flow for
known. It omits some effects: the filter is Gaussian, flows are not drawn from the prior, and a
contact with the wall may go unseen. The factors were calibrated so that 90 % intervals cover 90 %
of the truths, on 64 recordings of known truth with the angle in the state and 32 without
(`studies/likelihood`, the sets synthetic and ode). The set coverage is the test.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.law.candidate_laws import INTENSITIES
from driftwalk.likelihood.law.force_law import inertia_facts, inertia_of, number_facts
from driftwalk.likelihood.newton import Mode, known_numbers_variance
from driftwalk.likelihood.prior import PRIOR
from driftwalk.likelihood.reml import Restricted

if TYPE_CHECKING:
    from driftwalk.model import Study


class InflationPolicy(NamedTuple):
    """Factors of the standard deviations of theory."""

    with_angle: tuple[float, ...] = (1.3, 1.3, 1.4, 1.0, 1.4)
    """Of ln C_d, ln q, ln r, the lever (known from its prior) and the angle's noise. Calibrated for
    a coverage of 90 % on 64 recordings (studies/likelihood, sets synthetic and ode)."""
    without_angle: tuple[float, ...] = (1.4, 1.4, 1.1)
    """Of ln C_d, ln q and ln r with the angle as an input or not used. Calibrated in the same way
    on 32 recordings (studies/likelihood)."""
    number: float = 1.3
    """Of the numbers of departures. Chosen by hand, as the factor of ln C_d."""
    most_factor: float = 10.0
    """Factor at one standard deviation from which on the recording does not determine C_d or
    sigma_F: a number of no known power of ten. Chosen by hand."""
    mended_force: float = 0.7
    """Error that mended frames add to ln sigma_F, over their share of all frames: 3.5 % (rms) where
    5 % of the frames were dropped, in eight worlds (studies/misfit)."""


INFLATION: Final = InflationPolicy()


def inflated(covariance: Floats, point: Point) -> Floats:
    """Return the covariance of ln C_d, noises and opened numbers with the calibrated factors.

    Examples
    --------
    >>> inflated(np.eye(3), Point(np.zeros((2, 4, 4)), -0.7, -9.0, -8.0)).diagonal().round(2)
    array([1.96, 1.96, 1.21])
    """
    noises = INFLATION.without_angle if point.log_lever is None else INFLATION.with_angle
    factors = np.array([*noises, *[INFLATION.number] * len(point.opened)])
    return np.asarray(covariance * np.outer(factors, factors))


def with_mended_frames(covariance: Floats, share: float) -> Floats:
    """Return the covariance with the error of frames whose time was put in, a `share` of all.

    A frame that is put in at a wrong place makes the block leap, which the fit takes for force.

    Examples
    --------
    >>> with_mended_frames(np.zeros((2, 2)), 0.05).diagonal() ** 0.5 / 2.0  # of ln sigma_F
    array([0.   , 0.035])
    """
    more = np.zeros_like(covariance)
    more[1, 1] = (2.0 * INFLATION.mended_force * share) ** 2
    return covariance + more


def parameter_covariance(mode: Mode, restricted: Restricted) -> Floats:
    """Return the covariance of ln C_d, the noises and opened numbers.

    C_d's variance comes from its own criterion, in which the numbers are known; it is made larger
    by the share that they add to it. The rest comes from theory. All of it has the calibrated
    factors.
    """
    drag = mode.point.coefficients.size
    covariance = mode.covariance[drag:, drag:].copy()
    scale = np.ones(len(covariance))
    scale[0] = restricted.log_drag_std / math.sqrt(known_numbers_variance(mode))
    return inflated(covariance * np.outer(scale, scale), mode.point)


def open_where_undetermined(covariance: Floats, mode: Mode, restricted: Restricted) -> Floats:
    """Return the covariance, infinite for parameters of which the recording tells nothing.

    The estimate of C_d is its weak prior's where the data say less of it than that prior.
    """
    if mode.diverged:
        return np.asarray(np.diag(np.full(len(covariance), math.inf)))
    found = covariance.copy()
    # Where data and prior tell as much, the posterior has 1 / sqrt(2) of the prior's deviation.
    if restricted.log_drag_std > math.sqrt(0.5) * PRIOR.log_drag_std:
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
    intensity = study.block.mass_kg**2 * math.exp(point.log_intensity)
    normal = float(ndtri(0.5 + 0.5 * confidence))
    reach = normal * np.sqrt(np.diag(covariance))
    reach_of_drag = normal * _log_drag_std(point, covariance)
    heavier = inertia_of(study, point)
    side = normal * study.fit.side_std_m / study.block.side_m
    of_drag, of_force = (
        math.hypot(one, normal * heavier.log_std, side * slope)
        for one, slope in zip((reach_of_drag, 0.5 * reach[1]), by_side, strict=True)
    )
    total = heavier.share**2 * intensity
    drag = (1.0 - point.number("linear_share")) * math.exp(point.log_drag)
    # Beyond this width not even the power of ten is known: the interval is open, and said to be.
    most = normal * math.log(INFLATION.most_factor)
    of_drag, of_force, reach_of_drag = (
        one if one < most else math.inf for one in (of_drag, of_force, reach_of_drag)
    )
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
    if point.intensity_contrasts:
        facts |= _flow_forces(point, covariance, math.sqrt(total / interval), normal, of_force)
    for name, (value, width) in values.items():
        facts[name] = value
        facts[f"{name}_interval"] = _ends(value, width)
    # A face is cut into strips, which takes a little drag from a block that turns: C_d comes out
    # too large by up to as much.
    if point.log_lever is not None:
        for name in {"drag_coefficient", "effective_drag_coefficient"} & values.keys():
            facts[f"{name}_interval"][0] *= 1.0 - strips_error(study.block.strips_per_face)
    return {
        **facts,
        **inertia_facts(heavier, facts, normal),
        **number_facts(point, normal**2 * covariance, study),
    }


def strips_error(strips: int) -> float:
    """Return the share by which strips underrate the drag of the spin: 2 / (3 n^2).

    A strip feels the water at its centre. On a spinning square the drag of a strip at r along a
    face, h from the centre, has the torque r (h^2 + r^2) per length; half a face in n / 2 strips
    gives 1 - 2 / (3 n^2) of the integral. The fitted C_d of a real face is too large by up to that.

    Parameters
    ----------
    strips : int
        Strips per face, >= 1.

    Returns
    -------
    float
        0.0104 for the usual eight.

    Examples
    --------
    >>> round(strips_error(8), 4)
    0.0104
    """
    return 2.0 / (3.0 * strips**2)


def _flow_forces(
    point: Point, covariance: Floats, first: float, normal: float, of_first: float
) -> dict[str, Any]:
    """Return sigma_F in each flow with its interval; `first` is that of the first flow."""
    order = list(point.extras)
    force, ends = [first], [_ends(first, of_first)]
    for flow, contrast in point.intensity_contrasts.items():
        at = [1, 1 + order.index(INTENSITIES[flow - 1])]
        variance = float(covariance[np.ix_(at, at)].sum()) - float(covariance[1, 1])
        # What is common to all flows, the mass among it, is as uncertain as in the first one.
        width = math.sqrt(max(of_first**2 + 0.25 * normal**2 * variance, 0.0))
        force.append(first * math.exp(0.5 * contrast))
        ends.append(_ends(force[-1], width))
    low, high = zip(*ends, strict=True)
    return {
        "flow_force_std_N": force,
        "flow_force_std_low_N": list(low),
        "flow_force_std_high_N": list(high),
    }


def _log_drag_std(point: Point, covariance: Floats) -> float:
    """Return the standard deviation of ln C_d of the quadratic part of the drag."""
    if math.isinf(covariance[0, 0]):
        return math.inf
    slopes = np.zeros(len(covariance))
    slopes[0] = 1.0
    if "linear_share" in point.opened:
        at = 1 + list(point.extras).index("linear_share")
        slopes[at] = -1.0 / max(1.0 - point.opened["linear_share"], 1e-6)
    return math.sqrt(float(slopes @ covariance @ slopes))


def _ends(value: float, log_width: float) -> list[float]:
    """Return the ends of an interval, 0 and infinity where the data leave it open.

    A mixed drag with more than all of it linear has a quadratic part below zero: no such drag is.
    """
    # Beyond 300 the exponential would soon not fit a double.
    if value < 0.0 or not log_width < 300.0:
        return [0.0, math.inf]
    return [value * math.exp(-log_width), value * math.exp(log_width)]
