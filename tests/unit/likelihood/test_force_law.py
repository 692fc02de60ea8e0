"""Derivatives and closed forms of the filter under other force laws."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from driftwalk import _core

SIDE = 0.03
GRID = {"origin_x": -0.1, "origin_y": -0.11, "spacing": 0.02, "columns": 15, "rows": 14}
BLOCK = {"side": SIDE, "mass": 0.0116, "depth": 0.0129, "strips": 8, "water_density": 1000.0}
MEAN = np.array([0.012, -0.007, 0.3, 0.01, 0.02, 0.4])
LAWS: list[dict[str, float]] = [
    {},
    {"water_acceleration": 1.0},
    {"water_spin": 1.0},
    {"quadratic": 0.4, "linear": 0.01, "water_acceleration": 0.7, "water_spin": 0.4},
    {"quadratic": 0.0, "linear": 0.02},
    {"drag_power": 1.0, "water_acceleration": 1.0},
    {"drag_power": 1.6, "drag_speed": 0.01},
]


def response(
    coefficients: np.ndarray, mean: np.ndarray = MEAN, drag: float = 0.5, **law: float
) -> dict[str, Any]:
    covariance = np.diag([0.0, 0.0, 0.0, 1e-5, 1e-5, 1e-2])
    return _core.expected_drag(
        **BLOCK,
        **GRID,
        coefficients=coefficients,
        drag_coefficient=drag,
        orientation="state",
        mean=mean,
        theta=0.0,
        omega=0.0,
        covariance=covariance,
        **law,
    )


def linear_flow(gradient: np.ndarray) -> np.ndarray:
    """Return coefficients of the flow u = gradient (x, y): those of a line are its values."""
    x = GRID["origin_x"] + GRID["spacing"] * (np.arange(GRID["columns"]) - 1.0)
    y = GRID["origin_y"] + GRID["spacing"] * (np.arange(GRID["rows"]) - 1.0)
    place = np.stack(np.meshgrid(x, y))
    return np.ascontiguousarray(np.einsum("ab,bji->aji", gradient, place))


@pytest.mark.parametrize("law", LAWS)
def test_derivatives_are_those_of_differences(law: dict[str, float]) -> None:
    """Central differences at 1e-6: an error of 1e-12 over it, and the third derivative's."""
    coefficients = 0.03 * np.random.default_rng(1).normal(size=(2, GRID["rows"], GRID["columns"]))
    found = response(coefficients, **law)
    for name, first in (("by_position", 0), ("by_velocity", 3)):
        for b in range(3):
            step = np.zeros(6)
            step[first + b] = 1e-6
            above, below = (
                response(coefficients, MEAN + sign * step, **law)["acceleration"]
                for sign in (1, -1)
            )
            size = np.abs(found[name]).max()
            np.testing.assert_allclose(found[name][:, b], (above - below) / 2e-6, atol=1e-6 * size)
    generator = np.random.default_rng(2)
    for _ in range(3):
        step = 1e-6 * generator.normal(size=coefficients.shape)
        above, below = (
            response(coefficients + sign * step, **law)["acceleration"] for sign in (1, -1)
        )
        along = np.einsum("acji,cji->a", found["by_coefficients"], step)
        np.testing.assert_allclose(along, (above - below) / 2, rtol=1e-6)


def test_rigid_rotation_pushes_to_its_centre() -> None:
    """In u = W (-y, x) water moves on circles: Du/Dt = -W^2 (x, y), without curl."""
    flow = linear_flow(1.7 * np.array([[0.0, -1.0], [1.0, 0.0]]))
    push = (
        response(flow, water_acceleration=1.0, water_spin=1.0)["acceleration"]
        - response(flow)["acceleration"]
    )
    np.testing.assert_allclose(push[:2], -(1.7**2) * MEAN[:2], rtol=1e-10)
    assert abs(push[2]) < 1e-9


def test_curl_of_the_acceleration_spins() -> None:
    """With the gradient G, Du/Dt = G^2 x, and half its curl is half the skew part of G^2."""
    gradient = np.array([[0.3, -1.1], [0.8, 0.6]])
    square = gradient @ gradient
    flow = linear_flow(gradient)
    push = (
        response(flow, water_acceleration=1.0, water_spin=1.0)["acceleration"]
        - response(flow)["acceleration"]
    )
    np.testing.assert_allclose(push[:2], square @ MEAN[:2], rtol=1e-10)
    assert push[2] == pytest.approx(0.5 * (square[1, 0] - square[0, 1]), rel=1e-10)


@pytest.mark.parametrize("theta", [0.0, 0.3, 1.1])
def test_the_push_is_the_mean_over_the_block_where_the_flow_bends(theta: float) -> None:
    """Of a quadratic flow Du/Dt is cubic: mean and moment by 20 x 20 Gauss points of the square."""
    bends = np.random.default_rng(5).normal(size=(2, 6)) * np.array([0.03, 1, 1, 30, 30, 30])

    def flow(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.asarray(np.tensordot(bends, np.stack([1 + 0 * x, x, y, x * x, x * y, y * y]), 1))

    # Of a parabola the coefficients are its values less a sixth of the second difference.
    x = GRID["origin_x"] + GRID["spacing"] * (np.arange(GRID["columns"]) - 1.0)
    y = GRID["origin_y"] + GRID["spacing"] * (np.arange(GRID["rows"]) - 1.0)
    shift = GRID["spacing"] ** 2 / 3 * (bends[:, 3] + bends[:, 5])
    coefficients = np.ascontiguousarray(flow(*np.meshgrid(x, y)) - shift[:, None, None])
    places, weights = np.polynomial.legendre.leggauss(20)
    across, along = SIDE / 2 * np.stack(np.meshgrid(places, places))
    arm_x = across * np.cos(theta) - along * np.sin(theta)
    arm_y = across * np.sin(theta) + along * np.cos(theta)
    x, y = MEAN[0] + arm_x, MEAN[1] + arm_y
    u, v = flow(x, y)
    by_x, by_y = (
        np.tensordot(bends, np.stack(slopes), 1)
        for slopes in (
            [0 * x, 1 + 0 * x, 0 * x, 2 * x, y, 0 * x],
            [0 * x, 0 * x, 1 + 0 * x, 0 * x, x, 2 * y],
        )
    )
    water = u * by_x + v * by_y
    weight = np.outer(weights, weights) / 4
    want = [*(weight * water).sum(axis=(1, 2)), 0.0]
    want[2] = 6 / SIDE**2 * float((weight * (arm_x * water[1] - arm_y * water[0])).sum())
    mean = MEAN.copy()
    mean[2] = theta
    push = (
        response(coefficients, mean, water_acceleration=1.0, water_spin=1.0)["acceleration"]
        - response(coefficients, mean)["acceleration"]
    )
    np.testing.assert_allclose(push, want, rtol=1e-8)


def test_linear_drag_is_that_of_all_strips() -> None:
    """Still water, known velocity: -K b 4 N v, whatever the angle."""
    still = np.zeros((2, GRID["rows"], GRID["columns"]))
    found = response(still, quadratic=0.0, linear=0.02)["acceleration"]
    strip = 0.5 * 1000.0 * 0.5 * (SIDE / 8) * BLOCK["depth"] / BLOCK["mass"]
    np.testing.assert_allclose(found[:2], -strip * 0.02 * 32 * MEAN[3:5], rtol=1e-12)


@pytest.mark.parametrize("power", [1.0, 1.5, 2.5])
@pytest.mark.parametrize("speed", [0.0, 0.004, 0.02, 0.05])
def test_a_power_of_the_speed_has_nearly_the_mean_drag(power: float, speed: float) -> None:
    """The velocity is known to 4 mm/s, in still water; the mean by Gauss and Hermite.

    The factor of the power is right to the second order in the velocity, and where its mean is
    nearly zero; in between the mean drag is off by less than 0.8 %.
    """
    std = 4e-3
    nodes, weights = np.polynomial.hermite_e.hermegauss(80)
    vx, vy = np.meshgrid(speed + std * nodes, 0.3 * speed + std * nodes)
    weight = np.outer(weights, weights) / weights.sum() ** 2
    size = np.hypot(vx, vy)
    strip = 0.5 * 1000.0 * 0.5 * (SIDE / 8) * BLOCK["depth"] / BLOCK["mass"]
    # All strips of a face move alike: eight times the law, on the faces that meet the water.
    law = 8 * strip * (np.abs(vx) + np.abs(vy)) * (size / 0.03) ** (power - 2.0)
    found = _core.expected_drag(
        **BLOCK,
        **GRID,
        coefficients=np.zeros((2, GRID["rows"], GRID["columns"])),
        drag_coefficient=0.5,
        orientation="state",
        mean=np.array([0.0, 0.0, 0.0, speed, 0.3 * speed, 0.0]),
        theta=0.0,
        omega=0.0,
        covariance=np.diag([0.0, 0.0, 0.0, std**2, std**2, 0.0]),
        drag_power=power,
    )["acceleration"]
    want = -np.array([(weight * law * vx).sum(), (weight * law * vy).sum()])
    largest = 8 * strip * np.hypot(speed, std) ** power * 0.03 ** (2.0 - power)
    np.testing.assert_allclose(found[:2], want, atol=0.01 * largest)


def test_linear_drag_goes_with_the_power_two_alone() -> None:
    flow = np.zeros((2, GRID["rows"], GRID["columns"]))
    with pytest.raises(ValueError, match="linear drag goes with the power 2 alone"):
        response(flow, linear=0.01, drag_power=1.5)


def innovations(memory: float, seconds: float = 2.0) -> dict[str, Any]:
    """Run over a block that drifts in still water, nearly without drag."""
    time = np.linspace(0.0, seconds, 21)
    at = np.stack([0.01 + 0.002 * np.sin(3.0 * time), 0.003 * time, 0.0 * time])
    still = np.zeros((2, GRID["rows"], GRID["columns"]))
    track = _core.InnovationsFilter(
        time,
        *at,
        0.0 * time,
        np.zeros(time.size, np.uint8),
        **BLOCK,
        **GRID,
        coefficients=still,
        drag_coefficient=1e-9,
        noise_intensity=3e-5,
        position_noise=3e-4,
        force_memory=memory,
    )
    return dict(track.run(time.size))


def test_memory_has_the_covariance_of_a_linear_filter() -> None:
    """Without drag the filter is linear: its covariances are those of a matrix exponential."""
    memory, q, dt = 0.25, 3e-5, 0.1
    drift = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0 / memory]])
    noise = np.diag([0.0, 0.0, q / memory**2])
    # Van Loan: the exponential of both together holds the transition and the noise of a step.
    both = expm(dt * np.block([[-drift, noise], [np.zeros((3, 3)), drift.T]]))
    step = both[3:, 3:].T
    added = step @ both[:3, 3:]
    covariance = np.diag([9e-8, 0.01, q / (2.0 * memory)])
    want = []
    for _ in range(20):
        covariance = step @ covariance @ step.T + added
        spread = covariance[0, 0] + 9e-8
        want.append(spread)
        gain = covariance[:, 0] / spread
        covariance = covariance - np.outer(gain, covariance[0])
    found = innovations(memory)["covariance"][1:, 0]
    np.testing.assert_allclose(found, want, rtol=2e-6)


def test_without_memory_is_its_limit() -> None:
    white, short = innovations(0.0), innovations(1e-5)
    np.testing.assert_allclose(short["covariance"][1:], white["covariance"][1:], rtol=2e-4)
    np.testing.assert_allclose(short["innovation"][1:], white["innovation"][1:], atol=1e-7)
