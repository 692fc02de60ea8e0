"""Ambiguous identities: intervals of possible exchanges, and decisions that are deferred.

A body that is hidden may be mistaken for something that turns up nearby. So a detection that is not
far more likely than "the body was missed, and this is something else" is taken with a reservation:
the track keeps, as its alternative, what it was before. Both are followed, and each later frame is
taken by the one that fits it better, given all since. The alternative is dropped when it has become
improbable; when it becomes the likelier one, the track goes back to it, without the samples.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats, Integers
from driftwalk.track.follow.kalman import Measured, edge_costs
from driftwalk.track.follow.settings import TrackerSettings
from driftwalk.track.follow.tracks import Alternative, Track, predicted_of


class MarkPolicy(NamedTuple):
    """How exchanged identities are scored."""

    parted: float = 0.5
    """Score of two bodies that were lost together, of which one is seen again: it may be
    either; chosen by hand."""
    settles_in: int = 3
    """Measurements that determine the velocity again, and so whether an assignment was right;
    chosen by hand."""


MARKS: Final = MarkPolicy()


class _Mark(NamedTuple):
    track: Track
    first: int
    last: int
    score: float


class Marks:
    """Notes who was near whom, and marks what could have been exchanged.

    Parameters
    ----------
    settings : TrackerSettings
        From which score on an assignment is ambiguous.
    """

    def __init__(self, settings: TrackerSettings) -> None:
        self._settings = settings
        self._marks: list[_Mark] = []

    def add(self, track: Track, first: int, last: int, score: float) -> None:
        """Mark a track from one frame to another."""
        self._marks.append(_Mark(track, first, last, score))

    def scores(self, frames: int, bodies: int, tracks: Iterable[Track]) -> Floats:
        """Return the score of each frame and body, shape (frames, bodies); 0 where not marked.

        Samples still in doubt in one of the tracks count as marked.
        """
        score = np.zeros((frames, bodies))
        still = [
            _Mark(track, track.alternative.since, track.samples.last_frame, track.alternative.score)
            for track in tracks
            if track.alternative is not None
        ]
        for mark in (*self._marks, *still):
            if mark.track.body is not None:
                part = score[mark.first : mark.last + 1, mark.track.body]
                np.maximum(part, mark.score, out=part)
        return score

    def note_neighbours(
        self, tracks: Sequence[Track], frame: int, exchanges: Sequence[tuple[int, int, float]]
    ) -> None:
        """Note which tracks are so near each other that they could be exchanged; since when."""
        before = {track: track.neighbours for track in tracks}
        for track in tracks:
            track.neighbours = {}
        meeting = self._meeting(tracks)
        likely = {(i, j) for i, j, score in exchanges if score >= self._settings.ambiguous_above}
        for one, other in sorted({(i, j) for i, j, _ in exchanges} | meeting):
            first, second = tracks[one], tracks[other]
            first.neighbours[second] = second.neighbours[first] = before[first].get(second, frame)
        for track in tracks:
            if track.measured is None and track.samples.last_frame == frame - 1:
                track.lost_beside = {}
        # Of two that may be taken for each other, when one is lost now.
        for one, other in likely | meeting:
            for lost, beside in ((tracks[one], tracks[other]), (tracks[other], tracks[one])):
                if lost.measured is None and lost.samples.last_frame == frame - 1:
                    lost.lost_beside[beside] = lost.neighbours[beside]

    def doubt(self, tracks: Iterable[Track], parted: Sequence[Track], frame: int) -> None:
        """Mark tracks whose assignment was a close thing, or that came back near others."""
        for track in parted:
            for other in track.lost_beside if track.key is None else ():
                track.score = max(track.score, MARKS.parted)
                other.score = max(other.score, MARKS.parted)
        for track in tracks:
            self._doubt(track, frame)
        for track in parted:
            track.lost_beside = {}

    def _meeting(self, tracks: Sequence[Track]) -> set[tuple[int, int]]:
        """Return pairs that are both unseen, and might meet where they are."""
        unseen = [index for index, track in enumerate(tracks) if track.measured is None]
        if len(unseen) < 2:
            return set()
        at = np.array([tracks[index].mean[:2] for index in unseen])
        spread = np.sqrt([tracks[index].covariance[0, 0] for index in unseen])
        apart = np.hypot(*(at[:, None] - at).transpose(2, 0, 1))
        near = apart <= self._settings.gate * (spread[:, None] + spread)
        return {(unseen[i], unseen[j]) for i, j in np.argwhere(np.triu(near, 1)).tolist()}

    def _doubt(self, track: Track, frame: int) -> None:
        """Mark a track whose assignment was a close thing, and go on until that has settled.

        After a wrong choice the velocities are wrong too, and the way back looks certain.
        """
        if track.score >= self._settings.ambiguous_above:
            track.doubt, track.settles_in = track.score, MARKS.settles_in
            self.add(track, self._since(track), frame, track.score)
        elif track.settles_in > 0:
            track.settles_in -= track.measured is not None
            track.score = track.doubt
            self.add(track, frame, frame, track.score)

    def _since(self, track: Track) -> int:
        """Return since when a track has been near those that it might be exchanged with."""
        # What was not seen may have been exchanged at any time since it was.
        last = int(track.samples.frames[-2 if track.measured is not None else -1 :][0])
        beside: Iterable[int] = track.lost_beside.values() if track.measured is not None else ()
        return min([*track.neighbours.values(), *beside, last])


class Alternatives:
    """Keeps alternatives of tracks, and settles which is right.

    Parameters
    ----------
    settings : TrackerSettings
        How bodies move, and from which score on something is in doubt.
    marks : Marks
        Where what remains in doubt is marked.
    counts : Counter
        Where measurements that were taken back are counted.
    """

    def __init__(self, settings: TrackerSettings, marks: Marks, counts: Counter[str]) -> None:
        self._settings = settings
        self._marks = marks
        self._counts = counts
        self._beyond_doubt = -math.log(settings.ambiguous_above)
        # What it tells that nothing was seen: a body that was seen just now hardly disappears.
        self._miss_tells = math.log(1.0 - settings.detection_probability) - math.log(
            1.0 - settings.return_probability
        )

    def costs(self, tracks: Sequence[Track], measured: Measured, time: float, frame: int) -> Floats:
        """Return the cost of each pair if the alternative were right, for `assign`, lag included.

        Both are compared with the same: that the track as it is was missed.
        """
        cost = np.full((len(tracks), len(measured.pose)), np.inf)
        rows = [row for row, track in enumerate(tracks) if track.alternative is not None]
        held = [track.alternative for track in tracks if track.alternative is not None]
        if rows and len(measured.pose):
            predicted = predicted_of(held, time, [True] * len(rows))
            pairs = zip(rows, held, strict=True)
            lead = np.array([self._lead(tracks[row], one, frame) for row, one in pairs])
            cost[rows] = edge_costs(predicted, measured, self._settings) + lead[:, None]
        return cost

    def settle(
        self,
        tracks: Sequence[Track],
        detection: Integers,
        own: Floats,
        alternative: Floats,
        frame: int,
    ) -> None:
        """Settle what can be settled, before the tracks take what was assigned to them.

        Parameters
        ----------
        tracks : sequence of Track
            What is followed.
        detection : array, shape (tracks,)
            What each was assigned, -1 for none.
        own, alternative : array, shape (tracks, detections)
            Costs for the track as it is, and for its alternative.
        frame : int
            The frame now.
        """
        for row, track in enumerate(tracks):
            taken = int(detection[row])
            seen, held, cost = taken >= 0, track.alternative, math.inf
            if held is not None:
                lead = lag = self._lead(track, held, frame)
                if seen:
                    lead = float(alternative[row, taken] - own[row, taken])
                    cost = float(own[row, taken] if lead >= 0.0 else alternative[row, taken] - lag)
                self._weigh(track, held, lead, frame, seen=seen)
            elif seen:
                cost = float(own[row, taken])
            doubtful = seen and cost > -self._beyond_doubt
            named = track.body is not None and track.key is None
            if track.alternative is None and doubtful and named:
                track.alternative = track.without(frame, -cost)

    def _lead(self, track: Track, alternative: Alternative, frame: int) -> float:
        """Return the lead of a track if it is missed now."""
        seen_just_now = track.samples.last_frame == frame - 1
        return alternative.lead + (self._miss_tells if seen_just_now else 0.0)

    def _weigh(
        self, track: Track, alternative: Alternative, lead: float, frame: int, *, seen: bool
    ) -> None:
        """Weigh by how much better the track explains a detection, or that nothing was seen."""
        if lead < 0.0:
            self._counts["taken_back"] += len(track.samples) - alternative.samples
            track.go_back(alternative)
            if seen and -lead < self._beyond_doubt:
                self._marks.add(track, track.samples.last_frame, frame, math.exp(lead))
        elif seen and lead >= self._beyond_doubt:
            track.alternative = None
        else:
            alternative.lead = lead
            # It was not settled in the time in which a body is given up.
            if alternative.time - alternative.seen > self._settings.lost_after:
                self._marks.add(track, alternative.since, frame, alternative.score)
                track.alternative = None
