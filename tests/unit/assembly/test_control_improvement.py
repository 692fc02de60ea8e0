"""What whole runs tell of a policy: counts by hand, the best mode of a cell, how it is drawn."""

from __future__ import annotations

import numpy as np
from scipy.stats import beta

from driftwalk.assembly.control.plan import (
    IMPROVEMENT_POLICY,
    Cells,
    cells_like,
    prior_of,
)
from driftwalk.assembly.control.worlds import UNKNOWN, Controller, Rules


def flat(modes: int) -> Cells:
    shape = (*cells_like(2), modes)
    return Cells(np.ones(shape), np.ones(shape))


def test_a_world_counts_once_for_every_cell_that_it_visited() -> None:
    # Six decisions: the first two in phase 1 (5 left or more), the others in phase 0. World 0 is in
    # class 0 for four of them and then in class 1; world 1 is seen three times alone.
    found = {
        "seen": np.array([[0, 0, 0, 0, 1, 1], [0, -1, 0, 0, -1, -1]]),
        "age": np.array([[0, 1, 2, 3, 0, 1], [0, 1, 2, 3, 4, 5]]),
        "free": np.ones((2, 6), dtype=int),
    }
    modes = np.zeros((2, *cells_like(2)), dtype=np.int64)
    modes[0, 0, 0, 2] = 1
    known = flat(2).updated(found, modes, np.array([1.0, 0.0]))
    reached, failed = known.reached - 1.0, known.failed - 1.0
    # World 0: ages 0 and 1 in phase 1; age 2 (ages 2 and 3 together, in mode 1); then class 1.
    expected = {(1, 0, 0, 0), (1, 0, 1, 0), (0, 0, 2, 1), (0, 1, 0, 0), (0, 1, 1, 0)}
    assert set(zip(*(at.tolist() for at in np.nonzero(reached)), strict=True)) == expected
    assert reached.max() == 1.0
    assert set(zip(*(at.tolist() for at in np.nonzero(failed)), strict=True)) == {
        (1, 0, 0, 0), (0, 0, 2, 0)
    }  # fmt: skip


def test_modes_that_were_not_taken_do_not_count() -> None:
    # One class and a dwell of 3 periods. Mode 1 is taken at age 0, and held over the looks at ages
    # 1 and 2; the look at age 3 is missed; mode 2 is taken at age 4, and held.
    action = np.array([1, 0, 0, 2, 2, 2])
    rules = Rules(np.broadcast_to(action, (1, *cells_like(1))), safe=0, dwell=3)
    controller, free, held = Controller(rules, np.zeros(1, int)), [], []
    for age in range(6):
        looked = np.array([UNKNOWN if age == 3 else 0])
        held.append(int(controller.decide(looked, np.array([age]), left=6 - age)[0]))
        free.append(bool(controller.free[0]))
    assert (held, free) == ([1, 1, 1, 1, 2, 2], [True, False, False, False, True, False])
    found = {"seen": np.zeros((1, 6), int), "age": np.arange(6)[None], "free": np.array([free])}
    shape = (*cells_like(1), 3)
    flat_one = Cells(np.ones(shape), np.ones(shape))
    modes = np.broadcast_to(action, (1, *cells_like(1)))
    counted = np.argwhere(flat_one.updated(found, modes, np.ones(1)).reached > 1.0)
    assert counted.tolist() == [[0, 0, 3, 2], [1, 0, 0, 1]]


def test_fading_leaves_the_prior() -> None:
    prior = flat(2)
    more = Cells(prior.reached + 10.0, prior.failed)
    faded = more.faded(prior)
    np.testing.assert_allclose(faded.reached, 1.0 + 10.0 * IMPROVEMENT_POLICY.kept)
    np.testing.assert_allclose(faded.failed, 1.0)


def test_the_prior_has_the_mean_and_weight_that_are_stated() -> None:
    prior = prior_of(np.full((*cells_like(1), 2), 0.8), scale=0.5)
    np.testing.assert_allclose(prior.reached + prior.failed, IMPROVEMENT_POLICY.weight)
    np.testing.assert_allclose(prior.reached / IMPROVEMENT_POLICY.weight, 0.4)


def test_modes_are_drawn_as_often_as_they_are_probably_the_best() -> None:
    shape = (*cells_like(1), 2)
    known = Cells(np.broadcast_to([30.0, 25.0], shape), np.broadcast_to([30.0, 30.0], shape))
    drawn = known.drawn(4000, np.random.default_rng(1))
    greedy = np.arange(4000) % IMPROVEMENT_POLICY.greedy == 0
    assert (drawn[greedy] == 0).all()
    # P(second > first) by quadrature, in 54,000 draws: five standard errors.
    x = np.linspace(0.0, 1.0, 20_001)
    share = float(np.trapezoid(beta.pdf(x, 25, 30) * beta.cdf(x, 30, 30), x))
    rest = drawn[~greedy]
    assert abs((rest == 1).mean() - share) < 5.0 * np.sqrt(share * (1.0 - share) / rest.size)


def test_the_best_mode_of_a_cell_is_found() -> None:
    """Three modes that reach .5, .55 and .7 in a one-decision world; false alarm below 1e-6."""
    random, known = np.random.default_rng(2), flat(3)
    prior, truth = known, np.array([0.5, 0.55, 0.7])
    found = {"seen": np.zeros((500, 1), int), "age": np.zeros((500, 1), int)}
    found["free"] = np.ones((500, 1), int)
    for _ in range(6):
        modes = known.drawn(500, random)
        hit = (random.random(500) < truth[modes[:, 0, 0, 0]]).astype(float)
        known = known.faded(prior).updated(found, modes, hit)
    assert known.best()[0, 0, 0] == 2
