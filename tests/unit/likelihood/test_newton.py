"""The search of the mode, on quadratic forms whose minimum is known."""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from driftwalk.core.arrays import Floats
from driftwalk.likelihood import newton
from driftwalk.likelihood.filter.filter_pass import Sums
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.newton import (
    FROM_AFAR,
    FROM_ANOTHER,
    FROM_NEAR,
    NEWTON,
    WORK,
    Mode,
    ModeSearch,
    damped,
    known_numbers_variance,
    limited,
    require_mode,
)
from driftwalk.likelihood.prior import Weights

COUNT = 6
WEIGHTS = Weights(1.0, 2.0)


def vector(point: Point) -> Floats:
    return np.array([*point.coefficients.ravel(), point.log_drag, *point.extras.values()])


class Bowl:
    """A quadratic form in all parameters, and where it was asked for."""

    def __init__(self, middle: Floats, form: Floats, *, pooled: int = 1) -> None:
        self.middle, self.form = middle, form
        self.asked: list[tuple[Floats, str]] = []
        self.time = np.zeros(50)
        self.series = [SimpleNamespace(pooled=pooled, time=self.time)]
        self.flows = 1

    def sums(self, point: Point, *, noise: str) -> Sums:
        at = vector(point)
        self.asked.append((at, noise))
        size = at.size if noise == "with" else COUNT + 1
        off = at - self.middle
        score = -self.form @ off
        return Sums(0.5 * float(off @ self.form @ off), score[:size], self.form[:size, :size], 40)


def search_of(bowl: Bowl, iterations: int = 30, **more: Any) -> ModeSearch:
    prior: Any = SimpleNamespace(
        add=lambda sums, point, weights: sums, updated=lambda weights, point, covariance: weights
    )
    passes: Any = bowl
    return ModeSearch(passes, prior, iterations, **more)


def start(*, oriented: bool = False, **opened: float) -> Point:
    angle = (math.log(3e-3), math.log(0.01)) if oriented else (None, None)
    return Point(np.zeros((2, 1, 3)), -0.7, -9.0, -8.0, *angle, opened=opened)


def bowl_about(point: Point, off: Floats, *, seed: int = 1, **more: Any) -> Bowl:
    size = vector(point).size
    half = np.random.default_rng(seed).normal(size=(size, 3 * size))
    return Bowl(vector(point) + off, 30.0 * half @ half.T, **more)


@pytest.mark.parametrize("oriented", [False, True])
def test_the_mode_of_a_quadratic_form_is_its_middle(oriented: bool) -> None:
    """Steps end below a quarter of the standard deviations, and a tenth of such a step is left."""
    point = start(oriented=oriented, marker_x=1e-3)
    size = vector(point).size
    off = 0.02 * np.random.default_rng(2).normal(size=size)
    off[-1] = 2e-3
    bowl = bowl_about(point, off)
    heard: list[float] = []
    mode = require_mode(search_of(bowl, passed=heard.append).find(point, WEIGHTS, held=FROM_NEAR))
    std = np.sqrt(np.diag(np.linalg.inv(bowl.form)))
    assert mode.converged
    assert np.abs((vector(mode.point) - bowl.middle) / std).max() < 0.1
    np.testing.assert_allclose(mode.covariance, np.linalg.inv(bowl.form), rtol=1e-9)
    assert mode.weights is WEIGHTS
    assert mode.used == 40
    assert mode.iterations == len(bowl.asked) == len(heard)
    assert heard[0] == 50 + WORK.overhead_samples
    last = bowl.asked[-1][0] - bowl.middle
    assert mode.deviance == pytest.approx(0.5 * last @ bowl.form @ last)
    assert not mode.diverged
    # What is said of one number is its own.
    for name, value in mode.point.extras.items():
        at = COUNT + 1 + list(mode.point.extras).index(name)
        assert mode.value_of(name) == (value, pytest.approx(std[at]))
    names = ["marker_x", "log_noise"]
    values, covariance = mode.values_of(names)
    at = [COUNT + 1 + list(mode.point.extras).index(name) for name in names]
    assert values.tolist() == [mode.point.extras[name] for name in names]
    np.testing.assert_allclose(covariance, np.linalg.inv(bowl.form)[np.ix_(at, at)])


@pytest.mark.parametrize(
    ("held", "left"),
    [
        (FROM_AFAR, [[0, 2], [0]]),
        (FROM_ANOTHER, [[1, 2], [1, 2]]),
    ],
)
def test_the_first_steps_leave_some_parameters_as_they_are(
    held: Any, left: list[list[int]]
) -> None:
    point = start()
    bowl = bowl_about(point, np.full(COUNT + 3, 0.05))
    mode = require_mode(search_of(bowl).find(point, WEIGHTS, held=held))
    assert mode.converged
    assert mode.iterations > len(left)
    for (before, noise), (after, _), some in zip(bowl.asked, bowl.asked[1:], left, strict=False):
        held_ones = [COUNT + k for k in some]
        np.testing.assert_array_equal(after[held_ones], before[held_ones])
        if before is bowl.asked[0][0]:
            assert (np.abs(np.delete(after - before, held_ones)) > 1e-9).all()
        # Derivatives by the noises are not asked for where all of them are held.
        assert noise == ("without" if some == [1, 2] else "with")


def test_a_search_that_has_too_few_steps_has_not_converged() -> None:
    point = start()
    off = np.full(COUNT + 3, 0.05)
    off[COUNT] = 4.0  # ln C_d moves by a half in a step at most
    bowl = bowl_about(point, off)
    mode = require_mode(search_of(bowl, 3).find(point, WEIGHTS, held=FROM_NEAR))
    assert not mode.converged
    assert mode.iterations == 3
    assert mode.diverged
    steps = np.diff([at[COUNT] for at, _ in bowl.asked])
    assert steps == pytest.approx(NEWTON.most_log_drag_step)
    assert search_of(bowl, 30).shortened().iterations == NEWTON.trial_iterations
    assert search_of(bowl, 3).shortened().iterations == 3
    assert search_of(bowl).shortened().close_nats == math.inf
    assert search_of(bowl).coarse().close == NEWTON.close_enough
    assert search_of(bowl).coarse().iterations == 30


def test_a_form_that_has_no_minimum_breaks_down() -> None:
    point = start()
    bowl = Bowl(np.zeros(COUNT + 3), -np.eye(COUNT + 3))
    assert search_of(bowl).find(point, WEIGHTS) is None
    with pytest.raises(np.linalg.LinAlgError, match="broke down"):
        require_mode(None)


def test_a_gain_of_a_nat_is_worth_another_step() -> None:
    """Of many coefficients each may move by little, and together they gain a nat or more."""
    point = start()
    # Steps of a fifth of the standard deviations: 0.5 * 9 * 0.04 nats, next to nothing.
    bowl = Bowl(vector(point) + 0.2 / 50.0, 2500.0 * np.eye(COUNT + 3))
    assert require_mode(search_of(bowl).find(point, WEIGHTS, held=FROM_NEAR)).iterations == 1
    strict = search_of(bowl, close_nats=0.17)
    assert require_mode(strict.find(point, WEIGHTS, held=FROM_NEAR)).iterations == 2


def test_of_a_fast_camera_the_flow_settles_without_the_noises() -> None:
    """Once the steps shrink fast, the noises are left as they are, and the search ends."""
    point = start()
    off = 0.3 / np.sqrt(np.arange(1.0, COUNT + 4.0))
    bowl = Bowl(vector(point) + off / 50.0, 2500.0 * np.eye(COUNT + 3), pooled=10)
    mode = require_mode(search_of(bowl, close_nats=0.0).find(point, WEIGHTS, held=FROM_NEAR))
    # Nothing ends it with a gain below 0; its third step is without the noises.
    assert not mode.converged
    assert [noise for _, noise in bowl.asked][:3] == ["with", "with", "without"]
    np.testing.assert_array_equal(bowl.asked[3][0][COUNT + 1 :], bowl.asked[2][0][COUNT + 1 :])
    assert vector(mode.point) == pytest.approx(bowl.middle, abs=1e-6)
    np.testing.assert_allclose(mode.covariance, np.linalg.inv(bowl.form))
    slow = Bowl(bowl.middle, bowl.form)
    search_of(slow, close_nats=0.0).find(point, WEIGHTS, held=FROM_NEAR)
    assert {noise for _, noise in slow.asked} == {"with"}


def test_a_step_that_takes_back_the_last_one_is_the_sum_of_all_to_come() -> None:
    """Steps that are lambda times the last: s (1 + lambda + lambda^2 + ...)."""
    form = np.diag([1.0, 4.0])
    last = np.array([0.3, -0.2])
    for ratio in (-0.9, -0.5, -0.1):
        found = damped(ratio * last, last, form)
        assert found == pytest.approx(ratio * last * sum(ratio**k for k in range(400)))
    onward = np.array([0.1, 0.1])
    assert damped(onward, np.zeros(2), form) is onward
    assert damped(0.5 * last, last, form) == pytest.approx(0.5 * last)
    # Across the last one, in the measure of the information, nothing is taken back.
    across = np.array([0.8, 0.3])
    assert across @ form @ last == pytest.approx(0.0)
    assert damped(across, last, form) == pytest.approx(across)


def test_each_kind_of_parameter_has_its_longest_step() -> None:
    size = 3 + 1 + 4 + 2
    step = np.full(size, 5.0)
    step[0] = 0.2
    found = limited(step, 3, ["marker_x", "drag_power"])
    # Coefficients go along with C_d; a variance changes by a factor, of ten at most.
    assert found[:4] == pytest.approx(np.array([0.2, 5.0, 5.0, 5.0]) * 0.1)
    assert found[4:6] == pytest.approx([math.log(6.0), 0.5 * math.log(10.0)])
    assert found[6:8].tolist() == [1.0, 1.0]
    assert found[8:].tolist() == [newton.NUMBERS[name].most for name in ("marker_x", "drag_power")]
    back = limited(-step, 3, ["marker_x", "drag_power"])
    assert back[3] == pytest.approx(-0.5)
    assert back[6:8].tolist() == [-1.0, -1.0]
    assert back[8:].tolist() == [-newton.NUMBERS[name].most for name in ("marker_x", "drag_power")]
    assert back[4:6] == pytest.approx([-math.log(10.0), -0.5 * math.log(10.0)])
    small = np.full(size, 1e-4)
    assert limited(small, 3, ["marker_x", "drag_power"]) == pytest.approx(small, rel=2e-4)


def test_of_normal_numbers_some_of_which_are_known_c_d_has_a_smaller_variance() -> None:
    """The inverse of its own entry of the precision, over C_d and the opened numbers."""
    point = start(marker_x=0.0, drag_power=2.1)
    half = np.random.default_rng(4).normal(size=(COUNT + 5, 40))
    covariance = half @ half.T
    mode = Mode(point, WEIGHTS, covariance, 1, 1, True, 0.0)
    some = [COUNT, COUNT + 3, COUNT + 4]
    precision = np.linalg.inv(covariance[np.ix_(some, some)])
    assert known_numbers_variance(mode) == pytest.approx(1.0 / precision[0, 0])
    plain = Mode(start(), WEIGHTS, covariance[:-2, :-2], 1, 1, True, 0.0)
    assert known_numbers_variance(plain) == covariance[COUNT, COUNT]


@dataclass(frozen=True)
class Named:
    """Passes over series that are names."""

    series: Any


@pytest.mark.parametrize(
    ("ends", "wanted"),
    [
        ({"pieces": True, "whole": True}, ["pieces", "whole"]),
        ({"pieces": False, "whole": True}, ["pieces", "whole from afar"]),
        ({"pieces": None, "whole": True}, ["pieces", "whole from afar"]),
        ({"pieces": True, "whole": False}, ["pieces", "whole", "whole from afar"]),
        ({"whole": True}, ["whole from afar"]),
    ],
)
def test_a_long_recording_is_searched_by_way_of_its_pieces(
    monkeypatch: pytest.MonkeyPatch, ends: dict[str, bool | None], wanted: list[str]
) -> None:
    asked: list[str] = []

    def find(self: ModeSearch, point: Point, weights: Weights, *, held: Any = FROM_AFAR) -> Any:
        name = self.passes.series[0]
        asked.append(f"{name} from afar" if name == "whole" and held is FROM_AFAR else str(name))
        end = ends[str(name)]
        if name == "pieces":
            assert held is FROM_AFAR
            assert self.close == NEWTON.close_enough
        elif held is not FROM_AFAR:
            assert held is FROM_ANOTHER
            assert point.log_drag == 9.0  # where the pieces came to
            assert self.close == NEWTON.close
        at = Point(point.coefficients, 9.0, 0.0, 0.0)
        return None if end is None else Mode(at, weights, np.eye(1), 1, 1, end, 0.0)

    monkeypatch.setattr(ModeSearch, "find", find)
    there = ["pieces"] if "pieces" in ends else None
    monkeypatch.setattr(newton, "pieces", lambda _: there)
    passes: Any = Named(["whole"])
    search = ModeSearch(passes, None, 30)  # type: ignore[arg-type]
    assert search.find_from_afar(start(), WEIGHTS) is not None
    assert asked == wanted
