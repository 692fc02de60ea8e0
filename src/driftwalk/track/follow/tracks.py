"""Tracks: the state and the samples of each body, and what it may go back to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats, Integers
from driftwalk.core.errors import InputError
from driftwalk.track.follow.kalman import Measured, Predicted
from driftwalk.track.types import Detection

COVARIANCE: Final = ("xx", "xy", "yy", "xtheta", "ytheta", "thetatheta")
"""The parts of the covariance of a measurement, in the order in which they are kept."""
_ROWS, _COLUMNS = np.array([0, 0, 1, 0, 1, 2]), np.array([0, 1, 1, 2, 2, 2])
"""Places of the parts of `COVARIANCE` in the matrix."""


class TrackState(NamedTuple):
    """Estimated state of a body."""

    id: str
    """Name of the body."""
    x: float
    """Position x [m]: the filter's."""
    y: float
    """Position y [m]."""
    theta: float
    """Orientation [rad]; NaN when it was never measured."""
    vx: float
    """Velocity in x [m/s]."""
    vy: float
    """Velocity in y [m/s]."""
    omega: float
    """Turn rate [rad/s]."""
    measured: Detection | None
    """The detection of this frame; None when the body was not seen."""
    ambiguous: float
    """Score of the best other assignment, 0 to 1."""


class Samples:
    """Measurements of a track: frame numbers, and x, y, theta with the parts of the covariance.

    They lie in arrays that grow by doubling, so that long recordings stay small and quick to read.
    """

    def __init__(self) -> None:
        self._frames = np.empty(8, dtype=np.int64)
        self._values = np.empty((8, 3 + len(COVARIANCE)))
        self._count = 0

    def __len__(self) -> int:
        """Return how many there are."""
        return self._count

    @property
    def frames(self) -> Integers:
        """Their frames, shape (n,)."""
        return self._frames[: self._count]

    @property
    def values(self) -> Floats:
        """x, y, theta and the covariance in the order of `COVARIANCE`, shape (n, 9)."""
        return self._values[: self._count]

    @property
    def first_frame(self) -> int:
        """Frame of the first one."""
        return int(self._frames[0])

    @property
    def last_frame(self) -> int:
        """Frame of the last one."""
        return int(self._frames[self._count - 1])

    def append(self, frame: int, pose: Floats, covariance: Floats) -> None:
        """Add one."""
        if self._count == len(self._frames):
            self._frames = np.concatenate([self._frames, np.empty_like(self._frames)])
            self._values = np.concatenate([self._values, np.empty_like(self._values)])
        self._frames[self._count] = frame
        self._values[self._count, :3] = pose
        self._values[self._count, 3:] = covariance[_ROWS, _COLUMNS]
        self._count += 1

    def keep_first(self, count: int) -> None:
        """Take back those after the first ones."""
        self._count = count

    def leave_out_first(self, count: int) -> None:
        """Take back the first ones."""
        self._frames = self._frames[count:].copy()
        self._values = self._values[count:].copy()
        self._count -= count


@dataclass(eq=False, kw_only=True)
class Followed:
    """State of a body; a track goes back to an earlier one where a measurement was wrong."""

    mean: Floats
    """The filter's x, y [m], theta [rad] and their rates [m/s, rad/s], shape (6,)."""
    covariance: Floats
    """Its covariance, shape (6, 6)."""
    time: float
    """Of mean and covariance [s]."""
    seen_at: Floats
    """Position last measured [m], shape (2,)."""
    seen: float
    """When that was [s]."""
    oriented: bool
    """Whether its angle was ever measured."""
    lost_beside: dict[Track, int] = field(default_factory=dict)
    """Tracks that were near when it was seen last, each with the frame since when."""


@dataclass(eq=False, kw_only=True)
class Alternative(Followed):
    """State of a track without its last measurements."""

    samples: int
    """How many samples of the track are its own."""
    since: int
    """Frame of the first measurement that is in doubt."""
    lead: float
    """Logarithm of how much likelier the track is."""

    @property
    def score(self) -> float:
        """Likelihood relative to the track's, 0 to 1."""
        return math.exp(-max(self.lead, 0.0))


@dataclass(eq=False, kw_only=True)
class Track(Followed):
    """A body that is followed, or a candidate for one."""

    began: int
    """Frame of the first sample."""
    key: str | None = None
    body: int | None = None
    score: float = 0.0
    measured: Detection | None = None
    samples: Samples = field(default_factory=Samples)
    doubt: float = 0.0
    """Score of the last assignment that was in doubt, 0 to 1."""
    settles_in: int = 0
    """Measurements after which an assignment that was in doubt has settled."""
    neighbours: dict[Track, int] = field(default_factory=dict)
    """Tracks that are near now, each with the frame since when."""
    alternative: Alternative | None = None
    """State before a measurement that is in doubt."""

    def without(self, frame: int, lead: float) -> Alternative:
        """Return the track as it is before it takes a measurement."""
        state: dict[str, Any] = {one.name: getattr(self, one.name) for one in fields(Followed)}
        state["lost_beside"] = dict(self.lost_beside)
        return Alternative(**state, samples=len(self.samples), since=frame, lead=max(lead, 0.0))

    def go_back(self, alternative: Alternative) -> None:
        """Make the track what it was before the measurements in doubt."""
        for one in fields(Followed):
            setattr(self, one.name, getattr(alternative, one.name))
        self.samples.keep_first(alternative.samples)
        self.alternative = None


def stacked(bodies: Sequence[Followed]) -> tuple[Floats, Floats]:
    """Return means (n, 6) and covariances (n, 6, 6)."""
    return np.array([one.mean for one in bodies]), np.array([one.covariance for one in bodies])


def predicted_of(bodies: Sequence[Followed], time: float, missed: Sequence[bool]) -> Predicted:
    """Return bodies as arrays, at a time; `missed` says which were not in the frame before."""
    return Predicted(
        *stacked(bodies),
        np.array([one.seen_at for one in bodies]),
        np.array([time - one.seen for one in bodies]),
        np.array(missed),
    )


def measured_of(found: Sequence[Detection]) -> Measured:
    """Return detections as arrays.

    Raises
    ------
    InputError
        When one has no position in metres.
    """
    pose, covariance = np.empty((len(found), 3)), np.empty((len(found), 3, 3))
    for place, one in enumerate(found):
        if one.x is None or one.y is None:
            raise InputError(
                "a detection has no position in metres: state the scale (tank diameter or a "
                "calibrated camera)"
            )
        pose[place] = one.x, one.y, one.theta
        covariance[place] = one.covariance
    # A perfect measurement has a likelihood, too.
    return Measured(pose, covariance + np.diag([1e-14, 1e-14, 1e-12]))
