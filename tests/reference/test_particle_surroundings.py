"""Self-propelled particles at walls and in moving water against closed forms.

Statistical checks compare the mean of independent numbers with its closed form, to five standard
errors of that mean; a new seed breaks one check at most once in 1e5 runs. Five errors are 1 to 8 %
of most numbers here: a factor of two, a wrong sign and a lost term fail. Where a finite time step
has a part in it, its size is added.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from particle_paths import FALSE_ALARM, SIGMAS, Floats, errors_off, of, paths
from scipy import stats

from driftwalk.flow import uniform_flow
from driftwalk.model import Tank
from driftwalk.motion.choose import family_model
from driftwalk.motion.family.columns import State, switching_table
from driftwalk.schema import build_flow_field

Seed = Callable[[int], int]

BASIN = Tank(diameter_m=0.3)
HALL = Tank(shape="rectangle", width_m=2.0, height_m=0.4)


# --- the wall -------------------------------------------------------------------------------------


@pytest.mark.false_alarm(2 * FALSE_ALARM)
def test_a_diffusing_particle_fills_a_circle_evenly(fresh_seed: Seed) -> None:
    # Motion without a direction keeps an even distribution where walls reflect: r^2 / R^2 is
    # uniform. All start in the middle, and after 15 times R^2 / (14.7 s^2 tau), the time over which
    # the slowest round wave decays, nothing is left of that.
    std, memory, clearance, count = 0.1, 0.1, 0.02, 4000
    reach = 0.15 - clearance
    table = family_model("inertial", clearance=clearance).table(
        {"speed_std": std, "memory_time": memory, "turn_rate": 0.0}, count
    )
    time = np.append(np.arange(0.0, 17.0, 0.25), 17.25)
    z, _ = paths(table, time, seed=fresh_seed(15), tank=BASIN, contact="reflect", time_step=0.01)
    assert np.abs(z).max() <= reach + 1e-6 * 0.3, "a particle was within its clearance of the wall"
    evenly = (np.abs(z[:, -1]) / reach) ** 2
    assert errors_off(evenly, 0.5) < SIGMAS
    assert stats.kstest(evenly, "uniform").pvalue > FALSE_ALARM


WALLS = ("wall_turn", "wall_follow")


@pytest.mark.parametrize("name", WALLS)
@pytest.mark.parametrize("psi", [-2.5, -0.4, 0.3, 1.2, 2.0])
def test_a_heading_turns_at_a_wall_as_the_formula(name: str, psi: float) -> None:
    # At rest at a distance d: dpsi / dt = a w sin(psi) leads to tan(psi / 2) growing by exp(a w t),
    # dpsi / dt = f w sin(2 psi) to tan(psi) growing by exp(2 f w t), with w = exp(-d / range).
    rate, depth, reach = 1.5, 0.01, 0.03
    table = switching_table([State(0.0)], {name: rate, "wall_range": reach}, worlds=1)
    time = np.arange(1, 21) * 0.1
    strength = rate * np.exp(-depth / reach) * time
    if name == "wall_turn":
        expected = 2 * np.arctan(np.tan(psi / 2) * np.exp(strength))
    else:
        # The angle stays within its quarter of the circle.
        expected = np.arctan(np.tan(psi) * np.exp(2 * strength))
        expected = expected + np.pi * np.round((psi - expected[0]) / np.pi)
    for tank, place in ((HALL, 1j * (0.2 - depth)), (BASIN, 1j * (0.15 - depth))):
        _, phi = paths(
            table, time, tank=tank, start=place, heading=psi + np.pi / 2, time_step=1e-3,
            precision="double",
        )  # fmt: skip
        off = np.angle(np.exp(1j * (phi[0] - np.pi / 2 - expected)))
        assert np.abs(off).max() < 2e-3, "steps of rate dt turn by a share of rate dt too little"


@pytest.mark.parametrize("gap", [0.004, 0.02, 0.1])
def test_beyond_the_gap_a_heading_turns_towards_the_wall(gap: float) -> None:
    # As above at a rate (1 - d / gap) times as large, which is below 0 beyond the gap.
    rate, depth, reach, psi = 1.5, 0.01, 0.03, 1.2
    felt = {"wall_turn": rate, "wall_range": reach, "wall_gap": gap}
    table = switching_table([State(0.0)], felt, worlds=1)
    time = np.arange(1, 21) * 0.1
    strength = rate * (1 - depth / gap) * np.exp(-depth / reach) * time
    expected = 2 * np.arctan(np.tan(psi / 2) * np.exp(strength))
    _, phi = paths(
        table, time, tank=HALL, start=1j * (0.2 - depth), heading=psi + np.pi / 2, time_step=1e-3,
        precision="double",
    )  # fmt: skip
    found = np.mod(phi[0] - np.pi / 2, 2 * np.pi)
    assert np.abs(found - expected).max() < 2e-3
    assert (found[-1] > psi) == (depth < gap)


def test_a_particle_swings_about_the_gap() -> None:
    # Along the wall, at d = gap + s: ds/dt = v sin(delta), d delta/dt = -a w s / gap, so small s
    # swing at the frequency sqrt(v a w / gap), w = exp(-gap / range). Here by 1 % of the gap: what
    # is left out is of that order of the swing.
    speed, rate, gap, reach = 0.03, 2.0, 0.02, 0.04
    off = 0.01 * gap
    felt = {"wall_turn": rate, "wall_range": reach, "wall_gap": gap}
    table = switching_table([State(speed)], felt, worlds=1)
    time = np.arange(0.0, 12.0, 0.1)
    place = -0.8 + 1j * (0.2 - gap - off)
    z, _ = paths(table, time, tank=HALL, start=place, time_step=2e-3, precision="double")
    swing = np.sqrt(speed * rate * np.exp(-gap / reach) / gap)
    expected = off * np.cos(swing * time)
    np.testing.assert_allclose(0.2 - gap - z[0].imag, expected, atol=0.03 * off)


def test_a_particle_slows_down_near_a_wall_as_the_formula() -> None:
    # Along a wall at the distance d from contact: v (1 - slowing exp(-d / range)).
    speed, slowing, reach, clearance = 0.05, 0.6, 0.03, 0.01
    depth = np.array([0.0, 0.005, 0.02, 0.05])
    shared = {"wall_slowing": slowing, "wall_range": reach, "clearance": clearance}
    table = switching_table([State(speed)], shared, worlds=4)
    place = 1j * (0.2 - clearance - depth)
    z, _ = paths(table, [0.0, 2.0], tank=HALL, start=place, precision="double")
    moved = (z[:, 1] - z[:, 0]) / 2.0
    np.testing.assert_allclose(moved, speed * (1 - slowing * np.exp(-depth / reach)), rtol=1e-6)


def near_wall(part: str, seed: int) -> Floats:
    """Return psi of active particles within a range of the wall, one sample a world."""
    reach, count = 0.03, 3000
    felt = {"wall_turn": 0.0, "wall_follow": 0.0, "wall_slowing": 0.0, "wall_range": reach}
    table = of(
        "active+wall+follow", count, speed=0.03, rotational_diffusion=0.3, turn_rate=0.0,
        **(felt | ({part: 2.0} if part else {})),
    )  # fmt: skip
    z, phi = paths(table, [30.0, 30.1], seed=seed, tank=BASIN, time_step=0.02)
    here = z[:, 1]
    psi = phi[:, 1] - np.angle(here)
    return np.asarray(psi[np.abs(here) > 0.15 - reach])


@pytest.mark.slow
@pytest.mark.false_alarm(2 * FALSE_ALARM)
def test_turning_away_and_following_show_near_the_wall(fresh_seed: Seed) -> None:
    # Turned away a particle heads outwards less, and one that follows heads along the wall more.
    # The differences are 15 and 50 standard errors: a wall that does nothing, or too little, fails.
    seeds = [fresh_seed(16 + k) for k in range(3)]
    plain, turned, followed = (
        near_wall(part, seed) for part, seed in zip(("", *WALLS), seeds, strict=True)
    )
    for here, of_psi in ((turned, np.cos), (followed, lambda psi: np.abs(np.cos(psi)))):
        assert here.size > 200
        difference = of_psi(plain).mean() - of_psi(here).mean()
        error = np.hypot(stats.sem(of_psi(plain)), stats.sem(of_psi(here)))
        assert difference > SIGMAS * error


# --- the water ------------------------------------------------------------------------------------


@pytest.mark.parametrize("precision", ["single", "double"])
def test_the_water_carries_a_resting_particle_at_its_speed(precision: str) -> None:
    table = switching_table([State(0.0)], {}, worlds=3)
    flow = uniform_flow(0.01, 0.0, arena=HALL.to_arena())
    inertial = of("inertial", 3, speed_std=0.0, memory_time=1.0, turn_rate=0.0)
    time = np.arange(11) * 2.0
    for given in (table, inertial):
        z, _ = paths(given, time, tank=HALL, flow=flow, start=-0.1j, precision=precision)
        # Every one of 2000 steps is added to up to 0.2 m, with 24 bits.
        tolerance = 1e-12 if precision == "double" else 2000 * 0.2 * 2.0**-25
        assert np.abs(z - (0.01 * time - 0.1j)).max() < tolerance


def test_the_water_s_speed_adds_to_a_swimmer_s() -> None:
    table = switching_table([State(0.02)], {}, worlds=1)
    flow = uniform_flow(0.01, 0.0, arena=HALL.to_arena())
    z, _ = paths(table, [5.0], tank=HALL, flow=flow, heading=np.pi / 2, precision="double")
    assert abs(z[0, 0] - (0.05 + 0.1j)) < 1e-8


def test_water_that_speeds_up_carries_a_particle_as_far_as_the_formula() -> None:
    # u = g t carries by g t^2 / 2: the middle of a step is exact for it.
    rate, still = 0.01, uniform_flow(0.0, 0.0, arena=HALL.to_arena())
    frames = np.array([0.0, 2.0, 6.0])
    u = rate * frames[:, None, None] * np.ones((3, still.sizes["y"], still.sizes["x"]))
    flow = build_flow_field(
        still.x.values, still.y.values, u=u, v=0 * u, flag=np.ones(u.shape), time=frames
    )
    time = np.arange(7) * 1.0
    z, _ = paths(
        switching_table([State(0.0)], {}, worlds=1), time, tank=HALL, flow=flow, precision="double"
    )
    # Nodes are whole numbers of the largest speed / 32767.
    np.testing.assert_allclose(z[0], rate * time**2 / 2, atol=6 * 0.06 / 32767)
