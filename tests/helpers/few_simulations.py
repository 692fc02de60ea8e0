"""Calibrations of many parameters and comparisons of models, with few simulations in every stage.

Every stage is there, and what it makes is real; the answers are coarse. This is for tests of what
is printed, stored and drawn. How good the answers are is tested with as many as users get.
"""

from __future__ import annotations

import pytest

from driftwalk.calibration.estimation import (
    gauss_newton,
    posterior,
    regression_abc,
    run,
    synthetic_likelihood,
)
from driftwalk.calibration.evolution import Budget
from driftwalk.calibration.ranking import compare

FEW = Budget(design=16, starts=1, short=2, long=2)


def simulate_little(patch: pytest.MonkeyPatch, *, matched: bool = False) -> None:
    """Let every stage of a calibration of many parameters simulate little.

    With `matched` all but one: the summaries are matched as closely as for users, so that the
    estimate lies at the bottom of its profiles.
    """
    patch.setattr(run, "SEARCH", FEW)
    _approach_little(patch)
    patch.setattr(posterior, "POSTERIOR", posterior.POSTERIOR._replace(most_rounds=2, steps=60))
    if not matched:
        _descend_little(patch)


def compare_after_little(patch: pytest.MonkeyPatch) -> None:
    """Let a comparison search each model, and match its summaries, for as short a time."""
    patch.setattr(compare, "Budget", lambda: FEW)
    _approach_little(patch)
    _descend_little(patch)
    fewer = synthetic_likelihood.SYNTHETIC._replace(simulations=256)
    patch.setattr(synthetic_likelihood, "SYNTHETIC", fewer)


def _approach_little(patch: pytest.MonkeyPatch) -> None:
    few = regression_abc.REGRESSION._replace(simulations=64, most_rounds=2)
    patch.setattr(regression_abc, "REGRESSION", few)


def _descend_little(patch: pytest.MonkeyPatch) -> None:
    few = gauss_newton.GAUSS_NEWTON._replace(
        fewest_simulations=(128, 128), per_coefficient=(4, 8), most_rounds=2
    )
    patch.setattr(gauss_newton, "GAUSS_NEWTON", few)
