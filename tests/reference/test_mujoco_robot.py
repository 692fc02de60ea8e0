"""The example that simulates with MuJoCo: docs/examples/mujoco_robot.py, held to closed forms.

MuJoCo integrates v' = v + dt a, with the damping taken at the end of the step. So without contact
the speed and the heading have a closed form in every step.
"""

from __future__ import annotations

import shlex
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import driftwalk as dw
from driftwalk.conditions import Conditions
from driftwalk.core.errors import InputError
from driftwalk.core.random_streams import world_keys
from driftwalk.model import Tank
from driftwalk.motion import MotionModel, Worlds, motion_model
from driftwalk.simulation import Start
from driftwalk.simulation.backend import Camera
from driftwalk.testing import MotionModelContract

pytest.importorskip("mujoco", reason="mujoco-core is not installed: make .venv/.test-tools")

PROGRAM = Path(__file__).resolve().parents[2] / "docs" / "examples" / "mujoco_robot.py"
SPEED, STEP, RADIUS = 0.05, 0.02, 0.015
SPEED_SETTLES, TURN_SETTLES = 0.2, 0.05
"""Mass / drag, and the same of the turning [s]."""
WIDE = dw.apply_overrides(dw.Study(), {"tank.diameter_m": 10.0}).tank
"""A tank whose wall is out of reach."""


@cache
def robot() -> MotionModel:
    """Return the model; its program runs on from test to test."""
    return motion_model(f"command:{shlex.quote(sys.executable)} {shlex.quote(str(PROGRAM))}")


def drive(
    start: Start, seconds: float, *, noise: float = 0.0, worlds: int = 1, tank=WIDE, seed: int = 1
) -> tuple[np.ndarray, Worlds]:
    """Return times and true positions, sampled between the steps of MuJoCo."""
    times = np.arange(0.0, seconds, 0.05)
    like = Conditions(times, start, Camera(), tank, None, None, 1)
    values = {"speed": np.full(worlds, SPEED), "turn_noise": np.full(worlds, noise)}
    keys = world_keys(seed, trial=0, replicate=np.arange(worlds))
    return times, robot().simulate(values, like, keys)


class TestContract(MotionModelContract):
    def model(self) -> MotionModel:
        return robot()


def test_without_noise_it_drives_straight_at_the_terminal_speed() -> None:
    heading = 0.7
    along = np.array([np.cos(heading), np.sin(heading)])
    times, seen = drive(Start(0.1, -0.2, heading, *(SPEED * along), 0.0), 20.0)
    way = np.stack([seen.x[0] - 0.1, seen.y[0] + 0.2])
    assert np.abs(way - SPEED * times * along[:, None]).max() < 1e-9
    assert np.abs(seen.theta[0] - heading).max() < 1e-9


def test_from_rest_the_speed_settles_as_the_drag_says() -> None:
    """v_n = v (1 - q^n), q = 1 / (1 + dt d/m): each step ends with its own drag."""
    times, seen = drive(Start(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), 2.0)
    steps = np.arange(round(2.0 / STEP) + 1)
    kept = 1.0 / (1.0 + STEP / SPEED_SETTLES)
    way = np.concatenate([[0.0], np.cumsum(STEP * SPEED * (1.0 - kept ** steps[1:]))])
    assert np.abs(seen.x[0] - np.interp(times, STEP * steps, way)).max() < 1e-9
    assert np.abs(seen.y[0]).max() < 1e-12


@pytest.mark.slow
@pytest.mark.false_alarm(2e-4)
def test_the_heading_diffuses(fresh_seed) -> None:
    """<cos> = exp(-V/2) with V = 2 D (t - 1.5 s): the turning settles within s, from rest.

    That is exact for short steps and t >> s; here the sum over the steps is taken, and held to it.
    2,000 worlds at 3 times, 4 standard errors: a false alarm in 5,000. A D that is wrong by a fifth
    is off by 6 of them at 0.5 s and by 5 at 1.5 s.
    """
    noise, worlds = 0.8, 2000
    still = Start(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    times, seen = drive(still, 4.0, noise=noise, worlds=worlds, seed=fresh_seed(5))
    kept = 1.0 / (1.0 + STEP / TURN_SETTLES)
    # A push at one step turns the body by a part of its impulse in every later step.
    pushed = np.cumsum(kept ** np.arange(1, round(4.0 / STEP) + 1)) * STEP / TURN_SETTLES
    for time in (0.5, 1.5, 3.0):
        steps = round(time / STEP)
        variance = 2.0 * noise * STEP * np.sum(pushed[:steps] ** 2)
        assert variance == pytest.approx(2.0 * noise * (time - 1.5 * TURN_SETTLES), rel=0.08)
        turned = np.cos(seen.theta[:, np.searchsorted(times, time - 1e-9)])
        spread = np.sqrt(0.5 * (1.0 + np.exp(-2.0 * variance)) - np.exp(-variance))
        error = spread / np.sqrt(worlds)
        assert turned.mean() == pytest.approx(np.exp(-variance / 2.0), abs=4.0 * error)


def test_the_wall_stops_it_at_its_radius() -> None:
    """Head on, against the middle of a flat piece: the soft contact gives way by 0.2 mm."""
    tank = dw.Study().tank
    _, seen = drive(Start(0.0, 0.0, 0.0, SPEED, 0.0, 0.0), 20.0, tank=tank)
    assert seen.x[0, -1] == pytest.approx(tank.radius_m - RADIUS, abs=2e-4)
    assert seen.x[0].max() < tank.radius_m - RADIUS + 2e-3
    assert np.abs(seen.y[0]).max() < 1e-6


def test_along_the_wall_it_slides_without_friction() -> None:
    """The wall takes the part of the push against it, so along it the speed is v sin(heading)."""
    tank = dw.Study().tank
    heading, reach = 0.06, tank.radius_m - RADIUS
    start = Start(reach, 0.0, heading, 0.0, 0.0, 0.0)
    times, seen = drive(start, 3.0, tank=tank)
    late = times > 1.5
    speed = np.polyfit(times[late], seen.y[0][late], 1)[0]
    assert speed == pytest.approx(SPEED * np.sin(heading), rel=0.02)


@pytest.mark.slow
def test_another_tank_is_refused_in_its_words() -> None:
    tank = Tank.from_arena({"shape": "rectangle", "width_m": 0.3, "height_m": 0.3})
    with pytest.raises(InputError, match="it reported: this robot knows round tanks only"):
        drive(Start(0.0, 0.0, 0.0, SPEED, 0.0, 0.0), 2.0, tank=tank)
