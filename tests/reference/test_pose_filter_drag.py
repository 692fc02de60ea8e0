"""Mean drag and torque over an uncertain pose, against the simulator, integrals and differences."""

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
    ORIGIN,
    SPACING,
    WAVY,
    Floats,
    linear_coefficients,
    mean_drag,
    slope,
)
from single_block import INERTIA, model
from uncertain_strips import (
    Block,
    SplineFlow,
    acceleration,
    closing_and_slip,
    moments,
    spreads,
    strips_at,
)

from driftwalk import _core

STATE = np.array([0.021, -0.034, 0.4, 0.045, 0.062, 1.3])
# Position known to 5 mm, angle to 2 degrees, velocity to 2 cm/s and rate to 1.5 rad/s, correlated:
# large, so that every term of the mean counts.
SPREAD = np.array([5e-3, 5e-3, 0.035, 0.02, 0.02, 1.5])
ROOT = np.tril(np.random.default_rng(5).uniform(-0.6, 0.6, (6, 6)), -1) + np.eye(6)
COVARIANCE = SPREAD[:, None] * (ROOT @ ROOT.T) * SPREAD
# Alike in all directions, so that it is the same in the frame of a turned block.
VELOCITY_ONLY = np.diag([0, 0, 0, 4e-4, 4e-4, 2.0])
OWN_BLOCK = Block(**BLOCK)


def pose_drag(
    coefficients: Floats, mean: Floats = STATE, covariance: Floats | None = None, **options: Any
) -> dict[str, Floats]:
    return mean_drag(coefficients, mean, covariance, orientation="state", **options)


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
    for theta in np.linspace(-9, 9, 7):
        state = STATE.copy()
        state[2] = theta
        x, y, _, vx, vy, omega = state
        force = _core.drag(
            simulated, drag_coefficient=0.5, x=x, y=y, theta=theta, vx=vx, vy=vy, omega=omega
        )
        want = np.array(force) / [BLOCK["mass"], BLOCK["mass"], INERTIA]
        got = pose_drag(linear_coefficients(gradient), state, strips=strips)["acceleration"]
        np.testing.assert_allclose(got, want, rtol=1e-10, atol=1e-10 * np.abs(want[2]))


def test_known_pose_and_angle_as_an_input_are_the_same():
    got = pose_drag(WAVY, STATE)
    given = mean_drag(WAVY, np.delete(STATE, [2, 5]), theta=STATE[2], omega=STATE[5])
    np.testing.assert_allclose(got["acceleration"][:2], given["acceleration"], rtol=1e-13)
    for name in ("by_position", "by_velocity"):
        np.testing.assert_allclose(got[name][:2, :2], given[name], rtol=1e-12)
    np.testing.assert_allclose(got["by_coefficients"][:2], given["by_coefficients"], rtol=1e-12)


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("coefficients", [LINEAR, WAVY], ids=["linear", "wavy"])
def test_mean_over_the_covariance_is_the_integral(coefficients):
    """Each strip integrated over its closing speed; the slip given it is linear in it."""
    flow = SplineFlow(coefficients, ORIGIN, SPACING)
    mean = closing_and_slip(OWN_BLOCK, flow, STATE)
    along, across = [], []
    for (s, slip), spread in zip(mean, spreads(OWN_BLOCK, flow, STATE, COVARIANCE), strict=True):
        tau, tilt = np.sqrt(spread[0, 0]), spread[0, 1] / spread[0, 0]

        def forces(speed, s=s, slip=slip, tau=tau, tilt=tilt):
            density = scipy.stats.norm.pdf(speed, s, tau)
            return density * speed * np.array([speed, slip + tilt * (speed - s)])

        top = max(s + 12 * tau, 0.0)
        square, product = scipy.integrate.quad_vec(forces, 0, top, epsrel=1e-12)[0]
        along.append(square)
        across.append(product)
    want = acceleration(
        OWN_BLOCK, strips_at(OWN_BLOCK, STATE[2]), np.array(along), np.array(across), 0.5
    )
    got = pose_drag(coefficients, covariance=COVARIANCE)["acceleration"]
    np.testing.assert_allclose(got, want, rtol=1e-8)
    # The mean is far from the drag of the mean: without the covariance this test would fail.
    assert np.all(np.abs(pose_drag(coefficients)["acceleration"] / want - 1) > 0.02)


@pytest.mark.false_alarm(2e-4)
def test_mean_over_the_covariance_is_the_mean_of_draws(fresh_seed):
    """4 standard errors, and 0.2 % of the force that the uncertain angle turns: one in 5000."""
    draws = np.random.default_rng(fresh_seed(3)).multivariate_normal(STATE, COVARIANCE, 20000)
    values = np.array([pose_drag(LINEAR, draw)["acceleration"] for draw in draws])
    got = pose_drag(LINEAR, covariance=COVARIANCE)["acceleration"]
    error = values.std(axis=0) / np.sqrt(len(values))
    assert np.all(np.abs(got - values.mean(axis=0)) < 4 * error + 0.002 * np.abs(got))
    without = pose_drag(LINEAR)["acceleration"]
    assert np.all(np.abs(without - values.mean(axis=0))[:2] > 20 * error[:2])


def test_derivatives_are_those_of_differences():
    def drag(mean: Floats, coefficients: Floats = WAVY):
        return pose_drag(coefficients, mean, VELOCITY_ONLY)

    got = drag(STATE)
    by_state = slope(lambda s: drag(s)["acceleration"], STATE, 1e-6)
    by_coefficients = slope(
        lambda c: drag(STATE, c.reshape(WAVY.shape))["acceleration"], WAVY.ravel(), 1e-5
    )
    for name, want in (
        ("by_position", by_state[:, :3]),
        ("by_velocity", by_state[:, 3:]),
        ("by_coefficients", by_coefficients.reshape(got["by_coefficients"].shape)),
    ):
        # Row by row: forces and torques are in other units.
        for row, wanted in zip(got[name], want, strict=True):
            np.testing.assert_allclose(row, wanted, rtol=1e-6, atol=2e-7 * np.abs(wanted).max())


def test_derivatives_are_nearly_those_of_differences_in_any_uncertainty():
    """What is left out is that the spreads move with the state.

    At half a millimetre, one degree, 1 cm/s and 0.5 rad/s that is 0.3 % of the derivatives of the
    force, 2 % of those of the torque; at ten times the distance, which no sample leaves, 15 %.
    """
    found = []
    for spread in (np.array([5e-4, 5e-4, 0.017, 0.01, 0.01, 0.5]), SPREAD):
        covariance = spread[:, None] * (ROOT @ ROOT.T) * spread
        got = pose_drag(WAVY, STATE, covariance)
        by_state = slope(lambda s, P=covariance: pose_drag(WAVY, s, P)["acceleration"], STATE, 1e-6)
        mine = np.hstack([got["by_position"], got["by_velocity"]])
        scale = np.abs(by_state).reshape(3, 2, 3).max(axis=2)
        apart = np.abs(mine - by_state).reshape(3, 2, 3).max(axis=2)
        found.append(apart / scale)
    assert found[0][:2].max() < 0.005
    assert found[0][2].max() < 0.03
    assert 0.05 < found[1].max() < 0.2


def test_all_is_proportional_to_the_drag_coefficient():
    """So the derivative by its logarithm is the drag itself."""
    one = pose_drag(WAVY, covariance=COVARIANCE, drag_coefficient=1.0)
    half = pose_drag(WAVY, covariance=COVARIANCE, drag_coefficient=0.5)
    assert set(one) == {"acceleration", "by_position", "by_velocity", "by_coefficients"}
    for name, value in one.items():
        np.testing.assert_allclose(half[name], value / 2, rtol=1e-12, atol=1e-15)


def test_a_quarter_turn_of_the_block_changes_nothing():
    """It is a square."""
    turned = STATE + np.array([0, 0, np.pi / 2, 0, 0, 0])
    base, other = (pose_drag(WAVY, state, COVARIANCE) for state in (STATE, turned))
    for name, value in base.items():
        close = 1e-12 * np.abs(value).max()
        np.testing.assert_allclose(other[name], value, rtol=1e-10, atol=close)


def test_a_turned_world_turns_the_force():
    """Flow, state and covariance turned together: force turns along, torque stays."""
    angle = 0.7
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    both = scipy.linalg.block_diag(turn, 1.0, turn, 1.0)
    state = both @ STATE + np.array([0, 0, angle, 0, 0, 0])
    base = pose_drag(LINEAR, covariance=COVARIANCE)
    other = pose_drag(
        linear_coefficients(turn @ GRADIENT @ turn.T), state, both @ COVARIANCE @ both.T
    )
    three = both[:3, :3]
    want = three @ base["acceleration"]
    np.testing.assert_allclose(other["acceleration"], want, rtol=1e-10)
    for name in ("by_position", "by_velocity"):
        want = three @ base[name] @ three.T
        np.testing.assert_allclose(other[name], want, rtol=1e-9, atol=1e-12 * np.abs(want).max())


@pytest.mark.false_alarm(1e-4)
def test_moments_of_the_oracle_are_those_of_draws(fresh_seed):
    """5 standard errors on each of sixty numbers: a false alarm in 30,000, were they normal."""
    flow = SplineFlow(LINEAR, ORIGIN, SPACING)
    mean = closing_and_slip(OWN_BLOCK, flow, STATE)
    spread = spreads(OWN_BLOCK, flow, STATE, COVARIANCE)
    along, across = moments(mean, spread)
    rng = np.random.default_rng(fresh_seed(9))
    for k in range(mean.shape[0]):
        s, slip = rng.multivariate_normal(mean[k], spread[k], 20000).T
        for want, values in (
            (along[k], np.maximum(s, 0) * s),
            (across[k], np.maximum(s, 0) * slip),
        ):
            error = values.std() / np.sqrt(values.size)
            assert abs(values.mean() - want) < 5 * error + 1e-12


@pytest.mark.parametrize(
    ("mean", "covariance"), [(np.zeros(4), np.eye(4)), (np.zeros(6), np.eye(4))]
)
def test_refuses_a_state_of_another_size(mean, covariance):
    with pytest.raises(ValueError, match="with orientation 'state'"):
        pose_drag(WAVY, mean, covariance)
