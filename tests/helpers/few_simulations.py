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
    patch.setattr(posterior, "MOST_ROUNDS", 2)
    patch.setattr(posterior, "STEPS", 60)
    if not matched:
        _descend_little(patch)


def compare_after_little(patch: pytest.MonkeyPatch) -> None:
    """Let a comparison search each model, and match its summaries, for as short a time."""
    patch.setattr(compare, "Budget", lambda: FEW)
    _approach_little(patch)
    _descend_little(patch)
    patch.setattr(synthetic_likelihood, "SIMULATIONS", 256)


def _approach_little(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(regression_abc, "SIMULATIONS", 64)
    patch.setattr(regression_abc, "MOST_ROUNDS", 2)


def _descend_little(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(gauss_newton, "FEWEST_SIMULATIONS", (128, 128))
    patch.setattr(gauss_newton, "COEFFICIENTS", (4, 8))
    patch.setattr(gauss_newton, "MOST_ROUNDS", 2)
