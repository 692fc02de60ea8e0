"""Multi-object tracker: detections to tracks, with marks where an identity is uncertain.

Each frame, the tracks are predicted over the time that has passed, detections are gated, and each
connected group of the gating graph is assigned on its own. The output is the measurement, not the
filter's state: smoothing is for later.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.schema.check import described
from driftwalk.track.follow.assign import assign
from driftwalk.track.follow.kalman import STATES, Measured, edge_costs, predict, start_state, update
from driftwalk.track.follow.marks import Alternatives, Marks
from driftwalk.track.follow.naming import Naming
from driftwalk.track.follow.settings import TrackerSettings
from driftwalk.track.follow.tracks import (
    COVARIANCE,
    Followed,
    Track,
    TrackState,
    measured_of,
    predicted_of,
    stacked,
)
from driftwalk.track.types import Detection

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["TrackState", "Tracker"]


class _Frame(NamedTuple):
    """The detections of a frame, as they are and as arrays."""

    number: int
    time: float
    found: list[Detection]
    measured: Measured


class Tracker:
    """Follows bodies from frame to frame.

    Parameters
    ----------
    settings : TrackerSettings
        Assumptions on how bodies move, and when a detection belongs to them.

    Examples
    --------
    >>> tracker = Tracker(TrackerSettings(max_speed=0.3))
    >>> for frame in range(5):
    ...     found = Detection(0.01 * frame, 0.0, 0.0, 0.0, 0.0, np.diag([1e-8, 1e-8, 1e-4]), 50.0)
    ...     states = tracker.step(0.1 * frame, [found])
    >>> states[0].id, round(states[0].vx, 2)
    ('0', 0.1)
    >>> tracker.finish()["x"].values[:, 0].tolist()
    [0.0, 0.01, 0.02, 0.03, 0.04]
    """

    def __init__(self, settings: TrackerSettings) -> None:
        self.settings = settings
        self.counts: Counter[str] = Counter()
        self._times: list[float] = []
        self._tracks: list[Track] = []
        self._over: list[Track] = []
        self._marks = Marks(settings)
        self._naming = Naming(settings, self._marks)
        self._alternatives = Alternatives(settings, self._marks, self.counts)

    def step(self, time: float, detections: Iterable[Detection]) -> list[TrackState]:
        """Take the detections of the next frame.

        Parameters
        ----------
        time : float
            Presentation time [s], later than that of the frame before.
        detections : iterable of Detection
            The detections, with positions in metres.

        Returns
        -------
        list of TrackState
            The bodies that are followed, those that are not seen in this frame among them.

        Raises
        ------
        InputError
            When time does not increase, or a detection has no position in metres.
        """
        if not math.isfinite(time):
            raise InputError(f"the time of a frame is not a finite number: {time}")
        if self._times and time <= self._times[-1]:
            raise InputError(
                f"time does not increase: a frame at {time:g} s follows one at "
                f"{self._times[-1]:g} s; leave duplicates out"
            )
        found = self._unique_keys(list(detections))
        self._times.append(time)
        now = _Frame(len(self._times) - 1, time, found, measured_of(found))
        self._predict(time)
        self._begin(now, self._assign(now))
        self._end(time)
        replaced = self._naming.name_new(self._tracks, self._times)
        self._over += [track for track in self._tracks if track in replaced]
        self._tracks = [track for track in self._tracks if track not in replaced]
        named = [track for track in self._tracks if track.body is not None]
        return [self._state(track) for track in sorted(named, key=lambda track: track.body or 0)]

    def finish(
        self, *, attrs: Mapping[str, Any] | None = None, counts: Mapping[str, Any] | None = None
    ) -> xr.Dataset:
        """Return what was measured so far; the tracker can go on afterwards.

        Parameters
        ----------
        attrs : mapping, optional
            Attributes to add: source, arena.
        counts : mapping, optional
            Counts of the source and the detector.

        Returns
        -------
        xarray.Dataset
            A `trajectory`, with ``ambiguous`` (time, body): score in [0, 1] of the best other
            assignment, over the whole interval in which identities could have been exchanged; and
            ``covariance`` (time, body, part) of each measurement [m^2, m rad, rad^2].

        Raises
        ------
        InputError
            When no body was ever followed.
        """
        from driftwalk.schema import build_trajectory

        names = self._naming.names
        if not names:
            raise InputError(
                f"nothing was tracked in {len(self._times)} frames: no object was found in "
                f"{self.settings.confirm_after} frames in a row"
            )
        tracks = [*self._over, *self._tracks]
        values = np.full((len(self._times), len(names), 3 + len(COVARIANCE)), np.nan)
        for track in tracks:
            if track.body is not None:
                values[track.samples.frames, track.body] = track.samples.values
        intervals = np.diff(self._times)
        recording = build_trajectory(
            self._times,
            *(values[..., part] for part in range(3)),
            body=list(names),
            attrs={
                "format": "driftwalk track",
                "sample_rate_Hz": 1.0 / float(np.median(intervals)) if intervals.size else 0.0,
                "position_quantum_m": 0.0,
                "y_axis": "up",
                **(attrs or {}),
                "counts": json.dumps({"frames": len(self._times), **self.counts, **(counts or {})}),
            },
        )
        ambiguous = self._marks.scores(len(self._times), len(names), tracks)
        recording["ambiguous"] = (("time", "body"), ambiguous)
        recording["covariance"] = (("time", "body", "part"), values[..., 3:])
        return described(recording.assign_coords(part=("part", np.array(COVARIANCE, dtype=object))))

    def _unique_keys(self, found: list[Detection]) -> list[Detection]:
        """Keep the best of several detections with the same tag."""
        best: dict[str, Detection] = {}
        for one in found:
            if one.key is not None and (one.key not in best or one.score > best[one.key].score):
                best[one.key] = one
        kept = [one for one in found if one.key is None or best[one.key] is one]
        if len(kept) < len(found):
            self.counts["same_tag_twice"] += len(found) - len(kept)
        return kept

    def _predict(self, time: float) -> None:
        if not self._tracks:
            return
        alternatives = filter(None, (track.alternative for track in self._tracks))
        both: list[Followed] = [*self._tracks, *alternatives]
        elapsed = np.array([time - one.time for one in both])
        mean, covariance = predict(*stacked(both), elapsed, self.settings.motion)
        speed = np.hypot(mean[:, 3], mean[:, 4])
        # Velocities beyond the bound are noise.
        mean[:, 3:5] *= np.minimum(1.0, self.settings.max_speed / np.maximum(speed, 1e-12))[:, None]
        for one, state, spread in zip(both, mean, covariance, strict=True):
            one.mean, one.covariance, one.time = state, spread, time
        for track in self._tracks:
            track.measured, track.score = None, 0.0

    def _assign(self, now: _Frame) -> set[int]:
        """Give detections to tracks; return those that are taken."""
        if not self._tracks:
            return set()
        tracks, frame = self._tracks, now.number
        missed = [track.samples.last_frame < frame - 1 for track in tracks]
        cost = edge_costs(predicted_of(tracks, now.time, missed), now.measured, self.settings)
        alternative = self._alternatives.costs(tracks, now.measured, now.time, frame)
        _obey_keys(cost, tracks, now.found)
        _obey_keys(alternative, tracks, now.found)
        chosen = assign(np.minimum(cost, alternative))
        self._alternatives.settle(tracks, chosen.detection, cost, alternative, frame)
        pairs = [(track, int(j)) for track, j in zip(tracks, chosen.detection, strict=True)]
        parted = [t for t, j in pairs if j >= 0 and t.samples.last_frame < frame - 1]
        self._update(now, [(t, j) for t, j in pairs if j >= 0])
        self._marks.note_neighbours(tracks, frame, chosen.exchanges)
        for track, score in zip(tracks, chosen.score, strict=True):
            track.score = float(score) if track.key is None else 0.0
        self._marks.doubt(tracks, parted, frame)
        for track in tracks:
            if track.alternative is not None:
                track.score = max(track.score, track.alternative.score)
        return {j for _, j in pairs if j >= 0}

    def _update(self, now: _Frame, pairs: Sequence[tuple[Track, int]]) -> None:
        if not pairs:
            return
        tracks, at = [track for track, _ in pairs], [j for _, j in pairs]
        measured = now.measured
        pose, noise = measured.pose[at].copy(), measured.covariance[at]
        mean, covariance = stacked(tracks)
        # An angle that cannot be is kept as it was measured, but the filter does not follow it.
        turned = np.abs(np.remainder(pose[:, 2] - mean[:, 2] + math.pi, 2 * math.pi) - math.pi)
        allowed = self.settings.gate * np.sqrt(covariance[:, 2, 2] + noise[:, 2, 2])
        pose[turned > np.maximum(allowed, 0.1), 2] = np.nan
        elapsed = np.array([now.time - track.seen for track in tracks])
        off, total = pose[:, :2] - mean[:, :2], covariance[:, :2, :2] + noise[:, :2, :2]
        covariance += self._bounced(off, total, elapsed)
        mean, covariance = update(mean, covariance, pose, noise)
        for place, (track, j) in enumerate(pairs):
            track.mean, track.covariance = mean[place], covariance[place]
            track.seen_at, track.seen = measured.pose[j, :2], now.time
            track.measured = now.found[j]
            track.oriented |= bool(np.isfinite(measured.pose[j, 2]))
            track.samples.append(now.number, measured.pose[j], measured.covariance[j])

    def _bounced(self, off: Floats, total: Floats, elapsed: Floats) -> Floats:
        """Return what to add to the covariance of tracks that were pushed: any velocity.

        They are `off` their predictions, which have the covariance `total`.
        """
        square = np.einsum("ni,ni->n", off, np.linalg.solve(total, off[..., None])[..., 0])
        # This far from the prediction [standard deviations], a body was pushed.
        std = self.settings.speed_std * (square > 3.5**2)
        added = np.zeros((len(off), STATES, STATES))
        for axis in range(2):
            added[:, axis, axis] = (std * elapsed) ** 2
            added[:, axis, axis + 3] = added[:, axis + 3, axis] = std**2 * elapsed
            added[:, axis + 3, axis + 3] = std**2
        return added

    def _begin(self, now: _Frame, taken: set[int]) -> None:
        """Begin a track at each detection that is left."""
        left = [j for j in range(len(now.found)) if j not in taken]
        if not left:
            return
        poses, covariances = now.measured.pose[left], now.measured.covariance[left]
        mean, covariance = start_state(poses, covariances, self.settings)
        for place, j in enumerate(left):
            track = Track(
                mean=mean[place],
                covariance=covariance[place],
                time=now.time,
                seen_at=poses[place, :2],
                seen=now.time,
                began=now.number,
                key=now.found[j].key,
                measured=now.found[j],
                oriented=bool(np.isfinite(poses[place, 2])),
            )
            track.samples.append(now.number, poses[place], covariances[place])
            self._tracks.append(track)

    def _end(self, time: float) -> None:
        """End tracks that were not seen for too long, and new ones that were mostly missed."""
        kept = []
        for track in self._tracks:
            unseen = time - track.seen
            if track.body is not None and unseen <= self.settings.lost_after:
                kept.append(track)
            elif track.body is not None:
                self._over.append(track)
            elif unseen == 0 or len(track.samples) / (len(self._times) - track.began) > 0.5:
                kept.append(track)
            else:
                self.counts["detections_of_nothing"] += len(track.samples)
        self._tracks = kept

    def _state(self, track: Track) -> TrackState:
        assert track.body is not None
        x, y, theta, vx, vy, omega = track.mean.tolist()
        if not track.oriented:
            theta = omega = math.nan
        name = self._naming.names[track.body]
        return TrackState(name, x, y, theta, vx, vy, omega, track.measured, track.score)


def _obey_keys(cost: Floats, tracks: Sequence[Track], found: Sequence[Detection]) -> None:
    """Let tags decide: the same one is certain, another one or none excludes."""
    if all(one.key is None for one in found) and all(track.key is None for track in tracks):
        return
    for row, track in enumerate(tracks):
        for column, one in enumerate(found):
            if track.key is not None and track.key == one.key:
                # A tag that says whose it is beats every likelihood; for another
                # body's there is no edge.
                cost[row, column] = -1e4
            elif track.key is not None or one.key is not None:
                cost[row, column] = math.inf
