"""Rectangles that assemble, against brute force in plain NumPy and the simulation of one."""

from __future__ import annotations

from typing import Any

import numpy as np
import plain_bodies as plain
import pytest

import driftwalk as dw
from driftwalk.assembly import LiveTank, assemble, assembly_path
from driftwalk.assembly.outcomes.outcome_classes import overlap_depth
from driftwalk.core.errors import InputError
from driftwalk.schema import build_flow_field
from driftwalk.simulation import Start, simulate

LENGTH, WIDTH, MASS, DRAG = 0.04, 0.02, 0.012, 0.5
SQUARE_RADIUS = (LENGTH**2 + WIDTH**2) / 12.0
NODES = np.linspace(-0.5, 0.5, 81)
SIZE = {"side": LENGTH, "width": WIDTH}


def study(*, shape: str = "rectangle", tank: float = 0.9, step: float = 1e-3, **more: Any) -> Any:
    sides = {"side_m": LENGTH, "width_m": WIDTH} if shape == "rectangle" else {"side_m": 0.03}
    return dw.Study(
        block={"shape": shape, "mass_kg": MASS} | sides,
        forces={"drag_coefficient": DRAG, "force_std_N": 0.0}, tank={"diameter_m": tank},
        simulation={"time_step_s": step}, assembly=more,
    )  # fmt: skip


def field(u: Any, v: Any) -> Any:
    x, y = np.meshgrid(NODES, NODES)
    flag = np.ones(x.shape, dtype=np.int8)
    return build_flow_field(NODES, NODES, u=u(x, y), v=v(x, y), flag=flag)


CLOSING = field(lambda x, y: -0.3 * x + 0.05 * y, lambda x, y: 0.1 * y + 0.02 * x)
STARTS = [(-0.1, 0.012, 0.4), (0.09, -0.006, -1.1)]


def corners_of(pose: Any, count: int = 2) -> Any:
    """A grid of points over a rectangle, its corners alone with a count of 2."""
    x, y = np.meshgrid(
        np.linspace(-0.5, 0.5, count) * LENGTH, np.linspace(-0.5, 0.5, count) * WIDTH
    )
    return complex(pose[0], pose[1]) + np.exp(1j * pose[2]) * (x + 1j * y).ravel()


def holds(pose: Any, points: Any, slack: float) -> Any:
    own = (points - complex(pose[0], pose[1])) * np.exp(-1j * pose[2])
    inside = (np.abs(own.real) < LENGTH / 2 + slack) & (np.abs(own.imag) < WIDTH / 2 + slack)
    return inside.any()


def test_overlap_of_rectangles_against_sampled_points() -> None:
    """Points of one within the other: a grid of 0.4 mm finds what overlaps by more than 0.6 mm."""
    rng = np.random.default_rng(7)
    seen = {True: 0, False: 0}
    for _ in range(300):
        first = np.array([0.0, 0.0, rng.uniform(-np.pi, np.pi)])
        second = np.array([*rng.uniform(-0.04, 0.04, 2), rng.uniform(-np.pi, np.pi)])
        depth = float(overlap_depth(first[None], second[None], **SIZE)[0])
        if abs(depth) < 6e-4:
            continue
        seen[depth > 0] += 1
        assert holds(first, corners_of(second, 101), 0.0) == (depth > 0)
    assert min(seen.values()) > 50


def test_rectangles_that_are_apart_do_not_latch() -> None:
    """At rest in still water, from 1 um to 4 mm apart."""
    rng = np.random.default_rng(3)
    still, starts = field(lambda x, y: 0 * x, lambda x, y: 0 * x), []
    while len(starts) < 200:
        place, angle = rng.uniform(-0.04, 0.04, 2), rng.uniform(-3, 3, 2)
        pair = np.array([(0, 0, angle[0]), (*place, angle[1])])
        if -0.004 < float(overlap_depth(pair[:1], pair[1:], **SIZE)[0]) < -1e-6:
            starts.append(pair)
    how = {"runs": 200, "duration": 0.002}
    runs = assemble(study(blocks=2), still, start=starts, **how, backend="reference")
    assert not (runs["event_count"].values > 0).any()


def test_momentum_and_angular_momentum_are_kept_where_rectangles_latch() -> None:
    tank = LiveTank(study(step=0.01), CLOSING, start=STARTS, blocks=2)
    tank.advance(3.5)
    tank.set(drag_coefficient=0.0)
    tank.advance(0.02)

    def momenta() -> list[float]:
        z, v = tank.x + 1j * tank.y, tank.vx + 1j * tank.vy
        spin = float(((z.conj() * v).imag + tank.omega * SQUARE_RADIUS).sum())
        return [v.sum().real, v.sum().imag, spin]

    before = momenta()
    assert len(set(tank.assembly)) == 2
    tank.advance(4.0)
    (event,) = tank.events()
    assert event.outcome == "2"
    assert momenta() == pytest.approx(before, rel=1e-9)
    pose = np.stack([tank.x, tank.y, tank.theta], axis=1)
    assert overlap_depth(pose[:1], pose[1:], **SIZE)[0] == pytest.approx(0.0, abs=1e-9)


def test_one_rectangle_alone_moves_as_in_a_simulation_of_it() -> None:
    """In the tank's swirl, with its walls; the second backend as the first."""
    case, flow = study(tank=0.3, step=0.01), dw.tank30_flow()
    for backend, close in (("reference", 1e-6), ("cpu", 2e-3)):
        found = assembly_path(
            case, flow, start=[(0.05, 0.02, 0.3)], blocks=1, duration=20.0, sample_interval=0.5,
            backend=backend,
        )  # fmt: skip
        alone = simulate(
            case, flow, start=Start(0.05, 0.02, 0.3), sample_time=found["time"].values,
            replicates=1, backend="reference",
        )  # fmt: skip
        for name in ("x", "y"):
            apart = found[name].values[0, :, 0] - alone[name].values[0, :, 0]
            assert np.abs(apart).max() < close


def test_a_latched_pair_feels_its_strips_at_their_own_places() -> None:
    """The acceleration from a moment's motion by brute-force strips, 8 a face, within 1 %."""
    case = study(step=1e-3)
    tank = LiveTank(case, CLOSING, start=STARTS, blocks=2)
    while len(set(tank.assembly)) == 2 and tank.time < 20.0:
        tank.advance(0.05)
    tank.advance(0.2)
    z, v = tank.x + 1j * tank.y, tank.vx + 1j * tank.vy
    theta, spin = tank.theta.copy(), float(tank.omega[0])
    scale = 0.5 * plain.DENSITY * DRAG * case.wetted_depth_m

    def water(at: Any) -> Any:
        return -0.3 * at.real + 0.05 * at.imag + 1j * (0.1 * at.imag + 0.02 * at.real)

    body = plain.rectangle(LENGTH, WIDTH)
    middle, inertia, force, torque = z.mean(), 0.0, 0j, 0.0
    for k in range(2):
        own = plain.drag(body, water, scale, z[k], theta[k], v[k], spin)
        arm = z[k] - middle
        force += own[0]
        torque += own[1] + (arm.conjugate() * own[0]).imag
        inertia += MASS * (SQUARE_RADIUS + abs(arm) ** 2)
    tank.advance(1e-3)
    after = tank.vx + 1j * tank.vy
    want = force / (2 * MASS)
    assert abs((after.mean() - v.mean()) / 1e-3 - want) < 0.01 * abs(want)
    turned = (float(tank.omega[0]) - spin) / 1e-3
    assert turned == pytest.approx(torque / inertia, rel=0.02, abs=1e-3)


@pytest.mark.parametrize("backend", ["reference", "cpu"])
@pytest.mark.parametrize("tank", ["circle", "corners"])
def test_a_rectangle_of_equal_sides_is_the_square_until_it_latches(tank: str, backend: Any) -> None:
    """Eight hard ones that meet each other and the wall, whose roundings grow with each contact.

    The drag of one sums over panels, that of the other over rows of strips.
    """
    corners = {"tank.shape": "rectangle", "tank.width_m": 0.2, "tank.height_m": 0.19}
    cases = [
        dw.apply_overrides(
            study(tank=0.3, step=0.01, blocks=8, latching="none"),
            {"block.shape": shape, "block.side_m": 0.03, "block.width_m": width,
             "forces.force_std_N": 5.5e-4} | (corners if tank == "corners" else {}),
        )
        for shape, width in (("rectangle", 0.03), ("square", None))
    ]  # fmt: skip
    equal, square = (
        assembly_path(one, dw.tank30_flow(), runs=range(1), duration=4.0, sample_interval=1.0,
                      backend=backend)
        for one in cases
    )  # fmt: skip
    assert equal.attrs["block_shape"] == "rectangle"
    for name in ("x", "y"):
        np.testing.assert_allclose(equal[name], square[name], rtol=0, atol=1e-6)
    latching = {"assembly.latching": "collision"}
    first = [
        assemble(dw.apply_overrides(one, latching), dw.tank30_flow(), runs=20, duration=6.0,
                 backend=backend)["first_contact_time"].values
        for one in cases
    ]  # fmt: skip
    assert np.isfinite(first[0]).sum() > 10
    np.testing.assert_array_equal(first[0], first[1])


@pytest.mark.parametrize("blocks", [8, 26])
@pytest.mark.parametrize("latching", ["none", "collision"])
def test_a_rectangle_is_the_one_with_swapped_sides_turned_by_a_quarter(
    latching: str, blocks: int
) -> None:
    """Few are looked at in all pairs, many by a list of near ones; events and places are alike."""
    column, row = np.divmod(np.arange(blocks), 6)
    start = np.stack([0.044 * (column - 2.0), 0.024 * (row - 2.5), 0.0 * row], axis=1)
    swapped = {"block.side_m": WIDTH, "block.width_m": LENGTH}
    found = []
    for keys, turn in (({}, 0.0), (swapped, np.pi / 2)):
        case = dw.apply_overrides(
            study(tank=0.3, step=0.01, blocks=blocks, latching=latching),
            keys | {"forces.force_std_N": 1e-3, "block.depth_m": 0.03},
        )
        tank = LiveTank(case, dw.tank30_flow(), seed=2, start=start + np.array([0.0, 0.0, turn]))
        tank.advance(1.5)
        events = [(event.time, event.blocks, event.outcome) for event in tank.events()]
        found.append((tank.x + 1j * tank.y, tank.theta - turn, events))
    (place, theta, events), (other, turned, others) = found
    assert np.abs(place - other).max() < 1e-6
    assert np.abs(np.sin(theta - turned)).max() < 1e-4
    assert events == others
    assert len(events) > 3 or latching == "none"


def bouncing(pose: Any, velocity: Any, *, step: float, tank: float, restitution: float) -> Any:
    """Hard rectangles that fly without water, shape (worlds, blocks, 3)."""
    worlds, blocks, _ = pose.shape
    case = dw.apply_overrides(
        study(tank=tank, step=step, blocks=blocks, latching="none", block_restitution=restitution),
        {"forces.drag_coefficient": 0.0, "tank.wall_restitution": restitution,
         "tank.wall_friction": 0.0, "tank.bounce_speed_m_s": 0.0},
    )  # fmt: skip
    start = {
        "pose": pose, "velocity": velocity, "assembly": np.tile(np.arange(blocks), (worlds, 1)),
        "cell": np.zeros((worlds, blocks, 2)), "quarter": np.zeros((worlds, blocks)),
    }  # fmt: skip
    still = dw.uniform_flow(0.0, 0.0, arena=case.tank.to_arena())
    return dw.TankBatch(case, still, worlds=worlds, start=start, backend="reference")


def energy_of(velocity: Any) -> Any:
    return MASS / 2 * (velocity**2 * [1.0, 1.0, SQUARE_RADIUS]).sum(axis=(1, 2))


@pytest.mark.parametrize("other", ["wall", "rectangle"])
def test_a_corner_that_hits_bounces_by_the_impulse_of_rigid_bodies(other: str) -> None:
    """Worlds go back from the moment of contact, and come to it by free flight.

    A contact is found up to one step of 20 us late, when its place and the arms have changed.
    """
    rng = np.random.default_rng(11)
    count, step, back, restitution, radius = 200, 2e-5, 0.004, 0.7, 0.4
    corner = rng.choice([-0.5, 0.5], count) * LENGTH + 0.5j * WIDTH * rng.choice([-1, 1], count)
    # The other's face, or the wall, is at x = `radius`; the corner that hits is the rightmost.
    theta = rng.uniform(0.3, np.pi / 2 - 0.3, count) - np.pi / 2 * (corner.real * corner.imag > 0)
    theta += np.pi * (corner.real < 0)
    arm = corner * np.exp(1j * theta)
    hit = radius + 1j * (rng.uniform(-0.4, 0.4, count) * WIDTH if other == "rectangle" else 0.0)
    centre = np.stack([hit - arm, np.full(count, radius + LENGTH / 2 + 0j)])
    velocity = rng.normal(0.0, 0.1, (2, count)) + 1j * rng.normal(0.0, 0.1, (2, count))
    spin = rng.normal(0.0, 2.0, (2, count))
    bodies = 1 if other == "wall" else 2
    if other == "wall":
        velocity[1] = spin[1] = 0.0
    arms = np.stack([arm, hit - centre[1]])
    closing = ((velocity + 1j * spin * arms) * [[1], [-1]]).real.sum(axis=0)
    # Unit impulses along x, on the second forwards.
    per_unit = 1.0 / MASS * (1.0 + arms.imag**2 / SQUARE_RADIUS)[:bodies].sum(axis=0)
    impulse = (1.0 + restitution) * closing / per_unit
    after = velocity + np.array([[-1.0], [1.0]]) * impulse / MASS
    turning = spin + np.array([[1.0], [-1.0]]) * arms.imag * impulse / (MASS * SQUARE_RADIUS)

    angle = np.stack([theta, np.zeros(count)]) - spin * back
    place = centre - velocity * back
    pose = np.stack([place.real, place.imag, angle], axis=-1).transpose(1, 0, 2)[:, :bodies]
    moving = np.stack([velocity.real, velocity.imag, spin], axis=-1).transpose(1, 0, 2)
    want = np.stack([after.real, after.imag, turning], axis=-1).transpose(1, 0, 2)
    good = closing > 0.05
    if other == "rectangle":
        good &= overlap_depth(pose[:, 0], pose[:, 1], **SIZE) < 0
    assert good.sum() > 50
    tank = 2 * radius if other == "wall" else 1.2
    batch = bouncing(pose[good], moving[good, :bodies], step=step, tank=tank,
                     restitution=restitution)  # fmt: skip
    batch.advance(back - step)
    np.testing.assert_allclose(batch.state()["velocity"], moving[good, :bodies], atol=1e-12)
    batch.advance(3 * step)
    off = (batch.state()["velocity"] - want[good, :bodies]) * [1.0, 1.0, LENGTH]
    assert np.abs(off).max() < 1e-3 * np.abs(want[good, :bodies, :2]).max()


def test_elastic_rectangles_keep_energy_and_momentum() -> None:
    """32 pairs that meet: energy and momentum to rounding, angular momentum to first order."""
    rng = np.random.default_rng(1)
    pose, velocity = np.zeros((2, 32, 2, 3))
    pose[:, 1, 0], pose[:, 1, 1] = 0.08, rng.uniform(-0.02, 0.02, 32)
    pose[..., 2] = rng.uniform(-3, 3, (32, 2))
    velocity[:, :, 0], velocity[..., 2] = [0.1, -0.1], rng.normal(0, 3, (32, 2))

    def spin_of(state: Any) -> Any:
        (x, y, _), (u, v, omega) = state["pose"].T, state["velocity"].T
        return (x * v - y * u + SQUARE_RADIUS * omega).sum(axis=0)

    lost = []
    for step in (1e-2, 1e-3):
        batch = bouncing(pose, velocity, step=step, tank=0.8, restitution=1.0)
        before = spin_of(batch.state())
        batch.advance(1.0)
        found = batch.state()["velocity"]
        assert (np.abs(found - velocity).max(axis=(1, 2)) > 1e-3).all()
        np.testing.assert_allclose(energy_of(found), energy_of(velocity), rtol=1e-12)
        np.testing.assert_allclose(found[..., :2].sum(axis=1), 0.0, atol=1e-15)
        lost.append(np.abs(spin_of(batch.state()) - before).max())
    assert lost[1] < 0.2 * lost[0] < 0.02 * 0.1 * LENGTH


@pytest.mark.parametrize("left", [6, 4])
def test_rectangles_that_part_or_lose_members_move_on_as_they_did(left: int) -> None:
    case = dw.apply_overrides(study(tank=0.3, step=0.01), {"forces.force_std_N": 1e-3})
    tank = LiveTank(case, dw.tank30_flow(), blocks=6, seed=1)
    tank.advance(40.0)
    assert len(set(tank.assembly)) < 3
    tank.set(drag_coefficient=0.0, force_std=0.0, latching="none")
    tank.advance(0.02)
    place, moving = tank.x + 1j * tank.y, tank.vx + 1j * tank.vy
    theta, spin = tank.theta, tank.omega
    if left == 6:
        tank.part()
    else:
        tank.set(blocks=left)
    tank.advance(0.01)
    label = tank.assembly.tolist()
    alone = [b for b in range(left) if label.count(label[b]) == 1]
    assert alone
    gone = (tank.x + 1j * tank.y)[alone] - (place + 0.01 * moving)[alone]
    assert np.abs(gone).max() < 1e-15
    turned = tank.theta[alone] - (theta + 0.01 * spin)[alone]
    assert np.abs(np.angle(np.exp(1j * turned))).max() < 1e-12


@pytest.mark.slow
def test_rectangles_stay_inside_and_apart_and_have_the_same_bits_alone() -> None:
    case = study(tank=0.3, step=0.01, blocks=8)
    case = dw.apply_overrides(case, {"forces.force_std_N": 5.5e-4})
    many, few = (assembly_path(case, dw.tank30_flow(), runs=range(n), duration=40.0,
                               sample_interval=0.5) for n in (20, 3))  # fmt: skip
    for name in ("x", "y", "theta"):
        assert np.array_equal(many[name].values[:3], few[name].values)
    pose = np.stack([many[name].values for name in ("x", "y", "theta")], axis=-1)
    corners = np.abs(np.array([corners_of(one) for one in pose.reshape(-1, 3)]))
    assert corners.max() < 0.15 + 2e-4
    label = many["assembly"].values
    for a, b in np.argwhere(np.triu(np.ones((8, 8)), 1)):
        depth = overlap_depth(pose[:, :, a].reshape(-1, 3), pose[:, :, b].reshape(-1, 3), **SIZE)
        apart = (label[..., a] != label[..., b]).ravel()
        assert depth[apart].max(initial=0.0) < 1.2e-4


@pytest.mark.parametrize("shape", ["rectangle:10x3cm", "xxx:3.3cm"])
def test_a_body_almost_as_long_as_its_tank_has_the_same_bits_alone(shape: str) -> None:
    """The two corners at the wall are more than a right angle apart, as seen from the middle."""
    case = dw.Study(
        block={"shape": shape, "mass_kg": 0.024}, tank={"diameter_m": 0.13},
        forces={"force_std_N": 1e-3, "drag_coefficient": 0.45},
    )  # fmt: skip
    flow = dw.uniform_flow(0.02, 0.0, arena={"shape": "circle", "diameter_m": 1.0})
    how = {"sample_time": np.arange(0.0, 20.0, 0.5), "start": Start(0.0, 0.0, 0.3)}
    found = [[simulate(case, flow, replicates=n, **how) for n in (32, 4)]]
    if case.block.shape == "rectangle":
        rest = {"blocks": 1, "duration": 20.0, "sample_interval": 0.5}
        found.append([assembly_path(case, flow, runs=range(n), **rest) for n in (32, 4)])
    for many, few in found:
        for name in ("x", "y", "theta"):
            assert np.array_equal(many[name].values[:4], few[name].values)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"assembly.latching": "connector"}, "rectangles latch as they lie"),
        ({"assembly.faces": "NSNS"}, "rectangles latch as they lie"),
        ({"assembly.glued": "xx"}, "where they are squares"),
        ({"interaction.magnets": "5x5x2mm,1.3T"}, "none between rectangles"),
        ({"interaction.capillary": "on"}, "none between rectangles"),
    ],
)
def test_what_needs_faces_is_refused_for_rectangles(keys: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        assemble(dw.apply_overrides(study(), keys), CLOSING, runs=1)
