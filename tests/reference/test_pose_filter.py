"""The innovations filter with the angle in its state, against filters written another way."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.stats
from dense_innovations import (
    ANGLE_NOISE,
    BLOCK,
    FORCE_LEVER,
    MISSING_ANGLE_VARIANCE,
    NODES,
    NOISE_INTENSITY,
    POSITION_NOISE,
    WAVY,
    Floats,
    dense_filter,
    difficult_track,
    make_filter,
    make_track,
    run_filter,
    slope,
    unknown_variances,
)

from driftwalk import _core

NAMES = ("innovation", "covariance", "state", "whitened", "jacobian")
TORQUE_INTENSITY = NOISE_INTENSITY * (6 * FORCE_LEVER / BLOCK["side"] ** 2) ** 2


def run_pose(track: dict[str, Any], coefficients: Floats = WAVY, **changes: Any) -> Any:
    return run_filter(track, coefficients, orientation="state", **changes)


def wrapped(angle: Floats) -> Floats:
    return np.angle(np.exp(1j * angle))


def difficult_poses() -> dict[str, Any]:
    """The difficult track with measured angles that wrap, some missing, and an outlier of them."""
    track = difficult_track()
    rng = np.random.default_rng(12)
    turned = np.pi + 0.8 * np.sin(1.1 * track["time"])
    track["theta"] = wrapped(turned + ANGLE_NOISE * rng.standard_normal(turned.size))
    # After each gap of 3 s the first angles are missing too: the state waits for a whole sample.
    track["theta"][[1, 2, 16, 17, 60, 91, 111, 112, 140]] = np.nan
    track["theta"][130] = wrapped(track["theta"][130] + 1.0)
    track["omega"] = np.full(track["time"].size, np.nan)
    return track


@pytest.mark.slow
def test_filter_is_the_dense_one():
    track = difficult_poses()
    got = run_pose(track, sensitivities=True)
    want = dense_filter(track, WAVY, orientation="state", largest=0.05)
    assert np.array_equal(got["used"].astype(bool), want["used"])
    # The track does hold what its name says.
    unused = np.flatnonzero(got["used"] == 0).tolist()
    excluded = {*range(20, 24), *range(30, 34), 90, 91, 92}
    assert {*range(4), *excluded, 45, 75, *range(110, 114), 130} < set(unused)
    # After false values, and where the track turns as the model does not, the filter slips, three
    # samples each time.
    assert len(unused) <= 46
    assert np.isnan(got["state"][[0, 1, 2, 110, 111, 112]]).all()
    assert np.isfinite(got["state"][3:110]).all()
    assert np.count_nonzero(np.abs(np.diff(track["theta"])) > np.pi) >= 3
    assert np.nanmax(np.abs(got["state"][:, 2])) > np.pi + 0.5
    want["covariance"][:, 5][missing_angle(track)] -= MISSING_ANGLE_VARIANCE
    got["covariance"][:, 5][missing_angle(track)] -= MISSING_ANGLE_VARIANCE
    for name in NAMES:
        assert np.array_equal(np.isnan(got[name]), np.isnan(want[name])), name
        values = want[name].reshape(160, -1) if name == "whitened" else want[name]
        scale = np.nanmax(np.abs(values), axis=0) if name != "jacobian" else np.abs(values).max()
        # As good as the differences of the oracle. Of the angle's variance where none was seen,
        # 1e12, the last digit is 1e-4.
        least = np.full_like(values, 1e-8) * scale
        if name == "covariance":
            least[missing_angle(track), 5] = 2e-4
        apart = np.abs(got[name].reshape(values.shape) - values)
        assert np.nanmax(apart / (1e-6 * np.abs(values) + least)) < 1.0, name


def missing_angle(track: dict[str, Any]) -> Any:
    return np.isnan(track["theta"])


def test_turns_of_the_measured_angle_do_not_matter():
    track = difficult_poses()
    base = run_pose(track)
    turns = 2 * np.pi * np.random.default_rng(3).integers(-20, 20, track["time"].size)
    other = run_pose(track | {"theta": track["theta"] + turns})
    assert np.array_equal(base["used"], other["used"])
    np.testing.assert_allclose(base["innovation"], other["innovation"], rtol=0, atol=1e-11)
    # The state may begin some whole turns away.
    turned = (other["state"] - base["state"])[:, 2] / (2 * np.pi)
    seen = np.isfinite(turned)
    np.testing.assert_allclose(turned[seen], np.rint(turned[seen]), atol=1e-9)


def test_a_missing_angle_changes_nothing_that_is_known():
    """A sample without an angle is one of the position alone."""
    track = make_track(np.arange(40) * 0.1)
    track["theta"][20] = np.nan
    got = run_pose(track)
    # Of the angle's innovation only the position's part of the covariance says something.
    assert got["innovation"][20, 2] == 0.0
    assert got["covariance"][20, 5] > 1e11
    assert got["used"][20] == 1
    seen = run_pose(track | {"theta": np.where(np.arange(40) < 20, track["theta"], np.nan)})
    assert np.array_equal(seen["innovation"][:21], got["innovation"][:21], equal_nan=True)
    # The angle becomes less and less certain, but the positions are predicted and used all along.
    assert seen["used"][1:].all()
    assert np.all(seen["covariance"][20:, 5] > 1e11)


def test_the_rate_is_not_read():
    track = make_track(np.arange(30) * 0.1)
    with_rate = run_pose(track)
    without = run_pose(track | {"omega": np.full(30, np.nan)})
    for name, values in with_rate.items():
        assert without[name].tobytes() == values.tobytes(), name


# --- pieces, bits and sums -----------------------------------------------------------------------
def test_a_run_in_pieces_is_the_run_at_once():
    track = difficult_poses()
    whole = run_pose(track, sensitivities=True)
    pieces = make_filter(track, orientation="state", sensitivities=True)
    assert (pieces.samples, pieces.remaining, pieces.coordinates) == (160, 160, 3)
    parts = [pieces.run(count) for count in (1, 0, 7, 53, 1000)]
    assert pieces.remaining == 0
    for name, values in whole.items():
        assert np.concatenate([part[name] for part in parts]).tobytes() == values.tobytes(), name
    for name, values in run_pose(track).items():
        assert values.tobytes() == whole[name].tobytes(), name


def test_instruction_sets_give_the_same_bits(monkeypatch):
    track = difficult_poses()
    kept, right = np.ones(160, np.uint8), np.random.default_rng(4).standard_normal((160, 3, 2))
    found = []
    for name in _core.available_instruction_sets():
        monkeypatch.setenv("DRIFTWALK_INSTRUCTION_SET", name)
        sums = make_filter(track, orientation="state", sensitivities=True).sums(kept, right)
        found.append(run_pose(track, sensitivities=True) | sums)
    assert len(found) > 1 or _core.available_instruction_sets() == ["baseline"]
    for other in found[1:]:
        for name, values in other.items():
            assert values.tobytes() == found[0][name].tobytes(), name


@pytest.mark.parametrize("orientation", ["given", "none", "state"])
@pytest.mark.parametrize("already", [0, 37])
def test_sums_are_the_products_of_the_derivatives(orientation, already):
    """Left out in J'J is what is below 1e-4 of the largest derivative among some two seconds.

    A column that is that small all along may be lost; one that counts is not.
    """
    track = difficult_poses() if orientation == "state" else difficult_track()
    whole = run_filter(track, orientation=orientation, sensitivities=True)
    d = whole["innovation"].shape[1]
    rng = np.random.default_rng(10)
    kept = (rng.random(160 - already) < 0.8).astype(np.uint8)
    right = rng.standard_normal((160 - already, d, 3))
    piece = make_filter(track, orientation=orientation, sensitivities=True)
    piece.run(already)
    got = piece.sums(kept, right)
    assert piece.remaining == 0
    jacobian = whole["jacobian"].reshape(160, d, -1)[already:] * kept[:, None, None]
    information = np.einsum("kai,kaj->ij", jacobian, jacobian, optimize=True)
    products = np.einsum("kac,kai->ci", right, jacobian, optimize=True)
    assert np.array_equal(got["information"], got["information"].T)
    # Of every product that is lost one factor is below 1e-4 of the largest derivative.
    least = 1e-4 * np.abs(jacobian).max()
    lost = least * np.abs(jacobian).sum(axis=(0, 1))
    beside = least * np.abs(right).sum(axis=(0, 1))[:, None]
    for values, want, allowed in (
        (got["information"], information, np.maximum.outer(lost, lost)),
        (got["products"], products, beside),
    ):
        assert np.all(np.abs(values - want) <= allowed + 1e-12 * np.abs(want).max())
    size = np.sqrt(np.diag(information))
    counts = np.flatnonzero(size > 0.01 * size.max())
    assert counts.size > 40
    part = np.ix_(counts, counts)
    relative = np.abs(got["information"] - information)[part] / np.outer(size, size)[part]
    assert relative.max() < 1e-3
    # Had the mask not been read, the sums would be larger by a quarter.
    assert np.trace(information) == pytest.approx(np.trace(got["information"]), rel=1e-6)


def test_prediction_moves_with_the_parameters_as_its_jacobian_says():
    """What is left out is of first order in the interval: ten times shorter, ten times less."""
    worst = []
    for interval in (0.02, 0.002):
        track = make_track(np.array([0.0, interval]))
        got = run_pose(track, sensitivities=True)
        S = np.zeros((3, 3))
        S[np.tril_indices(3)] = got["covariance"][1]
        S = S + np.tril(S, -1).T
        jacobian = np.linalg.cholesky(S) @ got["jacobian"][3:]
        touched = np.flatnonzero(np.abs(jacobian[:, :-1]).max(axis=0) > 0)
        assert 40 < touched.size < NODES

        def prediction(change: Floats, track=track, touched=touched) -> Floats:
            coefficients = WAVY.ravel().copy()
            coefficients[touched] += change[:-1]
            drag = 0.5 * np.exp(change[-1])
            found = run_pose(track, coefficients.reshape(WAVY.shape), drag_coefficient=drag)
            return -found["innovation"][1]

        want = slope(prediction, np.zeros(touched.size + 1), 1e-4)
        mine = jacobian[:, [*touched, -1]]
        # By coordinate: the angle's numbers are in other units.
        error = np.abs(mine - want)
        worst.append(
            [
                (error[rows][:, columns].max() / np.abs(want[rows][:, columns]).max())
                for rows in ([0, 1], [2])
                for columns in (slice(None, -1), slice(-1, None))
            ]
        )
    assert np.all(np.array(worst[0]) < 0.2), worst
    assert np.all(np.array(worst[1]) < 0.02), worst


# --- the limit without water ---------------------------------------------------------------------
def free_run(track: dict[str, Any], **changes: Any) -> Any:
    """Run with next to no drag: three double integrators."""
    return run_pose(track, np.zeros_like(WAVY), drag_coefficient=1e-9, **changes)


def log_density(values: Floats, elapsed: Floats, noise: float, start: float, q: float) -> float:
    """Of all values but the first, given the first: start + start rate t + noise twice integrated.

    `noise` is the sd of a sample, `start` that of the first rate.
    """
    early, late = np.minimum.outer(elapsed, elapsed), np.maximum.outer(elapsed, elapsed)
    joint = (
        noise**2 * (1 + np.eye(elapsed.size))
        + start**2 * np.outer(elapsed, elapsed)
        + q * early**2 * (3 * late - early) / 6
    )[1:, 1:]
    mean = np.full(values.size - 1, values[0])
    return float(scipy.stats.multivariate_normal.logpdf(values[1:], mean, joint))


def test_without_drag_it_is_the_normal_law_of_all_samples_at_once():
    rng = np.random.default_rng(2)
    time = np.cumsum(rng.uniform(0.03, 0.2, 60))
    track = make_track(time)
    turned = track["theta"] + 3.0 + ANGLE_NOISE * rng.standard_normal(60)
    track["x"][[7, 8, 30]] = np.nan
    blind = [5, 12, 13, 14, 40]
    track["theta"] = wrapped(turned)
    assert np.count_nonzero(np.abs(np.diff(track["theta"])) > np.pi) > 0
    track["theta"][blind] = np.nan
    got = free_run(track)
    there = ~np.isnan(track["x"])
    # Where a position is missing its angle is not read.
    seen = there & ~np.isnan(track["theta"])
    elapsed = time - time[0]
    unknown = np.sqrt(unknown_variances(3))
    want = sum(
        log_density(track[axis][there], elapsed[there], POSITION_NOISE, 0.1, NOISE_INTENSITY)
        for axis in ("x", "y")
    ) + log_density(turned[seen], elapsed[seen], ANGLE_NOISE, unknown[2], TORQUE_INTENSITY)
    used = np.flatnonzero(got["used"])
    assert used.tolist() == np.flatnonzero(there)[1:].tolist()
    logarithm = 0.0
    for k in used:
        S = np.zeros((3, 3))
        S[np.tril_indices(3)] = got["covariance"][k]
        S = S + np.tril(S, -1).T
        count = 3 if seen[k] else 2
        logarithm += scipy.stats.multivariate_normal.logpdf(
            got["innovation"][k, :count], np.zeros(count), S[:count, :count]
        )
    assert logarithm == pytest.approx(want, abs=1e-5)


@pytest.mark.slow
@pytest.mark.false_alarm(2e-3)
def test_whitened_innovations_of_a_linear_world_are_standard_normal(fresh_seed):
    """False alarm in 500; a lever too large by a fifth, or 10 % more noise of the angle, is caught.

    Of the same draws these make the sum of squares 0.927 +- 0.002 and 0.862 +- 0.001 times what it
    is (8 seeds), whatever it is by chance.

    A fifth of the angles is missing: their whitened innovations are none.
    """
    rng = np.random.default_rng(fresh_seed(21))
    count, dt = 6000, 0.1
    square = np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
    intensity = np.array([NOISE_INTENSITY, NOISE_INTENSITY, TORQUE_INTENSITY])
    kicks = np.linalg.cholesky(square) @ rng.standard_normal((count, 2, 3)) * np.sqrt(intensity)
    velocity = np.cumsum(kicks[:, 1], axis=0)
    before = np.vstack([np.zeros((1, 3)), velocity[:-1]])
    poses = np.cumsum(before * dt + kicks[:, 0], axis=0)
    noise = np.array([POSITION_NOISE, POSITION_NOISE, ANGLE_NOISE])
    poses += noise * rng.standard_normal(poses.shape)
    track = make_track(dt * np.arange(count))
    track["x"], track["y"] = np.ascontiguousarray(poses[:, :2].T)
    missing = rng.random(count) < 0.2
    missing[0] = False
    track["theta"] = np.where(missing, np.nan, wrapped(poses[:, 2]))

    def angles(**changes: Any) -> Floats:
        found = free_run(track, sensitivities=True, **changes)
        assert found["used"][1:].all()
        white = found["whitened"].reshape(-1, 3)
        assert np.abs(white[missing, 2]).max() < 1e-4
        return white[1:][~missing[1:], 2]

    whitened = angles()
    assert scipy.stats.kstest(whitened, "norm").pvalue > 0.001
    low, high = scipy.stats.chi2.ppf([0.0005, 0.9995], whitened.size)
    assert low < np.sum(whitened**2) < high
    for wrong in ({"force_lever": 1.2 * FORCE_LEVER}, {"angle_noise": 1.1 * ANGLE_NOISE}):
        assert np.sum(angles(**wrong) ** 2) < 0.95 * np.sum(whitened**2)


# --- what it refuses -----------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"force_lever": -1e-9}, "lever of the force must not be negative"),
        ({"force_lever": np.nan}, "lever of the force must not be negative"),
        ({"angle_noise": 0.0}, "angle noise must be positive"),
        ({"angle_noise": np.inf}, "angle noise must be positive"),
        ({"theta": np.array([0.0, np.inf, 0.0])}, "angles must be finite, or NaN"),
        ({"velocity_prior": np.full((3, 6), -1.0)}, "the prior of the velocity"),
        ({"velocity_prior": np.ones((3, 3))}, r"velocity_prior must have shape \(n, 6\)"),
    ],
)
def test_refuses(changes, message):
    track = make_track(np.array([0.0, 0.1, 0.2]))
    own = {name: value for name, value in changes.items() if name in track}
    with pytest.raises(ValueError, match=message):
        run_pose(track | own, **{name: changes[name] for name in changes if name not in own})


def test_without_any_angle_nothing_is_predicted():
    got = run_pose(make_track(np.arange(30) * 0.1) | {"theta": np.full(30, np.nan)})
    assert not got["used"].any()
    assert np.isnan(got["state"]).all()


def test_a_sample_far_away_does_no_harm():
    """A tracker's slip of kilometres or of many turns: left out, and the filter goes on."""
    track = make_track(np.arange(60) * 0.1)
    track["x"][30] = 1e300
    got = run_pose(track, sensitivities=True)
    assert np.flatnonzero(got["used"] == 0).tolist() == [0, 30]
    assert np.isfinite(got["jacobian"]).all()
    assert np.isfinite(got["state"]).all()
