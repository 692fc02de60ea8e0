"""Tracks and the block as the filter takes them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.likelihood.filter.departures import STRENGTH_TERMS
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.spline import Floats

Flags = npt.NDArray[np.bool_]


class FilterPolicy(NamedTuple):
    """How the filter goes over a track."""

    largest_step_s: float = 0.05
    """Longest step of the filter's integrator [s]. Chosen by hand."""
    longest_gap_s: float = 1.0
    """Longest gap that is predicted over [s]; the filter restarts after a longer one. Chosen by
    hand."""
    settling_samples: int = 3
    """Samples after the first one of a stretch until the filter knows the velocity. Its innovations
    are a hundredth to four fifths of what it expects there; when they counted, six of 42 recordings
    of the model itself were rejected."""


FILTER: Final = FilterPolicy()


@dataclass(frozen=True, eq=False)
class Series:
    """One track as the filter takes it, shapes (n,)."""

    time: Floats
    x: Floats
    y: Floats
    theta: Floats
    omega: Floats
    excluded: npt.NDArray[np.uint8]
    """Samples that end an interval which is left out."""
    flow: int = 0
    """Number of the flow that the water has meanwhile."""
    recording: int = 0
    """Number of the recording, which may be cut into several series."""
    near_wall: int = 0
    """Intervals that are left out because the block may touch the wall."""
    angle: Floats = field(default_factory=lambda: np.zeros(0))
    """The angle, with holes filled in; zeros where there is none."""
    span: float = 0.0
    """Time of the recording's last sample, counted from its first [s]."""

    @property
    def settled(self) -> Flags:
        """Which samples are not the first ones of a stretch, shape (n,).

        Where the filter begins, and after a contact with the wall, it allows for any velocity. So
        its next errors are far smaller than it expects, and places where it often begins, which are
        those at the wall, would seem to have less noise.
        """
        begins = np.concatenate([[True], np.diff(self.time) > FILTER.longest_gap_s])
        begins |= self.excluded != 0
        settled = ~begins
        for later in range(1, FILTER.settling_samples + 1):
            settled[later:] &= ~begins[:-later]
        return settled

    def part(self, first: int, end: int) -> Series:
        """Return the samples from a first one on, before an end."""
        columns = ("time", "x", "y", "theta", "omega", "excluded", "angle")
        return replace(self, **{name: getattr(self, name)[first:end] for name in columns})


@dataclass(frozen=True)
class Body:
    """The block and the water."""

    side: float
    mass: float
    depth: float
    strips: int
    water_density: float
    linear_speed: float
    """Speed [m/s] at which linear drag is as strong as the quadratic one in its place."""
    drag_speed: float
    """Speed [m/s] at which C_d holds, whatever the power of the drag."""
    orientation: str
    """"state", "given" or "none": the track's angle is measured like the position, is an input, or
    is not used."""


def corrected(series: Series, point: Point) -> tuple[Floats, Floats, Floats]:
    """Return the centre of mass and the angle of its faces, for what the camera says."""
    across, along = point.number("marker_x"), point.number("marker_y")
    offset = point.number("angle_offset")
    x, y, theta = series.x, series.y, series.theta
    if across or along:
        cosine, sine = np.cos(series.angle), np.sin(series.angle)
        x = x - (across * cosine - along * sine)
        y = y - (across * sine + along * cosine)
    if offset:
        theta = theta - offset
    return x, y, theta


def strength_of(series: Series, point: Point) -> Floats | None:
    """Return the strength of the flow at the samples; nothing where it is 1 all the time."""
    terms = {k: point.number(f"strength_{k}") for k in range(STRENGTH_TERMS + 1)}
    waves = point.number("pulse_cosine"), point.number("pulse_sine")
    if not any(terms.values()) and not any(waves):
        return None
    strength = np.ones_like(series.time)
    for k, term in terms.items():
        strength += term * cosine_of(series, k)
    phase = 2.0 * np.pi * point.number("pulse_frequency") * series.time
    return np.asarray(strength + waves[0] * np.cos(phase) + waves[1] * np.sin(phase))


def cosine_of(series: Series, number: int) -> Floats:
    """Return one of the cosines over the recording, at the samples."""
    return np.asarray(np.cos(number * np.pi * series.time / max(series.span, 1e-300)))
