"""Rigid assemblies in a uniform flow: what one step and ten seconds do, on paper."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from kernel_worlds import assemble, keys
from single_block import DENSITY, INERTIA, MASS, SIDE, Floats, model

from driftwalk import _core

SPEED, STEP = 0.05, 0.01
SHAPES: dict[str, list[list[int]]] = {
    "pair along": [[0, 0], [1, 0]],
    "pair across": [[0, 0], [0, 1]],
    "line along": [[0, 0], [1, 0], [2, 0]],
    "corner": [[0, 0], [1, 0], [0, 1]],
    "square": [[0, 0], [1, 0], [0, 1], [1, 1]],
}
SYMMETRIC = ["pair along", "pair across", "line along", "square"]


def stream() -> _core.Model:
    """A uniform flow along x in a tank far away."""
    return model(
        lambda x, y: (SPEED + 0 * x, 0 * y), times=[0.0], radius=5.0, nodes=np.arange(-1, 2) * 5.0
    )


def poses_after(shape: str, steps: int, **options: Any) -> Floats:
    """Poses of blocks that begin at rest side by side, and latch in the first step."""
    start = np.zeros((1, len(SHAPES[shape]), 3))
    start[0, :, :2] = SIDE * np.array(SHAPES[shape])
    run = assemble(
        stream(), start, keys(1), steps=steps, sample_every=steps, precision="double", **options
    )
    assert (run["assembly"] == 0).all()
    assert (run["event_step"] == 1).all()
    np.testing.assert_array_equal(run["cell"][0], SHAPES[shape])
    return np.asarray(run["pose"][0])


def windward(shape: str, hidden: str) -> list[list[int]]:
    """Cells whose face towards the flow feels it."""
    cells = SHAPES[shape]
    return [[x, y] for x, y in cells if hidden == "full" or [x - 1, y] not in cells]


def rate(drag: float) -> float:
    """Deceleration of a block per square of its speed, one face ahead [1/m]."""
    return DENSITY * drag * SIDE * SIDE / (2 * MASS)


def first_speed(drag: float) -> float:
    """Speed of a single block after the first step, from rest."""
    c = rate(drag)
    return STEP * c * SPEED**2 / (1 + STEP / 2 * c * SPEED)


@pytest.mark.parametrize("hidden", ["none", "full"])
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("drag", [0.45, 4.0])
def test_one_step_of_a_rigid_assembly(shape: str, hidden: str, drag: float) -> None:
    one, two = (poses_after(shape, n, drag=drag, hidden_face_drag=hidden) for n in (1, 2))
    count, facing = len(one), windward(shape, hidden)
    before = first_speed(drag)
    slip = SPEED - before
    # One step without drag memory: force and conductance of the faces ahead, over all the mass.
    c = rate(drag) * len(facing) / count
    expected = STEP * (before + STEP / 2 * c * slip**2 / (1 + STEP / 2 * c * slip))
    moved = (two - one).mean(axis=0)
    assert moved[0] == pytest.approx(expected, rel=1e-9)
    assert moved[1] == pytest.approx(0.0, abs=1e-13)
    # Each face ahead pulls at its block's height above the centre of mass.
    arms = SIDE * (np.array(SHAPES[shape]) - np.mean(SHAPES[shape], axis=0))
    inertia = count * INERTIA + MASS * np.sum(arms**2)
    ahead = [SHAPES[shape].index(cell) for cell in facing]
    force = MASS * rate(drag) * slip**2
    torque = -force * np.sum(arms[ahead, 1])
    resistance = MASS * rate(drag) * slip * np.sum(SIDE**2 / 3 + np.sum(arms[ahead] ** 2, axis=1))
    turn = STEP**2 / 2 * torque / inertia / (1 + STEP / 2 * resistance / inertia)
    assert two[0, 2] - one[0, 2] == pytest.approx(turn, rel=1e-9, abs=1e-14)
    assert (abs(turn) > 1e-6) == (shape == "corner" and hidden == "none")


@pytest.mark.parametrize("hidden", ["none", "full"])
@pytest.mark.parametrize("shape", SYMMETRIC)
def test_the_terminal_velocity_is_that_of_the_flow(shape: str, hidden: str) -> None:
    # slip' = -c slip^2: slip = s / (1 + c s t), way = U t - ln(1 + c s t) / c.
    drag, seconds = 1.0, 10.0
    options: dict[str, Any] = {"drag": drag, "hidden_face_drag": hidden}
    steps = round(seconds / STEP)
    one = poses_after(shape, 1, **options).mean(axis=0)
    last, end = (poses_after(shape, n, **options).mean(axis=0) for n in (steps, steps + 1))
    c = rate(drag) * len(windward(shape, hidden)) / len(SHAPES[shape])
    slip = SPEED - first_speed(drag)
    way = SPEED * seconds - np.log1p(c * slip * seconds) / c
    assert end[0] - one[0] == pytest.approx(way, rel=1e-4)
    speed = SPEED - slip / (1 + c * slip * (seconds - STEP / 2))
    assert (end[0] - last[0]) / STEP == pytest.approx(speed, rel=1e-5)
    assert speed > 0.85 * SPEED
    assert abs(end[2]) < 1e-9
