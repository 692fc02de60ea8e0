"""Self-propelled bodies in plain NumPy, as recordings: not the family's kernels (synthetic).

A body is a point in a round tank that keeps a distance from the wall. It slides along the wall:
what of its step leads outwards is lost. Times are in seconds, lengths in metres.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr

from driftwalk.schema import build_trajectory

TANK = 0.15
"""Radius of the tank [m]."""
CLEARANCE = 0.0150
NOISE = 3e-4
"""Of the camera, per axis [m]."""
TICK = 0.02
"""Time step of a walker [s]; five to a sample."""

Step = Callable[[np.random.Generator, float, float], tuple[float, float]]
"""Returns speed [m/s] and heading [rad], given the body's distance from contact and the angle of
its outward normal."""


def run_and_tumble(random: np.random.Generator) -> Step:
    """Exponential runs of 2 s, each with its own speed; normal turns between them."""
    mean, std = 0.04, 0.3
    state = {"left": 0.0, "heading": 0.0, "speed": mean}

    def step(random: np.random.Generator, _depth: float, _normal: float) -> tuple[float, float]:
        state["left"] -= TICK
        if state["left"] <= 0.0:
            state["left"] = random.exponential(2.0)
            state["heading"] += random.normal(0.0, 1.2)
            state["speed"] = mean * random.lognormal(-0.5 * std**2, std)
        state["heading"] += np.sqrt(2.0 * 0.05 * TICK) * random.normal()
        return state["speed"], state["heading"]

    return step


def active_chiral(random: np.random.Generator) -> Step:
    """One speed, a heading that diffuses and turns."""
    state = {"heading": random.uniform(0.0, 2.0 * np.pi)}

    def step(random: np.random.Generator, _depth: float, _normal: float) -> tuple[float, float]:
        state["heading"] += 0.5 * TICK + np.sqrt(2.0 * 0.2 * TICK) * random.normal()
        return 0.03, state["heading"]

    return step


def two_state(random: np.random.Generator) -> Step:
    """Slow and fast bouts in turn, each of exponential duration, with a turn between them."""
    state = {"left": 0.0, "heading": 0.0, "fast": 0.0}

    def step(random: np.random.Generator, _depth: float, _normal: float) -> tuple[float, float]:
        state["left"] -= TICK
        if state["left"] <= 0.0:
            state["fast"] = 1.0 - state["fast"]
            state["left"] = random.exponential(2.0 if state["fast"] else 3.0)
            state["heading"] += random.normal(0.0, 1.0)
        state["heading"] += np.sqrt(2.0 * 0.1 * TICK) * random.normal()
        return (0.06 if state["fast"] else 0.012), state["heading"]

    return step


def levy(random: np.random.Generator) -> Step:
    """Runs with a power law, exponent 1.5 of their survival, from 0.3 s on; any turn between."""
    state = {"left": 0.0, "heading": 0.0}

    def step(random: np.random.Generator, _depth: float, _normal: float) -> tuple[float, float]:
        state["left"] -= TICK
        if state["left"] <= 0.0:
            state["left"] = min(0.3 * (1.0 + random.pareto(1.5)), 300.0)
            state["heading"] = random.uniform(0.0, 2.0 * np.pi)
        return 0.04, state["heading"]

    return step


def run_and_rest(random: np.random.Generator) -> Step:
    """Exponential runs of 2 s and exponential rests of 3 s."""
    return _resting(lambda random: random.exponential(3.0))


def heavy_rests(random: np.random.Generator) -> Step:
    """Exponential runs of 2 s and rests with a power law, exponent 1.2, from 0.5 s on."""
    return _resting(lambda random: min(0.5 * (1.0 + random.pareto(1.2)), 300.0))


def _resting(rest: Callable[[np.random.Generator], float]) -> Step:
    state = {"left": 0.0, "heading": 0.0, "moves": 0.0}

    def step(random: np.random.Generator, _depth: float, _normal: float) -> tuple[float, float]:
        state["left"] -= TICK
        if state["left"] <= 0.0:
            state["moves"] = 1.0 - state["moves"]
            if state["moves"]:
                state["left"] = random.exponential(2.0)
                state["heading"] += random.normal(0.0, 1.0)
            else:
                state["left"] = rest(random)
        if not state["moves"]:
            return 0.0, state["heading"]
        state["heading"] += np.sqrt(2.0 * 0.05 * TICK) * random.normal()
        return 0.05, state["heading"]

    return step


def sees_the_wall(random: np.random.Generator) -> Step:
    """Stops and turns round where the wall ahead comes within 4 cm; else a run and tumble."""
    state = {"left": 0.0, "heading": 0.0, "waits": 0.0}

    def step(random: np.random.Generator, depth: float, normal: float) -> tuple[float, float]:
        if state["waits"] > 0.0:
            state["waits"] -= TICK
            if state["waits"] <= 0.0:
                state["heading"] = normal + np.pi + random.normal(0.0, 0.5)
            return 0.0, state["heading"]
        ahead = np.cos(state["heading"] - normal)
        if ahead > 0.3 and depth < 0.04 * ahead:
            state["waits"] = 0.8
            return 0.0, state["heading"]
        state["left"] -= TICK
        if state["left"] <= 0.0:
            state["left"] = random.exponential(2.0)
            state["heading"] += random.normal(0.0, 1.0)
        state["heading"] += np.sqrt(2.0 * 0.05 * TICK) * random.normal()
        return 0.05, state["heading"]

    return step


WALKERS = {
    one.__name__: one
    for one in (
        *(run_and_tumble, active_chiral, two_state, run_and_rest),
        *(levy, heavy_rests, sees_the_wall),
    )
}


def sliding_recording(
    name: str, seconds: float, *, seed: int, noise: float = NOISE, clearance: float = CLEARANCE
) -> xr.Dataset:
    """Return a recording of a walker at 10 Hz, with white noise of the camera."""
    random = np.random.default_rng([seed, *name.encode()])
    step = WALKERS[name](random)
    reach, x, y = TANK - clearance, 0.03, 0.0
    count = round(seconds / 0.1)
    seen = np.empty((2, count))
    for sample in range(count):
        seen[:, sample] = x, y
        for _ in range(round(0.1 / TICK)):
            out = np.hypot(x, y)
            speed, heading = step(random, reach - out, np.arctan2(y, x))
            x += speed * TICK * np.cos(heading)
            y += speed * TICK * np.sin(heading)
            if (out := np.hypot(x, y)) > reach:
                x, y = x * reach / out, y * reach / out
    seen += noise * random.normal(size=seen.shape)
    arena = {"arena": '{"shape": "circle", "diameter_m": 0.3}'}
    return build_trajectory(0.1 * np.arange(count), *seen, attrs={**arena, "simulated": "yes"})
