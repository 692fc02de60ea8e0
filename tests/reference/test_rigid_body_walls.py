"""Discs, rectangles and glued blocks at a wall and under a force with a lever: closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from plain_bodies import glued, rectangle

import driftwalk as dw
from driftwalk.schema import build_flow_field

EXACT = {"position_noise_m": 0.0, "orientation_noise_rad": 0.0, "position_quantum_m": 0.0}
FREE = {"drag_coefficient": 0.0, "force_std_N": 0.0}
STILL = dw.uniform_flow(0.0, 0.0, arena={"shape": "circle", "diameter_m": 1.0})
STEP = 2e-3
CIRCLE = {"diameter_m": 0.3}
POLYGON = {
    "shape": "polygon", "vertices_m": [[-0.15, -0.12], [0.16, -0.13], [0.18, 0.1], [-0.1, 0.16]]
}  # fmt: skip


def poses(
    shape: str, start: Any, seconds: float, *, tank: dict[str, Any], forces: Any = None,
    flow: Any = STILL, every: float = STEP, **options: Any,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Return places and angles, shape (replicates, samples), in double precision."""
    study = dw.Study(
        block={"shape": shape, "mass_kg": 0.02}, forces=FREE | (forces or {}), tank=tank,
        observation=EXACT, simulation={"time_step_s": STEP},
    )  # fmt: skip
    found = dw.simulate(
        study, flow, sample_time=np.arange(round(seconds / every) + 1) * every, start=start,
        **{"replicates": 1, "backend": "reference"} | options,
    )  # fmt: skip
    assert not found["status"].values.any()
    place = found["x"].values[..., 0] + 1j * found["y"].values[..., 0]
    return place, np.unwrap(found["theta"].values[..., 0], axis=-1)


@pytest.mark.parametrize("friction", [0.0, 0.05, 0.4])
@pytest.mark.parametrize("where", ["circle", "polygon"])
def test_a_disc_bounces_as_the_closed_form_says(where: str, friction: float) -> None:
    """Restitution e across; along the wall it loses min(mu (1 + e) v_n, v_t / 3) and spins up.

    The rim sticks when an impulse J stops it: v_t - J (1 + R² m/I) = 0 with R² m/I = 2.
    """
    e, radius, speed = 0.7, 0.02, 0.1 + 0.06j
    tank = {"wall_restitution": e, "wall_friction": friction}
    tank |= CIRCLE if where == "circle" else {
        "shape": "polygon", "vertices_m": [[-0.2, -0.2], [0.2, -0.2], [0.2, 0.2], [-0.2, 0.2]]
    }  # fmt: skip
    start = dw.simulation.Start(0.05, -0.03, 0.2, speed.real, speed.imag, 0.0)
    place, angle = poses("disc:4cm", start, 2.2, tank=tank)
    velocity = np.diff(place[0]) / STEP
    hit = int(np.flatnonzero(np.abs(np.diff(velocity)) > 1e-6)[0])
    # The first two changes are of one blow: the step in which it was, and the one after.
    after = velocity[hit + 3]
    at = place[0, hit + 1]
    normal = at / abs(at) if where == "circle" else 1.0
    across, along = ((speed * np.conj(normal)).real, (speed * np.conj(normal)).imag)
    lost = np.sign(along) * min(friction * (1 + e) * across, abs(along) / 3)
    want = (-e * across + 1j * (along - lost)) * normal
    assert abs(after - want) < 0.01 * abs(speed)
    spin = (angle[0, hit + 4] - angle[0, hit + 3]) / STEP
    # The impulse -lost acts at R: I d(omega) = -R m lost, with I = m R² / 2.
    assert spin == pytest.approx(-2 * lost / radius, abs=0.02 * abs(speed) / radius)


OUTLINES = {
    "rectangle:5x2cm": rectangle(0.05, 0.02).corners,
    "xx:3cm": glued("xx", 0.03, 0.0).corners,
    "x./xx:3cm": glued("x./xx", 0.03, 0.0).corners,
    "disc:4cm": np.zeros(1),
}
RIM = {"disc:4cm": 0.02}
"""How far the outline is beyond these points [m]."""


def beyond(shape: str, place: np.ndarray, angle: np.ndarray, tank: dict[str, Any]) -> float:
    """Return how far any point of the outline was outside [m]."""
    corners = place[..., None] + OUTLINES[shape] * np.exp(1j * angle[..., None])
    if "diameter_m" in tank:
        return float(np.abs(corners).max() - tank["diameter_m"] / 2) + RIM.get(shape, 0.0)
    outline = [complex(*corner) for corner in tank["vertices_m"]]
    edges = zip(outline, outline[1:] + outline[:1], strict=True)
    return RIM.get(shape, 0.0) + max(
        float((np.conj((b - a) / abs(b - a)) * (corners - a)).imag.min() * -1.0) for a, b in edges
    )


@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("tank", [CIRCLE, POLYGON], ids=["circle", "polygon"])
@pytest.mark.parametrize("shape", OUTLINES)
def test_energy_never_grows_at_a_wall(shape: str, tank: dict[str, Any], friction: float) -> None:
    """Without drag and force, elastic: between blows the energy is that before, or less."""
    moment = dw.Study(block={"shape": shape, "mass_kg": 1.0}).block.inertia_kg_m2
    rng = np.random.default_rng(6)
    count = 12
    angle = rng.uniform(0, 2 * np.pi, count)
    start = dw.simulation.Start(
        rng.uniform(-0.05, 0.05, count), rng.uniform(-0.05, 0.05, count), rng.uniform(-3, 3, count),
        0.1 * np.cos(angle), 0.1 * np.sin(angle), rng.uniform(-3, 3, count),
    )  # fmt: skip
    wall = {"wall_restitution": 1.0, "wall_friction": friction, "bounce_speed_m_s": 0.0}
    place, turned = poses(shape, start, 30.0, tank=tank | wall, replicates=count)
    assert beyond(shape, place, turned, tank) < 2e-5
    velocity, spin = np.diff(place) / STEP, np.diff(turned) / STEP
    energy = 0.5 * (np.abs(velocity) ** 2 + moment * spin**2)
    free = np.abs(np.diff(velocity, append=0)) + 0.02 * np.abs(np.diff(spin, append=0)) < 1e-8
    free &= np.roll(free, 1)
    blows = 0
    for row, mask in zip(energy, free, strict=True):
        flights = row[mask]
        assert np.all(np.diff(flights) < 1e-6 * row[0])
        blows += int((~mask).sum())
        if friction == 0.0:
            assert flights[-1] == pytest.approx(row[0], rel=1e-5)
    assert blows > 10 * count


@pytest.mark.parametrize("tank", [CIRCLE, POLYGON], ids=["circle", "polygon"])
@pytest.mark.parametrize("shape", OUTLINES)
def test_a_strong_force_leaves_no_corner_beyond_the_wall(shape: str, tank: dict[str, Any]) -> None:
    place, turned = poses(
        shape, dw.simulation.Start(0.0, 0.0, 0.3), 60.0, tank=tank | {"wall_friction": 0.3},
        forces={"force_std_N": 5e-3, "drag_coefficient": 0.5}, replicates=6, every=0.02,
        flow=dw.uniform_flow(0.06, 0.02, arena={"shape": "circle", "diameter_m": 1.0}),
    )  # fmt: skip
    assert -1e-3 < beyond(shape, place, turned, tank) < 1e-4


@pytest.mark.parametrize("tank", [CIRCLE, POLYGON], ids=["circle", "polygon"])
def test_a_rectangle_of_equal_sides_moves_as_the_square_block(tank: dict[str, Any]) -> None:
    rng = np.random.default_rng(3)
    count = 8
    start = dw.simulation.Start(
        rng.uniform(-0.05, 0.05, count), rng.uniform(-0.05, 0.05, count), rng.uniform(-3, 3, count)
    )
    flow = dw.uniform_flow(0.05, 0.01, arena={"shape": "circle", "diameter_m": 1.0})
    forces = {"force_std_N": 6e-4, "drag_coefficient": 0.5, "added_mass_share": 0.5,
              "pressure_gradient": True}  # fmt: skip
    square, twin = (
        poses(shape, start, 8.0, tank=tank, forces=forces, flow=flow, every=0.1, replicates=count)
        for shape in ("square:3cm", "rectangle:3x3cm")
    )
    assert np.abs(square[0]).max() > 0.1
    for one, other in zip(square, twin, strict=True):
        # A blow makes a difference of rounding larger.
        assert np.abs(one - other)[:, :10].max() < 1e-12
        assert np.abs(one - other).max() < 2e-5
    single = [
        poses(shape, start, 2.0, tank=tank, forces=forces, flow=flow, every=0.1, replicates=count,
              backend="cpu")[0]
        for shape in ("square:3cm", "rectangle:3x3cm")
    ]  # fmt: skip
    assert np.abs(single[0] - single[1]).max() < 5e-5


@pytest.mark.slow
@pytest.mark.false_alarm(3e-4)
def test_a_force_with_a_lever_turns_a_free_body(fresh_seed: Any) -> None:
    """var(omega) = (sigma_F l / I)² tau t, and nothing of it is in the velocity.

    1,500 bodies: four standard deviations of a variance are 14.6 %, of a correlation 0.103.
    """
    sigma, lever, tau, seconds = 6e-4, 0.012, 0.01, 0.5
    place, turned = poses(
        "xx:3cm", dw.simulation.Start(0.0, 0.0, 0.3), seconds, tank={"diameter_m": 20.0},
        forces={"force_std_N": sigma, "force_lever_m": lever, "force_interval_s": tau},
        replicates=1500, every=tau, seed=fresh_seed(8),
    )  # fmt: skip
    # The mean over the last interval lacks half of its own push.
    spin = (turned[:, -1] - turned[:, -2]) / tau
    velocity = (place[:, -1] - place[:, -2]) / tau
    steps = seconds / tau - 1 + 0.25
    inertia = 0.02 * 5 * 0.03**2 / 12
    assert spin.var() == pytest.approx((sigma * lever / inertia) ** 2 * tau**2 * steps, rel=0.147)
    assert velocity.var() == pytest.approx(2 * (sigma / 0.02) ** 2 * tau**2 * steps, rel=0.147)
    for part in (velocity.real, velocity.imag):
        assert abs(np.corrcoef(spin, part)[0, 1]) < 0.104


@pytest.mark.parametrize("shape", OUTLINES)
def test_the_water_carries_a_floating_body_round(shape: str) -> None:
    """Without drag, in water that turns as a solid, a body that moves with it stays with it."""
    axis = np.linspace(-0.2, 0.2, 41)
    x, y = np.meshgrid(axis, axis)
    flow = build_flow_field(axis, axis, u=-y, v=x, flag=np.ones(x.shape, dtype=np.int8))
    place, angle = poses(
        shape, dw.simulation.Start(0.05, 0.0, 0.0, 0.0, 0.05, 1.0), 6.0, tank=CIRCLE, flow=flow,
        forces={"pressure_gradient": True, "added_mass_share": 0.5}, every=0.1,
    )  # fmt: skip
    circle = 0.05 * np.exp(1j * 0.1 * np.arange(61))
    assert np.abs(place[0] - circle).max() < 2e-3 * 0.05
    assert angle[0, -1] == pytest.approx(6.0, abs=2e-3)


@pytest.mark.parametrize("shape", ["square:3cm", *OUTLINES])
def test_the_water_turns_a_floating_body_as_itself(shape: str) -> None:
    """In u = g z with complex g, Du/Dt = g² z: from rest it moves as cosh(g t) and spins im(g²) t.

    That holds for every outline.
    """
    axis = np.linspace(-0.2, 0.2, 41)
    x, y = np.meshgrid(axis, axis)
    water = (growth := -0.5 + 1j) * (x + 1j * y)
    flow = build_flow_field(
        axis, axis, u=water.real, v=water.imag, flag=np.ones(x.shape, dtype=np.int8)
    )
    place, angle = poses(
        shape, dw.simulation.Start(0.02, 0.0, 0.3), 1.0, tank=CIRCLE, flow=flow, every=0.1,
        forces={"pressure_gradient": True, "added_mass_share": 0.5},
    )  # fmt: skip
    time = 0.1 * np.arange(11)
    np.testing.assert_allclose(place[0], 0.02 * np.cosh(growth * time), atol=1e-4)
    np.testing.assert_allclose(angle[0], 0.3 + (growth**2).imag * time**2 / 2, atol=2e-3)
