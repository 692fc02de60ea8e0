"""The parts of the model check against dense linear algebra, brute force and made-up worlds."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.stats import chi2

from driftwalk.comparison import ks_distance
from driftwalk.core.errors import InputError
from driftwalk.likelihood.check.criteria import (
    LEAST,
    motion_criterion,
    noise_criterion,
    place_criterion,
    strength_criterion,
    tail_criterion,
    time_and_place_criterion,
)
from driftwalk.likelihood.check.errors import Contrast, Innovations, Leverage, Part, velocity_at
from driftwalk.likelihood.check.place import (
    Layout,
    LocalMeans,
    Spread,
    Trend,
    cell_of,
    groups_of,
    lay_out,
    local_scores,
    spread_of,
    trend_of,
)
from driftwalk.likelihood.check.posterior_predictive import compare_motion, distances_at_estimate
from driftwalk.likelihood.check.replicates import Replicates
from driftwalk.likelihood.check.scan import scan_of
from driftwalk.likelihood.check.whiteness import whiteness_tests
from driftwalk.likelihood.filter.series import Series
from driftwalk.likelihood.spline import Spline

ROWS, PARAMETERS, COMPONENTS = 400, 12, 2


def linear_world(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return derivatives J, the precision of the prior, and C = (J'J + Lambda)^-1."""
    generator = np.random.default_rng(seed)
    jacobian = generator.normal(size=(ROWS, PARAMETERS)) * generator.uniform(0.1, 1.0, PARAMETERS)
    # Some parameters move whole blocks of rows, as a coefficient of the flow moves a cell.
    jacobian[:, :8] += np.kron(np.eye(8), np.ones((ROWS // 8, 1)))
    precision = np.diag(generator.uniform(1.0, 60.0, PARAMETERS))
    return jacobian, precision, np.linalg.inv(jacobian.T @ jacobian + precision)


def contrast_of(
    group: np.ndarray, size: int, weight: np.ndarray, white: np.ndarray, jacobian: np.ndarray
) -> Contrast:
    found = Contrast([group], size)
    found.begin(PARAMETERS)
    half = ROWS // 2
    for start in (0, half):
        rows = slice(start, start + half)
        found.add(part_of(white[rows], start), {"one": weight[rows]}, jacobian[rows], None)
    return found


def part_of(white: np.ndarray, start: int = 0, pooled: int = 1) -> Part:
    """Return a part of the only series, whose columns are all parameters."""
    whole, nothing = ((slice(None), slice(None)),), np.zeros(0)
    return Part(0, 0, start, nothing, nothing, white, whole, pooled)


def test_sums_and_their_variance_by_dense_algebra() -> None:
    jacobian, _, covariance = linear_world(1)
    generator = np.random.default_rng(2)
    white, weight = generator.normal(size=(2, ROWS))
    group = generator.integers(-1, 5, ROWS)
    found = contrast_of(group, 5, weight, white, jacobian)
    matrix = np.array([(group == k) * weight for k in range(5)])
    assert found.score == pytest.approx(matrix @ white)
    assert found.power == pytest.approx(np.diag(matrix @ matrix.T))
    left = matrix @ (np.eye(ROWS) - jacobian @ covariance @ jacobian.T) @ matrix.T
    trend = trend_of(found, covariance)
    assert trend.dof == 5
    assert trend.change == pytest.approx(np.linalg.solve(left, matrix @ white))
    assert trend.std == pytest.approx(np.sqrt(np.diag(np.linalg.inv(left))))
    assert trend.chi_squared == pytest.approx(
        matrix @ white @ np.linalg.solve(left, matrix @ white)
    )


def test_a_change_that_the_fit_has_absorbed_is_not_visible() -> None:
    generator = np.random.default_rng(5)
    white, weight = generator.normal(size=(2, ROWS))
    group = np.arange(ROWS) % 3
    jacobian = np.zeros((ROWS, PARAMETERS))
    jacobian[group == 0, 0] = weight[group == 0]
    covariance = np.linalg.inv(jacobian.T @ jacobian + 1e-6 * np.eye(PARAMETERS))
    trend = trend_of(contrast_of(group, 3, weight, white, jacobian), covariance)
    assert trend.visible.tolist() == [False, True, True]
    assert trend.dof == 2


def test_chi_squared_of_a_cell_by_dense_algebra() -> None:
    jacobian, _, covariance = linear_world(3)
    generator = np.random.default_rng(4)
    white = generator.normal(size=ROWS)
    cell = np.repeat(generator.integers(0, 3, ROWS // COMPONENTS), COMPONENTS)
    group = cell * COMPONENTS + np.tile(np.arange(COMPONENTS), ROWS // COMPONENTS)
    found = contrast_of(group, 3 * COMPONENTS, np.ones(ROWS), white, jacobian)
    local = local_scores(
        found.score.reshape(3, -1),
        found.power.reshape(3, -1)[:, 0],
        found.slope.reshape(3, COMPONENTS, -1),
        covariance,
    )
    for k in range(3):
        matrix = np.array([group == k * COMPONENTS + d for d in range(COMPONENTS)], dtype=float)
        left = matrix @ (np.eye(ROWS) - jacobian @ covariance @ jacobian.T) @ matrix.T
        total = matrix @ white
        assert local.chi_squared[k] == pytest.approx(total @ np.linalg.solve(left, total))
        assert local.mean[k] == pytest.approx(total / matrix[0].sum())
        step = covariance @ jacobian.T @ (matrix.T @ local.mean[k])
        assert local.drag_change[k] == pytest.approx(step[-1])
    assert local.samples.sum() == ROWS / COMPONENTS


@pytest.mark.false_alarm(2e-5)
def test_residuals_of_a_fit_have_the_stated_variance(fresh_seed: Callable[[int], int]) -> None:
    """A linear world whose coefficients come from the prior: 4000 fits, 5 sd of a variance each."""
    jacobian, precision, covariance = linear_world(5)
    generator = np.random.default_rng(fresh_seed(6))
    group = np.arange(ROWS) // 50
    matrix = np.array([group == k for k in range(8)], dtype=float)
    left = matrix @ (np.eye(ROWS) - jacobian @ covariance @ jacobian.T) @ matrix.T
    fits = 4000
    truth = generator.normal(size=(PARAMETERS, fits)) / np.sqrt(np.diag(precision))[:, None]
    seen = jacobian @ truth + generator.normal(size=(ROWS, fits))
    residual = seen - jacobian @ (covariance @ (jacobian.T @ seen))
    variance = (matrix @ residual).var(axis=1)
    assert variance == pytest.approx(np.diag(left), rel=5.0 * np.sqrt(2.0 / fits))
    # The correction is worth making: fitting takes 40 % of it away, somewhere.
    assert (np.diag(left) < 0.6 * 50).any()


def errors_of_noise(white: np.ndarray, used: np.ndarray | None = None) -> Innovations:
    """Return errors made on a circle of 8 cm, one turn in 40 s, at 10 Hz."""
    time = 0.1 * np.arange(len(white))
    angle = 2.0 * np.pi * time / 40.0
    used = np.ones(time.size, dtype=bool) if used is None else used
    series = Series(
        time,
        0.08 * np.cos(angle),
        0.08 * np.sin(angle),
        angle,
        0.0 * time,
        np.zeros(time.size, np.uint8),
    )
    return Innovations(
        series,
        np.where(used[:, None], white, 0.0),
        used,
        np.zeros(time.size, bool),
        0.02 + 0.01 * np.cos(angle),
    )


def nothing_fitted(components: int = 2) -> Leverage:
    return Leverage(np.zeros((1, 1)), 0.0, np.zeros((components, 21)))


def test_portmanteau_without_gaps_is_that_of_ljung_and_box() -> None:
    white = np.random.default_rng(7).normal(size=(800, 2))
    found = whiteness_tests([errors_of_noise(white)], nothing_fitted())
    expected = 0.0
    for column in white.T:
        for lag in range(1, 21):
            rho = (column[lag:] * column[:-lag]).sum() / (column**2).sum()
            expected += 800 * 802 * rho**2 / (800 - lag)
    # Each product is divided by its number of pairs; at 20 of 800 lags that is 2.5 % of a term.
    assert found.portmanteau == pytest.approx(expected, rel=0.03)
    assert found.portmanteau_dof == 40
    assert found.p_value == pytest.approx(chi2.sf(found.portmanteau, 40))


def test_autocorrelation_with_gaps_by_brute_force() -> None:
    generator = np.random.default_rng(8)
    white, used = generator.normal(size=(300, 2)), generator.random(300) < 0.7
    found = whiteness_tests([errors_of_noise(white, used)], nothing_fitted())
    for lag in (1, 7, 20):
        pairs = [(k, k + lag) for k in range(300 - lag) if used[k] and used[k + lag]]
        mean = np.mean([white[a] * white[b] for a, b in pairs], axis=0)
        variance = (white[used] ** 2).mean(axis=0)
        assert found.autocorrelation[:, lag - 1] == pytest.approx(mean / variance)
        assert found.std[:, lag - 1] == pytest.approx(1.0 / np.sqrt(len(pairs)))


def test_one_passage_does_not_reject_a_model_that_is_right_elsewhere() -> None:
    """Of large errors twelve in a row count as one; thirty far from each other are found."""
    noise = np.random.default_rng(31).normal(size=(6000, 2))
    in_a_row, apart = noise.copy(), noise.copy()
    in_a_row[2430:2442, 1] += 5.0
    apart[100::200, 1] += 5.0
    one, many = (
        whiteness_tests([errors_of_noise(white)], nothing_fitted()) for white in (in_a_row, apart)
    )
    assert one.excess_kurtosis[1] > 0.5
    assert one.kurtosis_p_value[1] > 0.1
    assert many.kurtosis_p_value[1] < 1e-4
    assert one.p_value > 0.1 > 1e-3 > chi2.sf((one.autocorrelation**2).sum() * 6000, 40)
    # By brute force: the scatter of the sums of 10 s about what their samples should hold.
    white = in_a_row[:, 1] / np.sqrt((in_a_row[:, 1] ** 2).mean())
    influence = [z**4 - 6.0 * z**2 + 3.0 for z in white]
    off = [sum(influence[k : k + 100]) - 100 * np.mean(influence) for k in range(0, 6000, 100)]
    assert one.kurtosis_std[1] == pytest.approx(np.sqrt(np.sum(np.square(off))) / 6000, rel=1e-2)
    assert one.kurtosis_std[0] == pytest.approx(np.sqrt(24.0 / 6000))


def test_errors_that_are_correlated_everywhere_are_found() -> None:
    """With 0.1 at a lag of one sample in 6000: as surely as without clusters."""
    noise = np.random.default_rng(32).normal(size=(6001, 2))
    found = whiteness_tests([errors_of_noise(noise[1:] + 0.1 * noise[:-1])], nothing_fitted())
    plain = (((found.autocorrelation - found.expected) / found.std) ** 2).sum()
    assert found.p_value < 1e-6
    assert found.portmanteau == pytest.approx(plain, rel=0.05)


def test_one_passage_does_not_hide_the_tails_of_another_component() -> None:
    generator = np.random.default_rng(33)
    white = np.stack(
        [generator.standard_t(8, 6000) / np.sqrt(8 / 6), generator.normal(size=6000)], 1
    )
    white[2430:2442, 1] += 6.0
    found = whiteness_tests([errors_of_noise(white)], nothing_fitted())
    assert found.excess_kurtosis[1] > found.excess_kurtosis[0] > LEAST.kurtosis
    said = tail_criterion(found, ("x", "y"))
    assert said.failed
    assert "kurtosis of x" in said.sentence


def test_lags_without_a_pair_take_no_degree_of_freedom() -> None:
    white = np.random.default_rng(12).normal(size=(400, 2))
    found = whiteness_tests([errors_of_noise(white, np.arange(400) % 2 == 0)], nothing_fitted())
    # Only even lags join samples that are used.
    assert found.portmanteau_dof == 2 * 10
    assert found.p_value == pytest.approx(chi2.sf(found.portmanteau, 20))


@pytest.mark.slow
@pytest.mark.false_alarm(1e-3)
def test_what_fitting_puts_in_is_taken_out_again(fresh_seed: Callable[[int], int]) -> None:
    """Residuals of a local mean are anticorrelated; with the leverage known they count as white."""
    generator = np.random.default_rng(fresh_seed(9))
    white = generator.normal(size=(20_000, 2))
    jacobian = np.kron(np.eye(400), np.ones((50, 1)))
    residual = white - jacobian @ (jacobian.T @ white) / 50.0
    # J C J' is 1/50 within a block of 50: at lag l a share (50 - l) / 50 of the pairs is in one.
    lags = np.arange(21)
    leverage = Leverage(np.zeros((1, 1)), 800.0, np.tile((50 - lags) / 50**2, (2, 1)))
    corrected = whiteness_tests([errors_of_noise(residual)], leverage)
    naive = whiteness_tests([errors_of_noise(residual)], nothing_fitted())
    assert naive.p_value < 1e-6
    assert corrected.p_value > 1e-3
    assert corrected.expected_chi_squared == pytest.approx(0.98)
    assert corrected.chi_squared == pytest.approx(np.full(2, 0.98), abs=0.05)


@pytest.mark.false_alarm(1e-3)
def test_moving_average_and_tails_are_seen(fresh_seed: Callable[[int], int]) -> None:
    generator = np.random.default_rng(fresh_seed(10))
    noise = generator.normal(size=(6001, 2))
    found = whiteness_tests(
        [errors_of_noise((noise[1:] + 0.5 * noise[:-1]) / np.sqrt(1.25))], nothing_fitted()
    )
    assert found.autocorrelation[:, 0] == pytest.approx([0.4, 0.4], abs=0.05)
    assert found.p_value < 1e-12
    assert found.largest[1] == 1
    # The excess kurtosis of Student's t with 10 degrees of freedom is 6 / (10 - 4).
    tails = whiteness_tests(
        [errors_of_noise(generator.standard_t(10, size=(40_000, 2)))], nothing_fitted()
    )
    assert tails.excess_kurtosis == pytest.approx([1.0, 1.0], abs=0.3)
    assert tails.kurtosis_p_value.max() < 1e-6


def test_layout_cells_parts_and_speeds() -> None:
    errors = [errors_of_noise(np.zeros((6000, 2))), errors_of_noise(np.zeros((3000, 2)))]
    layout = lay_out(errors, (-0.15, -0.15, 0.15, 0.15), side=0.03)
    assert layout.size == pytest.approx(0.02)
    assert (layout.x.size, layout.y.size) == (15, 15)
    assert layout.parts == 10
    assert np.bincount(layout.series).tolist() == [7, 3]
    assert layout.end[6] == pytest.approx(599.9)
    cell = cell_of(layout, np.array([0.0, -0.145, 9.0]), np.array([0.0, 0.145, -9.0]))
    assert cell.tolist() == [7 * 15 + 7, 14 * 15, 14]
    groups = groups_of(layout, errors)
    before = errors[0].series.x[:-1], errors[0].series.y[:-1]
    assert (groups[0].cell[1:] == cell_of(layout, *before)).all()
    assert np.bincount(groups[0].part).min() > 850
    counts = np.bincount(np.concatenate([one.speed for one in groups]))
    assert counts == pytest.approx(np.full(6, 1500), rel=0.05)


@pytest.mark.false_alarm(1e-4)
def test_louder_noise_in_one_group_is_seen(fresh_seed: Callable[[int], int]) -> None:
    generator = np.random.default_rng(fresh_seed(11))
    group = generator.integers(0, 4, 8000)
    white = generator.normal(size=(8000, 2)) * np.where(group == 2, 1.3, 1.0)[:, None]
    found = spread_of([errors_of_noise(white)], [group], 5)
    mean = (3 + 1.3**2) / 4
    assert found.ratio[:4] == pytest.approx(np.array([1.0, 1.0, 1.69, 1.0]) / mean, rel=0.1)
    assert (found.ratio[2] - 1.0) / found.std[2] > 8.0
    assert np.isnan(found.ratio[4])


def test_flow_at_scattered_points_is_that_of_the_grid() -> None:
    spline = Spline(-0.1, -0.08, 0.02, 13, 11)
    coefficients = np.random.default_rng(12).normal(size=(2, 11, 13))
    x, y = np.linspace(-0.09, 0.09, 7), np.linspace(-0.07, 0.07, 5)
    at_x, at_y = (part.ravel() for part in np.meshgrid(x, y))
    found = velocity_at(spline, coefficients, at_x, at_y)
    assert found.reshape(2, 5, 7) == pytest.approx(spline.values(coefficients, x, y))
    assert np.isnan(velocity_at(spline, coefficients, np.array([np.nan]), np.zeros(1))).all()


def turning(
    seed: int, *, backwards: tuple[float, float] = (0.0, 0.0)
) -> list[tuple[np.ndarray, ...]]:
    """Return a body that goes round at 5 cm/s at random radii, the other way for a while."""
    generator = np.random.default_rng(seed)
    time = 0.1 * np.arange(6000)
    sign = np.where((time >= backwards[0]) & (time < backwards[1]), -1.0, 1.0)
    radius = 0.08 + 0.02 * np.sin(2.0 * np.pi * time / 97.0 + generator.uniform(0.0, 6.0))
    angle = generator.uniform(0.0, 6.0) + np.cumsum(sign * 0.05 / radius) * 0.1
    noise = 0.0003 * generator.normal(size=(2, time.size))
    return [(time, radius * np.cos(angle) + noise[0], radius * np.sin(angle) + noise[1])]


def ten_parts() -> Layout:
    axis = 0.02 * np.arange(-7.0, 8.0)
    start = 60.0 * np.arange(10)
    return Layout(axis, axis, 0.02, np.zeros(10, np.int64), start, start + 60.0, np.zeros(2))


def test_scan_names_the_stretch_that_differs() -> None:
    simulated = [turning(seed) for seed in range(1, 17)]
    found = scan_of(turning(100, backwards=(180.0, 300.0)), simulated, ten_parts(), level=5e-4)
    assert found is not None
    assert (found.first, found.last) == (3, 4)
    # The other way round at 5 cm/s: 10 cm/s apart.
    assert found.difference == pytest.approx(0.1, rel=0.1)
    assert found.p_value < 1e-6
    assert found.expected < 0.03


@pytest.mark.slow
@pytest.mark.false_alarm(2.5e-3)
def test_scan_of_steady_motion_is_not_alarmed(fresh_seed: Callable[[int], int]) -> None:
    """Twenty recordings at a level of 5 %: more than four alarms once in 400 such tests."""
    simulated = [turning(seed) for seed in map(fresh_seed, range(1, 17))]
    p_values = []
    for seed in map(fresh_seed, range(200, 220)):
        found = scan_of(turning(seed), simulated, ten_parts(), level=5e-4)
        assert found is not None
        p_values.append(found.p_value)
    assert np.count_nonzero(np.array(p_values) < 0.05) <= 4


def replicates(seed: int, *, count: int = 8, spread: float = 1.0) -> Replicates:
    generator = np.random.default_rng(seed)
    steps = [np.abs(generator.normal(size=(500, 2))) * spread for _ in range(count)]
    return Replicates(steps, [[] for _ in steps], 0)


def test_distances_and_bands_by_brute_force() -> None:
    real = np.abs(np.random.default_rng(1).normal(size=(400, 2)))
    estimate, drawn = replicates(2), replicates(3)
    near = distances_at_estimate(real, estimate)
    found = compare_motion(real, near, drawn)
    assert found.distance == pytest.approx([ks_distance(real, one) for one in estimate.steps])
    pairs = [ks_distance(a, b) for a in estimate.steps[:4] for b in estimate.steps[4:]]
    assert found.floor == pytest.approx(pairs)
    for k, one in enumerate(drawn.steps):
        others = [s for j, s in enumerate(drawn.steps) if j != k]
        assert found.drawn_between[k] == pytest.approx(
            np.mean([ks_distance(one, s) for s in others])
        )
    width = np.diff(found.step_length.edge)
    assert (found.step_length.recording * width).sum() == pytest.approx(1.0, abs=0.01)
    assert (found.turning_angle.low <= found.turning_angle.median).all()
    assert (found.turning_angle.median <= found.turning_angle.high).all()
    assert found.p_value > 0.01
    assert found.rank_p_value > 1 / 9
    near = distances_at_estimate(1.5 * real, estimate)
    wide = compare_motion(1.5 * real, near, drawn)
    assert wide.rank_p_value == pytest.approx(1 / 9)
    assert wide.p_value < 1e-3


def test_steps_that_differ_are_put_into_words() -> None:
    real = 1.5 * np.abs(np.random.default_rng(1).normal(size=(400, 2)))
    near = distances_at_estimate(real, replicates(2))
    motion = compare_motion(real, near, replicates(3))
    found = {angle: motion_criterion(motion, angle=angle) for angle in ("given", "none")}
    assert found["given"].failed
    assert f"KS distance {motion.drawn_distance.mean():.3f}" in found["given"].sentence
    assert "averaged the drag over all orientations" in found["none"].sentence
    assert "orientations" not in found["given"].sentence
    # However sure, a difference that does not matter is no finding.
    assert found["given"].size == pytest.approx(motion.drawn_distance.mean())
    small = found["given"]._replace(size=0.09)
    assert not small.failed
    assert "the KS distance of the steps is 0.09, up to 0.10 is tolerated" in (small.note or "")
    assert not motion_criterion(None, angle="given").failed


@pytest.mark.parametrize(("added", "fails"), [(0.004, False), (-0.006, True)])
def test_a_wrong_place_that_hardly_counts_in_the_drag_is_a_note(added: float, fails: bool) -> None:
    """Two cells stand out, each in one part of the recording; what the others add is chance."""
    layout = ten_parts()
    cells, parts, dof = layout.cells, layout.parts, 2
    alone, drag_change = np.full((parts, cells), float(dof)), np.full((parts, cells), 0.1)
    alone[3, [7, 11]], drag_change[3, [7, 11]] = 150.0, added
    some = np.ones((parts, cells, dof))
    local = LocalMeans(
        50.0 * some[..., 0].ravel(), some.reshape(-1, dof), alone.ravel(), drag_change.ravel()
    )
    whole = LocalMeans(50.0 * some[0, :, 0], some[0], alone[3], drag_change[3])
    for found in (place_criterion(whole, layout), time_and_place_criterion(local, layout)):
        assert found.p_value < 1e-6
        assert found.size == pytest.approx(2.0 * abs(added))
        assert found.failed == fails
        assert fails == (found.note is None)
    note = place_criterion(whole, layout).note
    if note is not None:
        assert "C_d is 0.8 % off by these errors, and 1 % is tolerated; the mean error" in note
    # Where no cell stands out, a whole part that is off is no matter of a place.
    alone[3] = 12.0
    assert time_and_place_criterion(local._replace(chi_squared=alone.ravel()), layout).failed


def test_too_few_sound_replicates_are_refused() -> None:
    few = Replicates(replicates(4).steps[:2], [[], []], 6)
    with pytest.raises(InputError, match="6 of 8 simulated recordings broke down"):
        compare_motion(np.ones((40, 2)), replicates(5), few)


def test_sums_of_means_over_samples_are_those_of_all() -> None:
    """Derivatives, weights and groups that are the same within ten samples."""
    generator = np.random.default_rng(7)
    samples, pooled = 396, 10  # the last mean is of six
    pools = -(-samples // pooled)
    shape = (pools, COMPONENTS)
    jacobian = generator.normal(size=(*shape, PARAMETERS))
    weight, group = generator.normal(size=shape), generator.integers(-1, 5, shape)
    every = np.repeat(np.arange(pools), pooled)[:samples]
    groups = np.where(generator.random((samples, COMPONENTS)) < 0.1, -1, group[every])
    white = generator.normal(size=(samples, COMPONENTS))
    whole, means = (Contrast([groups], 5) for _ in range(2))
    for one in (whole, means):
        one.begin(PARAMETERS)
    rows = jacobian[every].reshape(-1, PARAMETERS)
    whole.add(part_of(white), {"one": weight[every].ravel()}, rows, None)
    rows = jacobian.reshape(-1, PARAMETERS)
    means.add(part_of(white, pooled=pooled), {"one": weight.ravel()}, rows, None)
    assert means.score == pytest.approx(whole.score)
    assert means.power == pytest.approx(whole.power)
    assert means.slope == pytest.approx(whole.slope)


@pytest.mark.parametrize("largest", [0.004, 0.05])
def test_a_change_of_the_flow_that_is_sure_but_small_is_a_note(largest: float) -> None:
    """Nine parts of ten are steady to 0.1 %; the other one is off, by many standard deviations."""
    change, std = np.zeros(10), np.full(10, 5e-4)
    change[3] = largest
    seen = np.ones(10, dtype=bool)
    found = strength_criterion(
        Trend(change, std, float(((change / std) ** 2).sum()), 9, seen), ten_parts()
    )
    assert found.p_value == pytest.approx(chi2.sf((largest / 5e-4) ** 2, 9))
    small = largest < 0.02
    assert found.failed is not small
    said = (
        "too small to change the verdict: the strength of the flow differs by 0.4 %, up to 2 % is"
    )
    assert (found.note or "").startswith(said) is small
    assert "between 180 s and 240 s it is" in found.sentence


def test_noise_that_differs_surely_fails_however_little() -> None:
    """At 30 Hz a force of 0.45 mN, then 0.65 mN: the rest of an error is the camera's 0.3 mm.

    Mean squares from Riccati's and Lyapunov's equations of a block of 11.6 g, along one axis.
    """
    std, ratio = np.full(10, 5e-3), np.repeat([0.961, 1.039], 5)
    found = noise_criterion(Spread(ratio, std), ten_parts(), by="time")
    assert (found.failed, found.note) == (True, None)
    assert not noise_criterion(Spread(np.ones(10), std), ten_parts(), by="time").failed
