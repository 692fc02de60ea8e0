"""The program that makes the recordings of another engine, held to closed forms.

It shares no code with driftwalk, and has to: the likelihood fit is judged by its recordings.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import driftwalk as dw
from driftwalk.schema import build_flow_field

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"
AXIS = np.linspace(-0.2, 0.2, 5)
SIDE, MASS, DEPTH, DENSITY = 0.03, 0.0116, 0.03, 1000.0
Simulate = Callable[..., np.ndarray]


@pytest.fixture(scope="module")
def peer() -> ModuleType:
    sys.path.append(str(BENCHMARKS))
    try:
        import peer
    finally:
        sys.path.remove(str(BENCHMARKS))
    return peer


@pytest.fixture(scope="module")
def simulate(peer: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Simulate:
    """Return a function that gives the poses, shape (samples, 3), of a block in turning water."""
    folder = tmp_path_factory.mktemp("ode")
    try:
        program = peer.build_peer(folder, "ode_recording")
    except peer.PeerMissing as reason:
        pytest.skip(str(reason))

    def run(
        *,
        start: list[float],
        step: float,
        seconds: float,
        hold: int = 1,
        period: int = 1,
        turning: float = 0.0,
        water: Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]] | None = None,
        axis: np.ndarray = AXIS,
        law: tuple[str, ...] = (),
    ) -> np.ndarray:
        study = dw.apply_overrides(dw.Study(), {"simulation.time_step_s": step})
        x, y = np.meshgrid(axis, axis)
        u, v = (-turning * y, turning * x) if water is None else water(x, y)
        case = folder / "case.txt"
        peer.write_case(
            case,
            study,
            axis=axis,
            u=u,
            v=v,
            worlds=np.array([[start]]),
            steps_per_sample=period,
        )
        samples = round(seconds / (step * period)) + 1
        numbers = ["5", str(hold), "0", str(samples), *law]
        done = subprocess.run([program, case, *numbers], check=True, capture_output=True, text=True)
        return np.array(done.stdout.split(), dtype=float).reshape(-1, 3)

    return run


def test_drag_brings_a_block_to_rest(simulate: Simulate) -> None:
    """Face on: m dv/dt = -k v^2, so the way is m/k ln(1 + k v0 t/m). The error is first order."""
    drag, speed, seconds = 0.6, 0.1, 3.0
    rate = 0.5 * DENSITY * drag * SIDE * DEPTH / MASS
    way = np.log1p(rate * speed * seconds) / rate
    start = [-0.05, 0.0, 0.0, speed, 0.0, 0.0, drag, 0.0]
    error = {}
    for step in (2e-3, 0.5e-3):
        poses = simulate(start=start, step=step, seconds=seconds)
        error[step] = (poses[-1, 0] - poses[0, 0]) / way - 1.0
        assert abs(poses[-1, 1]) < 1e-12
        assert abs(poses[-1, 2]) < 1e-12
    assert abs(error[0.5e-3]) < 1e-3
    assert error[2e-3] == pytest.approx(4.0 * error[0.5e-3], rel=0.1)


def test_drag_of_strips_brings_a_turning_block_to_rest(simulate: Simulate) -> None:
    """I domega/dt = -c omega^2: half of each face is windward, strips at o_k with s = omega o_k
    and tangential speed omega h, so c = 4 K sum_windward (o_k^3 + h^2 o_k), K = rho C_d w d / 2."""
    drag, turning, seconds = 0.6, 3.0, 2.0
    width, half = SIDE / 8, SIDE / 2
    offsets = (np.arange(4) + 0.5) * width
    damping = 4 * 0.5 * DENSITY * drag * width * DEPTH * np.sum(offsets**3 + half**2 * offsets)
    rate = damping / (MASS * SIDE**2 / 6)
    angle = np.log1p(rate * turning * seconds) / rate
    start = [0.0, 0.0, 0.0, 0.0, 0.0, turning, drag, 0.0]
    poses = simulate(start=start, step=0.5e-3, seconds=seconds)
    assert np.unwrap(poses[:, 2])[-1] == pytest.approx(angle, rel=2e-3)


def test_the_force_is_held_and_of_the_stated_size(simulate: Simulate) -> None:
    """Without drag, velocities change only every 20 steps, by N(0, (sigma_F 20 dt/m)^2).

    800 draws (2 axes, 400): their sample variance has a relative sd of 5 %; 4 sd, a false alarm
    in 16,000. A force held for another time, or redrawn each step, is off by a factor.
    """
    step, hold, force = 0.5e-3, 20, 1e-4
    start = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, force]
    poses = simulate(start=start, step=step, seconds=4.0, hold=hold)
    kicks = np.diff(poses[:, :2], n=2, axis=0) / step**2 * MASS
    # The first force acts from step 0 on; second differences show it from the second step on.
    held = kicks[: (len(kicks) // hold) * hold]
    blocks = np.stack([held[k * hold : (k + 1) * hold - 1] for k in range(len(held) // hold)])
    assert np.ptp(blocks, axis=1).max() < 1e-3 * force
    assert blocks[:, 0].var() == pytest.approx(force**2, rel=0.2)


def test_a_corner_comes_back_from_the_wall(simulate: Simulate) -> None:
    """A corner straight at the wall: half the normal speed comes back, restitution 0.5."""
    speed, step = 0.2, 0.5e-3
    start = [0.05, 0.0, np.pi / 4, speed, 0.0, 0.0, 0.0, 0.0]
    poses = simulate(start=start, step=step, seconds=1.0)
    assert poses[:, 0].max() + SIDE / np.sqrt(2.0) == pytest.approx(0.15, abs=speed * step)
    assert np.diff(poses[-100:, 0]) / step == pytest.approx(np.full(99, -0.5 * speed))


def test_added_mass_slows_the_drag_down(simulate: Simulate) -> None:
    """Face on, (m + m_a) dv/dt = -k v^2: the way of a block whose mass is 1.5 times as large."""
    drag, speed, seconds = 0.6, 0.1, 3.0
    rate = 0.5 * DENSITY * drag * SIDE * DEPTH / (1.5 * MASS)
    start = [-0.05, 0.0, 0.0, speed, 0.0, 0.0, drag, 0.0]
    poses = simulate(start=start, step=0.5e-3, seconds=seconds, law=("added_mass=0.5",))
    way = np.log1p(rate * speed * seconds) / rate
    assert poses[-1, 0] - poses[0, 0] == pytest.approx(way, rel=1e-3)


def test_linear_drag_falls_off_exponentially(simulate: Simulate) -> None:
    """At 3 cm/s as large as the quadratic drag: m dv/dt = -k v0 v with v0 = 3 cm/s."""
    drag, speed, seconds = 0.6, 0.1, 3.0
    rate = 0.5 * DENSITY * drag * SIDE * DEPTH / MASS * 0.03
    start = [-0.05, 0.0, 0.0, speed, 0.0, 0.0, drag, 0.0]
    poses = simulate(start=start, step=0.5e-3, seconds=seconds, law=("drag_power=1",))
    way = speed / rate * -np.expm1(-rate * seconds)
    assert poses[-1, 0] - poses[0, 0] == pytest.approx(way, rel=1e-3)


@pytest.mark.parametrize("added_mass", [0.0, 0.5])
def test_the_water_s_acceleration_keeps_a_block_on_its_circle(
    simulate: Simulate, added_mass: float
) -> None:
    """Without drag, in water that turns as a solid, a block that moves with it stays with it.

    The engine's steps of first order let the radius grow by a part in 2,000.
    """
    turning, radius, seconds = 1.0, 0.05, 6.0
    start = [radius, 0.0, 0.0, 0.0, turning * radius, 0.0, 0.0, 0.0]
    law = ("pressure_gradient=1", f"added_mass={added_mass}")
    poses = simulate(start=start, step=0.5e-3, seconds=seconds, turning=turning, law=law)
    angle = turning * 0.5e-3 * np.arange(len(poses))
    circle = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    assert np.abs(poses[:, :2] - circle).max() < 2e-3 * radius


@pytest.mark.parametrize("added_mass", [0.0, 0.5])
def test_water_that_gains_spin_turns_a_block(simulate: Simulate, added_mass: float) -> None:
    """u = (U, b x^2) has the vorticity 2 b x, so water gains the spin b U a second, everywhere.

    Without drag a block gains the same, with whatever added inertia, and stays where it is. The
    nodes' central differences are exact for a parabola, and first-order steps add b U t dt/2.
    """
    along, bend, seconds, step = 0.05, 2.0, 4.0, 0.5e-3
    law = ("water_spin=1", f"added_mass={added_mass}")
    poses = simulate(
        start=[0.0, 0.01, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0],
        step=step,
        seconds=seconds,
        water=lambda x, y: (along + 0 * x, bend * x**2),
        law=law,
    )
    turned = np.unwrap(poses[:, 2])[-1] - 0.3
    assert turned == pytest.approx(0.5 * bend * along * seconds * (seconds + step), rel=1e-5)
    assert np.abs(poses[:, :2] - [0.0, 0.01]).max() < 1e-12


@pytest.mark.parametrize("added_mass", [0.0, 0.5])
def test_a_drag_linear_in_the_slip_brings_a_block_to_rest(
    simulate: Simulate, added_mass: float
) -> None:
    """(m + m_a) dv/dt = -k v at any angle, and (I + I_a) domega/dt = -k <r^2> omega.

    <r^2> is the mean of strips at offsets o on faces h from the middle: h^2 + <o^2>.
    """
    drag, speed, spin, seconds, step = 5e-3, 0.05, 2.0, 3.0, 0.25e-3
    poses = simulate(
        start=[-0.02, 0.0, 0.5, 0.6 * speed, 0.8 * speed, spin, 0.0, 0.0],
        step=step,
        seconds=seconds,
        law=(f"linear_drag={drag}", f"added_mass={added_mass}"),
    )
    rate = drag / (MASS * (1 + added_mass))
    way = speed / rate * -np.expm1(-rate * seconds)
    moved = poses[-1, :2] - poses[0, :2]
    assert moved == pytest.approx([0.6 * way, 0.8 * way], rel=1e-3)
    offsets = (np.arange(8) + 0.5) * SIDE / 8 - SIDE / 2
    spin_rate = rate * (SIDE**2 / 4 + np.mean(offsets**2)) / (SIDE**2 / 6)
    turned = np.unwrap(poses[:, 2])[-1] - 0.5
    assert turned == pytest.approx(spin / spin_rate * -np.expm1(-spin_rate * seconds), rel=1e-3)


def test_a_drag_linear_in_the_slip_takes_a_block_along(simulate: Simulate) -> None:
    """In water of one speed U the slip falls off exponentially, whichever faces are windward."""
    drag, along, seconds = 5e-3, 0.02, 3.0
    poses = simulate(
        start=[-0.05, 0.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0],
        step=0.25e-3,
        seconds=seconds,
        water=lambda x, y: (along + 0 * x, 0 * x),
        law=(f"linear_drag={drag}",),
    )
    rate = drag / MASS
    way = along * (seconds + np.expm1(-rate * seconds) / rate)
    assert poses[-1, 0] - poses[0, 0] == pytest.approx(way, rel=1e-3)
    assert np.abs(poses[:, 1:] - [0.0, 0.3]).max() < 1e-9


def test_a_force_that_remembers_keeps_its_intensity(simulate: Simulate) -> None:
    """Without drag the velocity diffuses as with the white force, and kicks are correlated.

    300 s in 1,500 pieces of 0.2 s, ten memories each: the variance of the velocity's gain has a
    relative sd of 5 % (2 axes) and is below sigma_F^2 tau t/m^2 by a tenth, the memory that does
    not count yet; 5 sd, a false alarm in 1.7 million.
    """
    hold, step, force, memory, seconds = 4, 2.5e-3, 1e-6, 0.02, 300.0
    start = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, force]
    poses = simulate(
        start=start, step=step, seconds=seconds, hold=hold, law=(f"force_memory={memory}",)
    )
    velocity = np.diff(poses[:, :2], axis=0) / step
    gain = np.diff(velocity[::80], axis=0)
    white = (force / MASS) ** 2 * (hold * step) * (80 * step)
    assert gain.var() == pytest.approx(0.9 * white, rel=0.2)
    kicks = np.diff(velocity[hold - 1 :: hold], axis=0)
    along = (kicks[1:] * kicks[:-1]).mean() / (kicks**2).mean()
    assert along == pytest.approx(np.exp(-hold * step / memory), abs=0.05)


def test_a_floating_body_moves_here_as_in_driftwalk(simulate: Simulate) -> None:
    """Water that turns and gathers, u = M r: Du/Dt = M^2 r has a curl, and is exact on all nodes.

    The engine's steps are of first order: 0.25 ms leave some 0.01 mm and 0.1 mrad in 2 s.
    """
    inward, turning, step, seconds = 0.4, 1.2, 0.25e-3, 2.0
    axis = np.linspace(-0.2, 0.2, 41)
    law = ("added_mass=0.6", "pressure_gradient=1", "water_spin=1", "linear_drag=0.004")
    poses = simulate(
        start=[0.08, 0.0, 0.3, 0.0, 0.03, 0.5, 0.45, 0.0],
        step=step,
        seconds=seconds,
        period=40,
        axis=axis,
        water=lambda x, y: (-inward * x - turning * y, turning * x - inward * y),
        law=law,
    )
    forces = {"drag_coefficient": 0.45, "force_std_N": 0.0, "added_mass_share": 0.6}
    floating = {"pressure_gradient": True, "linear_drag_kg_s": 0.004}
    x, y = np.meshgrid(axis, axis)
    water = build_flow_field(
        axis,
        axis,
        u=-inward * x - turning * y,
        v=turning * x - inward * y,
        flag=np.ones(x.shape, dtype=np.int8),
    )
    found = {}
    for name, kept in (("floating", {**forces, **floating}), ("paper", {"force_std_N": 0.0})):
        run = dw.simulate(
            dw.Study(forces=kept, simulation={"time_step_s": 2.5e-3}),
            water,
            sample_time=np.arange(len(poses)) * 40 * step,
            start=dw.simulation.Start(0.08, 0.0, 0.3, 0.0, 0.03, 0.5),
            replicates=1,
            backend="reference",
        )
        found[name] = np.stack([run[axis].values[0, :, 0] for axis in ("x", "y", "theta")], axis=1)
    apart = {name: np.abs(path - poses).max(axis=0) for name, path in found.items()}
    assert apart["floating"][:2].max() < 5e-5
    assert apart["floating"][2] < 5e-4
    assert apart["paper"][:2].max() > 5e-3
    assert apart["paper"][2] > 0.1


def test_a_law_with_another_name_is_refused(simulate: Simulate) -> None:
    with pytest.raises(subprocess.CalledProcessError):
        simulate(start=[0.0] * 8, step=1e-3, seconds=0.1, law=("gravity=9.81",))


def test_drag_of_the_rim_brings_a_disc_to_rest(simulate: Simulate) -> None:
    """m dv/dt = -k v^2 in any direction, and I domega/dt = -k v R^2 omega: omega ~ v^(m R^2/I)."""
    drag, speed, seconds = 0.6, 0.1, 3.0
    rate = 0.5 * DENSITY * drag * SIDE * DEPTH / MASS
    start = [-0.04, -0.03, 0.0, 0.8 * speed, 0.6 * speed, 2.0, drag, 0.0]
    poses = simulate(start=start, step=0.5e-3, seconds=seconds, law=("disc=1",))
    way = np.log1p(rate * speed * seconds) / rate
    assert poses[-1, :2] == pytest.approx([0.8 * way - 0.04, 0.6 * way - 0.03], abs=1e-3 * way)
    # v = v0 / (1 + k v0 t / m), so omega = omega0 / (1 + ...)^2: its integral.
    turned = 2.0 * seconds / (1.0 + rate * speed * seconds)
    assert np.unwrap(poses[:, 2])[-1] == pytest.approx(turned, rel=2e-3)


def test_a_disc_bounces_off_the_wall_and_rolls(simulate: Simulate) -> None:
    """Restitution 0.5; the study's wall is smooth, so what is along it stays."""
    step = 0.5e-3
    start = [0.05, 0.05, 0.0, 0.2, 0.05, 1.0, 0.0, 0.0]
    poses = simulate(start=start, step=step, seconds=1.0, law=("disc=1",))
    at = poses[np.argmax(np.hypot(poses[:, 0], poses[:, 1])), :2]
    normal = at / np.hypot(*at)
    velocity = np.array([0.2, 0.05])
    want = velocity - 1.5 * (velocity @ normal) * normal
    assert np.hypot(*poses[:, :2].T).max() == pytest.approx(0.15 - SIDE / 2, abs=0.2 * step)
    assert np.diff(poses[-50:, :2], axis=0)[0] / step == pytest.approx(want, abs=0.005)
    assert np.unwrap(poses[:, 2])[-1] == pytest.approx(1.0, rel=1e-3)


def test_a_disc_goes_the_way_of_driftwalk_for_20_s(simulate: Simulate) -> None:
    """Two engines in one flow, without noise: the paths are 0.15 mm apart at most."""
    axis = np.linspace(-0.165, 0.165, 67)

    def water(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        near = np.exp(-(((x**2 + y**2) / 0.1**2) ** 2))
        return -0.6 * y * near - 0.2 * x, 0.6 * x * near - 0.2 * y + 0.01 * np.sin(30 * x)

    step, seconds = 0.25e-3, 20.0
    start = [0.06, 0.02, 0.0, 0.0, 0.0, 0.0, 0.6, 0.0]
    poses = simulate(
        start=start, step=step, seconds=seconds, period=round(0.5 / step), water=water, axis=axis,
        law=("disc=1",),
    )  # fmt: skip
    x, y = np.meshgrid(axis, axis)
    u, v = water(x, y)
    found = dw.simulate(
        dw.Study(
            block={"shape": "disc", "side_m": SIDE, "mass_kg": MASS},
            forces={"drag_coefficient": 0.6, "force_std_N": 0.0},
            observation={"position_noise_m": 0.0, "position_quantum_m": 0.0},
            simulation={"time_step_s": 2e-3},
        ),
        build_flow_field(axis, axis, u=u, v=v, flag=np.ones(u.shape, dtype=np.int8)),
        sample_time=0.5 * np.arange(41), replicates=1,
        start=dw.simulation.Start(0.06, 0.02, 0.0),
    )  # fmt: skip
    path = np.stack([found["x"].values[0, :, 0], found["y"].values[0, :, 0]], axis=1)
    assert np.hypot(*(path - poses[:, :2]).T).max() < 1.5e-4
    assert np.hypot(*np.diff(path, axis=0).T).sum() > 0.3
