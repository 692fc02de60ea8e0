"""Starting values of the search."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from driftwalk.conditions import recorded_camera, typical_speed
from driftwalk.conditions.recorded import flow_from_track
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.measured_flow import MeasuredFlow
from driftwalk.likelihood.preparation import PreparedRecordings
from driftwalk.likelihood.prior import PRIOR, Weights, usual_lever
from driftwalk.likelihood.spline import Spline, penalties, products
from driftwalk.schema import FLAGS, Track

if TYPE_CHECKING:
    from driftwalk.model import Study


class Starts(NamedTuple):
    """Where the search begins under each force law."""

    paper: Point
    floating: tuple[Point, ...]
    """They are tried in this order until a search converges."""


class InitialValuesPolicy(NamedTuple):
    """Where the search begins."""

    floating_intensity_factors: tuple[float, ...] = (64.0, 4.0, 16.0)
    """First values of q under the law of a floating body, as multiples of that under the paper's.
    On small orbits each fails for some bodies, but not for the same ones: of 35 in studies/verdict
    two were not found from 4 alone and one not from 16; 64 found the four hardest."""


INITIAL_VALUES: Final = InitialValuesPolicy()


def first_points(ready: PreparedRecordings) -> Starts:
    """Return the first values under each law.

    A floating body follows the water: the push of the water explains what Eq. 4 takes for slip.
    From the flow of Eq. 4 the search lost the track of bodies on small orbits, or took all of the
    motion for noise.
    """
    from driftwalk.model import apply_overrides

    paper = first_point(ready)
    tracer = apply_overrides(ready.study, {"flow.inertia": "none"})
    flow = _first_coefficients(ready, tracer)
    floating = [
        replace(paper, coefficients=flow, log_intensity=paper.log_intensity + math.log(one))
        for one in INITIAL_VALUES.floating_intensity_factors
    ]
    return Starts(paper, tuple(floating))


def first_point(ready: PreparedRecordings) -> Point:
    """Return the first values: C_d = 0.5, the flow of Eq. 4, the noise of `driftwalk info`."""
    study, tracks = ready.study, ready.tracks
    cameras = [recorded_camera(track, study, position_quantum=0.0) for track in tracks]
    steps = np.concatenate([np.hypot(np.diff(track.x), np.diff(track.y)) for track in tracks])
    # A noise of a thousandth of the step between samples at least.
    least = max(1e-3 * float(np.median(steps[steps > 0.0])), 1e-9)
    # The first q is a tenth of U^3 / a, speed U and side a: rather too large than too small, as a
    # small one makes the filter lose the track.
    unrest = 0.1 * typical_speed(tracks) ** 3 / study.block.side_m
    point = Point(
        _first_coefficients(ready, study),
        log_drag=math.log(PRIOR.drag),
        log_intensity=math.log(unrest),
        log_noise=_log_noise([camera.position_noise for camera in cameras], least),
        amplitudes=None if ready.measured is None else ready.measured.amplitudes,
    )
    if ready.angle != "state":
        return point
    # The angle that a noise of the position at a corner would make.
    least_angle = least / study.block.side_m
    return replace(
        point,
        log_lever=math.log(usual_lever(study.block.side_m, study.block.body())),
        log_angle_noise=_log_noise([camera.orientation_noise for camera in cameras], least_angle),
    )


def _first_coefficients(ready: PreparedRecordings, study: Study) -> Floats:
    """Return the first coefficients of the flow, of each flow, or of its modes."""
    spline = ready.passes.spline
    if ready.intervals.steady:
        coefficients = _flow_coefficients(ready.tracks[0], study, spline, ready.measured)
        if ready.measured is None or ready.measured.layers == 1:
            return coefficients
        normal, right = ready.measured.normal, ready.measured.right
        modes = [
            _smooth(normal[k : k + 2].mean(axis=0), right[k : k + 2], spline)
            for k in range(2, len(normal), 2)
        ]
        return np.stack([coefficients, *modes])
    # Each flow begins with the longest stretch that was recorded in it.
    parts = list(zip(ready.places, ready.parts, strict=True))
    longest = [
        max((part for (flow, _), part in parts if flow == k), key=lambda one: one.time.size)
        for k in range(len(ready.intervals.labels))
    ]
    return np.stack([_flow_coefficients(one, study, spline) for one in longest])


def _log_noise(estimates: Sequence[float], least: float) -> float:
    """Return the logarithm of the mean of the estimates there are, and of the least if none."""
    seen = [value for value in estimates if math.isfinite(value)]
    return math.log(max(float(np.mean(seen)) if seen else least, least))


def first_weights(tracks: Sequence[Track], spline: Spline) -> Weights:
    """Return weights for a flow of the body's speed that changes over one or two knots."""
    power = typical_speed(tracks) ** 2 * spline.spacing**2
    return Weights(roughness=10.0 * spline.spacing**4 / power, size=0.02 / power)


def _flow_coefficients(
    track: Track, study: Study, spline: Spline, measured: MeasuredFlow | None = None
) -> Floats:
    """Return a smooth spline through the flow of Eq. 4, and through a measured one; else still."""
    found = _field_sums(track, study, spline)
    if measured is not None:
        # Where vectors were measured they count a thousand times as much as those of Eq. 4.
        own = measured.normal[:2].mean(axis=0)
        weight = 1e3 * float(np.trace(found[0])) / float(np.trace(own)) if found is not None else 1
        normal, right = weight * own, weight * measured.right[:2]
        found = (normal, right) if found is None else (normal + found[0], right + found[1])
    if found is None:
        return np.zeros((2, spline.rows, spline.columns))
    return _smooth(*found, spline)


def _smooth(normal: Floats, right: Floats, spline: Spline) -> Floats:
    """Return the coefficients of a smooth flow from sums of products, (2, rows, columns)."""
    roughness, size = penalties(spline)
    share = float(np.trace(normal)) / float(np.trace(roughness))
    # Little smoothing: the roughness has a thousandth of the weight of the data.
    normal = normal + 1e-3 * share * (roughness + 1e-3 * size / spline.spacing**4)
    solved = np.linalg.solve(normal, np.stack(list(right), axis=1)).T
    return np.ascontiguousarray(solved.reshape(2, spline.rows, spline.columns))


def _field_sums(track: Track, study: Study, spline: Spline) -> tuple[Floats, Floats] | None:
    """Return the sums of products of the flow of Eq. 4 with the bases; nothing without one."""
    try:
        field = flow_from_track(track, study)
    except InputError:
        return None
    along_x, along_y = spline.design(field["x"].values, field["y"].values)
    weight = (field["flag"].values == FLAGS["measured"]).astype(np.float64)
    normal = products(weight, along_x, along_y)
    right = [(along_y.T @ (weight * field[name].values) @ along_x).ravel() for name in ("u", "v")]
    return normal, np.stack(right)
