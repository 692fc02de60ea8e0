"""Bodies that move by themselves in a round tank: plain NumPy.

At the wall a body stops in the direction of the wall and slides along it; its heading stays. Laws
outside driftwalk's family: runs or rests whose lengths fall with a power, and a body that sees the
wall in front of it and turns off.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt
from ranges import CLEARANCE_M, RADIUS_M, SAMPLE_S
from scipy.signal import lfilter

Floats = npt.NDArray[np.float64]
Complexes = npt.NDArray[np.complex128]

STEP_S: Final = 5e-3
REACH_M: Final = RADIUS_M - CLEARANCE_M
"""Farthest place of the middle of a body."""


@dataclass(frozen=True)
class Walker:
    """One body: what it has not is 0, or infinite."""

    law: str
    speed: float
    speed_cv: float = 0.0
    rotational_diffusion: float = 0.0
    turn_rate: float = 0.0
    bout_s: float = np.inf
    """Mean length of a run; of a Lévy walk the shortest one."""
    rest_s: float = np.inf
    """Mean length of a rest or of the slow state; with a heavy tail the shortest one."""
    turn_std: float = 0.0
    """At the beginning of a bout; infinite is a direction drawn at random."""
    exponent: float = 0.0
    slow_share: float = 0.0
    relaxation_s: float = 0.0
    memory_s: float = 0.0
    sight_m: float = 0.0


def simulate(
    walker: Walker,
    seconds: float,
    seed: int,
    *,
    reach: float = REACH_M,
    step: float = STEP_S,
) -> tuple[Complexes, npt.NDArray[np.bool_]]:
    """Return the places at the samples, and whether the body touched the wall since the last."""
    rng = np.random.default_rng(seed)
    count, every = round(seconds / step) + 1, round(SAMPLE_S / step)
    if walker.law == "persistent":
        return persist(walker, count, rng, reach, step, every)
    speed, turns = bouts(walker, count, rng, step)
    turns = turns + step * walker.turn_rate
    turns += np.sqrt(2.0 * walker.rotational_diffusion * step) * rng.normal(size=count)
    if walker.sight_m:
        return look(step * speed, turns, reach, every, walker.sight_m, rng)
    return slide(step * speed * np.exp(1j * np.cumsum(turns)), reach, every)


def persist(
    walker: Walker, count: int, rng: np.random.Generator, reach: float, step: float, every: int
) -> tuple[Complexes, npt.NDArray[np.bool_]]:
    """Move with a velocity whose parts are Ornstein-Uhlenbeck processes, sd `speed` each, exact.

    The wall takes the part of the velocity that goes into it.
    """
    fade = math.exp(-step / walker.memory_s)
    draws = walker.speed * (rng.normal(size=count) + 1j * rng.normal(size=count))
    draws[1:] *= math.sqrt(1.0 - fade**2)
    kept, touches = [0j], [False]
    at, velocity, touched = 0j, 0j, False
    for k, draw in enumerate(draws[:-1].tolist(), 1):
        velocity = fade * velocity + draw
        at += step * velocity
        if abs(at) > reach:
            normal = at / abs(at)
            velocity -= normal * max((velocity * normal.conjugate()).real, 0.0)
            at, touched = reach * normal, True
        if k % every == 0:
            kept.append(at)
            touches.append(touched)
            touched = False
    return np.array(kept), np.array(touches)


def bouts(
    walker: Walker, count: int, rng: np.random.Generator, step: float
) -> tuple[Floats, Floats]:
    """Return the speed in each step, and the turns at the beginning of bouts."""
    ends, speeds, states = [], [], []
    time, state = 0.0, 0
    while time < count * step:
        time += length(walker, state, rng)
        ends.append(time)
        speeds.append(walker.speed * log_normal(walker.speed_cv, rng))
        states.append(state)
        state = 1 - state if np.isfinite(walker.rest_s) else 0
    which = np.searchsorted(ends, np.arange(count) * step, side="right")
    speed = np.array(speeds) * np.where(np.array(states) == 1, walker.slow_share, 1.0)
    wanted = speed[which]
    if walker.relaxation_s:
        kept = np.exp(-step / walker.relaxation_s)
        start = [kept * wanted[0]]
        wanted, _ = lfilter([1.0 - kept], [1.0, -kept], wanted, zi=start)
    turns = np.zeros(count)
    begins = np.flatnonzero(np.diff(which, prepend=-1))
    if walker.slow_share == 0.0:
        # A run begins with a turn, a rest does not.
        begins = begins[np.array(states)[which[begins]] == 0]
    if np.isinf(walker.turn_std):
        turns[begins] = rng.uniform(-np.pi, np.pi, begins.size)
    else:
        turns[begins] = walker.turn_std * rng.normal(size=begins.size)
    turns[0] = rng.uniform(-np.pi, np.pi)
    return wanted, turns


def length(walker: Walker, state: int, rng: np.random.Generator) -> float:
    """Draw the length of a bout [s]."""
    mean = walker.rest_s if state else walker.bout_s
    tail = {"Lévy runs": 0, "rests with a heavy tail": 1}.get(walker.law)
    if state == tail:
        return float(mean * rng.uniform() ** (-1.0 / walker.exponent))
    return float(mean * rng.exponential()) if np.isfinite(mean) else np.inf


def log_normal(cv: float, rng: np.random.Generator) -> float:
    """Draw a number of mean 1 with a coefficient of variation."""
    variance = np.log1p(cv**2)
    return float(np.exp(np.sqrt(variance) * rng.normal() - 0.5 * variance))


def slide(moves: Complexes, reach: float, every: int) -> tuple[Complexes, npt.NDArray[np.bool_]]:
    """Add up moves; the wall takes away what goes beyond it."""
    kept, touches = [0j], [False]
    at, touched = 0j, False
    for k, move in enumerate(moves[:-1].tolist(), 1):
        at += move
        away = abs(at)
        if away > reach:
            at *= reach / away
            touched = True
        if k % every == 0:
            kept.append(at)
            touches.append(touched)
            touched = False
    return np.array(kept), np.array(touches)


def look(
    moves: Floats, turns: Floats, reach: float, every: int, sight: float, rng: np.random.Generator
) -> tuple[Complexes, npt.NDArray[np.bool_]]:
    """Add up moves of a body that takes another direction where it sees the wall in front."""
    kept, touches = [0j], [False]
    at, heading, touched = 0j, 0.0, False
    for k, (move, turn) in enumerate(zip(moves[:-1].tolist(), turns[:-1].tolist(), strict=True), 1):
        heading += turn
        if reach - abs(at) < sight:
            for _ in range(50):
                if ahead(at, heading, reach) > sight:
                    break
                heading = float(rng.uniform(0.0, 2.0 * np.pi))
        at += move * cmath.exp(1j * heading)
        if abs(at) > reach:
            at *= reach / abs(at)
            touched = True
        if k % every == 0:
            kept.append(at)
            touches.append(touched)
            touched = False
    return np.array(kept), np.array(touches)


def ahead(at: complex, heading: float, reach: float) -> float:
    """Return how far it is to the wall, straight ahead."""
    along = (at.conjugate() * cmath.exp(1j * heading)).real
    return math.sqrt(max(along**2 + reach**2 - abs(at) ** 2, 0.0)) - along
