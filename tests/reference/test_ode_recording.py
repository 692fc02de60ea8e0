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
    """Return a function that gives the poses, shape (samples, 3), of a block in even flow."""
    folder = tmp_path_factory.mktemp("ode")
    try:
        program = peer.build_peer(folder, "ode_recording")
    except peer.PeerMissing as reason:
        pytest.skip(str(reason))

    def run(
        *, start: list[float], step: float, seconds: float, hold: int = 1, period: int = 1
    ) -> np.ndarray:
        study = dw.apply_overrides(dw.Study(), {"simulation.time_step_s": step})
        still = np.zeros((AXIS.size, AXIS.size))
        case = folder / "case.txt"
        peer.write_case(
            case,
            study,
            axis=AXIS,
            u=still,
            v=still,
            worlds=np.array([[start]]),
            steps_per_sample=period,
        )
        samples = round(seconds / (step * period)) + 1
        numbers = ["5", str(hold), "0", str(samples)]
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
