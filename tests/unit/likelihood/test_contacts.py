"""Restitution and friction of the wall from contacts, on simulated walls that are known."""

from __future__ import annotations

import numpy as np
import pytest
from fit_worlds import coarse_study, driven, fitted, recording

import driftwalk as dw
from driftwalk.conditions import estimated_study
from driftwalk.likelihood import estimate_wall
from driftwalk.likelihood.contacts import _answer, _drawn, _known, _Wall
from driftwalk.model import apply_overrides


@pytest.mark.slow
def test_the_wall_of_a_simulation_is_found() -> None:
    """Intervals of 99.9 %: each misses once in a thousand; the seeds are fixed."""
    restitution, friction = 0.8, 0.3
    wall = {"tank.wall_restitution": restitution, "tank.wall_friction": friction}
    track = driven(3, 600.0, wall)
    study = apply_overrides(coarse_study(), {"fit.confidence": 0.999})
    found = estimate_wall(dw.fit_motion(track, study), [track])
    assert int(found["wall_contacts"]) > 50
    for name, true, width in (
        ("wall_restitution", restitution, 0.4),
        ("wall_friction", friction, 0.15),
    ):
        low, high = found[f"{name}_interval"].values
        assert low <= true <= high
        assert high - low < width
    tank = estimated_study(found).tank
    assert tank.wall_friction == float(found["wall_friction"])
    assert tank.wall_restitution == float(found["wall_restitution"])


def test_a_recording_with_few_contacts_says_nothing_of_the_wall() -> None:
    found = estimate_wall(fitted(60.0), [recording(60.0)])
    assert int(found["wall_contacts"]) < 8
    assert "wall_friction" not in found
    assert estimated_study(found).tank.wall_friction == 0.0


def test_a_parabola_gives_its_top_and_its_width() -> None:
    """Without scatter the answer is that of the normal law; friction is e / (1 - e) of its hold."""
    walls = [
        _Wall(e, hold, -0.5 * ((e - 0.6) / 0.1) ** 2 - 0.5 * ((hold - 0.2) / 0.04) ** 2)
        for e in np.linspace(0.0, 1.0, 9)
        for hold in np.linspace(0.05, 0.35, 7)
    ]
    found = _answer(walls, 0.9)
    assert float(found["wall_restitution"][1]) == pytest.approx(0.6)
    np.testing.assert_allclose(
        found["wall_restitution_interval"][1], 0.6 + np.array([-1, 1]) * 1.644854 * 0.1, rtol=1e-6
    )
    hold = 0.2 + np.array([-1, 1]) * 1.644854 * 0.04
    np.testing.assert_allclose(found["wall_friction_interval"][1], hold / (1 - hold), rtol=1e-6)
    assert float(found["wall_friction"][1]) == pytest.approx(0.25)


def test_particles_are_drawn_by_their_weights() -> None:
    weight = np.array([[0.0, 3.0, 1.0, 0.0], [1.0, 1.0, 1.0, 1.0]])
    state = [np.array([[0.0, 1.0, 2.0, 3.0], [4.0, 5.0, 6.0, 7.0]])]
    (drawn,) = _drawn(state, weight, np.array([[0.5], [0.5]]))
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
    np.testing.assert_allclose(_known(noise, q, dt), want, rtol=1e-4)
