"""Rectangles that assemble, against brute force in plain NumPy and the simulation of one."""

from __future__ import annotations

from typing import Any

import numpy as np
import plain_bodies as plain
import pytest

import driftwalk as dw
from driftwalk.assembly import LiveTank, assemble, assembly_path
from driftwalk.assembly.outcomes.disc_contacts import overlap_depth
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
