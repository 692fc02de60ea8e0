"""The share of the restricted likelihood's correction that is due: closed forms."""

from __future__ import annotations

import numpy as np
import pytest

import driftwalk as dw
from driftwalk.likelihood.filter.filter_pass import Sums
from driftwalk.likelihood.law.candidate_laws import DRAG_SHAPES
from driftwalk.likelihood.law.force_law import assumptions_of
from driftwalk.likelihood.refuse import cholesky
from driftwalk.likelihood.reml import pull_of_prior, remembered


@pytest.mark.parametrize("crossing", [0.2, 1.0, 2.0, 20.0])
def test_one_visit_is_corrected_as_a_short_panel_is(crossing: float) -> None:
    """A mean that is seen for a time T once: 1 - (1 - exp(-kappa T)) / (kappa T) (Nickell 1981)."""
    count = 500
    kept, _ = remembered(
        np.ones((count, 1)), np.full(count, crossing / count), np.zeros(count, bool), np.zeros(1)
    )
    assert kept.mean() == pytest.approx(1.0 + np.expm1(-crossing) / crossing, rel=1e-9)


def test_a_later_visit_remembers_nothing_of_the_first() -> None:
    rows = np.zeros((400, 2))
    rows[:100, 0] = rows[300:, 0] = rows[100:300, 1] = 1.0
    turns, sound = np.full(400, 0.1), np.zeros(400, bool)
    kept, _ = remembered(rows, turns, sound, np.zeros(2))
    first, later = kept[:100, 0], kept[300:, 0]
    assert first == pytest.approx(later, abs=3e-9)
    # The same in two parts.
    half, memory = remembered(rows[:150], turns[:150], sound[:150], np.zeros(2))
    rest, _ = remembered(rows[150:], turns[150:], sound[150:], memory)
    assert np.concatenate([half, rest]) == pytest.approx(kept, rel=1e-12)


def test_a_contact_ends_the_memory() -> None:
    rows, turns, lost = np.ones((200, 1)), np.full(200, 0.01), np.zeros(200, bool)
    lost[99] = True
    kept, _ = remembered(rows, turns, lost, np.zeros(1))
    assert kept[100:, 0] == pytest.approx(kept[:100, 0], rel=1e-12)


@pytest.mark.slow
def test_the_bias_of_a_rate_is_that_of_the_sum() -> None:
    """Velocities pulled to a mean that is new in every visit: the score at the fitted means.

    With kappa T = 2, 20,000 visits: the share is 0.57 with a standard error of 0.01.
    """
    rng = np.random.default_rng(11)
    visits, steps, turns = 20_000, 100, 0.02
    velocity = rng.normal(scale=np.sqrt(0.5), size=visits)
    moved = np.empty((steps, visits))
    before = np.empty((steps, visits))
    for k in range(steps):
        before[k] = velocity
        moved[k] = -turns * velocity + np.sqrt(turns) * rng.normal(size=visits)
        velocity = velocity + moved[k]
    # Fitted means, in a time of 1 / kappa and with sigma = 1; the true ones are 0.
    mean = (moved + turns * before).sum(axis=0) / (steps * turns)
    pull = mean - before
    score = (pull * (moved - turns * pull)).sum(axis=0)
    kept, _ = remembered(
        np.ones((steps, 1)), np.full(steps, turns), np.zeros(steps, bool), np.zeros(1)
    )
    error = score.std() / np.sqrt(visits)
    assert error < 0.012
    assert abs(score.mean() - kept.mean()) < 4 * error + 0.01


@pytest.mark.slow
@pytest.mark.parametrize("weight", [300.0, 3000.0, 10000.0])
def test_the_bias_under_a_prior_holds_its_pull(weight: float) -> None:
    """A body goes round a ring of 40 hats with kappa T = 1; the true flow has three waves.

    400 scores at the fitted coefficients: their mean has a standard error of 0.6. It is 15 to 19;
    without the pull 9 to 15 are expected, and by the whole correction 34 where the prior is weak.
    The sum is that of the fitted flow and not of the true one, 2 off at most.
    """
    rng = np.random.default_rng(5)
    count, knots, step, noise, runs = 3000, 40, 0.1, 0.02, 400
    ring = np.cumsum(step + 0.05 * rng.normal(size=count)) % knots
    rows = np.zeros((count, knots))
    rows[np.arange(count), ring.astype(int)] = 1.0 - ring % 1.0
    rows[np.arange(count), (ring.astype(int) + 1) % knots] = ring % 1.0
    flow = rows @ (0.03 * np.sin(6.0 * np.pi * np.arange(knots) / knots))
    before, velocity = np.empty((count, runs)), np.zeros(runs)
    moved = np.empty_like(before)
    for k in range(count):
        before[k] = velocity
        moved[k] = step * (flow[k] - velocity) + noise * np.sqrt(step) * rng.normal(size=runs)
        velocity = velocity + moved[k]
    bent = np.roll(np.eye(knots), 1, 0) - 2.0 * np.eye(knots) + np.roll(np.eye(knots), -1, 0)
    prior = weight * (bent.T @ bent + 1e-3 * np.eye(knots))
    scale = 1.0 / (noise * np.sqrt(step))
    white = scale * step * rows
    both = white.T @ white
    fitted = np.linalg.solve(both + prior, scale * white.T @ (moved + step * before))
    slip = scale * step * (before - rows @ fitted)
    score = -(slip * (scale * moved + slip)).sum(axis=0)
    kept, _ = remembered(rows, np.full(count, step), np.zeros(count, bool), np.zeros(knots))
    inverse = np.linalg.inv(both + prior)
    whole = np.sum(inverse * both)
    expected = np.sum(inverse * (white.T @ (scale * step * kept)).T) + np.zeros(runs)
    for run in range(runs):
        alone = np.zeros((knots + 1, knots + 1))
        alone[:-1, :-1], alone[-1, :-1] = both, -white.T @ slip[:, run]
        added = alone.copy()
        added[:-1, :-1] += prior
        pulled = Sums(0.0, np.append(prior @ fitted[:, run], 0.0), alone, count)
        at_rest = Sums(0.0, np.zeros(knots + 1), added, count)
        pull = pull_of_prior(pulled, at_rest, cholesky(added[:-1, :-1]), np.zeros(knots))
        expected[run] += pull.slope + whole * pull.share
    error = score.std() / np.sqrt(runs)
    assert error < 0.7
    assert abs(score.mean() - expected.mean()) < 2.0 + 2.5 * error


@pytest.mark.parametrize(("shape", "tried"), [("disc", False), ("square", True), ("xx", True)])
def test_the_power_of_the_drag_is_not_tried_without_a_heading(shape: str, tried: bool) -> None:
    study = dw.Study(block={"shape": shape})
    found = assumptions_of(study, "none" if shape == "disc" else "state", recordings=1, flows=1)
    assert (set(DRAG_SHAPES) <= set(found.tried)) == tried
    assert "force_memory" in found.tried
    stated = dw.apply_overrides(study, {"fit.law": "power"})
    assert "drag_power" in assumptions_of(stated, "none", recordings=1, flows=1).opened
