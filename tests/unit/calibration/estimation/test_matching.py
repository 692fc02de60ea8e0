"""How summaries become an estimate, on emulators that are linear and known."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from driftwalk.calibration.estimation import estimate as matching, posterior as sampling
from driftwalk.calibration.estimation.bootstrap_correction import bootstrap_estimates
from driftwalk.calibration.estimation.estimate import (
    MATCHING,
    find_optima,
    match_summaries,
    most_simulations,
)
from driftwalk.calibration.estimation.gauss_newton import GAUSS_NEWTON, simulations_of
from driftwalk.calibration.estimation.posterior import POSTERIOR, Region, sample_posterior
from driftwalk.calibration.estimation.regression_abc import REGRESSION
from driftwalk.calibration.estimation.synthetic_likelihood import LocalEmulator

STD = np.array([0.02, 0.01])
CENTRE = np.array([0.4, 0.6])


def linear(
    centre: np.ndarray = CENTRE, *, width: float = 0.2, std: np.ndarray = STD
) -> LocalEmulator:
    """Return an emulator whose two summaries are the parameters, with these errors."""
    slopes = np.diag(width / std)
    coefficients = np.column_stack([centre / std, slopes])
    return LocalEmulator(
        centre, np.full(2, width), "slopes", coefficients, np.diag(1.0 / std),
        np.ones(2, dtype=bool), 40,
    )  # fmt: skip


def test_a_linear_emulator_is_solved_exactly() -> None:
    """The weakest of normal priors, as wide as the region, keeps the inverse finite."""
    found = linear().solve(np.array([0.43, 0.59]), reach=1.0)
    assert found.setting == pytest.approx([0.43, 0.59], abs=1e-6)
    assert found.discrepancy == pytest.approx(0.0, abs=1e-9)
    curvature = (0.2 / STD) ** 2 + 1.0
    assert found.std == pytest.approx(0.2 / np.sqrt(curvature))
    assert found.log_volume == pytest.approx(4.0 * math.log(0.2) - np.log(curvature).sum())
    # Beyond its reach it ends there, and what is left is the distance in the errors.
    far = linear().solve(np.array([0.9, 0.6]), reach=1.0)
    assert far.setting == pytest.approx([0.6, 0.6], abs=1e-5)
    assert far.discrepancy == pytest.approx((0.3 / 0.02) ** 2, rel=1e-4)
    assert linear().discrepancies(np.array([[0.44, 0.6], [0.4, 0.57]]), CENTRE) == pytest.approx(
        [4.0, 9.0]
    )
    held = linear().solve(np.array([0.43, 0.59]), reach=1.0, held=(0, 0.41))
    assert held.setting == pytest.approx([0.41, 0.59], abs=1e-6)
    assert held.discrepancy == pytest.approx(1.0, rel=1e-5)
    assert linear().log_variance == pytest.approx(2.0 * np.log(STD).sum())


def known(sample: np.ndarray, **more: Any) -> Any:
    return SimpleNamespace(sample=sample, emulator=linear(), **more)


def test_estimates_of_known_recordings_give_bias_and_scatter() -> None:
    """Summaries 0.004 too large in the first parameter, and thrice the scatter in the second."""
    random, count = np.random.default_rng(1), POSTERIOR.fewest_estimates
    sample = CENTRE + STD * random.normal(size=(200, 2))
    off = np.column_stack([np.full(count, 0.004), 0.03 * np.tile([1.0, -1.0], count // 2)])
    found = bootstrap_estimates(lambda chosen: chosen + off, known(sample), count)
    assert found.bias == pytest.approx([0.004, 0.0], abs=1e-5)
    every = sample.std(axis=0)
    assert found.spread == pytest.approx([1.0, 0.03 / every[1]], rel=1e-4)
    assert found.discrepancies == pytest.approx(np.zeros(count), abs=1e-6)
    # A recording beyond the region has a discrepancy, at its end.
    off[0] = [0.5, 0.0]
    far = bootstrap_estimates(lambda chosen: chosen + off, known(sample), count)
    gone = (sample[0, 0] + 0.5 - 0.6) / 0.02
    assert far.discrepancies[0] == pytest.approx(gone**2, rel=1e-3)


def test_of_few_recordings_the_covariance_s_own_error_stands_in() -> None:
    sample = CENTRE + STD * np.random.default_rng(1).normal(size=(200, 2))
    few = 5
    assert few < POSTERIOR.fewest_estimates
    found = bootstrap_estimates(lambda chosen: chosen + 0.01, known(sample), few)
    assert found.bias.tolist() == [0.0, 0.0]
    assert found.spread == pytest.approx(np.full(2, linear().error_inflation))
    assert found.discrepancies.shape == (few,)


def test_draws_are_those_of_the_normal_posterior(monkeypatch: pytest.MonkeyPatch) -> None:
    """Within a wide region, by a short chain: 32 walkers, 60 steps, of which half are left out.

    Some 960 draws with correlation times of about ten steps: their mean is off by a tenth of a
    standard deviation, their spread by a tenth; three of those are allowed with this seed.
    """
    monkeypatch.setattr(
        sampling, "POSTERIOR", POSTERIOR._replace(walkers=32, steps=60, size=256, most_rounds=2)
    )
    monkeypatch.setattr(sampling, "simulations_of", lambda _: (64, 128))
    random = np.random.default_rng(3)
    recorded = np.array([[0.43, 0.59], [0.42, 0.58]])
    asked: list[tuple[int, int]] = []

    def simulate(settings: np.ndarray, *, parts: int) -> np.ndarray:
        asked.append((len(settings), parts))
        return settings[:, None] + STD * random.normal(size=(len(settings), parts, 2))

    emulator = linear()
    end: Any = SimpleNamespace(emulator=emulator, solution=emulator.solve(recorded[0], reach=1.0))
    found = sample_posterior(simulate, recorded, end, seed=5)
    assert asked == [(64, 2), (64, 2)]
    assert found.sample.shape == (256, 2)
    assert np.abs((found.sample.mean(axis=0) - recorded[0]) / STD).max() < 0.6
    assert found.sample.std(axis=0) == pytest.approx(STD, rel=0.35)
    (other,) = found.others
    assert np.abs((found.solution.setting - recorded[0]) / STD).max() < 0.6
    assert np.abs((other.setting - recorded[1]) / STD).max() < 0.6
    assert (found.region.distances(found.sample) <= 1.0).all()
    moved = (found.sample.mean(axis=0) - found.region.centre) / found.sample.std(axis=0)
    assert found.moved == pytest.approx(moved)


def place(shift: float = 0.0, *, discrepancy: float = 3.0) -> Any:
    """Return a posterior about a setting, with one of another part of the recording."""
    sample = CENTRE + shift + STD * np.random.default_rng(2).normal(size=(512, 2))
    emulator = linear(CENTRE + shift)
    solution = emulator.solve(CENTRE + shift, reach=1.0)._replace(discrepancy=discrepancy)
    return SimpleNamespace(
        sample=sample,
        emulator=emulator,
        region=Region(CENTRE + shift, np.diag(STD)),
        solution=solution,
        others=(SimpleNamespace(setting=np.array([1.2, 0.3])),),
        moved=np.array([0.5, -1.5]),
    )


def matched(
    monkeypatch: pytest.MonkeyPatch,
    *places: Any,
    own: np.ndarray,
    bias: float = 0.0,
    spread: float = 1.0,
    order: Any = None,
) -> Any:
    monkeypatch.setattr(
        matching,
        "find_optima",
        lambda *_, **__: [SimpleNamespace(solution=one.solution, of=one) for one in places],
    )
    seeds: list[int] = []

    def sampled(objective: Any, recorded: Any, optimum: Any, *, seed: int) -> Any:
        seeds.append(seed)
        return optimum.of

    monkeypatch.setattr(matching, "sample_posterior", sampled)
    correction = SimpleNamespace(
        discrepancies=own, bias=np.array([bias, 0.0]), spread=np.array([1.0, spread])
    )
    monkeypatch.setattr(matching, "bootstrap_estimates", lambda *_: correction)
    objective: Any = SimpleNamespace(recorded=np.array([CENTRE, CENTRE]))
    found = match_summaries(
        objective, 2, lambda: CENTRE[None], order=order or (lambda one: one), replicates=50, seed=7
    )
    assert seeds == [7 + 10_000 * (1 + k) for k in range(len(places))]
    return found


USUAL = np.linspace(1.0, 5.0, 101)


def test_an_estimate_is_the_median_of_the_draws_less_the_bias(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    one = place()
    found = matched(monkeypatch, one, own=USUAL, bias=0.003, spread=2.0)
    middle = np.median(one.sample, axis=0)
    assert found.point == pytest.approx(middle - [0.003, 0.0])
    wanted = middle - [0.003, 0.0] + [1.0, 2.0] * (one.sample - middle)
    np.testing.assert_allclose(found.sample, np.clip(wanted, 0.0, 1.0))
    assert found.stretch == 1.0
    assert (found.discrepancy.value, found.discrepancy.median) == (3.0, 3.0)
    assert found.discrepancy.upper == pytest.approx(4.8)
    assert found.even_point.tolist() == [1.0, 0.3]
    assert found.unsettled.tolist() == [False, True]
    assert not found.ambiguous.any()
    assert not found.undetermined
    # Rises of a parabola, over the square of the factor by which the draws are spread.
    assert found.profiles is not None
    at = found.profiles.place + np.array([[0.003], [0.0]])
    rise = ((at - CENTRE[:, None]) / STD[:, None]) ** 2
    np.testing.assert_allclose(
        found.profiles.rise, np.maximum(rise - 3.0, 0.0) / np.array([[1.0], [4.0]]), atol=1e-3
    )


@pytest.mark.parametrize(("value", "undetermined"), [(11.9, False), (12.1, True)])
def test_what_a_model_leaves_unexplained_widens_the_draws(
    monkeypatch: pytest.MonkeyPatch, value: float, undetermined: bool
) -> None:
    """By the root of the discrepancy over its median; with four times that nothing is known."""
    one = place(discrepancy=value)
    found = matched(monkeypatch, one, own=USUAL)
    assert found.stretch == pytest.approx(math.sqrt(value / 3.0))
    middle = np.median(one.sample, axis=0)
    np.testing.assert_allclose(found.sample - middle, found.stretch * (one.sample - middle))
    assert found.undetermined is undetermined


def test_another_place_that_fits_as_well_is_ambiguous(monkeypatch: pytest.MonkeyPatch) -> None:
    apart = np.array([0.3, 0.0])
    found = matched(monkeypatch, place(), place(apart), own=USUAL)  # type: ignore[arg-type]
    assert found.ambiguous.tolist() == [True, False]
    high = found.sample[:, 0] > 0.55
    assert np.mean(high) == pytest.approx(0.5, abs=0.01)


def test_states_that_have_changed_places_have_no_profiles(monkeypatch: pytest.MonkeyPatch) -> None:
    found = matched(monkeypatch, place(), own=USUAL, order=lambda one: one[:, ::-1])
    assert found.profiles is None
    assert found.point == pytest.approx(np.median(place().sample, axis=0)[::-1])


class Searches:
    """Searches that end with stated discrepancies, and where each of them began."""

    def __init__(
        self, monkeypatch: pytest.MonkeyPatch, *ends: float, deviances: Any = None
    ) -> None:
        self.ends = list(ends)
        self.deviances = list(deviances or ends)
        self.begun: list[tuple[list[float], list[float], int, float]] = []
        monkeypatch.setattr(
            matching,
            "sequential_regression",
            lambda *_, **__: SimpleNamespace(centre=CENTRE, error=np.array([0.01, 0.02])),
        )
        monkeypatch.setattr(matching, "minimise_discrepancy", self.minimise)

    def minimise(self, objective: Any, recorded: Any, start: Any, width: Any, **how: Any) -> Any:
        number = len(self.begun)
        self.begun.append((start.tolist(), width.tolist(), how["seed"], how["give_up"]))
        return SimpleNamespace(
            discrepancy=self.ends[number], deviance=self.deviances[number], number=number
        )

    def found(self, starts: Any, **more: Any) -> list[int]:
        objective: Any = SimpleNamespace(recorded=np.zeros((2, 2)))
        optima: Any = find_optima(
            objective, 2, lambda: np.array(starts), order=lambda one: one, seed=5, **more
        )
        return [one.number for one in optima]


FAR = [[0.1, 0.1], [0.12, 0.12], [0.9, 0.1], [0.9, 0.9], [0.5, 0.5]]


def test_where_the_first_end_matches_no_other_start_is_tried(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    searches = Searches(monkeypatch, MATCHING.matches - 0.01)
    assert searches.found(FAR) == [0]
    width = (REGRESSION.wide_errors * np.array([0.01, 0.02])).tolist()
    assert searches.begun == [(CENTRE.tolist(), pytest.approx(width), 1005, math.inf)]
    hopeless = Searches(monkeypatch, MATCHING.no_restart_above + 1.0)
    assert hopeless.found(FAR) == [0]
    given = Searches(monkeypatch, 21.0)
    assert given.found(FAR, give_up=20.0) == [0]
    assert given.begun[0][-1] == 20.0


def test_other_starts_are_tried_that_are_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two at most; the second is 0.02 from the first, and is none. The likeliest is first.

    Of the others only those stay that match.
    """
    searches = Searches(monkeypatch, 5.0, 1.2, 1.3, deviances=[30.0, 10.0, 20.0])
    assert searches.found(FAR) == [1]
    assert [start for start, *_ in searches.begun[1:]] == [[0.1, 0.1], [0.9, 0.1]]
    assert [seed for *_, seed, _ in searches.begun] == [1005, 2005, 3005]
    assert searches.begun[1][1] == [GAUSS_NEWTON.widest] * 2
    both = Searches(monkeypatch, 5.0, 1.2, 1.1, deviances=[1.0, 20.0, 10.0])
    assert both.found(FAR) == [0, 2, 1]


def test_the_most_simulations_are_those_of_every_round() -> None:
    each, last = simulations_of(3)
    rounds = GAUSS_NEWTON.most_rounds * each + POSTERIOR.most_rounds * last // 2
    searches = 1 + MATCHING.most_starts
    assert most_simulations(3, 50) == REGRESSION.most_simulations + searches * rounds + 50
