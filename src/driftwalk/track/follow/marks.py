"""Ambiguous identities: marked intervals of possible exchanges, each with a score."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.track.follow.settings import TrackerSettings
from driftwalk.track.follow.tracks import Track


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
            _Mark(track, track.rival.since, track.samples.last_frame, track.rival.score)
            for track in tracks
            if track.rival is not None
        ]
        for mark in (*self._marks, *still):
            if mark.track.body is not None:
                part = score[mark.first : mark.last + 1, mark.track.body]
                np.maximum(part, mark.score, out=part)
        return score

    def note_company(
        self, tracks: Sequence[Track], frame: int, exchanges: Sequence[tuple[int, int, float]]
    ) -> None:
        """Note which tracks are so near each other that they could be exchanged; since when."""
        before = {track: track.company for track in tracks}
        for track in tracks:
            track.company = {}
        meeting = self._meeting(tracks)
        likely = {(i, j) for i, j, score in exchanges if score >= self._settings.ambiguous_above}
        for one, other in sorted({(i, j) for i, j, _ in exchanges} | meeting):
            first, second = tracks[one], tracks[other]
            since = before[first].get(second, frame)
            first.company[second] = second.company[first] = since
        for track in tracks:
            if track.measured is None and track.samples.last_frame == frame - 1:
                track.lost_beside = {}
        for one, other in likely | meeting:
            self._note_loss(tracks[one], tracks[other], frame)

    def _note_loss(self, one: Track, other: Track, frame: int) -> None:
        """Note of two that may be taken for each other that they were, when one is lost now."""
        for lost, beside in ((one, other), (other, one)):
            if lost.measured is None and lost.samples.last_frame == frame - 1:
                lost.lost_beside[beside] = lost.company[beside]

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
        return min([*track.company.values(), *beside, last])
