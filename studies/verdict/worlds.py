"""The recordings of a set: what is drawn for each, by its kind and its number."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import flows
import numpy as np
from flows import Flow, uniform
from ranges import (
    ADDED_MASS,
    BOUT_S,
    DRAG_COEFFICIENT,
    DRAG_POWER,
    DROPPED,
    FORCE_MEMORY_S,
    FORCE_STD_N,
    GROWTH,
    KINDS,
    LEVY_EXPONENT,
    MEMORY_S,
    MINUTES,
    MINUTES_SHARE,
    MISTAKEN_SHARE,
    ORIENTATION_NOISE_DEG,
    OUTLIER_M,
    OUTLIERS,
    POSITION_NOISE_M,
    PULSE,
    PULSE_PERIOD_S,
    RELAXATION_S,
    REST_EXPONENT,
    ROTATIONAL_DIFFUSION,
    SEEDS,
    SHORTEST_S,
    SIGHT_M,
    SLOW_SHARE,
    SPEED_CV,
    SPEED_M_S,
    TURN_RATE,
    TURN_STD,
    WALKER_MINUTES,
    WALL_FRICTION,
    WALL_RESTITUTION,
    Kind,
)
from walkers import Walker

LAWS = {
    "active": "active",
    "chiral": "active",
    "run and tumble": "run_tumble",
    "run and rest": "run_rest",
    "two states": "two_state",
    "persistent": "inertial",
}
"""Driftwalk's model of each kind of walker."""
NAMES = {
    "speed": "speed",
    "speed_cv": "speed_cv",
    "rotational_diffusion": "rotational_diffusion",
    "turn_rate": "turn_rate",
    "bout_s": "run_time",
    "rest_s": "rest_time",
    "turn_std": "turn_std",
}
"""Driftwalk's names of the numbers of a walker."""


@dataclass(frozen=True)
class Camera:
    """What the camera makes of the motion."""

    position_noise: float
    """[m], of x and of y."""
    orientation_noise: float
    """[rad]."""
    dropped: float = 0.0
    """Share of the frames; the others keep their right times."""
    outliers: float = 0.0
    outlier_m: float = 0.0


@dataclass(frozen=True)
class Block:
    """A block in stirred water."""

    flow: Flow
    drag_coefficient: float
    force_std: float
    """[N], in 10 ms."""
    start: complex
    added_mass: float = 0.0
    floating: bool = False
    drag_power: float = 2.0
    force_memory: float = 0.0
    growth: float = 0.0
    """Of the strength of the flow a second, as a share of that at the first sample."""
    pulse: float = 0.0
    pulse_period: float = 10.0
    friction: float = 0.0
    restitution: float = 0.5


@dataclass(frozen=True)
class World:
    """One recording of a set."""

    name: str
    kind: Kind
    minutes: float
    seed: int
    camera: Camera
    body: Block | Walker
    options: list[str] = field(default_factory=list)
    """What its user knows, as options of the command."""


def worlds(which: str, most_minutes: float = math.inf) -> Iterator[World]:
    """Draw the worlds of a set; each depends on the seed of the set and its own number alone."""
    number = 0
    for kind in KINDS:
        count = kind.development if which == "development" else kind.held_out
        for _ in range(count):
            number += 1
            rng = np.random.default_rng([SEEDS[which], number])
            world = draw(f"{kind.body[0]}{number:03d}", kind, rng)
            yield replace(world, minutes=min(world.minutes, most_minutes))


def draw(name: str, kind: Kind, rng: np.random.Generator) -> World:
    """Draw one world."""
    camera = draw_camera(rng)
    known = ["--tank", "30cm"]
    if kind.body == "walker":
        minutes = float(rng.choice(WALKER_MINUTES))
        walker = draw_walker(kind.name, rng)
        return World(name, kind, minutes, _seed(rng), camera, walker, known)
    minutes = float(rng.choice(MINUTES, p=MINUTES_SHARE))
    block = draw_block(kind.name, minutes, rng)
    known += ["--side", "3cm", "--mass", "11.6g"]
    if block.floating and block.added_mass != 0.5:
        known += ["--added-mass", f"{block.added_mass:.3g}"]
    return World(name, kind, minutes, _seed(rng), camera, block, known)


def draw_camera(rng: np.random.Generator) -> Camera:
    """Draw the noise, and in some recordings mistakes."""
    noise = uniform(rng, POSITION_NOISE_M), np.deg2rad(uniform(rng, ORIENTATION_NOISE_DEG))
    drops, jumps = rng.uniform(size=2) < MISTAKEN_SHARE
    dropped, outliers, size = (uniform(rng, span) for span in (DROPPED, OUTLIERS, OUTLIER_M))
    return Camera(*noise, dropped * drops, outliers * jumps, size * jumps)


def draw_block(kind: str, minutes: float, rng: np.random.Generator) -> Block:
    """Draw a block and its flow."""
    values: dict[str, Any] = {
        "drag_coefficient": uniform(rng, DRAG_COEFFICIENT),
        "force_std": uniform(rng, FORCE_STD_N),
        "start": complex(*flows.place(rng, 0.08)),
        "friction": uniform(rng, WALL_FRICTION),
        "restitution": uniform(rng, WALL_RESTITUTION),
    }
    carried = rng.uniform() < 0.5
    share = round(uniform(rng, ADDED_MASS), 3)
    usual = {"floating": True, "added_mass": 0.5}
    if kind == "floating, added mass stated":
        values |= {"floating": True, "added_mass": share}
    elif kind.startswith("floating"):
        values |= usual
    elif kind == "power of the drag":
        values["drag_power"] = uniform(rng, DRAG_POWER)
    elif kind == "force with memory":
        values["force_memory"] = uniform(rng, FORCE_MEMORY_S)
    elif kind == "flow that grows":
        grown = rng.choice([-1.0, 1.0]) * uniform(rng, GROWTH)
        # By so much from the first sample to the last, as a share of the middle.
        values["growth"] = grown / (1.0 - 0.5 * grown) / (60.0 * minutes)
    elif kind == "flow that pulses":
        values |= {"pulse": uniform(rng, PULSE), "pulse_period": uniform(rng, PULSE_PERIOD_S)}
    if carried and kind not in ("paper", "power of the drag", "force with memory"):
        values = usual | values
    if kind == "slow orbit":
        flow = flows.slow_orbit(rng)
        values["start"] = complex(*flows.place(rng, 0.03))
        values["force_std"] = rng.uniform(0.3e-3, 0.45e-3)
    elif kind == "often at the wall":
        flow = flows.outward(rng)
    elif kind == "alternating eddies":
        flow = flows.alternating(rng)
    elif kind == "turning jet":
        flow = flows.turning(rng)
    else:
        # A sink or a small eddy keeps a floating body in one place, where nothing is learned.
        floats = bool(values.get("floating"))
        flow = flows.steady(rng, sinks=0.1 if floats else 0.5, swirls=0.7 if floats else 0.33)
    return Block(flow=flow, **values)


def draw_walker(kind: str, rng: np.random.Generator) -> Walker:
    """Draw a body that moves by itself."""
    speed, cv = uniform(rng, SPEED_M_S), uniform(rng, SPEED_CV)
    diffusion, turn = uniform(rng, ROTATIONAL_DIFFUSION), uniform(rng, TURN_STD)
    bout, rest, shortest = (uniform(rng, span) for span in (BOUT_S, BOUT_S, SHORTEST_S))
    side = float(rng.choice([-1.0, 1.0]))
    moves = {"speed_cv": cv, "rotational_diffusion": diffusion, "turn_std": turn, "bout_s": bout}
    if kind == "active":
        return Walker(kind, speed, rotational_diffusion=diffusion)
    if kind == "chiral":
        rate = side * uniform(rng, TURN_RATE)
        return Walker(kind, speed, rotational_diffusion=diffusion, turn_rate=rate)
    if kind == "persistent":
        return Walker(kind, speed, memory_s=uniform(rng, MEMORY_S))
    if kind == "run and tumble":
        return Walker(kind, speed, **moves)
    if kind == "run and rest":
        return Walker(kind, speed, **moves, rest_s=rest)
    if kind == "two states":
        slow, relaxation = uniform(rng, SLOW_SHARE), uniform(rng, RELAXATION_S)
        return Walker(kind, speed, **moves, rest_s=rest, slow_share=slow, relaxation_s=relaxation)
    if kind == "Lévy runs":
        exponent = uniform(rng, LEVY_EXPONENT)
        return Walker(kind, speed, bout_s=shortest, turn_std=np.inf, exponent=exponent)
    if kind == "rests with a heavy tail":
        exponent = uniform(rng, REST_EXPONENT)
        return Walker(kind, speed, **moves, rest_s=shortest, exponent=exponent)
    return Walker(kind, speed, rotational_diffusion=diffusion, sight_m=uniform(rng, SIGHT_M))


def numbers_of(kind: str, walker: Walker) -> dict[str, float]:
    """Return the numbers of a walker under driftwalk's names; none of a law outside its family."""
    if kind not in LAWS:
        return {}
    if kind == "persistent":
        return {"speed_std": walker.speed, "memory_time": walker.memory_s}
    if kind == "two states":
        return {
            "slow_speed": walker.slow_share * walker.speed,
            "fast_speed": walker.speed,
            "speed_cv": walker.speed_cv,
            "slow_time": walker.rest_s,
            "fast_time": walker.bout_s,
            "slow_rotational_diffusion": walker.rotational_diffusion,
            "fast_rotational_diffusion": walker.rotational_diffusion,
            "turn_std": walker.turn_std,
            "relaxation_time": walker.relaxation_s,
        }
    values = {name: getattr(walker, own) for own, name in NAMES.items()}
    return {name: value for name, value in values.items() if value and math.isfinite(value)}


def _seed(rng: np.random.Generator) -> int:
    return int(rng.integers(2**31))
