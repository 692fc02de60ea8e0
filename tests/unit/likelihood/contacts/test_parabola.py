"""Estimates of the wall from a parabola through the likely walls."""

from __future__ import annotations

import numpy as np
import pytest

from driftwalk.likelihood.contacts.estimate import Wall, answer, is_undetermined


def test_a_parabola_gives_its_top_and_its_width() -> None:
    """Without scatter the answer is that of the normal law; friction is e / (1 - e) of its hold."""
    walls = [
        Wall(e, hold, -0.5 * ((e - 0.6) / 0.1) ** 2 - 0.5 * ((hold - 0.2) / 0.04) ** 2)
        for e in np.linspace(0.0, 1.0, 9)
        for hold in np.linspace(0.05, 0.35, 7)
    ]
    found = answer(walls, 0.9)
    assert float(found["wall_restitution"][1]) == pytest.approx(0.6)
    np.testing.assert_allclose(
        found["wall_restitution_interval"][1], 0.6 + np.array([-1, 1]) * 1.644854 * 0.1, rtol=1e-6
    )
    hold = 0.2 + np.array([-1, 1]) * 1.644854 * 0.04
    np.testing.assert_allclose(found["wall_friction_interval"][1], hold / (1 - hold), rtol=1e-6)
    assert float(found["wall_friction"][1]) == pytest.approx(0.25)
    assert not is_undetermined(found)


def test_walls_that_are_all_alike_are_no_answer() -> None:
    """A block that passes along the wall and never touches it."""
    walls = [Wall(e, hold, -79.0) for e in np.linspace(0, 1, 5) for hold in np.linspace(0, 0.6, 5)]
    assert is_undetermined(answer(walls, 0.9))
