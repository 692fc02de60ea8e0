"""The prior, and the starting values of the search: both from what is known before the fit.

Prior of the flow's coefficients: ``exp(-(lam_r c' R c + lam_s c' S c) / 2)`` per component, R and S
the roughness and the size of `driftwalk.likelihood.spline.penalties`; with several flows the
weights are the same for all. The two weights follow from the data: each step sets a weight to the
degrees of freedom that the data have taken from its prior, over ``c' R c`` or ``c' S c`` (MacKay's
fixed point of the evidence). ln C_d, lever and angle noise have weak normal priors.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from driftwalk.conditions import recorded_camera, typical_speed
from driftwalk.conditions.recorded import flow_from_track
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.likelihood.filter.filter_pass import Passes, Sums
from driftwalk.likelihood.filter.parameters import NUMBERS, Point
from driftwalk.likelihood.spline import Spline, penalties
from driftwalk.schema import FLAGS, Track

if TYPE_CHECKING:
    from driftwalk.likelihood.preparation import PreparedRecordings
    from driftwalk.model import Study


class PriorPolicy(NamedTuple):
    """Centres and widths of the weak priors."""

    drag: float = 0.5
    """Centre of the prior of C_d, and where the search begins. Chosen by hand."""
    log_drag_std: float = 0.7
    """Standard deviation of ln C_d: within a factor of two. Chosen by hand."""
    lever: float = 0.01
    """Centre of the prior of the force's lever, in sides of the block, and its first value. On
    recordings of the model it comes out at 0.001 to 0.004 (docs/explanation/likelihood.md)."""
    log_lever_std: float = 1.0
    """Within a factor of three. Chosen by hand."""
    angle_noise: float = 0.01
    """Centre of the prior of the angle's noise [rad]. Chosen by hand: half a degree."""
    log_angle_noise_std: float = 2.3
    """A factor of ten: it counts only where the turning is so restless that nothing is known of the
    noise. Chosen by hand."""


PRIOR: Final = PriorPolicy()
LEVER, ANGLE_NOISE = 3, 4
"""Places of the lever and of the angle's noise, counted from C_d on."""
MOST_FACTOR: Final = 10.0
"""Largest factor by which q, r^2 or the weight of a penalty changes in a step. Chosen by hand."""


@dataclass(frozen=True)
class Weights:
    """Weights of the two penalties."""

    roughness: float
    size: float


class Prior:
    """The prior of all parameters as a quadratic form."""

    def __init__(self, passes: Passes) -> None:
        self.roughness, self.size = penalties(passes.spline)
        self.log_lever = math.log(PRIOR.lever * passes.body.side)

    def matrix(self, weights: Weights) -> Floats:
        """Return the precision of one component's coefficients."""
        return weights.roughness * self.roughness + weights.size * self.size

    def add(self, sums: Sums, point: Point, weights: Weights) -> Sums:
        """Return the sums with the prior of the coefficients, of C_d and of the lever in them."""
        precision = self.matrix(weights)
        count = len(precision)
        coefficients = point.coefficients.reshape(-1, count)
        score, information = sums.score.copy(), sums.information.copy()
        pull = coefficients @ precision
        for component in range(len(coefficients)):
            part = slice(component * count, (component + 1) * count)
            information[part, part] += precision
            score[part] -= pull[component]
        deviance = sums.deviance + 0.5 * float((pull * coefficients).sum())
        drag = coefficients.size
        single = [(drag, point.log_drag - math.log(PRIOR.drag), PRIOR.log_drag_std)]
        if point.log_lever is not None:
            single.append((drag + LEVER, point.log_lever - self.log_lever, PRIOR.log_lever_std))
        if point.log_angle_noise is not None:
            off = point.log_angle_noise - math.log(PRIOR.angle_noise)
            single.append((drag + ANGLE_NOISE, off, PRIOR.log_angle_noise_std))
        first = drag + 1 + len(point.noises)
        for index, (name, value) in enumerate(point.opened.items(), first):
            single.append((index, value - NUMBERS[name].model, NUMBERS[name].prior_std))
        for index, off, std in single:
            deviance += 0.5 * (off / std) ** 2
            # Without derivatives by the noises there is no row of the lever.
            if index < score.size:
                information[index, index] += 1.0 / std**2
                score[index] -= off / std**2
        return Sums(deviance, score, information, sums.used)

    def updated(self, weights: Weights, point: Point, covariance: Floats) -> Weights:
        """Return the weights after one step of the evidence's fixed point."""
        inverse = np.linalg.inv(self.matrix(weights))
        count = len(inverse)
        coefficients = point.coefficients.reshape(-1, count)
        parts = [
            covariance[k * count : (k + 1) * count, k * count : (k + 1) * count]
            for k in range(len(coefficients))
        ]
        new = []
        for old, form in ((weights.roughness, self.roughness), (weights.size, self.size)):
            prior = len(parts) * float((form * inverse).sum())
            posterior = sum(float((form * part).sum()) for part in parts)
            value = float(np.einsum("ka,ab,kb->", coefficients, form, coefficients))
            wanted = old * (prior - posterior) / max(value, 1e-300)
            new.append(float(np.clip(wanted, old / MOST_FACTOR, old * MOST_FACTOR)))
        return Weights(*new)


def first_point(ready: PreparedRecordings, spline: Spline) -> Point:
    """Return the first values: C_d = 0.5, the flow of Eq. 4, the noise of `driftwalk info`."""
    study, tracks = ready.study, ready.tracks
    cameras = [recorded_camera(track, study, position_quantum=0.0) for track in tracks]
    steps = np.concatenate([np.hypot(np.diff(track.x), np.diff(track.y)) for track in tracks])
    # A noise of a thousandth of the step between samples at least.
    least = max(1e-3 * float(np.median(steps[steps > 0.0])), 1e-9)
    # The first q is a tenth of U^3 / a, speed U and side a: rather too large than too small, as a
    # small one makes the filter lose the track.
    unrest = 0.1 * typical_speed(tracks) ** 3 / study.block.side_m
    if ready.intervals.steady:
        coefficients = _flow_coefficients(tracks[0], study, spline)
    else:
        # Each flow begins with the longest stretch that was recorded in it.
        longest: dict[int, Track] = {}
        for (flow, _), part in zip(ready.places, ready.parts, strict=True):
            if flow not in longest or part.time.size > longest[flow].time.size:
                longest[flow] = part
        flows = range(len(ready.intervals.labels))
        coefficients = np.stack([_flow_coefficients(longest[k], study, spline) for k in flows])
    point = Point(
        coefficients,
        log_drag=math.log(PRIOR.drag),
        log_intensity=math.log(unrest),
        log_noise=_log_noise([camera.position_noise for camera in cameras], least),
    )
    if ready.angle != "state":
        return point
    # The angle that a noise of the position at a corner would make.
    least_angle = least / study.block.side_m
    return replace(
        point,
        log_lever=math.log(PRIOR.lever * study.block.side_m),
        log_angle_noise=_log_noise([camera.orientation_noise for camera in cameras], least_angle),
    )


def _log_noise(estimates: Sequence[float], least: float) -> float:
    """Return the logarithm of the mean of the estimates there are, and of the least if none."""
    seen = [value for value in estimates if math.isfinite(value)]
    return math.log(max(float(np.mean(seen)) if seen else least, least))


def first_weights(tracks: Sequence[Track], spline: Spline) -> Weights:
    """Return weights for a flow of the body's speed that changes over one or two knots."""
    power = typical_speed(tracks) ** 2 * spline.spacing**2
    return Weights(roughness=10.0 * spline.spacing**4 / power, size=0.02 / power)


def _flow_coefficients(track: Track, study: Study, spline: Spline) -> Floats:
    """Return a smooth spline through the flow field of Eq. 4; still water where there is none."""
    try:
        field = flow_from_track(track, study)
    except InputError:
        return np.zeros((2, spline.rows, spline.columns))
    along_x, along_y = spline.design(field["x"].values, field["y"].values)
    weight = (field["flag"].values == FLAGS["measured"]).astype(np.float64)
    # Products of the bases over a node, for all pairs of coefficients of a direction.
    pairs_x = np.einsum("xi,xk->xik", along_x, along_x)
    pairs_y = np.einsum("yj,yl->yjl", along_y, along_y)
    normal = np.einsum("yx,yjl,xik->jilk", weight, pairs_y, pairs_x, optimize=True)
    normal = normal.reshape(spline.size, spline.size)
    roughness, size = penalties(spline)
    share = float(np.trace(normal)) / float(np.trace(roughness))
    # Little smoothing: the roughness has a thousandth of the weight of the data.
    normal += 1e-3 * share * (roughness + 1e-3 * size / spline.spacing**4)
    right = [(along_y.T @ (weight * field[name].values) @ along_x).ravel() for name in ("u", "v")]
    found = np.linalg.solve(normal, np.stack(right, axis=1)).T
    return np.ascontiguousarray(found.reshape(2, spline.rows, spline.columns))
