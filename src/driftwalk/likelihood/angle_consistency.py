"""Whether the turning of the block and its motion tell of the same drag.

With the angle in the state most of what is learned of C_d comes from how the block turns: its
torque goes with differences of the flow over the block. With the angle as an input the motion alone
tells. If the drag law is right the two agree.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from driftwalk.likelihood.filter_pass import Passes
from driftwalk.likelihood.newton import FROM_NEAR, Mode, Prior, find_mode
from driftwalk.likelihood.reml import Restricted, restricted_drag
from driftwalk.likelihood.result import parameter_covariance, parameter_facts
from driftwalk.likelihood.solution import BREAKDOWN

if TYPE_CHECKING:
    from driftwalk.model import Study

CLOSE: Final = 2.0
"""In standard deviations: a shorter step of the search leaves a fifth of one at most."""
NOTABLE_DISAGREEMENT: Final = 3.0
"""Combined standard deviations beyond which the two estimates of C_d do not agree."""


def angle_given_facts(
    passes: Passes, mode: Mode, restricted: Restricted, study: Study
) -> dict[str, Any]:
    """Fit once more with the angle as an input, and compare.

    Parameters
    ----------
    passes : Passes
        The filter with the angle as an input.
    mode, restricted : Mode, Restricted
        Result with the angle in the state; the search begins there.
    study : Study
        The section [fit].

    Returns
    -------
    dict
        ``drag_coefficient_angle_given`` with its interval, and ``angle_disagreement_std``: the
        difference of the two ln C_d in combined standard deviations, NaN where the second fit has
        no solution.
    """
    found = restricted.point
    known = {**found.fixed, **found.opened}
    start = replace(found, log_lever=None, log_angle_noise=None, opened={}, fixed=known)
    prior = Prior(passes)
    try:
        other = find_mode(
            passes,
            start,
            mode.weights,
            prior,
            iterations=study.fit.iterations,
            held=FROM_NEAR,
        )
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
