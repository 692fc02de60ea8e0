"""Whether the turning of the block and its motion tell of the same drag.

With the angle in the state most of what is learned of C_d comes from how the block turns: its
torque goes with differences of the flow over the block. With the angle as an input the motion alone
tells. If the drag law is right the two agree.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from driftwalk.likelihood.filter.filter_pass import Passes
from driftwalk.likelihood.interval_inflation import parameter_covariance, parameter_facts
from driftwalk.likelihood.newton import FROM_NEAR, Mode, ModeSearch, require_mode
from driftwalk.likelihood.prior import Prior
from driftwalk.likelihood.reml import Restricted, restricted_drag
from driftwalk.likelihood.solution import BREAKDOWN

if TYPE_CHECKING:
    from driftwalk.model import Study


def angle_given_facts(
    passes: Passes, mode: Mode, restricted: Restricted, study: Study
) -> dict[str, Any]:
    """Fit once more with the angle as an input (`passes`), and compare.

    Returns ``drag_coefficient_angle_given`` with its interval, and ``angle_disagreement_std``: the
    difference of the two ln C_d in combined standard deviations, NaN where the second fit has no
    solution.
    """
    found = restricted.point
    known = {**found.fixed, **found.opened}
    start = replace(found, log_lever=None, log_angle_noise=None, opened={}, fixed=known)
    prior = Prior(passes)
    try:
        search = ModeSearch(passes, prior, study.fit.iterations)
        other = require_mode(search.find(start, mode.weights, held=FROM_NEAR))
        again = restricted_drag(passes, other, prior, intensity=False)
        covariance = parameter_covariance(other, again)
        own = parameter_covariance(mode, restricted)
        apart = abs(again.point.log_drag - found.log_drag)
        facts = parameter_facts(again.point, covariance, study)
        disagreement = apart / math.sqrt(covariance[0, 0] + own[0, 0])
    except BREAKDOWN:
        return {"angle_disagreement_std": math.nan}
    if other.lost or not math.isfinite(disagreement):
        return {"angle_disagreement_std": math.nan}
    return {
        "drag_coefficient_angle_given": facts["drag_coefficient"],
        "drag_coefficient_angle_given_interval": facts["drag_coefficient_interval"],
        "angle_disagreement_std": disagreement,
    }
