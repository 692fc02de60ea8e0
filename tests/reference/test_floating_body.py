"""What a floating body feels beyond the paper's law, against exact solutions.

Added mass, the water's own acceleration, a drag linear in the slip, and a force that remembers.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from kernel_worlds import assemble, keys
from single_block import (
    DENSITY,
    INERTIA,
    MASS,
    NODES,
    SIDE,
    Floats,
    flow_arrays,
    model,
    one_world,
    run,
    wrapped,
)

DRAG, LINEAR = 0.45, 5e-3
BOTH = pytest.mark.parametrize(("precision", "exact"), [("double", 1.0), ("single", 10.0)])
ADDED = pytest.mark.parametrize("added", [0.0, 0.5])


def turning_water(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    return -y, x


def frames_of(*velocities: Any, times: list[float]) -> dict[str, Any]:
    """Frames of a flow as arguments of a model; a velocity is as in `model`."""
    u, v = zip(*(flow_arrays(velocity) for velocity in velocities), strict=True)
    return {"u": np.stack(u), "v": np.stack(v), "frame_time": np.array(times)}


@ADDED
@BOTH
@pytest.mark.parametrize("drag", [0.0, 2.0])
def test_a_block_that_turns_with_the_water_stays_on_its_circle(
    added: float, drag: float, precision: str, exact: float
) -> None:
    # Nothing slips, so that no drag acts: what keeps the block on the circle is the water's own
    # acceleration, of the block's mass and of what it carries alike. The steps let the angle grow
    # by (omega dt)^2 / 24 of itself.
    time = np.arange(61) * 0.1
    native = model(turning_water, times=time, added_mass_share=added, displaced_mass=MASS)
    x, y, theta, _ = run(
        native, one_world(0.05, vy=0.05, omega=1.0, drag=drag), precision=precision
    )
    assert np.abs(x[0] - 0.05 * np.cos(time)).max() < exact * 3e-6
    assert np.abs(y[0] - 0.05 * np.sin(time)).max() < exact * 3e-6
    assert np.abs(wrapped(theta[0] - time)).max() < exact * 5e-5


@pytest.mark.parametrize(("added", "displaced"), [(0.0, 2.0), (0.5, 2.0), (0.5, 0.25), (3.0, 0.1)])
def test_the_push_goes_with_displaced_and_added_mass(added: float, displaced: float) -> None:
    # In turning water Du/Dt = -Omega^2 r: an ellipse, of the frequency sqrt of the push.
    push = (displaced + added) / (1.0 + added)
    time = np.arange(61) * 0.1
    native = model(
        turning_water, times=time, added_mass_share=added, displaced_mass=displaced * MASS
    )
    x, y, _, _ = run(native, one_world(0.05, vy=0.03, drag=0.0))
    turns = np.sqrt(push)
    assert np.abs(x[0] - 0.05 * np.cos(turns * time)).max() < 2e-5
    assert np.abs(y[0] - 0.03 / turns * np.sin(turns * time)).max() < 2e-5


@pytest.mark.parametrize("theta", [0.0, 0.6])
@pytest.mark.parametrize(("added", "displaced"), [(0.0, 1.0), (0.5, 1.0), (0.5, 2.0)])
@BOTH
def test_water_that_gains_spin_turns_the_block(
    theta: float, added: float, displaced: float, precision: str, exact: float
) -> None:
    # u = (U, b x^2): Du/Dt = (0, 2 b U x), half its curl is b U, and in the middle it is nothing.
    # Nodes are rounded to a part in 32,767: the curl between two is off by up to 1e-4 rad/s^2.
    along, bend = 0.05, 2.0
    time = np.arange(31) * 0.1
    native = model(
        lambda x, y: (along + 0 * x, bend * x**2), times=time,
        added_mass_share=added, displaced_mass=displaced * MASS,
    )  # fmt: skip
    x, y, angle, _ = run(native, one_world(theta=theta, drag=0.0), precision=precision)
    gain = bend * along * (displaced + added) / (1.0 + added)
    assert np.abs(wrapped(angle[0] - theta - 0.5 * gain * time**2)).max() < exact * 5e-4
    assert np.abs(x[0]).max() < 1e-9
    assert np.abs(y[0]).max() < exact * 2e-6


@pytest.mark.parametrize("theta", [0.0, 0.6])
@BOTH
def test_an_eddy_as_small_as_the_block_turns_it_by_the_whole_moment(
    theta: float, precision: str, exact: float
) -> None:
    # u = U + W(r) (-y, x): mean and moment of Du/Dt by 12 x 12 Gauss points, without drag, and the
    # motion by another integrator. With 2 x 2 points that do not turn the place is 0.4 mm off.
    from scipy.integrate import solve_ivp

    stream, size, time = (0.03, 0.01), 0.02, np.arange(11) * 0.1
    places, weights = np.polynomial.legendre.leggauss(12)
    across, along = SIDE / 2 * np.stack(np.meshgrid(places, places))
    weight = np.outer(weights, weights) / 4

    def velocity(x: Floats, y: Floats) -> tuple[Any, Any]:
        rate = 2.0 * np.exp(-0.5 * (x**2 + y**2) / size**2)
        return stream[0] - rate * y, stream[1] + rate * x

    def change(_: float, state: Floats) -> Floats:
        cosine, sine = np.cos(state[2]), np.sin(state[2])
        arm_x, arm_y = cosine * across - sine * along, sine * across + cosine * along
        x, y = state[0] + arm_x, state[1] + arm_y
        rate = 2.0 * np.exp(-0.5 * (x**2 + y**2) / size**2)
        u, v = velocity(x, y)
        by_x, by_y = -rate * x / size**2, -rate * y / size**2
        water_x = -y * (u * by_x + v * by_y) - v * rate
        water_y = x * (u * by_x + v * by_y) + u * rate
        moment = 6 / SIDE**2 * (weight * (arm_x * water_y - arm_y * water_x)).sum()
        push = [(weight * water_x).sum(), (weight * water_y).sum(), moment]
        return np.array([*state[3:], *push])

    begin = np.array([0.008, -0.013, theta, 0.0, 0.0, 0.0])
    want = solve_ivp(change, (0.0, 1.0), begin, t_eval=time, rtol=1e-8, atol=1e-10).y
    nodes = np.linspace(-0.16, 0.16, 257)
    native = model(velocity, times=time, nodes=nodes, time_step=0.0025, displaced_mass=MASS)
    x, y, angle, _ = run(native, one_world(*begin[:3], drag=0.0), precision=precision)
    assert np.abs(want[2] - theta).max() > 0.1
    assert np.abs(x[0] - want[0]).max() < 5e-5
    assert np.abs(y[0] - want[1]).max() < 5e-5
    assert np.abs(wrapped(angle[0] - want[2])).max() < 3e-3


@BOTH
def test_water_that_changes_pushes_with_its_whole_acceleration(
    precision: str, exact: float
) -> None:
    # Omega goes from 0.4 to 1.6 in 3 s and stays: Du/Dt = -Omega^2 r + Omega' x r is what a body
    # that moves with the water needs, and it spins up by Omega' as well.
    low, high, change = 0.4, 1.6, 3.0
    native = model(
        times=(time := np.arange(51) * 0.1),
        displaced_mass=MASS,
        **frames_of(
            lambda x, y: (-low * y, low * x), lambda x, y: (-high * y, high * x),
            times=[0.0, change],
        ),
    )  # fmt: skip
    rate = (high - low) / change
    early = low * time + 0.5 * rate * time**2
    angle = np.where(time < change, early, 0.5 * (low + high) * change + high * (time - change))
    world = one_world(0.05, vy=0.05 * low, omega=low, drag=0.0)
    x, y, theta, _ = run(native, world, precision=precision)
    assert np.abs(x[0] - 0.05 * np.cos(angle)).max() < exact * 2e-5
    assert np.abs(y[0] - 0.05 * np.sin(angle)).max() < exact * 2e-5
    assert np.abs(wrapped(theta[0] - angle)).max() < exact * 1e-3


def test_a_steady_flow_in_frames_pushes_as_a_steady_flow() -> None:
    time = np.arange(21) * 0.1
    options: dict[str, Any] = {"times": time, "displaced_mass": MASS}
    steady = run(model(turning_water, **options), one_world(0.05, vy=0.02))
    frames = frames_of(turning_water, turning_water, turning_water, times=[0.2, 0.5, 1.1])
    changing = run(model(**options, **frames), one_world(0.05, vy=0.02))
    for one, other in zip(steady, changing, strict=True):
        np.testing.assert_allclose(other, one, atol=1e-15)


@ADDED
@pytest.mark.parametrize("angle", [0.0, 0.5])
def test_linear_drag_takes_a_block_along_and_stops_its_spin(added: float, angle: float) -> None:
    # (m + m_a) dv/dt = k (U - v) at any angle, and (I + I_a) domega/dt = -k <r^2> omega.
    speed, spin, time = 0.03, 2.0, np.arange(51) * 0.1
    native = model(
        lambda x, y: (speed + 0 * x, 0 * y), times=time, radius=1.0,
        linear_drag=LINEAR, added_mass_share=added,
    )  # fmt: skip
    world = one_world(theta=angle, vy=0.04, omega=spin, drag=0.0)
    x, y, theta, _ = run(native, world)
    rate = LINEAR / (MASS * (1.0 + added))
    gone = -np.expm1(-rate * time) / rate
    assert np.abs(x[0] - speed * (time - gone)).max() < 2e-6
    assert np.abs(y[0] - 0.04 * gone).max() < 2e-6
    offsets = (np.arange(8) + 0.5) * SIDE / 8 - SIDE / 2
    spin_rate = LINEAR * (SIDE**2 / 4 + np.mean(offsets**2)) / (INERTIA * (1.0 + added))
    turned = spin / spin_rate * -np.expm1(-spin_rate * time)
    assert np.abs(wrapped(theta[0] - angle - turned)).max() < 5e-4


@BOTH
def test_linear_and_quadratic_drag_act_together(precision: str, exact: float) -> None:
    # Face on: m dv/dt = -k v - c v^2, v = k v0 / ((k + c v0) exp(k t/m) - c v0), the way is
    # m/c ln(1 + c v0 (1 - exp(-k t/m)) / k).
    c, speed, time = 0.5 * DENSITY * DRAG * SIDE * SIDE, 0.1, np.arange(31) * 0.1
    native = model(times=time, radius=1.0, linear_drag=LINEAR)
    x, _, _, _ = run(native, one_world(vx=speed, drag=DRAG), precision=precision)
    way = MASS / c * np.log1p(c * speed / LINEAR * -np.expm1(-LINEAR * time / MASS))
    assert np.abs(x[0] - way).max() < exact * 5e-6


@pytest.mark.parametrize("added", [0.5, 2.0])
def test_added_mass_stretches_the_decay(added: float) -> None:
    speed, time = 0.05, np.arange(51) * 0.1
    rate = 0.5 * DENSITY * DRAG * SIDE * SIDE / (MASS * (1.0 + added))
    native = model(
        lambda x, y: (speed + 0 * x, 0 * y), times=time, radius=0.5, added_mass_share=added
    )
    x, _, _, _ = run(native, one_world(drag=DRAG))
    way = speed * time - np.log1p(rate * speed * time) / rate
    assert np.abs(x[0] - way).max() < 1e-6


def test_a_wall_gives_back_the_same_speed_whatever_is_added() -> None:
    # An impulse changes the motion by ratios of mass and inertia, which have the same share added.
    time = np.arange(21) * 0.1
    world = one_world(0.1, 0.02, 0.3, vx=0.3, omega=1.0, drag=0.0)
    plain = run(model(times=time, friction=0.3), world)
    heavy = run(model(times=time, friction=0.3, added_mass_share=0.7), world)
    for one, other in zip(plain, heavy, strict=True):
        np.testing.assert_allclose(other, one, atol=1e-12)


MEMORY, STEP = 0.05, 0.01


def forces(memory: float, *, worlds: int, intervals: int) -> Floats:
    """Forces over sigma_F of every interval of four steps, shape (2 worlds, intervals)."""
    sigma, every = 1e-6, 4
    steps = every * intervals
    native = model(times=np.arange(steps + 1) * STEP, steps_per_interval=every, force_memory=memory)
    table = np.repeat(one_world(drag=0.0, force=sigma), worlds, axis=0)
    x, y, _, _ = run(native, table)
    # Without drag the second difference of a path within an interval is its acceleration.
    bends = np.diff(np.concatenate([x, y]), n=2, axis=1) / STEP**2 * MASS / sigma
    within = bends[:, : every * (intervals - 1) + 1].copy()
    assert np.abs(np.diff(within.reshape(2 * worlds, -1)[:, :3], axis=1)).max() < 1e-3
    return np.asarray(bends[:, ::every])


def test_the_force_remembers_as_said_from_the_start_on() -> None:
    """Covariance of forces i and j: kept^|i-j| (1 - kept)/(1 + kept), of the first as of others.

    8,000 rows: a variance has a relative sd of 1.6 %, a correlation one below 0.011; 5 sd, and 20
    of each: a false alarm in 80,000.
    """
    found = forces(MEMORY, worlds=4000, intervals=20)
    kept = np.exp(-4 * STEP / MEMORY)
    variance = (found**2).mean(axis=0)
    np.testing.assert_allclose(variance, (1 - kept) / (1 + kept), rtol=0.08)
    scaled = found / np.sqrt(variance)
    for lag in (1, 2, 3):
        along = (scaled[:, lag:] * scaled[:, :-lag]).mean(axis=0)
        np.testing.assert_allclose(along, kept**lag, atol=0.055)


@pytest.mark.slow
def test_a_force_that_remembers_has_the_intensity_it_had() -> None:
    """The sum of n forces has the variance sum of kept^|i-j| (1 - kept)/(1 + kept), n for large n.

    8,000 sums: relative sd 1.6 %; 5 sd, a false alarm in 1.7 million.
    """
    intervals = 60
    total = forces(MEMORY, worlds=4000, intervals=intervals).sum(axis=1)
    kept = np.exp(-4 * STEP / MEMORY)
    order = np.arange(intervals)
    exact = (kept ** np.abs(order[:, None] - order)).sum() * (1 - kept) / (1 + kept)
    assert exact == pytest.approx(intervals, rel=0.05)
    assert total.var() == pytest.approx(exact, rel=0.08)


def test_a_short_memory_is_none() -> None:
    world = np.repeat(one_world(0.02, force=1e-3), 5, axis=0)
    time = np.arange(11) * 0.1
    white = run(model(turning_water, times=time), world)
    short = run(model(turning_water, times=time, force_memory=1e-4), world)
    for one, other in zip(white, short, strict=True):
        np.testing.assert_array_equal(one, other)


@ADDED
@pytest.mark.parametrize("precision", ["double", "single"])
def test_an_assembly_that_turns_with_the_water_stays_with_it(added: float, precision: str) -> None:
    # Three blocks in an L, which latch at the first step; the water pushes each at its place.
    cells = np.array([[0, 0], [1, 0], [0, 1]])
    arms = SIDE * (cells - cells.mean(axis=0))
    start = np.zeros((1, 3, 3))
    start[0, :, :2] = np.array([0.03, 0.0]) + arms
    native = model(
        turning_water, times=[0.0], nodes=NODES, displaced_mass=MASS, added_mass_share=added
    )
    # From rest without drag, the middle swings through the tank's and the body does not turn: the
    # push on it is that on its centre of mass, -Omega^2 r.
    steps = 200
    found = assemble(
        native, start, keys(1), steps=steps, drag=0.0, sample_every=steps,
        precision=precision,
    )  # fmt: skip
    assert (found["assembly"] == 0).all()
    middle = found["pose"][0, :, :2].mean(axis=0)
    # The latch forgets what pushed before it, which costs half a step.
    assert middle[0] == pytest.approx(0.03 * np.cos(steps * STEP), abs=0.03 * STEP)
    assert abs(middle[1]) < 1e-6
    assert np.abs(found["pose"][0, :, 2]).max() < 1e-4


@pytest.mark.parametrize("precision", ["double", "single"])
def test_joined_faces_feel_no_linear_drag(precision: str) -> None:
    # Two blocks face to face in a stream along them: six of eight faces, each a quarter of k.
    speed, time = 0.03, 5.0
    start = np.zeros((1, 2, 3))
    start[0, 1, 0] = SIDE
    native = model(
        lambda x, y: (speed + 0 * x, 0 * y), times=[0.0], radius=1.0, linear_drag=LINEAR,
    )  # fmt: skip
    for hidden, faces in (("none", 6), ("full", 8)):
        found = assemble(
            native, start, keys(1), steps=round(time / STEP), drag=0.0,
            hidden_face_drag=hidden, sample_every=1, precision=precision,
        )  # fmt: skip
        rate = LINEAR / MASS * faces / 8
        way = speed * (time + np.expm1(-rate * time) / rate)
        moved = found["sample_pose"][0, -1, 0, 0] - found["sample_pose"][0, 0, 0, 0]
        assert moved == pytest.approx(way, rel=2e-3)
