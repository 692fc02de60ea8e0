"""What must hold for any pose, motion, wall and flow."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from single_block import (
    INERTIA,
    MASS,
    corner_positions,
    model,
    one_world,
    run,
    still,
)

from driftwalk import _core
from driftwalk.core.random_streams import world_keys
from driftwalk.model import Tank
from driftwalk.simulation.backend import wall_edges

TANKS = {
    "circle": Tank(diameter_m=0.3),
    "small circle": Tank(diameter_m=0.06),
    "rectangle": Tank(shape="rectangle", width_m=0.2, height_m=0.1),
    "triangle": Tank(shape="polygon", vertices_m=((-0.1, -0.06), (0.14, -0.06), (-0.02, 0.12))),
    "hexagon": Tank(
        shape="polygon",
        vertices_m=tuple((0.1 * np.cos(a), 0.1 * np.sin(a)) for a in np.arange(6) * np.pi / 3),
    ),
}
speeds = st.floats(-0.3, 0.3)
angles = st.floats(-np.pi, np.pi)
shares = st.floats(0.0, 1.0)


def _outside(tank: Tank, x, y, theta) -> float:
    corner_x, corner_y = corner_positions(x, y, theta)
    if tank.radius_m is not None:
        return float(np.hypot(corner_x, corner_y).max() - tank.radius_m)
    return max(float((corner_x * a + corner_y * b - d).max()) for a, b, d in wall_edges(tank))


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(
    tank=st.sampled_from(sorted(TANKS)),
    where=st.tuples(shares, angles),
    theta=angles,
    motion=st.tuples(speeds, speeds, st.floats(-10, 10)),
    restitution=shares,
    friction=st.floats(0.0, 2.0),
)
def test_a_wall_gives_no_energy_and_keeps_the_block_inside(
    tank, where, theta, motion, restitution, friction
) -> None:
    # Without drag and force the energy is kept but for the wall: the path between impacts is a
    # straight line, so the velocity is the difference of the samples one step apart.
    arena, step = TANKS[tank], 0.005
    reach = (arena.radius_m or 0.1) - 0.022
    x, y = (max(reach, 0.0) * where[0] * f(where[1]) for f in (np.cos, np.sin))
    if not arena.contains(x, y):
        x, y = 0.0, 0.0
    native = model(
        still,
        times=np.arange(201) * step,
        radius=arena.radius_m or 0.0,
        edges=wall_edges(arena),
        restitution=restitution,
        friction=friction,
        time_step=step,
    )
    px, py, angle, status = run(native, one_world(x, y, theta, *motion, drag=0.0))
    assert not status[0] & 3
    # The start itself may have been pushed in by a wall; a corner never stays outside. The smallest
    # arenas can hold a fast corner only once it has been pushed at all of the walls around it.
    assert _outside(arena, px[0, 1:], py[0, 1:], angle[0, 1:]) < (5e-4 if "small" in tank else 1e-6)
    turn = np.remainder(np.diff(angle[0]) + np.pi, 2 * np.pi) - np.pi
    impact = np.hypot(np.diff(px[0], 2), np.diff(py[0], 2)) > 1e-12
    clear = ~np.append(False, impact) & ~np.append(impact, False)
    speed = np.hypot(np.diff(px[0]), np.diff(py[0])) / step
    energy = (0.5 * MASS * speed**2 + 0.5 * INERTIA * (turn / step) ** 2)[clear]
    first = 0.5 * MASS * (motion[0] ** 2 + motion[1] ** 2) + 0.5 * INERTIA * motion[2] ** 2
    assert (np.diff(energy) <= 1e-9 * first + 1e-18).all()
    assert (energy <= first * (1 + 1e-9) + 1e-18).all()


@settings(max_examples=100, deadline=None)
@given(
    pose=st.tuples(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), angles),
    motion=st.tuples(speeds, speeds, st.floats(-10, 10)),
    drag_coefficient=st.floats(0.0, 4.0),
    strips=st.integers(1, 64),
)
def test_drag_in_still_water_takes_energy(pose, motion, drag_coefficient, strips) -> None:
    force_x, force_y, torque = _core.drag(
        model(times=[0.0], strips=strips),
        drag_coefficient=drag_coefficient,
        x=pose[0],
        y=pose[1],
        theta=pose[2],
        vx=motion[0],
        vy=motion[1],
        omega=motion[2],
    )
    assert force_x * motion[0] + force_y * motion[1] + torque * motion[2] <= 1e-15


@settings(max_examples=60, deadline=None)
@given(
    pose=st.tuples(st.floats(-0.08, 0.08), st.floats(-0.08, 0.08), angles),
    motion=st.tuples(speeds, speeds, st.floats(-5, 5)),
    quarter=st.integers(1, 3),
)
def test_a_square_block_looks_the_same_after_a_quarter_turn(pose, motion, quarter) -> None:
    def feel(turned: float):
        return np.array(
            _core.drag(
                model(lambda x, y: (-0.31 * y, 0.155 * x), times=[0.0]),
                drag_coefficient=1.0,
                x=pose[0],
                y=pose[1],
                theta=pose[2] + turned,
                vx=motion[0],
                vy=motion[1],
                omega=motion[2],
            )
        )

    np.testing.assert_allclose(feel(quarter * np.pi / 2), feel(0.0), rtol=1e-9, atol=1e-14)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**63 - 1), trial=st.integers(0, 2**50), replicate=st.integers(0, 2**40))
def test_keys_are_functions_of_their_address(seed: int, trial: int, replicate: int) -> None:
    alone = world_keys(seed, trial=trial, replicate=replicate)
    batch = world_keys(seed, trial=[[trial], [trial + 1]], replicate=[[replicate, replicate + 1]])
    assert alone[0] == batch[0]
    assert len(set(batch.tolist())) == 4


@settings(max_examples=40, deadline=None)
@given(
    times=st.lists(st.floats(0.0, 3.0), min_size=1, max_size=12, unique=True),
    precision=st.sampled_from(["single", "double"]),
)
def test_any_sampling_times_give_the_same_path(times, precision) -> None:
    world = one_world(0.04, 0.0, 0.3, 0.05, 0.02, 1.0, force=1e-3)
    flow = lambda x, y: (-0.31 * y, 0.31 * x)  # noqa: E731
    every = np.arange(301) * 0.01
    at = np.sort(times)
    at = at[np.append(True, np.diff(at) > 0)]
    x = run(model(flow, times=at), world, precision=precision)[0][0]
    dense = run(model(flow, times=every), world, precision=precision)[0][0]
    np.testing.assert_allclose(x, np.interp(at, every, dense), atol=1e-7)
