"""The native core in double precision against its NumPy twin, and float against double."""

from __future__ import annotations

import numpy as np
import pytest
from single_block import (
    BEYOND_PAPER,
    model,
    numbers_of,
    one_world,
    random_worlds,
    run,
    swirl,
    twin,
    wrapped,
)
from twin.block import drag, simulate_reference

from driftwalk import _core
from driftwalk.core.random_streams import world_keys


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("law", BEYOND_PAPER)
def test_twin_and_double_agree_beyond_the_paper_s_law(law: str) -> None:
    numbers = {**numbers_of(BEYOND_PAPER[law]), "steps_per_interval": 2}
    keys = world_keys(6, trial=0, replicate=np.arange(8))
    worlds = random_worlds(8, seed=4)
    worlds[:2, :2] = [[0.12, 0.03], [-0.02, -0.125]]  # two that start at the wall
    native = model(swirl, times=np.arange(31) * 0.1, friction=0.4, **numbers)
    x, y, theta, status = run(native, worlds, keys=keys)
    path = simulate_reference(
        twin(swirl, friction=0.4, **numbers),
        drag_coefficient=worlds[:, 6],
        force_std=worlds[:, 7],
        key=keys,
        pose=worlds[:, :3].T,
        motion=worlds[:, 3:6].T,
        steps=300,
    )[::10]
    paper = run(model(swirl, times=np.arange(31) * 0.1, friction=0.4), worlds, keys=keys)
    assert not status.any()
    assert np.abs(x - path[:, 0].T).max() < 1e-10
    assert np.abs(y - path[:, 1].T).max() < 1e-10
    assert np.abs(wrapped(theta - path[:, 2].T)).max() < 1e-8
    assert np.abs(x - paper[0])[:, -1].min() > 1e-5, "a world moved as the paper says"


@pytest.mark.slow
@pytest.mark.parametrize("friction", [pytest.param(0.0, marks=pytest.mark.slow), 0.4])
def test_twin_and_double_agree_over_ten_seconds(friction: float) -> None:
    keys = world_keys(5, trial=0, replicate=np.arange(8))
    worlds = random_worlds(8)
    worlds[:2, :2] = [[0.12, 0.03], [-0.02, -0.125]]  # two that start at the wall
    worlds[:2, 2] = [0.4, 1.2]
    native = model(swirl, times=np.arange(101) * 0.1, friction=friction)
    x, y, theta, status = run(native, worlds, keys=keys)
    path = simulate_reference(
        twin(swirl, friction=friction),
        drag_coefficient=worlds[:, 6],
        force_std=worlds[:, 7],
        key=keys,
        pose=worlds[:, :3].T,
        motion=worlds[:, 3:6].T,
        steps=1000,
    )[::10]
    assert not status.any()
    assert np.abs(x - path[:, 0].T).max() < 1e-10
    assert np.abs(y - path[:, 1].T).max() < 1e-10
    assert np.abs(wrapped(theta - path[:, 2].T)).max() < 1e-8
    assert (np.hypot(x, y) > 0.12).any(), "no world came near the wall"


def test_twin_and_core_agree_on_the_drag() -> None:
    native, plain = model(swirl, times=[0.0]), twin(swirl)
    worlds = random_worlds(200, seed=3)
    force_x, force_y, torque, _ = drag(plain, worlds[:, 6], worlds[:, :3].T, worlds[:, 3:6].T)
    for row, expected in zip(worlds, zip(force_x, force_y, torque, strict=True), strict=True):
        got = _core.drag(
            native,
            drag_coefficient=row[6],
            x=row[0],
            y=row[1],
            theta=row[2],
            vx=row[3],
            vy=row[4],
            omega=row[5],
        )
        np.testing.assert_allclose(got, expected, rtol=1e-10, atol=1e-17)


@pytest.mark.parametrize("law", ["paper", *BEYOND_PAPER])
def test_single_precision_stays_with_double_for_a_second(law: str) -> None:
    worlds = random_worlds(200)
    native = model(swirl, times=np.arange(11) * 0.1, **numbers_of(BEYOND_PAPER.get(law, {})))
    single = run(native, worlds, precision="single")
    double = run(native, worlds)
    assert single[0].dtype == np.float32
    assert double[0].dtype == np.float64
    assert np.abs(single[0] - double[0]).max() < 5e-6
    assert np.abs(single[1] - double[1]).max() < 5e-6
    assert np.abs(wrapped(single[2] - double[2])).max() < 5e-4


def test_single_precision_is_not_double() -> None:
    # Were both backends the same code path, the test above could not fail.
    worlds = one_world(0.05, 0.02, 0.3, force=0.5e-3)
    native = model(swirl, times=[0.0, 1.0])
    single, double = run(native, worlds, precision="single"), run(native, worlds)
    assert single[0][0, 1] != double[0][0, 1]
