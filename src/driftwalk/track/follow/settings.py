"""Assumptions of the tracker about the bodies."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from driftwalk.core.errors import ConfigurationError


class Motion(NamedTuple):
    """How fast velocities wander: spectral densities of the white accelerations."""

    acceleration_density: float
    """Of both directions [m^2/s^3]."""
    angular_acceleration_density: float
    """Of the turning [rad^2/s^3]."""


@dataclass(frozen=True)
class TrackerSettings:
    """Assumptions on how bodies move, and when a detection belongs to them.

    Parameters
    ----------
    max_speed : float
        No body is faster [m/s]: what it could not have reached since it was last seen is not it.
    max_turn_rate : float
        The same for turning [rad/s]; a scale, no bound.
    turn_time : float
        Time in which a body may have changed its velocity altogether [s].
    lost_after : float
        Time without a detection after which a track ends [s].
    confirm_after : int
        Detections in a row of tracks that make a new one believed; one is enough for a coded tag.
    bodies : int, optional
        How many bodies there are at most. A new track then continues one that was lost.
    detection_probability : float
        Chance that a body in view is detected in a frame.
    return_probability : float
        Chance that a body that was missed is detected in the next frame.
    bounce_probability : float
        Chance that a body collides between two frames, and has any velocity afterwards.
    clutter_density : float
        Detections of something else [1/m^2], in each frame. The default fits a tank of 30 cm;
        scale it with the inverse of the area (`driftwalk track` does).
    gate : float
        How many standard deviations from its prediction a body may be found.
    ambiguous_above : float
        Score from which on another assignment counts as nearly as likely.

    Raises
    ------
    ConfigurationError
        When a value is out of range.

    Examples
    --------
    >>> TrackerSettings(max_speed=0.3).lost_after
    1.0
    """

    max_speed: float
    max_turn_rate: float = 6.0
    turn_time: float = 1.0
    lost_after: float = 1.0
    confirm_after: int = 3
    bodies: int | None = None
    detection_probability: float = 0.98
    return_probability: float = 0.5
    bounce_probability: float = 0.01
    clutter_density: float = 1.0
    gate: float = 5.0
    ambiguous_above: float = 0.001

    def __post_init__(self) -> None:
        """Check the ranges."""
        for name in ("max_speed", "max_turn_rate", "turn_time", "lost_after", "clutter_density"):
            self._require(name, math.isfinite(getattr(self, name)) and getattr(self, name) > 0)
        for name in ("bounce_probability", "detection_probability", "return_probability"):
            self._require(name, 0 < getattr(self, name) < 1)
        self._require("gate", math.isfinite(self.gate) and self.gate >= 1)
        self._require("ambiguous_above", 0 < self.ambiguous_above <= 1)
        self._require("confirm_after", self.confirm_after >= 1)
        self._require("bodies", self.bodies is None or self.bodies >= 1)

    def _require(self, name: str, holds: bool) -> None:
        if not holds:
            raise ConfigurationError(f"{name} is out of range: {getattr(self, name)}")

    @property
    def speed_std(self) -> float:
        """Standard deviation of each velocity of a body that was seen once [m/s]."""
        return self.max_speed / 3.0

    @property
    def turn_rate_std(self) -> float:
        """The same of the turn rate [rad/s]."""
        return self.max_turn_rate / 3.0

    @property
    def motion(self) -> Motion:
        """How velocities wander: in `turn_time` by what a new body's velocity may be."""
        return Motion(self.speed_std**2 / self.turn_time, self.turn_rate_std**2 / self.turn_time)
