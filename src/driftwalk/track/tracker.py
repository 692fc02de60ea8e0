"""From detections to tracks: which detection is which body, and where that is not certain.

Each frame, the tracks are predicted over the time that has passed, detections are gated, and each
connected group of the gating graph is assigned on its own. What is written is the measurement, not
the filter's state: smoothing is for later.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.errors import InputError
from driftwalk.track.assign import assign
from driftwalk.track.gate import Measured, Predicted, edge_costs, reach
from driftwalk.track.kalman import predict, start_state, update
from driftwalk.track.settings import TrackerSettings
from driftwalk.track.types import Detection

if TYPE_CHECKING:
    import xarray as xr

Floats = npt.NDArray[np.float64]

COVARIANCE: Final = ("xx", "xy", "yy", "xtheta", "ytheta", "thetatheta")
"""The parts of the covariance of a measurement, in the order in which they are kept."""
_ROWS, _COLUMNS = np.array([0, 0, 1, 0, 1, 2]), np.array([0, 1, 1, 2, 2, 2])
# Cost by which a tag that says whose it is beats every likelihood; for one that says otherwise, no
# edge is made.
_CERTAIN: Final = -1e4
# Smallest variance of a measurement, so that a perfect one has a likelihood too.
_LEAST_VARIANCE: Final = np.diag([1e-14, 1e-14, 1e-12])
# A body that could come back is taken for a lost one rather than for a new one.
_COME_BACK: Final = -50.0
# Score of two that were lost sight of together: which one went on being seen, nobody can say.
_PARTED: Final = 0.5
# Cost of taking two for one that were seen at once, one of them something else for a while.
_TOGETHER: Final = 20.0
# Standard deviations from the prediction at which a body was pushed rather than unlucky.
_PUSHED: Final = 3.5
# Measurements that tell the velocity anew, and with it whether an assignment was right.
_SETTLES_IN: Final = 3


class TrackState(NamedTuple):
    """Where the tracker believes a body to be."""

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


class _Sample(NamedTuple):
    frame: int
    pose: Floats
    covariance: Floats


class _Mark(NamedTuple):
    track: _Track
    first: int
    last: int
    score: float


@dataclass(eq=False)
class _Track:
    mean: Floats
    covariance: Floats
    time: float
    """Of mean and covariance."""
    seen_at: Floats
    seen: float
    began: int
    """Frame of the first sample."""
    key: str | None = None
    body: int | None = None
    believed: bool = False
    oriented: bool = False
    score: float = 0.0
    measured: Detection | None = None
    samples: list[_Sample] = field(default_factory=list)
    doubt: float = 0.0
    settles_in: int = 0
    """Measurements after which an assignment that was in doubt has settled."""
    company: dict[_Track, int] = field(default_factory=dict)
    """Tracks that are near now, each with the frame since when."""
    lost_beside: dict[_Track, int] = field(default_factory=dict)
    """Tracks that were near when it was seen last."""


class Tracker:
    """Follows bodies from frame to frame.

    Parameters
    ----------
    settings : TrackerSettings
        How bodies move, and when a detection is theirs.

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
        self._tracks: list[_Track] = []
        self._ended: list[_Track] = []
        self._all: list[_Track] = []
        self._names: list[str] = []
        self._last: dict[int, _Track] = {}
        self._marks: list[_Mark] = []

    def step(self, time: float, detections: Iterable[Detection]) -> list[TrackState]:
        """Take the detections of the next frame.

        Parameters
        ----------
        time : float
            Presentation time [s], later than that of the frame before.
        detections : iterable of Detection
            What was found, with positions in metres.

        Returns
        -------
        list of TrackState
            The bodies that are followed, those that are not seen in this frame among them.

        Raises
        ------
        InputError
            When time does not increase, or a detection has no position in metres.
        """
        self._check_time(time)
        found = self._unique_keys(list(detections))
        self._times.append(time)
        frame = len(self._times) - 1
        measured = _measured(found)
        self._predict(time)
        taken = self._assign(time, frame, found, measured)
        self._begin(time, frame, found, measured, taken)
        self._end(time)
        self._name_new_tracks(frame)
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
            What the source and the detector counted.

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

        if not self._names:
            raise InputError(
                f"nothing was tracked in {len(self._times)} frames: no object was found in "
                f"{self.settings.confirm_after} frames in a row"
            )
        pose, covariance = self._samples()
        intervals = np.diff(self._times)
        rate = 1.0 / float(np.median(intervals)) if intervals.size else 0.0
        recording = build_trajectory(
            self._times,
            *(pose[..., part] for part in range(3)),
            body=list(self._names),
            attrs={
                "format": "driftwalk track",
                "sample_rate_Hz": rate,
                "position_quantum_m": 0.0,
                "y_axis": "up",
                **(attrs or {}),
                "counts": json.dumps({"frames": len(self._times), **self.counts, **(counts or {})}),
            },
        )
        score = {"units": "1", "long_name": "score of the best other assignment of identities"}
        parts = {"long_name": "covariance of the measurement", "units": "m, m, rad"}
        recording["ambiguous"] = (("time", "body"), self._ambiguous(), score)
        recording["covariance"] = (("time", "body", "part"), covariance, parts)
        return recording.assign_coords(part=("part", np.array(COVARIANCE, dtype=object)))

    def _check_time(self, time: float) -> None:
        if not math.isfinite(time):
            raise InputError(f"the time of a frame is not a finite number: {time}")
        if self._times and time <= self._times[-1]:
            raise InputError(
                f"time does not increase: a frame at {time:g} s follows one at "
                f"{self._times[-1]:g} s; leave duplicates out"
            )

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
        elapsed = np.array([time - track.time for track in self._tracks])
        mean, covariance = predict(*_stacked(self._tracks), elapsed, self.settings.motion)
        speed = np.hypot(mean[:, 3], mean[:, 4])
        # Velocities beyond the bound are noise.
        mean[:, 3:5] *= np.minimum(1.0, self.settings.max_speed / np.maximum(speed, 1e-12))[:, None]
        for track, state, spread in zip(self._tracks, mean, covariance, strict=True):
            track.mean, track.covariance, track.time = state, spread, time
            track.measured, track.score = None, 0.0

    def _assign(
        self, time: float, frame: int, found: Sequence[Detection], measured: Measured
    ) -> set[int]:
        """Give detections to tracks; return those that are taken."""
        if not self._tracks:
            return set()
        tracks = self._tracks
        cost = edge_costs(self._predicted(time), measured, self.settings)
        _obey_keys(cost, tracks, found)
        chosen = assign(cost)
        pairs = [(track, int(j)) for track, j in zip(tracks, chosen.detection, strict=True)]
        parted = [t for t, j in pairs if j >= 0 and t.samples[-1].frame < frame - 1]
        self._update(time, frame, [(t, j) for t, j in pairs if j >= 0], found, measured)
        self._note_company(frame, chosen.group)
        for track, score in zip(tracks, chosen.score, strict=True):
            track.score = float(score) if track.key is None else 0.0
        for track in parted:
            for other in track.lost_beside if track.key is None else ():
                track.score = max(track.score, _PARTED)
                other.score = max(other.score, _PARTED)
        for track in tracks:
            self._doubt(track, frame)
        for track in parted:
            track.lost_beside = {}
        return {j for _, j in pairs if j >= 0}

    def _predicted(self, time: float) -> Predicted:
        return Predicted(
            *_stacked(self._tracks),
            np.array([track.seen_at for track in self._tracks]),
            np.array([time - track.seen for track in self._tracks]),
        )

    def _update(
        self,
        time: float,
        frame: int,
        pairs: Sequence[tuple[_Track, int]],
        found: Sequence[Detection],
        measured: Measured,
    ) -> None:
        if not pairs:
            return
        tracks, at = [track for track, _ in pairs], [j for _, j in pairs]
        pose, noise = measured.pose[at].copy(), measured.covariance[at]
        mean, covariance = _stacked(tracks)
        # An angle that cannot be is kept as it was measured, but the filter does not follow it.
        turned = np.abs(np.remainder(pose[:, 2] - mean[:, 2] + math.pi, 2 * math.pi) - math.pi)
        allowed = self.settings.gate * np.sqrt(covariance[:, 2, 2] + noise[:, 2, 2])
        pose[turned > np.maximum(allowed, 0.1), 2] = np.nan
        covariance += self._bounced(mean, covariance, pose, noise, time, tracks)
        mean, covariance = update(mean, covariance, pose, noise)
        for place, (track, j) in enumerate(pairs):
            track.mean, track.covariance = mean[place], covariance[place]
            track.seen_at, track.seen = measured.pose[j, :2], time
            track.measured = found[j]
            track.oriented |= bool(np.isfinite(measured.pose[j, 2]))
            track.samples.append(_sample(frame, measured, j))

    def _bounced(
        self,
        mean: Floats,
        covariance: Floats,
        pose: Floats,
        noise: Floats,
        time: float,
        tracks: Sequence[_Track],
    ) -> Floats:
        """Return what to add to the covariance of tracks that were pushed: any velocity."""
        total = covariance[:, :2, :2] + noise[:, :2, :2]
        off = pose[:, :2] - mean[:, :2]
        square = np.einsum("ni,ni->n", off, np.linalg.solve(total, off[..., None])[..., 0])
        std = self.settings.speed_std * (square > _PUSHED**2)
        elapsed = np.array([time - track.seen for track in tracks])
        added = np.zeros_like(covariance)
        for axis in range(2):
            added[:, axis, axis] = (std * elapsed) ** 2
            added[:, axis, axis + 3] = added[:, axis + 3, axis] = std**2 * elapsed
            added[:, axis + 3, axis + 3] = std**2
        return added

    def _note_company(self, frame: int, group: npt.NDArray[np.int64]) -> None:
        """Note which tracks are near each other, and since when."""
        before = {track: track.company for track in self._tracks}
        for track in self._tracks:
            track.company = {}
        for one, other in self._near_pairs(group):
            since = before[one].get(other, frame)
            one.company[other] = other.company[one] = since
        for track in self._tracks:
            if track.measured is None and track.samples[-1].frame == frame - 1:
                track.lost_beside = dict(track.company)

    def _near_pairs(self, group: npt.NDArray[np.int64]) -> list[tuple[_Track, _Track]]:
        """Return pairs that compete for a detection, or are both unseen where they might meet."""
        members: dict[int, list[int]] = {}
        for index, number in enumerate(group.tolist()):
            members.setdefault(number, []).append(index)
        pairs = {
            (one, other)
            for inside in members.values()
            for place, one in enumerate(inside)
            for other in inside[place + 1 :]
        }
        unseen = [index for index, track in enumerate(self._tracks) if track.measured is None]
        for place, one in enumerate(unseen):
            for other in unseen[place + 1 :]:
                first, second = self._tracks[one], self._tracks[other]
                spread = np.sqrt(first.covariance[0, 0]) + np.sqrt(second.covariance[0, 0])
                apart = first.mean[:2] - second.mean[:2]
                if np.hypot(*apart) <= self.settings.gate * spread:
                    pairs.add((one, other))
        return [(self._tracks[one], self._tracks[other]) for one, other in sorted(pairs)]

    def _doubt(self, track: _Track, frame: int) -> None:
        """Mark a track whose assignment was a close thing, and go on until that has settled.

        After a wrong choice the velocities are wrong too, and the way back looks certain.
        """
        if track.score >= self.settings.ambiguous_above:
            track.doubt, track.settles_in = track.score, _SETTLES_IN
            self._mark(track, frame)
        elif track.settles_in > 0:
            track.settles_in -= track.measured is not None
            track.score = track.doubt
            self._marks.append(_Mark(track, frame, frame, track.score))

    def _mark(self, track: _Track, frame: int) -> None:
        """Mark a track as ambiguous, since it came near those that it might be exchanged with."""
        # What was not seen may have been exchanged at any time since it was.
        last = track.samples[-2 if track.measured is not None else -1 :][0].frame
        beside = track.lost_beside.values() if track.measured is not None else ()
        since = min([*track.company.values(), *beside, last])
        self._marks.append(_Mark(track, since, frame, track.score))

    def _begin(
        self,
        time: float,
        frame: int,
        found: Sequence[Detection],
        measured: Measured,
        taken: set[int],
    ) -> None:
        """Begin a track at each detection that is left."""
        left = [j for j in range(len(found)) if j not in taken]
        if not left:
            return
        mean, covariance = start_state(
            measured.pose[left],
            measured.covariance[left],
            speed_std=self.settings.speed_std,
            turn_rate_std=self.settings.turn_rate_std,
        )
        for place, j in enumerate(left):
            track = _Track(
                mean[place],
                covariance[place],
                time,
                measured.pose[j, :2],
                time,
                frame,
                found[j].key,
                measured=found[j],
                oriented=bool(np.isfinite(measured.pose[j, 2])),
                samples=[_sample(frame, measured, j)],
            )
            self._tracks.append(track)
            self._all.append(track)

    def _end(self, time: float) -> None:
        """End tracks that were not seen for too long, and new ones that were mostly missed."""
        kept = []
        for track in self._tracks:
            unseen = time - track.seen
            if track.body is not None and unseen <= self.settings.lost_after:
                kept.append(track)
            elif track.body is not None:
                self._ended.append(track)
            elif unseen == 0 or len(track.samples) / (len(self._times) - track.began) > 0.5:
                kept.append(track)
            else:
                self._all.remove(track)
                self.counts["detections_of_nothing"] += len(track.samples)
        self._tracks = kept

    def _name_new_tracks(self, frame: int) -> None:
        """Say which body each track is that has been seen often enough."""
        for track in self._tracks:
            if track.body is None and track.key is not None:
                self._take_body(track, self._body_of_key(track.key))
        new = [
            track
            for track in self._tracks
            if track.body is None and len(track.samples) >= self.settings.confirm_after
        ]
        if not new:
            return
        came_back = self._come_back(new, frame)
        for track in new:
            if track in came_back:
                self._take_body(track, came_back[track])
            elif self.settings.bodies is None or len(self._names) < self.settings.bodies:
                self._take_body(track, self._new_body(str(len(self._names))))

    def _come_back(self, new: Sequence[_Track], frame: int) -> dict[_Track, int]:
        """Return which new tracks are bodies that were lost.

        Where another one is nearly as likely, it is so only if there can be no further body, and
        then it is marked.
        """
        lost = [
            track
            for body, track in sorted(self._last.items())
            if track.measured is None and track.key is None
        ]
        if not lost:
            return {}
        cost = np.array([[self._return_cost(gone, track) for track in new] for gone in lost])
        chosen = assign(cost)
        full = self.settings.bodies is not None and len(self._names) >= self.settings.bodies
        found: dict[_Track, int] = {}
        for gone, column, score in zip(lost, chosen.detection, chosen.score.tolist(), strict=True):
            uncertain = score >= self.settings.ambiguous_above
            if uncertain and not full:
                continue
            came_back = [new[column]] if column >= 0 else []
            since = [gone.samples[-1].frame]
            together = [track for track in came_back if _seen_together(gone, track)]
            since += [track.samples[0].frame for track in together]
            for track in came_back:
                # What it was before that, it was as something else.
                del track.samples[: self._first_within_reach(gone, track)]
            found.update((track, gone.body) for track in came_back if gone.body is not None)
            beside = gone.lost_beside if came_back else {}
            if uncertain or beside or together:
                first = min([*beside.values(), *since])
                likely = max(score, _PARTED if beside or together else 0.0)
                for marked in (gone, *came_back, *beside):
                    self._marks.append(_Mark(marked, first, frame, likely))
        return found

    def _return_cost(self, gone: _Track, track: _Track) -> float:
        """Return the cost of taking a new track for one that was lost, for `assign`."""
        first = self._first_within_reach(gone, track)
        if first is None:
            return math.inf
        sample = track.samples[first]
        distance = float(np.hypot(*(sample.pose[:2] - gone.seen_at)))
        cost = 0.5 * (3.0 * distance / self._reach(gone, sample)) ** 2 + _COME_BACK
        return cost + (_TOGETHER if _seen_together(gone, track) else 0.0)

    def _first_within_reach(self, gone: _Track, track: _Track) -> int | None:
        """Return the first sample of a new track that a lost body could have reached."""
        for place, sample in enumerate(track.samples):
            apart = float(np.hypot(*(sample.pose[:2] - gone.seen_at)))
            if self._times[sample.frame] > gone.seen and apart <= self._reach(gone, sample):
                return place
        return None

    def _reach(self, gone: _Track, sample: _Sample) -> float:
        noise = math.sqrt(sample.covariance[0, 0] + sample.covariance[1, 1])
        elapsed = self._times[sample.frame] - gone.seen
        return float(reach(np.array(elapsed), np.array(noise), self.settings))

    def _body_of_key(self, key: str) -> int:
        return self._names.index(key) if key in self._names else self._new_body(key)

    def _new_body(self, name: str) -> int:
        self._names.append(name)
        return len(self._names) - 1

    def _take_body(self, track: _Track, body: int) -> None:
        """Make a track that of a body; the track that it had is over."""
        old = self._last.get(body)
        if old is not None and old in self._tracks:
            self._tracks.remove(old)
        track.body, self._last[body] = body, track

    def _state(self, track: _Track) -> TrackState:
        assert track.body is not None
        x, y, theta, vx, vy, omega = track.mean.tolist()
        return TrackState(
            self._names[track.body],
            x,
            y,
            theta if track.oriented else math.nan,
            vx,
            vy,
            omega if track.oriented else math.nan,
            track.measured,
            track.score,
        )

    def _samples(self) -> tuple[Floats, Floats]:
        """Return poses (time, body, 3) and covariances (time, body, 6), NaN where not seen."""
        shape = (len(self._times), len(self._names))
        pose, covariance = np.full((*shape, 3), np.nan), np.full((*shape, 6), np.nan)
        for track in self._all:
            if track.body is None:
                continue
            frames = [sample.frame for sample in track.samples]
            pose[frames, track.body] = [sample.pose for sample in track.samples]
            covariance[frames, track.body] = [
                sample.covariance[_ROWS, _COLUMNS] for sample in track.samples
            ]
        return pose, covariance

    def _ambiguous(self) -> Floats:
        score = np.zeros((len(self._times), len(self._names)))
        for mark in self._marks:
            if mark.track.body is not None:
                part = score[mark.first : mark.last + 1, mark.track.body]
                np.maximum(part, mark.score, out=part)
        return score


def _measured(found: Sequence[Detection]) -> Measured:
    pose, covariance = np.empty((len(found), 3)), np.empty((len(found), 3, 3))
    for place, one in enumerate(found):
        if one.x is None or one.y is None:
            raise InputError(
                "a detection has no position in metres: state the scale (tank diameter or a "
                "calibrated camera)"
            )
        pose[place] = one.x, one.y, one.theta
        covariance[place] = one.covariance
    return Measured(pose, covariance + _LEAST_VARIANCE)


def _stacked(tracks: Sequence[_Track]) -> tuple[Floats, Floats]:
    return (
        np.array([track.mean for track in tracks]),
        np.array([track.covariance for track in tracks]),
    )


def _sample(frame: int, measured: Measured, j: int) -> _Sample:
    return _Sample(frame, measured.pose[j], measured.covariance[j])


def _obey_keys(cost: Floats, tracks: Sequence[_Track], found: Sequence[Detection]) -> None:
    """Let tags decide: the same one is certain, another one or none excludes."""
    if all(one.key is None for one in found) and all(track.key is None for track in tracks):
        return
    for row, track in enumerate(tracks):
        for column, one in enumerate(found):
            if track.key is not None and track.key == one.key:
                cost[row, column] = _CERTAIN
            elif track.key is not None or one.key is not None:
                cost[row, column] = math.inf


def _seen_together(gone: _Track, track: _Track) -> bool:
    """Return whether a new track began before a lost one was seen last."""
    return track.samples[0].frame <= gone.samples[-1].frame
