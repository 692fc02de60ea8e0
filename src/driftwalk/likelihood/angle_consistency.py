"""Whether the turning of the block and its motion agree: on the drag, and on the vorticity.

With the angle in the state most of what is learned of C_d comes from how the block turns: its
torque goes with differences of the flow over the block. With the angle as an input the motion alone
tells. If the drag law is right the two agree. A block also turns with the water around it, unless
its orientation is counted clockwise.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.likelihood.filter.filter_pass import Passes
from driftwalk.likelihood.interval_inflation import (
    open_where_undetermined,
    parameter_covariance,
    parameter_facts,
)
from driftwalk.likelihood.law.search import evidence_of
from driftwalk.likelihood.newton import FROM_NEAR, Mode, ModeSearch, inverse, require_mode, thinned
from driftwalk.likelihood.preparation import Estimate, PreparedRecordings
from driftwalk.likelihood.refuse import BREAKDOWN
from driftwalk.likelihood.reml import Restricted, restricted_drag
from driftwalk.likelihood.spline import Spline
from driftwalk.schema.answers.facts import is_open

LEFT_OUT_NATS = 18.0
"""Least loss of log likelihood by a sample that the filter leaves out, in closed form, as it is 6
standard deviations from its prediction: so a fit cannot gain by leaving samples out."""


def angle_given_facts(
    ready: PreparedRecordings, search: ModeSearch, mode: Mode, restricted: Restricted
) -> dict[str, Any]:
    """Fit once more with the angle as an input, and compare.

    Returns ``drag_coefficient_angle_given`` with its interval, and ``angle_disagreement_std``: the
    difference of the two ln C_d in combined standard deviations, NaN where the second fit has no
    solution.
    """
    found = restricted.point
    known = {**found.fixed, **found.opened}
    start = replace(found, log_lever=None, log_angle_noise=None, opened={}, fixed=known)
    passes = thinned(ready.with_angle("given").passes)
    given = ModeSearch(
        replace(passes, layers=search.passes.layers), search.prior, search.iterations
    )
    try:
        other = require_mode(given.find(start, mode.weights, held=FROM_NEAR))
        again = restricted_drag(given, other, intensity=False)
        covariance = parameter_covariance(other, again)
        own = parameter_covariance(mode, restricted)
        apart = abs(again.point.log_drag - found.log_drag)
        stated = open_where_undetermined(covariance, other, again)
        facts = parameter_facts(again.point, stated, ready.study)
        disagreement = apart / math.sqrt(covariance[0, 0] + own[0, 0])
    except BREAKDOWN:
        return {"angle_disagreement_std": math.nan}
    if is_open(facts, "drag_coefficient") or not math.isfinite(disagreement):
        return {"angle_disagreement_std": math.nan}
    return {
        "drag_coefficient_angle_given": facts["drag_coefficient"],
        "drag_coefficient_angle_given_interval": facts["drag_coefficient_interval"],
        "angle_disagreement_std": disagreement,
    }


def spin_correlation(coefficients: Floats, passes: Passes) -> float:
    """Return the correlation of the block's spin with the vorticity of the water around it.

    A block in water turns with it, at about half the vorticity. With the orientation counted the
    wrong way round the correlation is negative.
    """
    spins, vorticities = [], []
    for one in passes.series:
        seen = np.isfinite(one.x) & np.isfinite(one.y) & (one.excluded == 0)
        spins.append(one.omega[seen])
        vorticities.append(_vorticity(coefficients, passes.spline, one.x[seen], one.y[seen]))
    spin, vorticity = np.concatenate(spins), np.concatenate(vorticities)
    with np.errstate(all="ignore"):
        size = float(np.sqrt((spin**2).mean() * (vorticity**2).mean()))
        found = float((spin * vorticity).mean()) / size if size > 0.0 else 0.0
    return found if math.isfinite(found) else 0.0


def log_evidence(estimate: Estimate) -> float:
    """Return the logarithm of the evidence for a stored fit, in the restricted likelihood.

    Fits of the same samples can be compared by it, with the orientation negated too.
    """
    passes, point, weights = estimate.passes, estimate.point, estimate.weights
    prior = estimate.prior
    sums = prior.add(passes.sums(point), point, weights)
    covariance = inverse(sums.information)
    mode = Mode(point, weights, covariance, sums.used, 0, converged=True, deviance=sums.deviance)
    return evidence_of(mode, prior) + LEFT_OUT_NATS * sums.used


def _vorticity(coefficients: Floats, spline: Spline, x: Floats, y: Floats) -> Floats:
    """Return dv/dx - du/dy at places, from differences over a tenth of a cell."""
    step = 0.05 * spline.spacing

    def at(component: int, dx: float, dy: float) -> Floats:
        along_x, along_y = spline.design(x + dx, y + dy)
        return np.asarray(np.einsum("ni,ji,nj->n", along_x, coefficients[component], along_y))

    return (at(1, step, 0.0) - at(1, -step, 0.0) - at(0, 0.0, step) + at(0, 0.0, -step)) / (
        2.0 * step
    )
