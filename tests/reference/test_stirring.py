"""The stochastic force as a field: its correlation at two places, its limits, and hidden drag."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from kernel_worlds import SETTINGS, assemble, keys
from single_block import INERTIA, MASS, SIDE, Floats, model

import driftwalk as dw
from driftwalk import _core
from driftwalk.model.rigid_bodies import Measures, rigid_body

WORLDS = 20_000
FORCE, STEP = 1e-3, 0.01
# Standard errors that a correlation may be off. With 20 correlations in a test and 6 tests, one of
# them fails by chance once in 5,000 runs.
SIGMAS = 5.2


def still_water() -> _core.Model:
    """Return a tank far away, without flow or drag."""
    return model(times=[0.0], radius=5.0, nodes=np.arange(-1, 2) * 5.0)


def forces(places: Floats, *, seed: int = 1, **stirring: Any) -> Floats:
    """Return the forces on free blocks at rest in one interval, in sigma_F, (worlds, blocks, 2)."""
    start = np.zeros((WORLDS, len(places), 3))
    start[:, :, :2] = places
    run = assemble(
        still_water(), start, keys(WORLDS, seed), steps=1, force=FORCE, drag=0.0, latching="none",
        precision="double", **stirring,
    )  # fmt: skip
    moved = run["pose"][:, :, :2] - start[:, :, :2]
    # From rest, x = F / m dt² / 2 after one step of the integrator.
    return np.asarray(moved * 2.0 * MASS / STEP**2 / FORCE)


def correlation(places: Floats, length: float, *, incompressible: bool) -> Floats:
    """Return the correlation of all components, (2 n, 2 n), x before y: the kernel on paper."""
    x, y = (places[:, None, k] - places[None, :, k] for k in (0, 1))
    rho = np.exp(-(x**2 + y**2) / (2.0 * length**2))
    if not incompressible:
        return np.block([[rho, 0.0 * rho], [0.0 * rho, rho]])
    # Of a stream function with this correlation: (d/dy, -d/dx) of it, in units of its own spread.
    across = rho * x * y / length**2
    return np.block(
        [[rho * (1.0 - y**2 / length**2), across], [across, rho * (1.0 - x**2 / length**2)]]
    )


def ring(count: int, spacing: float) -> Floats:
    """Return places on a spiral, no two nearer than a spacing."""
    turn = 2.4 * np.arange(count)
    return spacing * np.sqrt(np.arange(count) + 0.5)[:, None] * np.stack(
        [np.cos(turn), np.sin(turn)], axis=1
    )  # fmt: skip


@pytest.mark.false_alarm(2e-4)
@pytest.mark.parametrize("count", [4, 8, 10])
@pytest.mark.parametrize("incompressible", [False, True])
def test_forces_have_the_correlation_of_the_kernel(
    count: int, incompressible: bool, fresh_seed: Any
) -> None:
    """Up to eight blocks by a Cholesky factor, more by the field: within 0.5 % of the kernel."""
    places, length = ring(count, 0.045), 0.06
    found = forces(
        places, seed=fresh_seed(1), stirring_length=length, incompressible=incompressible
    )
    columns = np.concatenate([found[..., 0], found[..., 1]], axis=1)
    expected = correlation(places, length, incompressible=incompressible)
    error = np.sqrt((1.0 + expected**2) / WORLDS)
    off = columns.T @ columns / WORLDS - expected
    assert np.abs(off / (SIGMAS * error + (0.012 if count > 8 else 1e-6))).max() < 1.0


def test_a_length_far_below_the_distance_gives_the_bits_of_none() -> None:
    places = ring(6, 0.05)
    alone, shared = forces(places), forces(places, stirring_length=1e-4)
    np.testing.assert_array_equal(shared, alone)


@pytest.mark.parametrize("count", [2, pytest.param(12, marks=pytest.mark.slow)])
def test_free_blocks_keep_their_distances_where_the_length_is_huge(count: int) -> None:
    places = ring(count, 0.06)
    found = forces(places, stirring_length=100.0)
    spread = np.abs(found - found.mean(axis=1, keepdims=True))
    assert spread.max() < 0.02 * np.abs(found).max()


def stream(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Return a flow that shears and turns."""
    return 0.05 + 0.0 * y, 0.2 * x


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_hidden_faces_feel_their_share(share: float) -> None:
    """Two blocks that latch in the first step move as the glued body of the one-body kernel."""
    native = model(
        lambda x, y: (0.05 + 0.0 * x, 0.2 * x),
        times=[0.0],
        radius=5.0,
        nodes=np.arange(-4, 5) * 0.5,
    )
    start = np.array([[[0.0, 0.0, 0.4], [SIDE * np.cos(0.4), SIDE * np.sin(0.4), 0.4]]])
    steps = 400
    pair = assemble(
        native, start, keys(1), steps=steps, sample_every=1, precision="double",
        latching="collision", hidden_face_drag=share,
    )  # fmt: skip
    poses = pair["sample_pose"][0]
    body = rigid_body("xx", Measures(SIDE, hidden_share=share))
    glued = model(
        stream, times=STEP * np.arange(steps), radius=5.0,
        nodes=np.arange(-4, 5) * 0.5, mass=2 * MASS,
        inertia=2 * MASS * body.moment_m2, **body.arrays(),
    )  # fmt: skip
    # The glued body begins where the pair is after its first step, with the same velocity.
    middle, first = poses.mean(axis=1), 2
    velocity = (middle[first + 1] - middle[first - 1]) / (2 * STEP)
    state = [*middle[first], *velocity, 0.45, 0.0]
    x, y, theta, _ = _core.simulate(
        glued, np.array([state]), keys(1), threads=1, precision="double"
    )  # fmt: skip
    count = steps - first
    assert np.abs(x[0, :count] - middle[first:-1][:count, 0]).max() < 2e-4
    assert np.abs(y[0, :count] - middle[first:-1][:count, 1]).max() < 2e-4
    assert np.abs(theta[0, :count] - middle[first:-1][:count, 2]).max() < 2e-2


def test_a_single_block_moves_as_without_stirring() -> None:
    study = dw.Study(forces={"stirring_length_m": 0.05, "stirring": "incompressible"})
    one, other = (dw.simulate(s, dw.tank30_flow()) for s in (study, dw.Study()))
    np.testing.assert_array_equal(one["x"].values, other["x"].values)
    assert SETTINGS["stirring_length"] == 0.0
    assert pytest.approx(MASS * SIDE**2 / 6.0) == INERTIA
