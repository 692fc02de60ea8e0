"""The innovations filter against closed forms, quadrature and filters written another way."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.integrate
import scipy.linalg
import scipy.stats
from dense_innovations import (
    BLOCK,
    GRADIENT,
    LINEAR,
    NODES,
    NOISE_INTENSITY,
    POSITION_NOISE,
    WAVY,
    Floats,
    dense_filter,
    difficult_track,
    linear_coefficients,
    make_filter,
    make_track,
    mean_drag,
    run_filter,
    slope,
)
from single_block import model

from driftwalk import _core

STATE = np.array([0.021, -0.034, 0.045, 0.062])
# Position known to 5 mm and velocity to 2 cm/s: large, so that every term of the mean counts.
COVARIANCE = np.array(
    [
        [2.5e-5, 5.0e-6, 3.0e-5, -1.0e-5],
        [5.0e-6, 2.0e-5, 1.0e-5, 2.0e-5],
        [3.0e-5, 1.0e-5, 4.0e-4, 1.0e-4],
        [-1.0e-5, 2.0e-5, 1.0e-4, 3.0e-4],
    ]
)
VELOCITY_ONLY = scipy.linalg.block_diag(np.zeros((2, 2)), COVARIANCE[2:, 2:])


# --- the drag ------------------------------------------------------------------------------------
@pytest.mark.parametrize("strips", [1, 5, 8, 21])
@pytest.mark.parametrize(
    # Flows that the table of the simulator holds exactly.
    "gradient",
    [[[0.0, -0.31], [0.31, 0.0]], [[0.31, 0.0], [0.0, -0.31]], [[0.0, 0.31], [0.0, 0.0]]],
    ids=["rotation", "saddle", "shear"],
)
def test_a_block_known_exactly_feels_the_strip_law(gradient, strips):
    (a, b), (c, d) = gradient
    simulated = model(lambda x, y: (a * x + b * y, c * x + d * y), times=[0.0], strips=strips)
    for theta in np.linspace(-3, 3, 7):
        x, y, vx, vy = STATE
        force = _core.drag(
            simulated, drag_coefficient=0.5, x=x, y=y, theta=theta, vx=vx, vy=vy, omega=1.3
        )
        got = mean_drag(linear_coefficients(gradient), STATE, theta=theta, strips=strips)[
            "acceleration"
        ]
        np.testing.assert_allclose(got, np.array(force[:2]) / BLOCK["mass"], rtol=1e-10)


def strips_of(theta: float) -> list[tuple[Floats, Floats]]:
    """Arm and outward normal of every strip."""
    out = []
    for face in range(4):
        angle = theta + face * np.pi / 2
        normal = np.array([np.cos(angle), np.sin(angle)])
        tangent = np.array([-normal[1], normal[0]])
        for k in range(8):
            out.append((0.015 * normal + (-0.015 + 0.00375 * (k + 0.5)) * tangent, normal))
    return out


@pytest.mark.slow
def test_mean_over_the_covariance_is_the_integral():
    """Each strip integrated over its closing speed; the slip given it is linear in it."""
    theta, omega = 0.4, 1.3
    spread = np.hstack([GRADIENT, -np.eye(2)]) @ COVARIANCE @ np.hstack([GRADIENT, -np.eye(2)]).T
    scale = 0.5 * 1000.0 * 0.5 * 0.00375 * 0.03 / 0.0116
    total = np.zeros(2)
    for arm, normal in strips_of(theta):
        w = GRADIENT @ (STATE[:2] + arm) - STATE[2:] - omega * np.array([-arm[1], arm[0]])
        tau = np.sqrt(normal @ spread @ normal)
        mean, along = -normal @ w, -(spread @ normal) / tau**2

        def force(s, w=w, tau=tau, mean=mean, along=along):
            return scipy.stats.norm.pdf(s, mean, tau) * s * (w + along * (s - mean))

        top = mean + 12 * tau
        if top > 0:
            total += scale * scipy.integrate.quad_vec(force, 0, top, epsrel=1e-12)[0]
    got = mean_drag(LINEAR, STATE, COVARIANCE, theta=theta, omega=omega)["acceleration"]
    np.testing.assert_allclose(got, total, rtol=1e-9)
    # The mean is far from the drag of the mean: without the covariance this test would fail.
    assert np.abs(mean_drag(LINEAR, STATE)["acceleration"] / total - 1).max() > 0.05


@pytest.mark.slow
@pytest.mark.false_alarm(2e-4)
def test_mean_over_the_covariance_is_the_mean_of_draws(fresh_seed):
    """4 standard errors on each of two components: a false alarm in 8000."""
    draws = np.random.default_rng(fresh_seed(3)).multivariate_normal(STATE, COVARIANCE, 20000)
    values = np.array([mean_drag(LINEAR, draw)["acceleration"] for draw in draws])
    got = mean_drag(LINEAR, STATE, COVARIANCE)["acceleration"]
    error = values.std(axis=0) / np.sqrt(len(values))
    assert np.all(np.abs(got - values.mean(axis=0)) < 4 * error)
    assert np.all(error < 0.02 * np.abs(got).max())


@pytest.mark.parametrize("orientation", ["given", "none"])
def test_derivatives_are_those_of_differences(orientation):
    def drag(mean: Floats, coefficients: Floats = WAVY, covariance: Floats = VELOCITY_ONLY):
        return mean_drag(coefficients, mean, covariance, orientation=orientation)

    got = drag(STATE)
    close = {"rtol": 1e-6, "atol": 1e-7 * np.abs(got["by_velocity"]).max()}
    by_state = slope(lambda s: drag(s)["acceleration"], STATE, 1e-6)
    np.testing.assert_allclose(got["by_position"], by_state[:, :2], **close)
    np.testing.assert_allclose(got["by_velocity"], by_state[:, 2:], **close)
    by_coefficients = slope(
        lambda c: drag(STATE, c.reshape(WAVY.shape))["acceleration"], WAVY.ravel(), 1e-5
    )
    np.testing.assert_allclose(got["by_coefficients"].reshape(2, -1), by_coefficients, **close)
    # By velocity they hold for any covariance.
    full = drag(STATE, covariance=COVARIANCE)
    by_state = slope(lambda s: drag(s, covariance=COVARIANCE)["acceleration"], STATE, 1e-6)
    np.testing.assert_allclose(full["by_velocity"], by_state[:, 2:], **close)


def test_drag_is_proportional_to_the_drag_coefficient():
    """So the derivative by its logarithm is the drag itself."""
    one = mean_drag(WAVY, STATE, COVARIANCE, drag_coefficient=1.0)
    half = mean_drag(WAVY, STATE, COVARIANCE, drag_coefficient=0.5)
    for name, value in one.items():
        np.testing.assert_allclose(half[name], value / 2, rtol=1e-13, atol=1e-15)


def test_an_unknown_angle_is_an_average_without_turning():
    angles = np.arange(720) * np.pi / 2 / 720
    for covariance, tolerance in ((None, 3e-3), (VELOCITY_ONLY, 1e-6)):
        exact = np.mean(
            [
                mean_drag(WAVY, STATE, covariance, theta=a, omega=0.0)["acceleration"]
                for a in angles
            ],
            axis=0,
        )
        for theta, omega in ((0.0, 0.0), (1.0, 5.0)):
            got = mean_drag(WAVY, STATE, covariance, theta=theta, omega=omega, orientation="none")[
                "acceleration"
            ]
            assert np.linalg.norm(got - exact) < tolerance * np.linalg.norm(exact)


# --- the filter ----------------------------------------------------------------------------------
@pytest.mark.parametrize("orientation", ["given", "none"])
def test_filter_is_the_dense_one(orientation):
    track = difficult_track()
    got = run_filter(track, orientation=orientation, sensitivities=True)
    want = dense_filter(track, WAVY, orientation=orientation, largest=0.05)
    assert np.array_equal(got["used"].astype(bool), want["used"])
    # The track does hold what its name says.
    used = got["used"].astype(bool)
    # The one after a contact gives the velocity.
    unused = [0, 1, *range(20, 24), *range(30, 34), 45, 50, 51, 75, *range(90, 93)]
    # Missing, the first after the gap, and the one that gives the velocity.
    unused += [110, 111, 112]
    # From the third sample in a row on, a jump is one.
    unused += [130, 131, 132]
    assert np.flatnonzero(~used).tolist() == unused
    assert np.isnan(got["state"][[0, 110]]).all()
    assert np.isfinite(got["state"][20:23]).all()
    for name in ("innovation", "covariance", "state", "whitened", "jacobian"):
        scale = np.nanmax(np.abs(want[name]))
        # Derivatives that have become as good as zero are set to zero. The bend of the drag, which
        # is found by differences, limits the rest: without it numbers differ by up to a third.
        least = 1e-8 if name == "jacobian" else 1e-10
        np.testing.assert_allclose(
            got[name], want[name], rtol=1e-8, atol=least * scale, err_msg=name
        )


def test_a_run_in_pieces_is_the_run_at_once():
    track = difficult_track()
    whole = run_filter(track, sensitivities=True)
    pieces = make_filter(track, sensitivities=True)
    assert (pieces.samples, pieces.remaining, pieces.parameters) == (160, 160, 2 * NODES + 1)
    parts = [pieces.run(count) for count in (1, 0, 7, 53, 1000)]
    assert [len(part["used"]) for part in parts] == [1, 0, 7, 53, 99]
    assert pieces.remaining == 0
    for name, values in whole.items():
        assert np.concatenate([part[name] for part in parts]).tobytes() == values.tobytes(), name
    # Nor do the sensitivities change anything.
    for name, values in run_filter(track).items():
        assert values.tobytes() == whole[name].tobytes(), name


def test_instruction_sets_give_the_same_bits(monkeypatch):
    track = difficult_track()
    found = []
    for name in _core.available_instruction_sets():
        monkeypatch.setenv("DRIFTWALK_INSTRUCTION_SET", name)
        found.append(run_filter(track, sensitivities=True))
    for other in found[1:]:
        for name, values in other.items():
            assert values.tobytes() == found[0][name].tobytes(), name


def test_prediction_moves_with_the_parameters_as_its_jacobian_says():
    """What is left out is of first order in the interval: ten times shorter, ten times less."""
    worst = []
    for interval in (0.02, 0.002):
        track = make_track(np.array([0.0, interval]))
        got = run_filter(track, sensitivities=True)
        xx, xy, yy = got["covariance"][1]
        jacobian = np.linalg.cholesky([[xx, xy], [xy, yy]]) @ got["jacobian"][2:]
        # The flow only where the block is, else most differences are 0 = 0.
        touched = np.flatnonzero(np.abs(jacobian[:, :-1]).max(axis=0) > 0)
        assert 40 < touched.size < NODES

        def prediction(change: Floats, track=track, touched=touched) -> Floats:
            coefficients = WAVY.ravel().copy()
            coefficients[touched] += change[:-1]
            drag = 0.5 * np.exp(change[-1])
            found = run_filter(track, coefficients.reshape(WAVY.shape), drag_coefficient=drag)
            return -found["innovation"][1]

        want = slope(prediction, np.zeros(touched.size + 1), 1e-4)
        mine = jacobian[:, [*touched, -1]]
        error = np.abs(mine - want).max(axis=0)
        worst.append(
            [error[:-1].max() / np.abs(want[:, :-1]).max(), error[-1] / np.abs(want[:, -1]).max()]
        )
    assert np.all(np.array(worst[0]) < 0.1)
    assert np.all(np.array(worst[1]) < 0.01)


# --- the limit without water ---------------------------------------------------------------------
def free_run(track: dict[str, Any], **changes: Any) -> Any:
    """Run with next to no drag: a double integrator, whose filter is the textbook's."""
    return run_filter(track, np.zeros_like(WAVY), drag_coefficient=1e-9, **changes)


def test_without_drag_it_is_the_normal_law_of_all_samples_at_once():
    rng = np.random.default_rng(2)
    time = np.cumsum(rng.uniform(0.03, 0.2, 60))
    track = make_track(time)
    track["x"][[7, 8, 30]] = np.nan
    got = free_run(track)
    there = np.flatnonzero(~np.isnan(track["x"]))
    elapsed = time - time[0]
    # One axis. Position k = start + start velocity * t + the twice integrated noise.
    early = np.minimum.outer(elapsed, elapsed)
    late = np.maximum.outer(elapsed, elapsed)
    joint = (
        POSITION_NOISE**2 * (1 + np.eye(60))
        + 0.01 * np.outer(elapsed, elapsed)
        + NOISE_INTENSITY * early**2 * (3 * late - early) / 6
    )[np.ix_(there[1:], there[1:])]
    logarithm = 0.0
    for axis in ("x", "y"):
        values = track[axis][there]
        logarithm += scipy.stats.multivariate_normal.logpdf(
            values[1:], np.full(values.size - 1, values[0]), joint
        )
    used = got["used"].astype(bool)
    assert used.sum() == there.size - 1
    innovations = sum(
        scipy.stats.multivariate_normal.logpdf(e, np.zeros(2), [[xx, xy], [xy, yy]])
        for e, (xx, xy, yy) in zip(got["innovation"][used], got["covariance"][used], strict=True)
    )
    assert innovations == pytest.approx(logarithm, abs=1e-5)


@pytest.mark.false_alarm(2e-3)
def test_whitened_innovations_of_a_linear_world_are_standard_normal(fresh_seed):
    """False alarm in 500; a force too large by a fifth, or 10 % more camera noise, is caught.

    Of the same draws these make the sum of squares 0.901 +- 0.002 and 0.875 +- 0.001 times what it
    is (8 seeds), whatever it is by chance.
    """
    rng = np.random.default_rng(fresh_seed(20))
    count, dt = 6000, 0.1
    root = np.linalg.cholesky(NOISE_INTENSITY * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]]))
    kicks = root @ rng.standard_normal((count, 2, 2))
    velocity = 0.03 * rng.standard_normal(2) + np.cumsum(kicks[:, 1], axis=0)
    before = np.vstack([velocity[:1] - kicks[:1, 1], velocity[:-1]])
    position = np.cumsum(before * dt + kicks[:, 0], axis=0)
    seen = position + POSITION_NOISE * rng.standard_normal(position.shape)
    track = make_track(dt * np.arange(count))
    track["x"], track["y"] = np.ascontiguousarray(seen.T)

    def values(**changes: Any) -> Floats:
        found = free_run(track, sensitivities=True, **changes)
        return found["whitened"].reshape(-1, 2)[found["used"].astype(bool)].ravel()

    whitened = values()
    assert whitened.size == 2 * (count - 1)
    assert scipy.stats.kstest(whitened, "norm").pvalue > 0.001
    low, high = scipy.stats.chi2.ppf([0.0005, 0.9995], whitened.size)
    assert low < np.sum(whitened**2) < high
    for wrong in (
        {"noise_intensity": 1.44 * NOISE_INTENSITY},
        {"position_noise": 1.1 * POSITION_NOISE},
    ):
        assert np.sum(values(**wrong) ** 2) < 0.95 * np.sum(whitened**2)


# --- what it refuses -----------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("time", np.array([0.0, 0.2, 0.2]), "times must increase"),
        ("time", np.array([0.0, 0.2, np.nan]), "times must be finite"),
        ("time", np.array([0.0, 0.2]), "differ in length"),
        ("x", np.array([0.0, np.inf, 0.0]), "positions must be finite"),
        ("theta", np.array([0.0, np.nan, 0.0]), "angles and their rates must be finite"),
        ("coefficients", WAVY[:, :-1], "shape"),
        ("coefficients", WAVY * np.nan, "coefficients must be finite"),
        ("drag_coefficient", 0.0, "drag coefficient must be positive"),
        ("spacing", -1.0, "spacing must be positive"),
        ("noise_intensity", -1.0, "must not be negative"),
        ("position_noise", 0.0, "position noise must be positive"),
        ("largest_step", 0.0, "largest step must be positive"),
        ("longest_gap", np.inf, "longest gap must not be above"),
        ("strips", 0, "at least one strip"),
        ("mass", np.nan, "must be positive"),
        ("orientation", "some", "'given', 'none' or 'state'"),
    ],
)
def test_refuses(name, value, message):
    track = make_track(np.array([0.0, 0.1, 0.2]))
    changes = {} if name in track else {name: value}
    with pytest.raises(ValueError, match=message):
        run_filter(track | ({name: value} if name in track else {}), **changes)


def test_without_an_angle_the_angle_may_be_missing():
    track = make_track(np.arange(30) * 0.1)
    want = run_filter(track, orientation="none")
    track["theta"] = track["omega"] = np.full(30, np.nan)
    got = run_filter(track, orientation="none")
    assert got["innovation"].tobytes() == want["innovation"].tobytes()
    assert got["used"].sum() == 29


def test_a_sample_far_away_does_no_harm():
    """A tracker's slip of kilometres: left out, and the filter goes on behind it."""
    track = make_track(np.arange(60) * 0.1)
    track["x"][30] = 1e300
    got = run_filter(track, sensitivities=True)
    assert np.flatnonzero(got["used"] == 0).tolist() == [0, 30]
    assert np.isfinite(got["jacobian"]).all()
    assert np.isfinite(got["state"]).all()


@pytest.mark.parametrize("orientation", ["given", "state"])
def test_after_a_contact_the_drag_of_the_first_interval_is_made_up_for(orientation):
    """In still water a block that goes face on has dv/dt = -k v^2: x = ln(1 + k v t) / k.

    The sample after the contact says the velocity in the middle of its interval h. Without the drag
    from there on the next error would be k v^2 h^2 / 2, with twice as much of it the opposite.
    """
    h, speed, contact = 0.1, 0.05, 20
    time = h * np.arange(40)
    still = np.zeros_like(WAVY)
    weak = {"drag_coefficient": 0.05}
    moving = np.array([0, 0, speed, 0])
    decay = -mean_drag(still, moving, theta=0.0, omega=0.0, **weak)["acceleration"][0]
    rate = decay / speed**2
    track = {
        "time": time,
        "x": np.log1p(rate * speed * time) / rate - 0.1,
        "y": np.zeros(40),
        "theta": np.zeros(40),
        "omega": np.zeros(40),
        "excluded": (np.arange(40) == contact).astype(np.uint8),
    }
    exact = {"position_noise": 1e-7, "noise_intensity": 1e-8}
    found = run_filter(track, still, orientation=orientation, **exact, **weak)
    error = found["innovation"][contact + 2, 0]
    slower = speed / (1 + rate * speed * time[contact])
    assert abs(error) < 0.05 * rate * slower**2 * h**2 / 2
