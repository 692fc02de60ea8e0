"""The NumPy twin of the self-assembly kernel against closed forms and conservation laws."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import single_block
from scipy.spatial import ConvexHull
from twin.assembly import (
    World,
    advance,
    assemble_reference,
    block_normals,
    drag_sums,
    integrate,
)
from twin.block import TwinModel, flow_at, simulate_reference
from twin.body import Assembly, Shape, single_block as one_block
from twin.contacts import Pair, collide, contact_points, overlap, separate
from twin.latch import Latch, candidates, laid_together, latch_once, merged
from twin.wall import meet_wall
from twin_assembly import (
    MASS,
    RECTANGLE,
    SIDE,
    SQUARE,
    Floats,
    energy,
    laid,
    momentum,
    rigid,
    rules,
    study,
    swirl,
    world,
)

import driftwalk as dw
from driftwalk import _core
from driftwalk.core.errors import InputError

HALF = SIDE / 2
DIMER, LINE, CORNER = [[0, 0], [1, 0]], [[0, 0], [1, 0], [2, 0]], [[0, 0], [1, 0], [0, 1]]
SHAPES = ([[0, 0]], DIMER, LINE, CORNER)
LAID = ([[0.0, 0.0, 0.0]], [[-0.015, 0.0, 0.0], [0.015, 0.0, 1.5]])
BOTH_SHAPES = pytest.mark.parametrize("shape", [SQUARE, RECTANGLE], ids=["square", "rectangle"])
PLAIN: dict[str, Any] = {
    "connector_distance": 2e-3,
    "connector_axis": 0.2,
    "block_restitution": 0.5,
    "block_friction": 0.3,
}


def corners_of(body: Assembly) -> Floats:
    length, width = body.shape.side, body.shape.width or body.shape.side
    arms = np.array([length + 1j * width, -length + 1j * width]) / 2
    z = np.concatenate([
        complex(x, y) + np.exp(1j * (body.pose[2] + turn)) * np.array([*arms, *-arms])
        for (x, y), turn in zip(body.centres(), body.turns, strict=True)
    ])  # fmt: skip
    return np.column_stack([z.real, z.imag])


def pair_of(first: Assembly, second: Assembly) -> Pair:
    return Pair((first, second), (first.blocks[0], second.blocks[0]))


def depth_by_hull(first: Floats, second: Floats) -> float:
    """Depth of the overlap of two convex shapes: how far the origin is inside their difference."""
    differences = (second[:, None] - first[None]).reshape(-1, 2)
    return float(-ConvexHull(differences).equations[:, 2].max())


def random_overlap(rng: np.random.Generator, shape: Shape = SQUARE) -> tuple[Assembly, Assembly]:
    """Two assemblies in motion whose first blocks overlap by a tenth of a side at most."""
    sizes = rng.integers(len(SHAPES) if shape.on_lattice else len(LAID), size=2)
    bodies = []
    for k, size in enumerate(sizes):
        pose, motion = rng.uniform(-3, 3, 3), rng.uniform(-1, 1, 3) * [0.1, 0.1, 3.0]
        make, places = (rigid, SHAPES) if shape.on_lattice else (laid, LAID)
        bodies.append(make(10 * k, places[size], pose, motion))
    # From far apart along a random line, so far that they overlap by the wanted depth.
    angle, wanted = rng.uniform(0, 2 * np.pi), rng.uniform(1e-5, 0.1 * SIDE)
    apart, closer = float(np.hypot(*(2 * shape.half))), 0.0
    for _ in range(25):
        middle = (apart + closer) / 2
        shift = middle * np.array([np.cos(angle), np.sin(angle)])
        bodies[1].pose[:2] += bodies[0].centres()[0] + shift - bodies[1].centres()[0]
        if overlap(pair_of(*bodies)).depth > wanted:
            closer = middle
        else:
            apart = middle
    return bodies[0], bodies[1]


# --- one block ------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_one_block_is_the_one_block_twin(friction: float) -> None:
    model = study(0.16, tank={"wall_friction": friction})
    flow = swirl(model)
    start, key, steps = [0.055, 0.01, 0.7], 0x123456789ABCDEF0, 400
    run = assemble_reference(
        model, flow, start=[start], key=key, drag_coefficient=0.45, force_std=0.8e-3, steps=steps,
        latching="collision", hidden_face_drag="none", sample_every=1, **PLAIN,
    )  # fmt: skip
    twin = single_block.twin(
        radius=0.08, friction=friction, flow_x=flow["x"].values, flow_y=flow["y"].values,
        flow_u=flow["u"].values, flow_v=flow["v"].values,
        velocity=single_block.still,
    )  # fmt: skip
    path = simulate_reference(
        twin,
        drag_coefficient=np.array([0.45]),
        force_std=np.array([0.8e-3]),
        key=np.array([key], dtype=np.uint64),
        pose=np.array(start)[:, None],
        motion=np.zeros((3, 1)),
        steps=steps,
    )
    np.testing.assert_allclose(run["pose"][0], path[-1, :, 0], rtol=0, atol=1e-12)
    np.testing.assert_array_equal(run["sample_pose"][:, 0], path[:, :, 0].astype(np.float32))
    reach = np.hypot(path[:, 0, 0], path[:, 1, 0]).max()
    assert reach > 0.08 - SIDE / np.sqrt(2), "the block never came near the wall"
    assert run["end_step"] == steps
    assert run["event_step"].tolist() == [-1]


def test_every_block_has_random_numbers_of_its_own() -> None:
    key, interval = 0xDEADBEEF12345678, (5 << 33) + 7
    normals = block_normals(key, interval, 3)
    for body in range(3):
        words = _core.philox(key, [interval >> 1 & 0xFFFFFFFF, body, interval >> 33, 1])
        radius = np.sqrt(-2 * np.log(((words[2] >> 8) + 1) / 2**24))
        turn = (words[3] >> 30) + (words[3] >> 8 & 0x3FFFFF) / 2**22 - 0.5
        expected = radius * np.array([np.cos(turn * np.pi / 2), np.sin(turn * np.pi / 2)])
        np.testing.assert_allclose(normals[body], expected, rtol=1e-12)


# --- a rigid assembly -----------------------------------------------------------------------------


def test_moment_of_inertia_of_a_row() -> None:
    # A rectangle 3a x a of mass 3m.
    body = rigid(0, LINE, [0, 0, 0.3])
    assert body.inertia == pytest.approx(3 * MASS * ((3 * SIDE) ** 2 + SIDE**2) / 12, rel=1e-14)


def test_forces_on_blocks_turn_and_push_the_assembly() -> None:
    free = World(rules(), [rigid(0, DIMER, [0.01, 0.02, np.pi / 2])])
    force = np.array([[0.0, 0.0], [2e-3, 0.0]])  # on the upper block, to the right
    integrate(free, force)
    dt = 0.01
    body = free.assemblies[0]
    inertia = MASS * SIDE**2 * 5 / 6  # a rectangle 2a x a of mass 2m
    expected = [2e-3 / (2 * MASS) * dt, 0.0, -2e-3 * HALF / inertia * dt]
    np.testing.assert_allclose(body.motion, expected, rtol=1e-12, atol=1e-18)


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(("hidden", "windward"), [("none", 1), ("full", 2)])
def test_a_pair_along_the_flow_follows_the_closed_form(hidden: Any, windward: int) -> None:
    # 2m dw/dt = -k w^2 with k = 1/2 rho C_d a d for each face that meets the water; w = u - v.
    flow = dw.uniform_flow(0.08, 0.0)
    free = World(
        rules(flow=flow, drag_coefficient=0.45, hidden_face_drag=hidden),
        [rigid(0, DIMER, [0, 0, 0])],
    )
    rate = windward * 0.5 * 1000 * 0.45 * SIDE * SIDE / (2 * MASS)
    for step in range(1, 301):
        integrate(free, np.zeros((2, 2)))
        if step % 100 == 0:
            lag = 0.08 - free.assemblies[0].motion[0]
            assert lag == pytest.approx(0.08 / (1 + rate * 0.08 * step * 0.01), rel=1e-3)
    assert np.abs(free.assemblies[0].motion[1:]).max() < 1e-14


@pytest.mark.slow
def test_a_free_pair_reaches_the_velocity_of_the_flow() -> None:
    flow = dw.uniform_flow(0.03, -0.04)
    free = World(rules(flow=flow, drag_coefficient=10.0), [rigid(0, DIMER, [0, 0, 0.7])])
    free.assemblies[0].motion[2] = 1.0
    for _ in range(1500):
        integrate(free, np.zeros((2, 2)))
    # Quadratic drag closes the gap as 2m / (k t), k = 1/2 rho C_d a d.
    gap = 2 * MASS / (0.5 * 1000 * 10 * SIDE * SIDE * 15.0)
    x, y, spin = free.assemblies[0].motion
    assert np.hypot(x - 0.03, y + 0.04) < 3 * gap
    assert abs(spin) * SIDE < 3 * gap


@pytest.mark.parametrize("hidden", ["none", "full"])
def test_drag_is_the_sum_over_the_strips_of_every_block(hidden: Any) -> None:
    model = study(0.3)
    flow = swirl(model)
    setup = rules(model, flow, drag_coefficient=0.45, hidden_face_drag=hidden)
    body = rigid(0, CORNER, [0.03, -0.02, 0.4], [0.02, -0.03, 0.8])
    [(acceleration, damping)] = drag_sums(World(setup, [body]), [body.pose], [body.motion])
    force, torque, conductance, turning = strips_one_by_one(setup.model, body, hidden)
    inertia = body.inertia
    np.testing.assert_allclose(acceleration[:2], force / (3 * MASS), rtol=1e-12)
    np.testing.assert_allclose(acceleration[2], torque / inertia, rtol=1e-12)
    np.testing.assert_allclose(damping[:2], conductance / (3 * MASS), rtol=1e-12)
    np.testing.assert_allclose(damping[2], turning / inertia, rtol=1e-12)


def strips_one_by_one(
    model: TwinModel, body: Assembly, hidden: str
) -> tuple[Floats, float, float, float]:
    """Force, torque, and the two sums of damping about the centre of mass, in a plain loop."""
    occupied = {tuple(cell) for cell in body.cells.tolist()}
    vx, vy, spin = body.motion
    scale = 0.5 * 1000 * 0.45 * SIDE / 8 * SIDE
    force, torque, conductance, turning = np.zeros(2), 0.0, 0.0, 0.0
    for (ix, iy), centre in zip(body.cells.tolist(), body.centres(), strict=True):
        for dx, dy in ((1, 0), (0, 1), (-1, 0), (0, -1)):
            if hidden == "none" and (ix + dx, iy + dy) in occupied:
                continue
            c, s = np.cos(body.pose[2]), np.sin(body.pose[2])
            normal = np.array([c * dx - s * dy, s * dx + c * dy])
            along = np.array([-normal[1], normal[0]])
            for strip in range(8):
                point = centre + HALF * normal + (strip - 3.5) * SIDE / 8 * along
                arm = point - body.pose[:2]
                u, v = flow_at(model, point[:1], point[1:])
                slip = np.array([u[0] - vx + spin * arm[1], v[0] - vy - spin * arm[0]])
                facing = max(0.0, -float(normal @ slip))
                push = scale * facing * slip
                force += push
                torque += arm[0] * push[1] - arm[1] * push[0]
                conductance += scale * facing
                lever = ((centre - body.pose[:2]) ** 2).sum()
                turning += scale * facing * (4 / 3 * HALF**2 + lever)
    return force, torque, conductance, turning


# --- contacts -------------------------------------------------------------------------------------


@BOTH_SHAPES
def test_overlap_is_the_depth_of_the_minkowski_difference(shape: Shape) -> None:
    rng = np.random.default_rng(1)
    signs = set()
    for _ in range(80):
        angles, apart = rng.uniform(-7, 7, 2), rng.uniform(-1.2, 1.2, 2) * SIDE
        first = one_block(shape, 0, np.array([0.1, 0.2, angles[0]]))
        second = one_block(shape, 1, np.array([0.1 + apart[0], 0.2 + apart[1], angles[1]]))
        found = overlap(pair_of(first, second))
        expected = depth_by_hull(corners_of(first), corners_of(second))
        # Outside, the rule takes face axes alone, which tell no more than apart or not.
        assert np.sign(found.depth) == np.sign(expected)
        if expected > 0:
            assert found.depth == pytest.approx(expected, rel=1e-9)
            assert found.normal @ apart > 0
        signs.add(np.sign(expected))
    assert signs == {-1.0, 1.0}


@pytest.mark.slow
@BOTH_SHAPES
def test_contact_points_lie_in_both_blocks(shape: Shape) -> None:
    rng = np.random.default_rng(2)
    counts = set()
    for _ in range(80):
        pair = pair_of(*random_overlap(rng, shape))
        points = contact_points(pair)
        counts.add(len(points))
        depth = overlap(pair).depth
        for point, found in points:
            assert 0 < found <= depth + 1e-12
            for side in (0, 1):
                angle = -pair.bodies[side].pose[2] - pair.bodies[side].turns[0]
                x, y = point - pair.centre(side)
                local = x * np.cos(angle) - y * np.sin(angle), x * np.sin(angle) + y * np.cos(angle)
                assert (np.abs(local) <= shape.half + 1e-12).all()
    assert counts == {1, 2}


@pytest.mark.fast_cases(1)
@BOTH_SHAPES
@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_collisions_keep_momentum_and_never_gain_energy(friction: float, shape: Shape) -> None:
    rng = np.random.default_rng(3)
    changed = 0
    for _ in range(80):
        bodies = random_overlap(rng, shape)
        before, had = momentum(bodies), energy(bodies)
        restitution = rng.uniform()
        collide(pair_of(*bodies), restitution=restitution, friction=friction, bounce_speed=0.01)
        np.testing.assert_allclose(momentum(bodies), before, rtol=0, atol=1e-15)
        assert energy(bodies) <= had * (1 + 1e-12)
        changed += energy(bodies) < had * (1 - 1e-6)
    assert changed > 15, "too few of the pairs were closing"


@pytest.mark.slow
def test_after_a_collision_no_contact_point_closes() -> None:
    rng = np.random.default_rng(4)
    for _ in range(100):
        bodies = random_overlap(rng)
        pair = pair_of(*bodies)
        normal, points = overlap(pair).normal, contact_points(pair)
        collide(pair, restitution=0.0, friction=0.0, bounce_speed=0.0)
        for point, _ in points[:1] if len(points) == 1 else points:
            speeds = []
            for body in bodies:
                x, y = point - body.pose[:2]
                vx, vy, spin = body.motion
                speeds.append(normal @ [vx - spin * y, vy + spin * x])
            # The second pass takes the points in turn: the last one is exact.
            closing = speeds[0] - speeds[1]
        assert closing < 1e-12


@pytest.mark.parametrize(
    ("cells", "speeds"),
    [([[0, 0]], (0.025, 0.075)), (DIMER, (0.05, 0.1))],
    ids=["equal masses", "two blocks against one"],
)
def test_head_on_collision_with_restitution_one_half(cells: Any, speeds: Any) -> None:
    # v1' = v (M1 - e M2) / (M1 + M2), v2' = v M1 (1 + e) / (M1 + M2) at v = 0.1 m/s, e = 0.5.
    length = len(cells)
    first = rigid(0, cells, [-length * HALF, 0, 0], [0.1, 0, 0])
    second = rigid(length, [[0, 0]], [HALF + 0.5e-3, 0, 0])
    space = World(rules(block_restitution=0.5), [first, second])
    advance(space, np.zeros((length + 1, 2)))
    assert space.first_contact_step == 1
    np.testing.assert_allclose(first.motion, [speeds[0], 0, 0], atol=1e-12)
    np.testing.assert_allclose(second.motion, [speeds[1], 0, 0], atol=1e-12)


def test_slow_collision_does_not_bounce() -> None:
    motions = [[0.009, 0, 0], [0, 0, 0]]
    space = world(rules(), [[-HALF, 0, 0], [HALF + 0.05e-3, 0, 0]], motions)
    advance(space, np.zeros((2, 2)))
    for body in space.assemblies:
        np.testing.assert_allclose(body.motion, [0.0045, 0, 0], atol=1e-12)


def test_friction_is_a_share_of_the_push_and_no_more_than_stops_the_sliding() -> None:
    poses = [[-HALF, 0, 0], [HALF - 1e-5, 0, 0]]
    slides = world(rules(block_friction=0.1), poses, [[0.1, 0.05, 0], [0, 0, 0]])
    advance(slides, np.zeros((2, 2)))
    first, second = slides.assemblies
    assert 0.05 - first.motion[1] == pytest.approx(0.1 * (0.1 - first.motion[0]), rel=1e-10)
    np.testing.assert_allclose(first.motion[:2] + second.motion[:2], [0.1, 0.05], atol=1e-15)
    grips = world(rules(block_friction=10.0), poses, [[0.1, 0.005, 0], [0, 0, 0]])
    advance(grips, np.zeros((2, 2)))
    (_, y1, spin1), (_, y2, spin2) = (body.motion for body in grips.assemblies)
    assert abs((y1 + spin1 * HALF) - (y2 - spin2 * HALF)) < 0.05 * 0.005


@pytest.mark.slow
def test_crowded_blocks_stay_apart_and_inside() -> None:
    # Block against block and wall, with sideways rubbing, for two seconds of hard shaking.
    model = study(0.12)
    setup = rules(model, latching="none", drag_coefficient=0.45, block_friction=0.2)
    around = np.arange(4) * np.pi / 2
    poses = np.column_stack([0.033 * np.cos(around), 0.033 * np.sin(around), 0.3 * around])
    space = world(setup, poses, np.zeros((4, 3)))
    rng = np.random.default_rng(5)
    deepest, met = 0.0, 0
    for _ in range(200):
        advance(space, 5e-3 * rng.normal(size=(4, 2)))
        squares = [corners_of(body) for body in space.assemblies]
        deepest = max(
            deepest, *(depth_by_hull(squares[i], squares[j]) for i in range(4) for j in range(i))
        )
        outside = max(np.hypot(*square.T).max() for square in squares) - 0.06
        assert outside < 1.1e-5
        met += space.assemblies[0].drag[0] == 0.0
    assert met > 5, "too few contacts"
    assert deepest < 1.1e-5


def test_separation_moves_by_inverse_mass() -> None:
    heavy = rigid(0, LINE, [-3 * HALF, 0, 0])
    light = rigid(3, [[0, 0]], [HALF - 4e-4, 0, 0])
    separate(rules().wall, [heavy, light])
    np.testing.assert_allclose(heavy.pose, [-3 * HALF - 1e-4, 0, 0], atol=1e-12)
    np.testing.assert_allclose(light.pose, [HALF - 1e-4, 0, 0], atol=1e-12)


def channel(width: float) -> Any:
    return rules(dw.Study(tank={"shape": "rectangle", "width_m": width, "height_m": 0.3}))


def test_a_wedged_block_is_turned_until_both_fit() -> None:
    # Two blocks abreast, 0.2 mm to spare: one tilt alone needs 0.45 mm, two of half the size less.
    walls = channel(2 * SIDE + 2e-4).wall
    straight = rigid(0, [[0, 0]], [-HALF - 1e-4, 0, 0])
    tilted = rigid(1, [[0, 0]], [HALF - 2e-4, 0.002, 0.015])
    straight.before, tilted.before = np.array([0, 0.1, 0.0]), np.array([0, -0.1, 0.0])
    separate(walls, [straight, tilted])
    assert overlap(pair_of(straight, tilted)).depth < 1e-4
    assert np.abs(np.concatenate([corners_of(straight), corners_of(tilted)])[:, 0]).max() < 0.0302
    assert tilted.pose[2] == pytest.approx(straight.pose[2], abs=1e-3)
    assert 0.004 < tilted.pose[2] < 0.011
    assert abs(tilted.pose[1]) < 0.01, "taken back instead"


def test_what_is_jammed_stays_where_it_was() -> None:
    # Three abreast where there is no room for three.
    walls = channel(3 * SIDE - 2e-3).wall
    bodies = [rigid(k, [[0, 0]], [(k - 1) * 0.0292, 0, 0], [0.1, 0.2, 0.3]) for k in range(3)]
    far = rigid(3, [[0, 0]], [0, -0.1, 0], [0.1, 0, 0])
    for k, body in enumerate(bodies):
        body.before = np.array([0.0, 0.05 * k, 0.1])
    separate(walls, [*bodies, far])
    for k, body in enumerate(bodies):
        np.testing.assert_array_equal(body.pose, [0, 0.05 * k, 0.1])
        np.testing.assert_array_equal(body.motion, np.zeros(3))
    np.testing.assert_array_equal(far.motion, [0.1, 0, 0])


def test_a_row_as_long_as_the_tank_is_wide_cannot_turn() -> None:
    walls = channel(3 * SIDE + 5e-4).wall
    row = rigid(0, LINE, [0, 0, 0.1], [0, 0, 10.0])
    row.before = np.array([0.0, 0.001, 0.05])
    assert meet_wall(walls, row)
    np.testing.assert_array_equal(row.pose, [0, 0.001, 0.05])
    np.testing.assert_array_equal(row.motion, np.zeros(3))


# --- latching -------------------------------------------------------------------------------------


def random_meeting(rng: np.random.Generator) -> World:
    first, second = random_overlap(rng)
    second.blocks = [block - 10 + first.size for block in second.blocks]
    for body in (first, second):
        body.quarters = rng.integers(4, size=body.size)
    return World(rules(latching="collision"), [first, second])


@pytest.mark.slow
def test_merging_keeps_momentum_and_angular_momentum_about_the_joint_centre() -> None:
    rng = np.random.default_rng(6)
    for _ in range(100):
        space = random_meeting(rng)
        bodies, blocks = list(space.assemblies), space.blocks
        px, py, spin = momentum(bodies)
        joint = sum(body.mass * body.pose[:2] for body in bodies) / (MASS * blocks)
        made = latch_once(space.rules.latch, space.rules.wall, bodies)
        assert made is not None
        after = momentum([made.made])
        np.testing.assert_allclose(after[:2], [px, py], rtol=0, atol=1e-15)
        own_before = spin - (joint[0] * py - joint[1] * px)
        centre = made.made.pose
        own_after = after[2] - (centre[0] * after[1] - centre[1] * after[0])
        assert own_after == pytest.approx(own_before, abs=1e-15)


def test_rectangles_latch_as_they_lie() -> None:
    rng = np.random.default_rng(8)
    for _ in range(40):
        first, second = random_overlap(rng, RECTANGLE)
        before = momentum([first, second])
        made = laid_together((first, 0, 0), (second, 10, 0))
        np.testing.assert_allclose(momentum([made]), before, rtol=0, atol=1e-15)
        assert overlap(Pair((made, made), (0, 10))).depth == pytest.approx(0.0, abs=1e-15)
        rows = made.block_poses()
        for body, part in ((first, rows[: first.size]), (second, rows[first.size :])):
            moved = part - body.block_poses()
            np.testing.assert_allclose(np.sin(moved[:, 2]), 0.0, atol=1e-12)
            np.testing.assert_allclose(moved[:, :2], moved[:1, :2].repeat(len(part), 0), atol=1e-15)


@pytest.mark.slow
def test_merged_blocks_are_on_one_lattice_with_the_joined_faces_together() -> None:
    rng = np.random.default_rng(7)
    for _ in range(100):
        space = random_meeting(rng)
        bodies = list(space.assemblies)
        made = latch_once(space.rules.latch, space.rules.wall, bodies)
        assert made is not None
        poses = made.made.block_poses()
        between = poses[:, None, :2] - poses[None, :, :2]
        c, s = np.cos(poses[0, 2]), np.sin(poses[0, 2])
        steps = np.stack(
            [c * between[..., 0] + s * between[..., 1], c * between[..., 1] - s * between[..., 0]]
        ) / SIDE  # fmt: skip
        np.testing.assert_allclose(steps, np.round(steps), rtol=0, atol=1e-12)
        assert len(np.unique(np.round(steps[:, 0].T), axis=0)) == len(poses)
        # The faces named in the event, from the blocks' own poses: one place, opposite normals.
        place = {block: poses[made.made.blocks.index(block)] for block in made.made.blocks}
        ends = []
        for block, face in zip(made.blocks, made.faces, strict=True):
            x, y, theta = place[block]
            normal = np.array([np.cos(theta + face * np.pi / 2), np.sin(theta + face * np.pi / 2)])
            ends.append((np.array([x, y]) + HALF * normal, normal))
        np.testing.assert_allclose(ends[0][0], ends[1][0], rtol=0, atol=1e-12)
        np.testing.assert_allclose(ends[0][1], -ends[1][1], rtol=0, atol=1e-12)
        # The larger one stays where it was, of equal ones that of the lower blocks.
        larger = bodies[0] if bodies[0].size >= bodies[1].size else bodies[1]
        for block, pose in zip(larger.blocks, larger.block_poses(), strict=True):
            np.testing.assert_allclose(place[block], pose, rtol=0, atol=1e-12)
        assert made.blocks[0] in larger.blocks


def test_the_nearest_faces_that_look_at_each_other_join() -> None:
    # Turned by a quarter and a little: +x of the first meets -y of the second.
    space = world(
        rules(latching="collision"),
        [[0, 0, 0.05], [SIDE - 1e-3, 2e-3, np.pi / 2 + 0.1]],
        np.zeros((2, 3)),
    )
    advance(space, np.zeros((2, 2)))
    assert [(event.step, event.blocks, event.faces) for event in space.events] == [
        (1, (0, 1), (0, 1))
    ]
    assert space.first_contact_step == 1
    assert space.gather("quarter").tolist() == [0, 1]
    assert space.gather("cell").tolist() == [[0, 0], [1, 0]]
    assert space.gather("assembly").tolist() == [0, 0]
    assert space.complete


def test_pairs_far_apart_join_in_one_step() -> None:
    setup = rules(latching="collision")
    poses = [[0, 0, 0], [1, 0, 0], [0, SIDE - 1e-3, 0], [1, SIDE - 1e-3, 0]]
    space = world(setup, poses, np.zeros((4, 3)))
    advance(space, np.zeros((4, 2)))
    assert sorted(event.blocks for event in space.events) == [(0, 2), (1, 3)]
    assert space.gather("assembly").tolist() == [0, 1, 0, 1]


def test_occupied_cells_are_not_joined() -> None:
    corner = rigid(0, CORNER, [0, 0, 0])
    left, right = rigid(3, [[0, 0], [-1, 0]], [0, 0, 0]), rigid(3, DIMER, [0, 0, 0])
    # On top of the corner's right block: a pair to the left would lie on its upper block.
    assert merged((corner, 1, 1), (left, 3, 3)) is None
    made = merged((corner, 1, 1), (right, 3, 3))
    assert made is not None
    assert made.cells.tolist() == [[0, 0], [1, 0], [0, 1], [1, 1], [2, 1]]


def test_a_face_that_does_not_fit_leaves_the_place_to_the_next() -> None:
    # A pair rotated into the notch of a corner: the faces nearest to each other cannot join.
    corner = rigid(0, CORNER, [0, 0, 0])
    notch = corner.centres()[1] + [0, SIDE]
    pair = rigid(3, DIMER, [notch[0] + 0.3 * SIDE, notch[1] + 0.25 * SIDE, 2.5])
    latch = Latch("collision", 0.0, 0.0)
    bodies = [corner, pair]
    ordered = sorted(candidates(latch, bodies))
    fits = [
        merged((corner, entry.block, entry.face), (pair, entry.other_block, entry.other_face))
        is not None
        for entry in ordered
    ]
    first = fits.index(True)
    assert first > 0, "the nearest faces can join: this is no test"
    made = latch_once(latch, rules().wall, bodies)
    assert made is not None
    chosen = ordered[first]
    assert made.blocks == (chosen.block, chosen.other_block)
    assert made.faces == (chosen.face, chosen.other_face)


def test_hidden_faces_do_not_join() -> None:
    pair, single = rigid(0, DIMER, [0, 0, 0]), rigid(2, [[0, 0]], [0, SIDE - 1e-3, 0.1])
    faces = {
        (entry.block, entry.face) for entry in candidates(Latch("collision", 0, 0), [pair, single])
    }
    assert (0, 1) in faces
    assert not faces & {(0, 0), (1, 2)}


@pytest.mark.parametrize(
    ("gap", "turn", "joins"), [(0.9e-3, 0.09, True), (1.1e-3, 0.09, False), (0.9e-3, 0.11, False)]
)
def test_connectors_join_within_their_tolerances(gap: float, turn: float, joins: bool) -> None:
    # The faces' centres stand `gap` apart; the blocks do not overlap.
    x = HALF + gap + HALF * np.cos(turn)
    setup = rules(latching="connector", distance=1e-3, axis=0.1)
    space = world(setup, [[0, 0, 0], [x, HALF * np.sin(turn), turn]], np.zeros((2, 3)))
    advance(space, np.zeros((2, 2)))
    assert bool(space.events) is joins
    assert (space.first_contact_step == 1) is joins or not joins


def test_a_merge_at_the_wall_is_shifted_inward() -> None:
    model = study(0.2)
    setup = rules(model, latching="collision")
    # The second block is at the wall; in line with the first it would stand through it.
    space = world(setup, [[0.055, 0, 0.0], [0.078, 0.004, 0.35]], np.zeros((2, 3)))
    advance(space, np.zeros((2, 2)))
    assert len(space.events) == 1
    outside = np.hypot(*corners_of(space.assemblies[0]).T).max() - 0.1
    # As cells in line with the first block they would have stood 1.1 mm through the wall.
    assert -1e-4 < outside <= 1e-6


def test_no_merge_into_a_third_block() -> None:
    # The nearest faces would put the moved block on top of the first one, 0.5 mm into the third.
    first = rigid(0, [[0, 0]], [0, 0, 0])
    second = rigid(1, [[0, 0]], [SIDE - 1e-3, 0.6 * SIDE, 0.2])
    third = rigid(2, [[0, 0]], [-0.01, 2 * SIDE - 5e-4, 0])
    latch, wall = Latch("collision", 0.0, 0.0), rules().wall
    alone = latch_once(latch, wall, [first, second])
    assert alone is not None
    assert alone.faces[0] == 1
    crowded = latch_once(latch, wall, [first, second, third])
    assert crowded is not None
    assert crowded.faces[0] == 0
    touching = rigid(2, [[0, 0]], [-0.01, 2 * SIDE - 0.9e-4, 0])
    close = latch_once(latch, wall, [first, second, touching])
    assert close is not None
    assert close.faces[0] == 1
    # A third block that has only just left the place may have to go back there.
    leaving = rigid(2, [[0, 0]], [-0.5, 0, 0])
    leaving.before = third.pose
    held = latch_once(latch, wall, [first, second, leaving])
    assert held is not None
    assert held.faces[0] == 0


# --- worlds ---------------------------------------------------------------------------------------


@pytest.mark.slow
def test_sampling_does_not_change_the_events_and_a_complete_world_ends_early() -> None:
    model = study(0.14)
    arguments: dict[str, Any] = {
        "start": [[-0.03, 0.0, 0.2], [0.008, 0.01, 1.0], [0.0, -0.035, 0.5]],
        "key": 23,
        "drag_coefficient": 0.45,
        "force_std": 3e-3,
        "steps": 120,
        "latching": "collision",
        "hidden_face_drag": "none",
        **PLAIN,
    }
    flow = swirl(model)
    plain = assemble_reference(model, flow, **arguments)
    sampled = assemble_reference(model, flow, sample_every=7, **arguments)
    assert plain["event_count"] == 2
    assert plain["end_step"] == plain["event_step"][-1] < 120
    for name in ("event_step", "event_block", "event_face"):
        np.testing.assert_array_equal(plain[name], sampled[name])
    assert sampled["end_step"] == 120
    assert sampled["sample_pose"].shape == (120 // 7 + 1, 3, 3)
    np.testing.assert_allclose(sampled["sample_pose"][0], arguments["start"], rtol=1e-6)
    parts = sampled["sample_assembly"]
    done = plain["event_step"]
    assert (parts[: (done[0] - 1) // 7 + 1] == [0, 1, 2]).all()
    assert (parts[-(-done[1] // 7) :] == 0).all()


def test_a_changing_flow_is_refused() -> None:
    flow = dw.uniform_flow(0.0, 0.0).expand_dims(time=[0.0, 1.0])
    with pytest.raises(InputError, match="steady"):
        rules(flow=flow)
