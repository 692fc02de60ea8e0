"""The particle filter: how particles are drawn, and what they begin with."""

from __future__ import annotations

import numpy as np
import pytest

from driftwalk.core.random_streams import world_keys
from driftwalk.likelihood.contacts.particles import (
    _propagated,
    _resampled,
    _with_short_force_interval,
    filtered_covariance,
)
from driftwalk.model import Study, apply_overrides
from driftwalk.schema import build_flow_field
from driftwalk.simulation.backend import Camera, native_model


def test_particles_are_drawn_by_their_weights() -> None:
    weight = np.array([[0.0, 3.0, 1.0, 0.0], [1.0, 1.0, 1.0, 1.0]])
    state = [np.array([[0.0, 1.0, 2.0, 3.0], [4.0, 5.0, 6.0, 7.0]])]
    (drawn,) = _resampled(state, weight, np.array([[0.5], [0.5]]))
    assert drawn.tolist() == [[1.0, 1.0, 1.0, 2.0], [4.0, 5.0, 6.0, 7.0]]


def test_what_is_known_of_a_state_is_a_steady_filter() -> None:
    """The Riccati equation of a steady state, held to scipy's solution."""
    from scipy.linalg import solve_discrete_are

    noise, q, dt = 3e-4, 4e-5, 0.1
    moved = np.array([[1.0, dt], [0.0, 1.0]])
    added = q * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
    predicted = solve_discrete_are(moved.T, np.array([[1.0], [0.0]]), added, noise**2)
    gain = predicted[:, 0] / (predicted[0, 0] + noise**2)
    want = predicted - np.outer(gain, predicted[0])
    np.testing.assert_allclose(filtered_covariance(noise, q, dt), want, rtol=1e-4)


@pytest.mark.parametrize("rate", [10.0, 120.0, 500.0])
def test_the_force_is_as_strong_whatever_the_rate_of_the_camera(rate: float) -> None:
    """The spread of the positions one interval after rest, in still water: sd² = q t³ / 3."""
    interval = 1.0 / rate
    forces = {"forces.force_interval_s": 0.016, "forces.force_std_N": 1e-3}
    study = _with_short_force_interval(apply_overrides(Study(), forces), interval)
    axis = np.linspace(-0.15, 0.15, 11)
    x, _ = np.meshgrid(axis, axis)
    still = build_flow_field(axis, axis, u=0 * x, v=0 * x, flag=np.ones(x.shape, dtype=np.int8))
    step, count = study.time_step_s, 4000
    model = native_model(study, still, np.array([interval, interval + step]), Camera())
    state = [np.zeros((1, count)) for _ in range(6)]
    keys = world_keys(0, trial=0, replicate=np.arange(count))
    moved = _propagated(model, study, state, keys, step)
    pose, motion = moved[:3], moved[3:]
    intensity = (1e-3 / study.block.mass_kg) ** 2 * 0.016
    # Two held draws in place of white noise: (4 + 1) / 16 in place of 1 / 3, and the rate is
    # that of the step after the sample.
    assert pose[0].std() == pytest.approx(np.sqrt(intensity * interval**3 / 3.0), rel=0.1)
    assert motion[0].std() == pytest.approx(np.sqrt(intensity * interval), rel=0.15)
