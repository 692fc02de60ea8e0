"""Value iteration against closed forms and a search of all histories; estimates; controllers."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from driftwalk.assembly.control.decision_process import (
    PROCESS_POLICY,
    Decisions,
    age_bin,
    transitions,
    value_iteration,
)
from driftwalk.assembly.control.worlds import UNKNOWN, Controller, Rules

BINS = len(PROCESS_POLICY.age_starts)


def random_process(classes: int, modes: int, seed: int) -> np.ndarray:
    random = np.random.default_rng(seed)
    return random.dirichlet(np.full(classes + 1, 0.7), size=(classes, BINS, modes))


def test_the_faster_of_two_modes_is_best_in_a_chain_of_two_classes() -> None:
    # One way from class 0 to class 1: 1 - (1 - p)^k with the larger p.
    rates = np.zeros((2, BINS, 2, 3))
    rates[0, :, 0], rates[0, :, 1] = [0.0, 0.1, 0.9], [0.0, 0.3, 0.7]
    rates[1, :, :, 2] = 1.0
    plan = value_iteration(rates, target=1, periods=8)
    np.testing.assert_allclose(plan.value[:, 0, 0], 1.0 - 0.7 ** np.arange(9))
    assert (plan.action[:, 0] == 1).all()


def test_a_risky_mode_is_best_only_when_the_time_is_short() -> None:
    # Mode 0: p = .1 to the target. Mode 1: .4 to the target, .4 to a trap. With k left, mode 0 for
    # ever gives 1 - .9^k; the risky one at once gives .4 + .2 V_(k-1).
    rates = np.zeros((3, BINS, 2, 4))
    rates[0, :, 0], rates[0, :, 1] = [0.0, 0.1, 0.0, 0.9], [0.0, 0.4, 0.4, 0.2]
    rates[1:, :, :, 3] = 1.0
    plan = value_iteration(rates, target=1, periods=40)
    value = [0.0]
    for _ in range(40):
        value.append(max(0.1 + 0.9 * value[-1], 0.4 + 0.2 * value[-1]))
    np.testing.assert_allclose(plan.value[:, 0, 0], value)
    assert plan.action[0, 0, 0] == 1
    assert plan.action[-1, 0, 0] == 0


def test_value_iteration_finds_what_a_search_through_all_histories_finds() -> None:
    rates = random_process(3, 3, seed=4)

    @cache
    def best(left: int, at: int, age: int) -> float:
        if left == 0:
            return float(at == 2)
        gains = []
        for mode in range(3):
            *enter, stay = rates[at, age_bin(np.array(age)), mode]
            gains.append(
                sum(p * best(left - 1, j, 0) for j, p in enumerate(enter))
                + stay * best(left - 1, at, age + 1)
            )
        return max(gains)

    # With more periods than there are ages: from 16 periods on they are in one bin.
    plan = value_iteration(rates, target=2, periods=24)
    assert plan.value.shape == (25, 3, 17)
    for at in range(3):
        for age in (0, 1, 15, 16):
            assert plan.value[23, at, age] == pytest.approx(best(23, at, age))
        assert plan.value[7, at, 16] == pytest.approx(best(7, at, 20))


def test_no_other_policy_of_a_small_process_does_better() -> None:
    rates = random_process(2, 2, seed=7)
    plan = value_iteration(rates, target=1, periods=2)

    def value(first: int, second: tuple[int, int, int]) -> float:
        """Begin in class 0 with one mode, then one for each of (0, old), (0, new), (1, new)."""
        start = rates[0, 0, first]
        after = (rates[0, 1, second[0]], rates[0, 0, second[1]], rates[1, 0, second[2]])
        weight = (start[2], start[0], start[1])
        last = [row[1] + (row[2] if at == 2 else 0.0) for at, row in enumerate(after)]
        return float(np.dot(weight, last))

    every = [value(a, (b, c, d)) for a in (0, 1) for b in (0, 1) for c in (0, 1) for d in (0, 1)]
    assert plan.value[2, 0, 0] == pytest.approx(max(every))


def test_transitions_are_the_counts_shrunk_twice() -> None:
    # 30 decisions in mode 0 at age 0, 12 of which enter class 1; 10 in mode 1 that never do.
    one = Decisions(
        source=np.zeros(40, int), age=np.zeros(40, int), mode=np.repeat([0, 1], [30, 10]),
        target=np.repeat([1, 0], [12, 28]), entered=np.repeat([1, 0], [12, 28]),
    )  # fmt: skip
    found = transitions([one], classes=2, modes=2)
    n, m = PROCESS_POLICY.age_weight, PROCESS_POLICY.mode_weight
    whole = 12 / 40
    by_mode = [(12 + m * whole) / (30 + m), m * whole / (10 + m)]
    assert found[0, 0, 0, 1] == pytest.approx((12 + n * by_mode[0]) / (30 + n))
    assert found[0, 3, 1, 1] == pytest.approx(by_mode[1])
    np.testing.assert_allclose(found.sum(axis=-1), 1.0)
    assert (found[1, :, :, 2] == 1.0).all(), "no world ever left class 1"


def test_drawn_transitions_have_the_mean_of_their_posterior() -> None:
    one = Decisions(*(np.tile(v, 100) for v in ([0, 0], [0, 0], [0, 1], [1, 0], [1, 0])))
    mean = transitions([one], classes=2, modes=2)
    random = np.random.default_rng(3)
    drawn = [transitions([one], classes=2, modes=2, random=random) for _ in range(400)]
    # Five standard errors of 400 draws: false alarm below 1e-5 over the 48 means.
    error = np.std(drawn, axis=0) / 20.0
    assert (np.abs(np.mean(drawn, axis=0) - mean) <= 5.0 * error + 1e-12).all()


@pytest.fixture
def rules() -> Rules:
    """Mode 1 in class 0 and mode 2 in class 1, whatever the age and the time left."""
    action = np.zeros((1, 3, 2, BINS), dtype=np.int64)
    action[:, :, 0], action[:, :, 1] = 1, 2
    return Rules(action, safe=0, dwell=2)


def decide(controller: Controller, seen: int, left: int) -> int:
    return int(controller.decide(np.array([seen]), np.array([0]), left=left)[0])


def test_a_mode_is_held_for_its_dwell(rules: Rules) -> None:
    controller = Controller(rules, np.zeros(1, int))
    assert [decide(controller, *one) for one in ((0, 4), (1, 3), (1, 2), (0, 1))] == [1, 1, 2, 2]


def test_without_a_class_the_mode_is_held_and_the_safe_mode_comes_first(rules: Rules) -> None:
    controller = Controller(rules, np.zeros(1, int))
    assert decide(controller, UNKNOWN, 4) == 0
    assert decide(controller, 1, 3) == 2
    assert decide(controller, UNKNOWN, 2) == 2


def test_long_ages_have_the_modes_of_the_last_bin() -> None:
    action = np.zeros((1, 3, 1, BINS), dtype=np.int64)
    action[..., -1] = 5
    controller = Controller(Rules(action), np.zeros(1, int))
    assert controller.decide(np.array([0]), np.array([99]), left=1).tolist() == [5]


def test_worlds_take_several_policies_in_turn() -> None:
    action = np.arange(3)[:, None, None, None] * np.ones((3, 1, BINS), dtype=np.int64)
    controller = Controller(Rules(action), np.array([7, 8, 9]))
    assert controller.decide(np.zeros(3, int), np.zeros(3, int), left=1).tolist() == [1, 2, 0]
