"""Self-propelled particles far from any wall against closed forms: headings, bouts, speeds.

Statistical checks compare the mean of independent numbers with its closed form, to five standard
errors of that mean; a new seed breaks one check at most once in 1e5 runs. Five errors are 1 to 8 %
of most numbers here: a factor of two, a wrong sign and a lost term fail. Where a finite time step
has a part in it, its size is added.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from particle_paths import FALSE_ALARM, SIGMAS, Floats, errors_off, gaussian, of, paths
from scipy import stats

from driftwalk.motion.family.columns import ParticleTable, State, switching_table

Seed = Callable[[int], int]


# --- swimming along a heading ---------------------------------------------------------------------


@pytest.mark.false_alarm(5 * FALSE_ALARM)
@pytest.mark.parametrize(("turn_rate", "diffusion"), [(0.0, 0.0), (1.5, 0.0), (0.0, 1e-3)])
def test_an_active_particle_spreads_as_a_persistent_walk(
    turn_rate: float, diffusion: float, fresh_seed: Seed
) -> None:
    # <r^2> = 2 v^2 Re[t / a - (1 - exp(-a t)) / a^2] + 4 D_t t with a = D - i Omega; without
    # turning it is 2 v^2 / D^2 (D t - 1 + exp(-D t)). What a step leaves out is of second order.
    speed, forgets, time, step = 0.05, 5.0, np.array([0.24, 1.0, 2.0, 4.0, 8.0]), 0.02
    given = {"speed": speed, "rotational_diffusion": forgets, "turn_rate": turn_rate}
    table = of("active+diffusion", 12_000, **given, diffusion=diffusion)
    z, _ = paths(table, time, seed=fresh_seed(1), time_step=step)
    a = forgets - 1j * turn_rate
    walk = 2 * speed**2 * (time / a - (1 - np.exp(-a * time)) / a**2).real
    slack = (forgets * step) ** 2 / 4 * walk
    assert errors_off(np.abs(z) ** 2, walk + 4 * diffusion * time, slack).max() < SIGMAS


@pytest.mark.false_alarm(10 * FALSE_ALARM)
@pytest.mark.parametrize("turn_rate", [0.0, -2.0])
def test_a_heading_forgets_and_turns(turn_rate: float, fresh_seed: Seed) -> None:
    # <exp(i (phi_t - phi_0))> = exp(-D t) exp(i Omega t), at any length of the step.
    time, first, forgets = np.array([0.2, 0.5, 1.0, 2.0, 3.0]), 0.7, 0.6
    table = of("active", 20_000, speed=0.01, rotational_diffusion=forgets, turn_rate=turn_rate)
    _, phi = paths(table, time, seed=fresh_seed(2), time_step=0.02, heading=first)
    expected = np.exp((1j * turn_rate - forgets) * time)
    turned = np.exp(1j * (phi - first))
    assert errors_off(turned.real, expected.real).max() < SIGMAS
    assert errors_off(turned.imag, expected.imag).max() < SIGMAS


@pytest.mark.false_alarm(5 * FALSE_ALARM)
@pytest.mark.parametrize("turn_std", [0.5, 1.2])
def test_tumbles_add_to_how_a_heading_forgets(turn_std: float, fresh_seed: Seed) -> None:
    # Turns of N(0, J) at exponential times T: the rate is D + (1 - exp(-J^2 / 2)) / T.
    time, forgets, lasting = np.array([0.2, 0.5, 1.0, 2.0, 3.0]), 0.1, 0.9
    table = of(
        "run_tumble", 20_000, speed=0.01, speed_cv=0.5, run_time=lasting, turn_std=turn_std,
        rotational_diffusion=forgets, turn_rate=0.0,
    )  # fmt: skip
    _, phi = paths(table, time, seed=fresh_seed(3))
    rate = forgets + (1 - np.exp(-(turn_std**2) / 2)) / lasting
    assert errors_off(np.cos(phi), np.exp(-rate * time)).max() < SIGMAS


# --- bouts ----------------------------------------------------------------------------------------


def runs_and_rests(count: int, **changes: float) -> ParticleTable:
    """Return the table of worlds that run straight on at 0.1 m/s, and rest."""
    given = {
        "speed": 0.1, "speed_cv": 0.0, "run_time": 1.0, "run_time_cv": 1.0, "rest_time": 0.5,
        "rest_time_cv": 1.0, "turn_std": 0.0, "rotational_diffusion": 0.0,
    }  # fmt: skip
    return of("run_rest", count, **(given | changes))


@pytest.mark.fast_cases(2)
@pytest.mark.false_alarm(FALSE_ALARM)
@pytest.mark.parametrize(("run_cv", "rest_cv"), [(0.3, 0.3), (1.0, 1.0), (2.0, 2.0), (0.3, 2.0)])
def test_the_share_of_time_at_rest(run_cv: float, rest_cv: float, fresh_seed: Seed) -> None:
    # The way of a straight run says how long it ran. Whatever the laws of the times, the share is
    # that of the means, once the beginning is forgotten.
    table = runs_and_rests(2000, run_time_cv=run_cv, rest_time_cv=rest_cv)
    z, _ = paths(table, [30.0, 80.0], seed=fresh_seed(4))
    running = (z[:, 1] - z[:, 0]).real / (0.1 * 50.0)
    assert errors_off(running, 1.0 / 1.5) < SIGMAS


@pytest.mark.slow
@pytest.mark.false_alarm(4 * FALSE_ALARM)
def test_bouts_last_as_long_as_asked_for(fresh_seed: Seed) -> None:
    # Of every world the same number of bouts: those of a fixed window would be the short ones.
    step, bouts = 0.01, 20
    table = runs_and_rests(500, run_time_cv=0.3, rest_time_cv=1.0)
    z, _ = paths(table, np.arange(6001) * step, seed=fresh_seed(5), time_step=step)
    moving = np.diff(z.real) > 0.05 * step
    lengths: dict[bool, list[Floats]] = {True: [], False: []}
    for world in moving:
        ends = np.flatnonzero(np.diff(world))[: bouts + 1]
        assert ends.size == bouts + 1, "the window is too short"
        for which in lengths:
            lengths[which].append(np.diff(ends)[world[ends[1:]] == which] * step)
    for which, mean, cv in ((True, 1.0, 0.3), (False, 0.5, 1.0)):
        lasted = np.concatenate(lengths[which])
        assert lasted.size == 500 * bouts // 2
        # A bout as the steps count it is up to a step longer or shorter: a variance of step^2 / 6.
        assert errors_off(lasted, mean, step / 10) < SIGMAS
        assert errors_off((lasted - mean) ** 2, (mean * cv) ** 2, step**2 / 3) < SIGMAS


@pytest.mark.false_alarm(4 * FALSE_ALARM)
def test_speeds_of_runs_are_log_normal(fresh_seed: Seed) -> None:
    # Clocked bouts of 0.5 s, seen at 0.1 and 0.4 s of each.
    mean, cv, bouts = 0.1, 0.6, np.arange(10)
    seen = (0.5 * bouts[:, None] + [0.1, 0.4]).ravel()
    table = switching_table([State(mean, cv, dwell=0.5, dwell_cv=0.0)], {}, worlds=1500)
    z, _ = paths(table, seen, seed=fresh_seed(6))
    speed = (z[:, 1::2] - z[:, ::2]).real / 0.3
    assert errors_off(speed.ravel(), mean) < SIGMAS
    assert errors_off((speed.ravel() - mean) ** 2, (mean * cv) ** 2) < SIGMAS
    spread = np.sqrt(np.log(1 + cv**2))
    law = stats.lognorm(spread, scale=mean * np.exp(-(spread**2) / 2))
    assert stats.kstest(speed.ravel(), law.cdf).pvalue > FALSE_ALARM
    # Of its own each: what one bout has says nothing about the next.
    number = np.log(speed / law.median()) / spread
    assert errors_off((number[:, 1:] * number[:, :-1]).ravel(), 0.0) < SIGMAS


def test_clocked_kicks_and_glides_go_as_far_as_the_formula() -> None:
    # After n kicks n V tau (1 - exp(-T / tau)): a step is as long as its mean speed. The last kick
    # may be a step early or late.
    speed, lasting, glides, step = 0.1, 0.8, 0.5, 0.02
    table = of(
        "burst_coast", 1, kick_speed=speed, kick_speed_cv=0.0, kick_time=lasting,
        kick_time_cv=0.0, glide_time=glides, turn_std=0.0,
    )  # fmt: skip
    kicks = np.arange(1, 11)
    z, _ = paths(table, kicks * lasting, time_step=step, precision="double")
    expected = kicks * speed * glides * (1 - np.exp(-lasting / glides))
    assert (np.abs(z[0] - expected) < speed * step).all()


@pytest.mark.false_alarm(FALSE_ALARM)
def test_kicks_at_random_times_have_the_mean_speed_of_the_formula(fresh_seed: Seed) -> None:
    # V tau / T E[1 - exp(-T' / tau)], which is V tau / (T + tau) for exponential times T'. A kick
    # comes half a step late in the mean, of glides that forget over 25 steps.
    speed, lasting, glides, step = 0.1, 0.8, 0.5, 0.02
    table = of(
        "burst_coast", 2000, kick_speed=speed, kick_speed_cv=0.5, kick_time=lasting,
        kick_time_cv=1.0, glide_time=glides, turn_std=0.0,
    )  # fmt: skip
    z, _ = paths(table, [8.0, 16.0], seed=fresh_seed(7), time_step=step)
    mean = speed * glides / (lasting + glides)
    way = (z[:, 1] - z[:, 0]).real / 8.0
    assert errors_off(way, mean, mean * (step / glides) ** 2) < SIGMAS


@pytest.mark.false_alarm(FALSE_ALARM)
def test_the_share_of_reversals(fresh_seed: Seed) -> None:
    # A reversal turns by pi, any other bout here by 0.1 rad.
    share, ends = 0.3, 0.25 + 0.5 * np.arange(21)
    state = State(0.01, dwell=0.5, dwell_cv=0.0, turn_std=0.1, reversal_share=share)
    _, phi = paths(switching_table([state], {}, worlds=500), ends, seed=fresh_seed(8))
    turn = np.angle(np.exp(1j * np.diff(phi)))
    assert ((np.abs(turn) < 0.6) | (np.abs(turn) > np.pi - 0.6)).all()
    assert errors_off((np.abs(turn) > np.pi / 2).astype(float).ravel(), share) < SIGMAS


@pytest.mark.false_alarm(FALSE_ALARM)
def test_runs_that_reverse_lose_their_direction_as_the_formula(fresh_seed: Seed) -> None:
    # A turn of pi at the share r, and N(0, s) in any case: E[cos turn] = (1 - 2 r) exp(-s^2 / 2). A
    # clock of 0.5 s for runs and rests begins one run a second, and a rest reverses nothing.
    share, std = 0.8, 0.7
    table = of(
        "run_rest+reverse", 4000, speed=0.01, speed_cv=0.0, run_time=0.5, run_time_cv=0.0,
        rest_time=0.5, rest_time_cv=0.0, turn_std=std, rotational_diffusion=0.0,
        reversal_share=share,
    )  # fmt: skip
    _, phi = paths(table, [0.25, 1.25], seed=fresh_seed(18))
    memory = np.cos(phi[:, 1] - phi[:, 0])
    assert errors_off(memory, (1 - 2 * share) * np.exp(-(std**2) / 2)) < SIGMAS


# --- slow changes and a stroke --------------------------------------------------------------------


@pytest.mark.false_alarm(13 * FALSE_ALARM)
def test_the_slow_factor_has_mean_one_and_a_memory(fresh_seed: Seed) -> None:
    # Its logarithm has the spread s, and exp(-t / tau) of it is left after t.
    std, memory, step, time = 0.5, 3.0, 0.02, np.array([0.0, 1.0, 3.0, 6.0, 20.0])
    table = of(
        "active+slow", 10_000, speed=0.1, rotational_diffusion=0.0, turn_rate=0.0, slow_std=std,
        slow_time=memory,
    )  # fmt: skip
    z, _ = paths(table, np.ravel(time[:, None] + [0.0, step]), seed=fresh_seed(9), time_step=step)
    factor = (z[:, 1::2] - z[:, ::2]).real / (0.1 * step)
    number = np.log(factor) / std + std / 2
    assert errors_off(factor, 1.0).max() < SIGMAS
    assert errors_off(number**2, 1.0, 1e-3).max() < SIGMAS
    kept = errors_off(number[:, 1:] * number[:, :1], np.exp(-time[1:] / memory), 1e-3)
    assert kept.max() < SIGMAS


@pytest.mark.false_alarm(FALSE_ALARM)
@pytest.mark.parametrize("stroke", [0.5, 4.0])
def test_a_stroke_swings_at_its_frequency_and_keeps_the_mean(
    stroke: float, fresh_seed: Seed
) -> None:
    # x = v t + v s / (2 pi f) sin(2 pi f t + phase), over ten whole periods.
    speed, frequency, step, count = 0.1, 2.0, 0.01, 300
    table = of(
        "active+stroke", count, speed=speed, rotational_diffusion=0.0, turn_rate=0.0,
        stroke=stroke, stroke_frequency=frequency,
    )  # fmt: skip
    time = np.arange(501) * step
    z, _ = paths(table, time, seed=fresh_seed(10), time_step=step, precision="double")
    np.testing.assert_allclose(z[:, -1].real, speed * 5.0, rtol=1e-7)
    swing = np.fft.rfft((z.real - speed * time)[:, :-1], axis=1) / 250
    found = np.abs(swing[:, 1:])
    assert (np.argmax(found, axis=1) == 9).all(), "the tenth of the periods in 5 s is 2 Hz"
    # A sum over steps has sin(pi f dt) where the integral has pi f dt: 7e-4 here.
    np.testing.assert_allclose(found[:, 9], speed * stroke / (2 * np.pi * frequency), rtol=1e-3)
    assert np.delete(found, 9, axis=1).max() < 1e-7
    phase = np.angle(swing[:, 10])
    assert stats.kstest(phase / (2 * np.pi) + 0.5, "uniform").pvalue > FALSE_ALARM


# --- a velocity that forgets ----------------------------------------------------------------------


@pytest.mark.false_alarm(8 * FALSE_ALARM)
@pytest.mark.parametrize("turn_rate", [0.0, 1.2])
def test_an_inertial_velocity_forgets_and_turns(turn_rate: float, fresh_seed: Seed) -> None:
    # Variance s^2 of each component; <v_0* v_t> = 2 s^2 exp(-t / tau) exp(i Omega t). The velocity
    # at t is taken from t - dt to t + dt: its variance lacks a share of 2 dt / (3 tau).
    std, memory, step, count = 0.03, 1.5, 0.005, 10_000
    time = np.array([0.5, 1.0, 2.0, 4.0])
    begins = gaussian(count, std, fresh_seed(11))
    table = of("inertial", count, speed_std=std, memory_time=memory, turn_rate=turn_rate)
    around = np.ravel(time[:, None] + [-step, step])
    z, _ = paths(table, around, seed=fresh_seed(12), time_step=step, velocity=begins)
    later = (z[:, 1::2] - z[:, ::2]) / (2 * step)
    slack = std**2 * step / memory
    for component in (later.real, later.imag):
        assert errors_off(component**2, std**2, slack).max() < SIGMAS
    kept = begins[:, None].conj() * later
    expected = 2 * std**2 * np.exp((1j * turn_rate - 1 / memory) * time)
    assert errors_off(kept.real, expected.real).max() < SIGMAS
    assert errors_off(kept.imag, expected.imag).max() < SIGMAS


@pytest.mark.false_alarm(5 * FALSE_ALARM)
def test_an_inertial_particle_spreads_as_its_closed_form(fresh_seed: Seed) -> None:
    # <r^2> = 4 s^2 tau^2 (t / tau - 1 + exp(-t / tau)).
    std, memory, count, time = 0.03, 1.5, 10_000, np.array([0.5, 1.0, 2.0, 4.0, 8.0])
    table = of("inertial", count, speed_std=std, memory_time=memory, turn_rate=0.0)
    begins = gaussian(count, std, fresh_seed(13))
    z, _ = paths(table, time, seed=fresh_seed(14), velocity=begins)
    expected = 4 * std**2 * memory**2 * (time / memory - 1 + np.exp(-time / memory))
    assert errors_off(np.abs(z) ** 2, expected).max() < SIGMAS
