"""Discs and glued blocks of the study of bodies, held to closed forms; no code of driftwalk."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import plain_bodies as plain
import pytest

STUDIES = Path(__file__).resolve().parents[2] / "studies"
FOLDERS = [str(STUDIES / name) for name in ("bodies", "verdict")]
NAMES = ("ranges", "flows", "blocks", "shapes")
SIDE, MASS, DEPTH, DENSITY = 0.03, 0.0116, 0.03, 1000.0


@pytest.fixture(scope="module")
def study() -> Iterator[dict[str, ModuleType]]:
    """Give the modules of the study; other studies have modules of the same names."""
    before = {name: sys.modules.pop(name) for name in NAMES if name in sys.modules}
    path = sys.path.copy()
    sys.path[:0] = FOLDERS
    try:
        yield {name: import_module(name) for name in NAMES}
    finally:
        sys.path[:] = path
        for name in NAMES:
            sys.modules.pop(name, None)
        sys.modules.update(before)


def tanks(study: dict[str, ModuleType], body: Any, count: int, **given: Any) -> Any:
    """Return tanks of still water with a body at rest in the middle, but for what is given."""
    water = given.pop("water", np.zeros_like(study["flows"].X))
    values = {
        "start": 0j, "velocity": 0j, "angle": 0.0, "spin": 0.0, "drag_coefficient": 0.6,
        "force_std": 0.0, "added_mass": 0.0, "floating": False, "drag_power": 2.0,
        "force_memory": 0.0, "growth": 0.0, "pulse": 0.0, "pulse_period": 10.0, "friction": 0.0,
        "restitution": 0.5, "correlation": 0.0,
    }  # fmt: skip
    arrays = {name: np.full(count, value) for name, value in (values | given).items()}
    flow = study["flows"].Flow((water + 0j)[np.newaxis])
    return study["blocks"].Tanks(flow=[flow] * count, seed=list(range(count)), body=body, **arrays)


def test_a_disc_comes_to_rest(study: dict[str, ModuleType]) -> None:
    """m dv/dt = -k v^2, and omega goes with v^2 (R^2 m / I = 2): 1 / (1 + k v0 t / m)^2."""
    speed, seconds = 0.05, 3.0
    given = tanks(study, study["shapes"].disc(), 1, velocity=speed * np.exp(0.4j), spin=2.0)
    motion = study["blocks"].simulate(given, seconds, settling=0.0)
    rate = 0.5 * DENSITY * 0.6 * SIDE * DEPTH / MASS * speed
    way = speed / rate * np.log1p(rate * seconds) * np.exp(0.4j)
    assert abs(motion.place[0, -1] - way) < 2e-3 * abs(way)
    turned = 2.0 * seconds / (1.0 + rate * seconds)
    assert motion.angle[0, -1] == pytest.approx(turned, rel=5e-3)


def test_a_disc_bounces(study: dict[str, ModuleType]) -> None:
    """Straight at the wall half its speed comes back; along it a third at most is rubbed off."""
    given = tanks(study, study["shapes"].disc(), 1, start=0.08 + 0j, velocity=0.2 + 0.06j,
                  drag_coefficient=0.0, friction=0.1)  # fmt: skip
    motion = study["blocks"].simulate(given, 0.6, settling=0.0)
    assert np.abs(motion.place).max() < 0.15 - SIDE / 2 + 1e-9
    at = motion.place[0, np.argmax(np.abs(motion.place[0]))]
    assert motion.touched.sum() == 1
    before, after = 0.2 + 0.06j, motion.velocity[0, -1]
    # Where it was: on the line from the start, at the distance of the wall less a radius.
    way = np.roots([abs(before) ** 2, 2 * 0.08 * 0.2, 0.08**2 - (0.15 - SIDE / 2) ** 2]).max()
    normal = (0.08 + before * way) / (0.15 - SIDE / 2)
    across, along = (before * normal.conjugate()).real, (before * normal.conjugate()).imag
    lost = np.sign(along) * min(0.1 * 1.5 * across, abs(along) / 3)
    assert after == pytest.approx((-0.5 * across + 1j * (along - lost)) * normal, abs=1e-3)
    assert motion.spin[0, -1] == pytest.approx(-2 * lost / (SIDE / 2), abs=0.1)
    assert abs(at) > 0.12


@pytest.mark.parametrize("hidden", [0.0, 0.5, 1.0])
def test_a_dimer_feels_all_its_faces(study: dict[str, ModuleType], hidden: float) -> None:
    """Against 200 strips a face."""
    body, own = study["shapes"].dimer(hidden), plain.glued("xx", SIDE, hidden, 200)
    assert 1.0 / body.per_inertia == pytest.approx(own.square_radius, rel=1e-9)
    inner = np.stack([body.inner.real, body.inner.imag])
    assert (inner * body.shares) @ inner.T == pytest.approx(
        np.diag([4, 1]) * SIDE**2 / 12, abs=1e-12
    )
    rng = np.random.default_rng(3)
    for _ in range(5):
        angle, spin = rng.uniform(-3, 3), rng.uniform(-1, 1)
        velocity = complex(*rng.uniform(-0.05, 0.05, 2))
        given = tanks(study, body, 1)
        turned = np.exp(1j * np.array([[angle]]))
        arms = body.points * turned
        found = study["blocks"].drag(
            given, np.zeros_like(arms), turned, arms, np.array([velocity]), np.array([spin])
        )
        force, torque = plain.drag(
            own, lambda z: 0j * z, 0.5 * DENSITY * 0.6 * DEPTH, 0j, angle, velocity, spin
        )
        assert abs(found[0][0] - force) < 0.01 * abs(force)
        assert found[1][0] == pytest.approx(torque, abs=0.01 * abs(force) * SIDE)


@pytest.mark.slow
@pytest.mark.parametrize("correlation", [0.0, 0.8])
def test_forces_of_the_members_of_a_dimer(study: dict[str, ModuleType], correlation: float) -> None:
    """var F = 2 sigma^2 (1 + rho), var torque = sigma^2 (1 - rho) a^2 / 2.

    600 tanks: four standard deviations of a variance are 23 %, a false alarm in 16,000 each.
    """
    sigma, seconds, count = 2e-4, 0.5, 600
    given = tanks(study, study["shapes"].dimer(0.0), count, force_std=sigma,
                  correlation=correlation, drag_coefficient=0.0)  # fmt: skip
    motion = study["blocks"].simulate(given, seconds, settling=0.0)
    mass, inertia = 2 * MASS, 2 * MASS * 5 * SIDE**2 / 12
    gained = 0.01 * seconds
    assert motion.velocity[:, -1].real.var() == pytest.approx(
        2 * sigma**2 * (1 + correlation) * gained / mass**2, rel=0.23
    )
    assert motion.spin[:, -1].var() == pytest.approx(
        sigma**2 * (1 - correlation) * SIDE**2 / 2 * gained / inertia**2, rel=0.23
    )
