"""Every range and seed of the study: what is drawn, and how many recordings of each kind."""

from __future__ import annotations

from typing import Final, NamedTuple

SEEDS: Final = {
    "development": 71_000,
    "held-out": 72_000,
    "confirmation": 73_000,
    "confirmation-2": 74_000,
    "confirmation-3": 75_000,
}
"""Choices may be made on the first, and on the others once they have been asked about."""

RADIUS_M: Final = 0.15
SIDE_M: Final = 0.03
MASS_KG: Final = 0.0116
DEPTH_M: Final = 0.03
DENSITY_KG_M3: Final = 1000.0
FORCE_INTERVAL_S: Final = 0.01
REFERENCE_M_S: Final = 0.03
"""Speed at which a drag with another power of the speed is that of C_d."""
SAMPLE_S: Final = 0.1
SETTLING_S: Final = 60.0
"""Simulated before the first sample."""


class Range(NamedTuple):
    """Values from `low` to `high`, of equal density."""

    low: float
    high: float


DRAG_COEFFICIENT: Final = Range(0.25, 0.9)
FORCE_STD_N: Final = Range(0.3e-3, 1.0e-3)
ADDED_MASS: Final = Range(0.0, 0.6)
DRAG_POWER: Final = Range(1.5, 2.5)
FORCE_MEMORY_S: Final = Range(0.1, 0.5)
WALL_FRICTION: Final = Range(0.0, 0.4)
WALL_RESTITUTION: Final = Range(0.2, 0.7)
FLOW_RMS_M_S: Final = Range(0.025, 0.07)
"""Over the tank."""
SINK_PER_S: Final = Range(0.05, 0.25)
SOURCE_PER_S: Final = Range(0.02, 0.12)
"""Water that rises and flows outwards, so that a block is often at the wall."""
GROWTH: Final = Range(0.05, 0.3)
"""Of the strength of the flow, over the recording, up or down, as a share of the mean."""
PULSE: Final = Range(0.05, 0.2)
PULSE_PERIOD_S: Final = Range(5.0, 30.0)
EDDY_PERIOD_S: Final = Range(20.0, 120.0)
"""Of two eddies that alternate."""
JET_PERIOD_S: Final = Range(60.0, 400.0)
"""Of a jet that turns."""
CHANGING_SHARE: Final = Range(0.25, 0.8)
"""Of the part of the flow that changes its shape, as rms over that of the mean flow."""
MINUTES: Final = (10.0, 20.0, 30.0)
MINUTES_SHARE: Final = (0.6, 0.25, 0.15)
POSITION_NOISE_M: Final = Range(0.2e-3, 0.5e-3)
ORIENTATION_NOISE_DEG: Final = Range(0.3, 0.7)
MISTAKEN_SHARE: Final = 0.15
"""Of the recordings with dropped frames, and of those with outliers."""
DROPPED: Final = Range(0.005, 0.05)
OUTLIERS: Final = Range(0.003, 0.02)
OUTLIER_M: Final = Range(5e-3, 30e-3)


class Kind(NamedTuple):
    """A kind of recording, and how many of it are in the development set and in each other one."""

    name: str
    development: int
    held_out: int
    body: str = "block"
    in_family: bool = True
    """Whether one of driftwalk's models is the law of this motion."""


KINDS: Final = (
    Kind("paper", 6, 36),
    Kind("floating, added mass 0.5", 3, 22),
    Kind("floating, added mass stated", 2, 18),
    Kind("power of the drag", 3, 16),
    Kind("force with memory", 1, 6),
    Kind("flow that grows", 3, 12),
    Kind("flow that pulses", 2, 12),
    Kind("slow orbit", 4, 16),
    Kind("often at the wall", 4, 16),
    Kind("alternating eddies", 2, 6, in_family=False),
    Kind("turning jet", 2, 6, in_family=False),
    Kind("active", 1, 4, "walker"),
    Kind("chiral", 1, 4, "walker"),
    Kind("run and tumble", 1, 4, "walker"),
    Kind("run and rest", 1, 4, "walker"),
    Kind("two states", 1, 4, "walker"),
    Kind("persistent", 1, 4, "walker"),
    Kind("Lévy runs", 1, 4, "walker", in_family=False),
    Kind("rests with a heavy tail", 1, 3, "walker", in_family=False),
    Kind("sees the wall", 1, 3, "walker", in_family=False),
)

WALKER_MINUTES: Final = (10.0, 15.0, 30.0)
CLEARANCE_M: Final = 0.015
SPEED_M_S: Final = Range(0.015, 0.05)
SPEED_CV: Final = Range(0.1, 0.4)
ROTATIONAL_DIFFUSION: Final = Range(0.05, 0.5)
"""[1/s]."""
TURN_RATE: Final = Range(0.3, 1.5)
"""Of a chiral body [rad/s], to either side."""
BOUT_S: Final = Range(1.0, 4.0)
TURN_STD: Final = Range(0.8, 1.8)
"""Between two bouts [rad]."""
RELAXATION_S: Final = Range(0.2, 0.6)
SLOW_SHARE: Final = Range(0.15, 0.4)
"""Speed of the slow state over that of the fast one."""
MEMORY_S: Final = Range(0.5, 2.0)
"""Of the velocity of a persistent body."""
LEVY_EXPONENT: Final = Range(1.3, 1.7)
"""P(run > t) falls with this power of t, from the shortest run on."""
SHORTEST_S: Final = Range(0.4, 1.0)
"""Run of a Lévy walk, or rest with a heavy tail."""
REST_EXPONENT: Final = Range(1.1, 1.5)
SIGHT_M: Final = Range(0.03, 0.06)
"""Distance straight ahead at which a body sees the wall, and turns off."""
