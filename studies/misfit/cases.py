"""What is not as the model says, one thing at a time.

A `Law` changes the world: its names are those of `Law` in benchmarks/ode/tank.hpp. A `Mistake`
changes what the camera, its clock or the user makes of the true poses.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


class Seen(NamedTuple):
    """Poses with their time stamps, shapes (n,) [s], [m], [m], [rad]."""

    time: Floats
    x: Floats
    y: Floats
    theta: Floats

    def only(self, kept: npt.NDArray[np.bool_]) -> Seen:
        """Return some of the samples."""
        return Seen(*(part[kept] for part in self))


Mistake = Callable[[Seen, np.random.Generator], Seen]


@dataclass(frozen=True)
class Case:
    """One thing that is not as the model says."""

    law: Mapping[str, float] = field(default_factory=dict)
    mistake: Mistake | None = None
    """Made of the poses with their noise."""
    told: Mapping[str, float] = field(default_factory=dict)
    """Keys of the study that are stated wrongly, as factors of the true value."""
    stated: Mapping[str, float] = field(default_factory=dict)
    """Keys of the study that the user knows, and states."""
    angle: str = "state"
    growth: float = 0.0
    """Of the flow's strength, from a minute before the first sample to the last, as a share."""
    carried: bool = False
    """Whether the water carries the block along. In a sink, or in a small vortex, such a block
    stays in one place, and nothing is learned: its flow is a swirl with jets, without a sink."""


def outliers(share: float, size_m: float, run: int = 1) -> Mistake:
    """Put `run` samples in a row a distance off, in a direction drawn at random."""

    def made(seen: Seen, rng: np.random.Generator) -> Seen:
        first = rng.uniform(size=seen.time.size) < share / run
        wrong = first.copy()
        for k in range(1, run):
            wrong[k:] |= first[:-k]
        direction = rng.uniform(0.0, 2.0 * np.pi, seen.time.size)
        for k in range(1, run):
            direction[k:][first[:-k]] = direction[:-k][first[:-k]]
        x = seen.x + size_m * np.cos(direction) * wrong
        y = seen.y + size_m * np.sin(direction) * wrong
        return seen._replace(x=x, y=y)

    return made


def dropped(share: float, *, stamped: bool) -> Mistake:
    """Lose frames; without stamps the rest is taken for a recording at a constant rate."""

    def made(seen: Seen, rng: np.random.Generator) -> Seen:
        kept = seen.only(rng.uniform(size=seen.time.size) >= share)
        return kept if stamped else kept._replace(time=seen.time[: kept.time.size])

    return made


def jittered(size_s: float) -> Mistake:
    """Write a time stamp that is off, by a normal law."""

    def made(seen: Seen, rng: np.random.Generator) -> Seen:
        return seen._replace(time=np.sort(seen.time + size_s * rng.normal(size=seen.time.size)))

    return made


def slow_clock(share: float) -> Mistake:
    """Let the clock be slow by a share."""
    return lambda seen, _: seen._replace(time=(1.0 - share) * seen.time)


def scaled(share: float) -> Mistake:
    """Take the pixels for larger than they are, by a share."""
    return lambda seen, _: seen._replace(x=(1.0 + share) * seen.x, y=(1.0 + share) * seen.y)


def turned(offset_deg: float) -> Mistake:
    """Measure the orientation from another direction than that of the faces."""
    return lambda seen, _: seen._replace(theta=seen.theta + np.deg2rad(offset_deg))


def mirrored(seen: Seen, _: np.random.Generator) -> Seen:
    """Measure the orientation clockwise."""
    return seen._replace(theta=-seen.theta)


def marker_off(distance_m: float) -> Mistake:
    """Follow a marker that is away from the centre of mass, along the block's own x axis."""

    def made(seen: Seen, _: np.random.Generator) -> Seen:
        x = seen.x + distance_m * np.cos(seen.theta)
        y = seen.y + distance_m * np.sin(seen.theta)
        return seen._replace(x=x, y=y)

    return made


def smoothed(frames: int) -> Mistake:
    """Give means of some frames, as a tracker's filter does."""

    def made(seen: Seen, _: np.random.Generator) -> Seen:
        window = np.full(frames, 1.0 / frames)
        edge = frames // 2
        x, y = (np.convolve(part, window, mode="valid") for part in (seen.x, seen.y))
        middle = slice(edge, seen.time.size - edge)
        return Seen(seen.time[middle], x, y, seen.theta[middle])

    return made


FLOATING = {"pressure_gradient": 1.0, "water_spin": 1.0}

CASES: dict[str, Case] = {
    "control": Case(),
    "floating body, added mass 0.5 m": Case({"added_mass": 0.5, **FLOATING}, carried=True),
    "the same, its spin left out": Case(
        {"added_mass": 0.5, "pressure_gradient": 1.0}, carried=True
    ),
    "the water's acceleration alone": Case(
        FLOATING, stated={"fit.added_mass_share": 0.0}, carried=True
    ),
    "added mass 0.5 m in the inertia alone": Case({"added_mass": 0.5}),
    "the same, stated as 0.5 ± 0.1": Case(
        {"added_mass": 0.5},
        stated={"fit.added_mass_share": 0.5, "fit.added_mass_share_std": 0.1},
    ),
    "drag with a linear part": Case({"linear_drag": 5e-3}),
    "drag ∝ speed": Case({"drag_power": 1.0}),
    "drag ∝ speed^1.5": Case({"drag_power": 1.5}),
    "flow grows by 20 %": Case({"flow_growth": 0.2 / 660.0}),
    "flow falls by 20 %": Case({"flow_growth": -0.2 / 660.0}),
    "flow pulses by 20 % in 10 s": Case({"pulse": 0.2}),
    "force remembers 0.1 s": Case({"force_memory": 0.1}),
    "force remembers 0.5 s": Case({"force_memory": 0.5}),
    "1 % of the positions off by 5 mm": Case(mistake=outliers(0.01, 5e-3)),
    "5 % of the positions off by 5 mm": Case(mistake=outliers(0.05, 5e-3)),
    "5 % of the positions off by 50 mm": Case(mistake=outliers(0.05, 50e-3)),
    "5 % off by 5 mm, two in a row": Case(mistake=outliers(0.05, 5e-3, run=2)),
    "5 % of the frames dropped, right stamps": Case(mistake=dropped(0.05, stamped=True)),
    "5 % dropped, constant rate assumed": Case(mistake=dropped(0.05, stamped=False)),
    "time stamps jittered by 10 ms": Case(mistake=jittered(0.01)),
    "clock 5 % slow": Case(mistake=slow_clock(0.05)),
    "scale 3 % off": Case(mistake=scaled(0.03)),
    "orientation + 5°": Case(mistake=turned(5.0)),
    "orientation + 20°": Case(mistake=turned(20.0)),
    "orientation mirrored": Case(mistake=mirrored),
    "orientation not used": Case(angle="none"),
    "marker 3 mm off": Case(mistake=marker_off(3e-3)),
    "positions smoothed over 3 frames": Case(mistake=smoothed(3)),
    "mass stated 15 % too large": Case(told={"block.mass_kg": 1.15}),
    "side stated 5 % too large": Case(told={"block.side_m": 1.05}),
}
