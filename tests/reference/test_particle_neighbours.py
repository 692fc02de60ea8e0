"""Other bodies that push a self-propelled particle off, against closed forms.

On the line through a body that stands still, a particle of the speed v has

    dr/dt = v (e + p exp(-r / R)),   e = 1 away from it and -1 towards it,

so y = exp(r / R) solves dy/dt = v (e y + p) / R. Steps of dt = 1 ms are of first order in v dt / R.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from particle_paths import Floats, paths

from driftwalk.motion.family.columns import ParticleTable, State, switching_table

SPEED, RANGE, STEP = 0.05, 0.04, 1e-3
TIME = np.arange(0.0, 4.0, 0.25)
Seed = Callable[[int], int]


def pushed(push: float, *, speed: float = SPEED) -> ParticleTable:
    return switching_table(
        [State(speed)], {"neighbour_push": push, "neighbour_range": RANGE}, worlds=1
    )


def standing(*places: complex) -> Floats:
    """Return bodies that stand still from the first step on."""
    return np.array([[[one.real, one.imag] for one in places]])


@pytest.mark.parametrize("push", [0.4, 1.0, 2.5])
@pytest.mark.parametrize("turned", [0.0, 0.7, 2.9])
@pytest.mark.parametrize("precision", ["single", "double"])
def test_away_from_a_body_it_is_faster_as_the_formula(
    push: float, turned: float, precision: str
) -> None:
    first, here = 0.02, 0.01 - 0.03j
    direction = np.exp(1j * turned)
    z, _ = paths(
        pushed(push), TIME, time_step=STEP, start=here + first * direction, heading=turned,
        others=standing(here), precision=precision,
    )  # fmt: skip
    grown = (np.exp(first / RANGE) + push) * np.exp(SPEED * TIME / RANGE) - push
    expected = RANGE * np.log(grown)
    assert expected[-1] - first > SPEED * TIME[-1] + 0.2 * RANGE * push, "the push is no part of it"
    along = (z[0] - here) / direction
    np.testing.assert_allclose(along, expected, atol=3 * SPEED * STEP)


@pytest.mark.parametrize("push", [2.0, 4.0])
def test_towards_a_body_it_comes_to_where_the_push_is_as_fast(push: float) -> None:
    first = 0.12
    z, _ = paths(
        pushed(push), TIME, time_step=STEP, start=first, heading=np.pi, others=standing(0j),
        precision="double",
    )  # fmt: skip
    y = push + (np.exp(first / RANGE) - push) * np.exp(-SPEED * TIME / RANGE)
    np.testing.assert_allclose(z[0], RANGE * np.log(y), atol=3 * SPEED * STEP)


def test_at_rest_it_is_not_pushed() -> None:
    z, _ = paths(pushed(3.0, speed=0.0), TIME, start=0.01, others=standing(0j))
    assert (z[0] == z[0, 0]).all()


def test_two_bodies_on_either_side_push_with_equal_force() -> None:
    z, _ = paths(pushed(2.0), [2.0], others=standing(0.03j, -0.03j), precision="double")
    single, _ = paths(pushed(2.0), [2.0], others=standing(0.03j), precision="double")
    assert abs(z[0, 0].imag) < 1e-15
    assert single[0, 0].imag < -0.01


def test_a_body_that_is_not_there_pushes_nobody() -> None:
    gone = np.full((1, 1, 2), np.nan)
    z, _ = paths(pushed(2.0), TIME, start=0.01, others=gone, precision="double")
    alone, _ = paths(pushed(2.0), TIME, start=0.01, precision="double")
    np.testing.assert_array_equal(z, alone)


def test_a_body_is_felt_where_it_is_at_the_time() -> None:
    # It passes at 2 s, in one step of 1 ms: one step of the push, at that place.
    others = np.full((4000, 1, 2), np.nan)
    others[2000] = [SPEED * 2.0, -0.01]
    z, _ = paths(
        pushed(2.0), [1.999, 2.002, 3.0], time_step=STEP, others=others, precision="double"
    )
    push = 2.0 * np.exp(-0.01 / RANGE) * SPEED * STEP
    np.testing.assert_allclose(z[0].imag, [0.0, push, push], atol=1e-9)


def test_bodies_push_nobody_who_has_no_push() -> None:
    plain = switching_table([State(SPEED)], {}, worlds=1)
    z, _ = paths(plain, TIME, others=standing(0.01j))
    alone, _ = paths(plain, TIME)
    np.testing.assert_array_equal(z, alone)
