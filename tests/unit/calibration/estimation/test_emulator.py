"""The emulator on summaries that are quadratic with normal noise: all is known in closed form."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from driftwalk.calibration.estimation.synthetic_likelihood import (
    SYNTHETIC,
    LocalEmulator,
    fit_emulator,
)

CENTRE = np.array([0.4, 0.6])
WIDTH = np.array([0.1, 0.05])
SUMMARIES = 8


def terms(place: np.ndarray) -> np.ndarray:
    """Return 1, a, b, a^2, b^2 and a b of points of the box."""
    a, b = place.T
    return np.column_stack([np.ones(len(place)), a, b, a**2, b**2, a * b])


class Quadratic:
    """Summaries of a model in a box of two parameters, and their noise."""

    def __init__(self, seed: int, *, related: bool) -> None:
        rng = np.random.default_rng(seed)
        size = np.array([10.0, 6.0, 6.0, 1.0, 1.0, 1.0])
        self.coefficients = size * rng.normal(size=(SUMMARIES, 6))
        spread = np.geomspace(0.5, 2.0, SUMMARIES)
        mixed = rng.normal(size=(SUMMARIES, 3 * SUMMARIES)) if related else np.eye(SUMMARIES)
        covariance = mixed @ mixed.T
        scale = spread / np.sqrt(np.diag(covariance))
        self.covariance = covariance * scale[:, None] * scale
        self.root = np.linalg.cholesky(self.covariance)
        self.rng = rng

    def expected(self, settings: np.ndarray) -> np.ndarray:
        return terms((settings - CENTRE) / WIDTH) @ self.coefficients.T

    def noise(self, count: int) -> np.ndarray:
        return self.rng.normal(size=(count, SUMMARIES)) @ self.root.T

    def emulator(self, simulations: int) -> LocalEmulator:
        settings = CENTRE + WIDTH * self.rng.uniform(-1, 1, (simulations, 2))
        summaries = self.expected(settings) + self.noise(simulations)
        return fit_emulator(settings, summaries, centre=CENTRE, width=WIDTH)


@pytest.mark.false_alarm(1e-4)
@pytest.mark.parametrize("related", [False, True])
def test_coefficients_are_those_of_the_model(related: bool, fresh_seed: Callable[[int], int]):
    """48 of them, each within 5 standard errors: s^2 (X' X)^-1, with uniform settings."""
    model, simulations = Quadratic(fresh_seed(1), related=related), 4096
    emulator = model.emulator(simulations)
    assert emulator.form == "products"
    assert emulator.summaries == SUMMARIES
    found = np.linalg.solve(emulator.whitening, emulator.coefficients)
    # Moments of uniform numbers of [-1, 1]: 1/3 and, of the fourth order, 1/5.
    moments = np.diag([1.0, 1 / 3, 1 / 3, 1 / 5, 1 / 5, 1 / 9])
    moments[0, 3:5] = moments[3:5, 0] = 1 / 3
    moments[3, 4] = moments[4, 3] = 1 / 9
    error = np.sqrt(
        np.diag(model.covariance)[:, None] * np.diag(np.linalg.inv(moments)) / simulations
    )
    assert np.abs((found - model.coefficients) / error).max() < 5.0


def test_few_simulations_leave_products_out():
    model = Quadratic(2, related=False)
    # Six coefficients with the product, five without.
    assert model.emulator(24).form == "products"
    few = model.emulator(23)
    assert few.form == "squares"
    assert few.coefficients.shape == (SUMMARIES, 5)


@pytest.mark.parametrize(("form", "count"), [("slopes", 3), ("squares", 5), ("products", 6)])
def test_the_form_is_that_of_the_summaries(form: str, count: int):
    """Coefficients that a model does not have foretell nothing: they are left out.

    A term of it has 5 deviations of the noise and more. A form with k terms too many makes the mean
    square of 512 errors larger by 2 k / 512 for each of 8 summaries; one with terms too few makes
    it several times as large.
    """
    model = Quadratic(10, related=False)
    model.coefficients[:, 3:] = 20.0
    model.coefficients[:, count:] = 0.0
    emulator = model.emulator(512)
    assert emulator.form == form
    assert emulator.coefficients.shape == (SUMMARIES, count)


@pytest.mark.false_alarm(1e-4)
def test_two_places_compare_by_their_likelihood(fresh_seed: Callable[[int], int]):
    """Discrepancy and logarithm of the determinant are -2 log of a normal density, but for a
    constant.

    The determinant of a covariance from 4096 simulations has a relative error of sqrt(16 / 4096).
    """
    model = Quadratic(fresh_seed(11), related=False)
    wanted = np.linalg.slogdet(model.covariance)[1]
    assert model.emulator(4096).log_variance == pytest.approx(wanted, abs=0.4)


@pytest.mark.fast_cases(1)
@pytest.mark.false_alarm(1e-4)
@pytest.mark.parametrize("related", [False, True])
def test_the_misfit_at_the_truth_is_that_of_the_known_noise(
    related: bool, fresh_seed: Callable[[int], int]
):
    """Normal noise with covariance S, whitened by A: mean tr(A S), variance 2 tr(A S A S).

    A is the inverse of S with a part of its correlations taken away; without correlations the
    discrepancy is chi-square with 8 degrees of freedom. 4000 draws give the mean within 4 errors
    and the variance within 15 % (its own error is 3.5 %); 4096 simulations add less than 1 % to
    each.
    """
    model, sample = Quadratic(fresh_seed(3), related=related), 4000
    emulator = model.emulator(4096)
    truth = CENTRE + WIDTH * [0.3, -0.4]
    summaries = model.expected(truth[None]) + model.noise(sample)
    discrepancies = np.array([emulator.discrepancies(truth[None], one)[0] for one in summaries])
    shrunk = (1 - SYNTHETIC.shrunk) * model.covariance + SYNTHETIC.shrunk * np.diag(
        np.diag(model.covariance)
    )
    product = np.linalg.solve(shrunk, model.covariance)
    mean, variance = np.trace(product), 2 * np.trace(product @ product)
    if not related:
        assert (mean, variance) == pytest.approx((SUMMARIES, 2 * SUMMARIES))
    assert abs(discrepancies.mean() - mean) < 4 * np.sqrt(variance / sample) + 0.01 * mean
    assert discrepancies.var() == pytest.approx(variance, rel=0.15)


@pytest.mark.slow
@pytest.mark.false_alarm(2e-4)
def test_a_solution_is_as_near_the_truth_as_it_says(fresh_seed: Callable[[int], int]):
    """300 recordings of a model at settings inside the box.

    90 % lie within 1.645 of their standard deviations: 600 such cases, which share an emulator but
    not their noise, have a share within 0.84 and 0.96, 4.5 and more binomial errors on either side.
    The discrepancy left is chi-square with 8 - 2 degrees of freedom; its mean has an error of 0.2.
    """
    model, recordings = Quadratic(fresh_seed(4), related=False), 300
    emulator = model.emulator(4096)
    apart, discrepancies = [], []
    for _ in range(recordings):
        truth = CENTRE + WIDTH * model.rng.uniform(-0.6, 0.6, 2)
        summaries = (model.expected(truth[None]) + model.noise(1))[0]
        solution = emulator.solve(summaries, reach=1.25)
        np.testing.assert_allclose(solution.setting, CENTRE + WIDTH * solution.place)
        apart.append((solution.setting - truth) / solution.std)
        discrepancies.append(solution.discrepancy)
    assert 0.84 < np.mean(np.abs(apart) < 1.645) < 0.96
    assert abs(np.mean(discrepancies) - (SUMMARIES - 2)) < 0.9
    # Standard deviations are of use: a part of the box.
    assert (solution.std < 0.3 * WIDTH).all()


def test_no_point_of_the_box_fits_better():
    """Every point of a fine grid over the part of the box that may be reached."""
    model = Quadratic(5, related=True)
    emulator = model.emulator(512)
    at = np.linspace(-1.25, 1.25, 301)
    grid = CENTRE + WIDTH * np.stack(np.meshgrid(at, at), axis=-1).reshape(-1, 2)
    for truth in ([0.2, 0.7], [1.2, -1.1], [1.6, 0.4]):
        summaries = (model.expected(CENTRE + WIDTH * [truth]) + model.noise(1))[0]
        solution = emulator.solve(summaries, reach=1.25)
        discrepancies = emulator.discrepancies(grid, summaries)
        assert solution.discrepancy == pytest.approx(
            emulator.discrepancies(solution.setting[None], summaries)[0]
        )
        assert solution.discrepancy <= discrepancies.min()
        best = grid[discrepancies.argmin()]
        assert (np.abs(solution.setting - best) <= 2 * WIDTH * 2.5 / 300).all()


def test_misfits_are_squares_of_what_is_left_over_its_covariance():
    """By the definition: least squares, and the covariance of what is left, its parts scaled."""
    model = Quadratic(6, related=True)
    settings = CENTRE + WIDTH * model.rng.uniform(-1, 1, (200, 2))
    summaries = model.expected(settings) + model.noise(200)
    emulator = fit_emulator(settings, summaries, centre=CENTRE, width=WIDTH)
    table = terms((settings - CENTRE) / WIDTH)
    coefficients = np.linalg.inv(table.T @ table) @ table.T @ summaries
    left = summaries - table @ coefficients
    covariance = left.T @ left / (200 - 6)
    covariance[~np.eye(SUMMARIES, dtype=bool)] *= 1 - SYNTHETIC.shrunk
    recorded = summaries[0] + 1.0
    at = settings[:7]
    apart = terms((at - CENTRE) / WIDTH) @ coefficients - recorded
    wanted = [one @ np.linalg.inv(covariance) @ one for one in apart]
    np.testing.assert_allclose(emulator.discrepancies(at, recorded), wanted)


def test_summaries_that_do_not_vary_say_nothing():
    model = Quadratic(7, related=True)
    settings = CENTRE + WIDTH * model.rng.uniform(-1, 1, (400, 2))
    summaries = model.expected(settings) + model.noise(400)
    # Zero, a number, one that varies in its last bits, and an exact function of the setting.
    last_bits = 7.0 * (1.0 + 1e-15 * model.rng.normal(size=400))
    exact = 3.0 + (settings[:, 0] - CENTRE[0]) / WIDTH[0]
    silent = np.column_stack([np.zeros(400), np.full(400, -2.5), last_bits, exact])
    more = np.insert(summaries, [0, 3, 3, 8], silent, axis=1)
    without = fit_emulator(settings, summaries, centre=CENTRE, width=WIDTH)
    found = fit_emulator(settings, more, centre=CENTRE, width=WIDTH)
    assert np.flatnonzero(~found.used).tolist() == [0, 4, 5, 11]
    assert found.summaries == SUMMARIES
    recorded = np.insert(summaries[5], [0, 3, 3, 8], [4.0, 8.0, -1.0, 100.0])
    np.testing.assert_allclose(
        found.discrepancies(settings[:9], recorded),
        without.discrepancies(settings[:9], summaries[5]),
    )


@pytest.mark.parametrize("corner", [(0.02, 0.98), (0.0, 1.0), (0.5, 0.99)])
def test_solutions_stay_within_reach_and_within_the_ranges(corner: tuple[float, float]):
    """Recordings of settings far outside, in every direction, near a corner of the cube."""
    rng = np.random.default_rng(8)
    centre, width = np.array(corner), np.array([0.1, 0.05])
    settings = np.clip(centre + width * rng.uniform(-1, 1, (300, 2)), 0.0, 1.0)
    slopes = rng.normal(size=(5, 2))
    summaries = (settings - centre) / width @ slopes.T + 0.05 * rng.normal(size=(300, 5))
    emulator = fit_emulator(settings, summaries, centre=centre, width=width)
    for angle in np.linspace(0.0, 2 * np.pi, 16, endpoint=False):
        away = 8.0 * np.array([np.cos(angle), np.sin(angle)])
        for start in (None, np.array([0.5, 0.5]), centre):
            solution = emulator.solve(slopes @ away, reach=1.25, start=start)
            assert (np.abs(solution.place) <= 1.25).all()
            assert (solution.setting >= 0.0).all()
            assert (solution.setting <= 1.0).all()
            assert np.isfinite(solution.std).all()


def test_a_parameter_that_changes_nothing_has_the_width_of_the_box():
    """Its standard deviation is finite: that of a prior as wide as the box."""
    rng = np.random.default_rng(9)
    settings = CENTRE + WIDTH * rng.uniform(-1, 1, (4000, 2))
    summaries = np.column_stack([settings[:, 0] / WIDTH[0]] * 3) + 0.01 * rng.normal(size=(4000, 3))
    solution = fit_emulator(settings, summaries, centre=CENTRE, width=WIDTH).solve(
        np.full(3, CENTRE[0] / WIDTH[0]), reach=1.25
    )
    assert solution.std[1] == pytest.approx(WIDTH[1], rel=0.05)
    assert solution.std[0] == pytest.approx(WIDTH[0] * 0.01 / np.sqrt(3), rel=0.1)
