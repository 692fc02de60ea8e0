"""Deferred decisions: uncertain detections, taken tentatively and revoked by later frames.

A body that is hidden may be mistaken for something that turns up nearby. So a detection that is not
far more likely than "the body was missed, and this is something else" is taken with a reservation:
the track keeps, as its rival, what it was before. Both are followed, and each later frame is taken
by the one that fits it better, given all since. The rival is dropped when it has become
improbable; when it becomes the likelier one, the track goes back to it, without the samples.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np

from driftwalk.core.arrays import Floats, Integers
from driftwalk.track.follow.kalman import Measured, edge_costs
from driftwalk.track.follow.marks import Marks
from driftwalk.track.follow.settings import TrackerSettings
from driftwalk.track.follow.tracks import Rival, Track, predicted_of


class Rivals:
    """Keeps rivals of tracks, and settles which is right.

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
        """Return the cost of each pair if the rival were right, its lag included; for `assign`.

        Both are compared with the same: that the track as it is was missed.
        """
        cost = np.full((len(tracks), len(measured.pose)), np.inf)
        having = [(row, track.rival) for row, track in enumerate(tracks) if track.rival is not None]
        if having and len(measured.pose):
            rivals = [rival for _, rival in having]
            predicted = predicted_of(rivals, time, [True] * len(rivals))
            lead = np.array([self._lead(tracks[row], rival, frame) for row, rival in having])
            cost[[row for row, _ in having]] = (
                edge_costs(predicted, measured, self._settings) + lead[:, None]
            )
        return cost

    def settle(
        self, tracks: Sequence[Track], detection: Integers, own: Floats, rival: Floats, frame: int
    ) -> None:
        """Settle what can be settled, before the tracks take what was assigned to them.

        Parameters
        ----------
        tracks : sequence of Track
            What is followed.
        detection : array, shape (tracks,)
            What each was assigned, -1 for none.
        own, rival : array, shape (tracks, detections)
            Costs for the track as it is, and for its rival.
        frame : int
            The frame now.
        """
        for row, track in enumerate(tracks):
            taken = int(detection[row])
            if track.rival is None:
                cost = float(own[row, taken]) if taken >= 0 else math.inf
            elif taken < 0:
                self._miss(track, track.rival, frame)
                continue
            else:
                lead = float(rival[row, taken] - own[row, taken])
                lag = self._lead(track, track.rival, frame)
                cost = float(own[row, taken] if lead >= 0.0 else rival[row, taken] - lag)
                self._seen(track, track.rival, lead, frame)
            doubtful = taken >= 0 and cost > -self._beyond_doubt
            if track.rival is None and doubtful and track.body is not None and track.key is None:
                track.rival = track.without(frame, -cost)

    def _lead(self, track: Track, rival: Rival, frame: int) -> float:
        """Return the lead of a track if it is missed now."""
        seen_just_now = track.samples.last_frame == frame - 1
        return rival.lead + (self._miss_tells if seen_just_now else 0.0)

    def _miss(self, track: Track, rival: Rival, frame: int) -> None:
        """Weigh that nothing was seen."""
        rival.lead = self._lead(track, rival, frame)
        if rival.lead < 0.0:
            self._go_back(track, rival)
        elif rival.time - rival.seen > self._settings.lost_after:
            self._leave_open(track, rival, frame)

    def _seen(self, track: Track, rival: Rival, lead: float, frame: int) -> None:
        """Weigh a detection by how much better the track explains it than its rival."""
        if lead < 0.0:
            self._go_back(track, rival)
            if -lead < self._beyond_doubt:
                self._marks.add(track, track.samples.last_frame, frame, math.exp(lead))
        elif lead >= self._beyond_doubt:
            track.rival = None
        else:
            rival.lead = lead
            if rival.time - rival.seen > self._settings.lost_after:
                self._leave_open(track, rival, frame)

    def _go_back(self, track: Track, rival: Rival) -> None:
        self._counts["taken_back"] += len(track.samples) - rival.samples
        track.go_back(rival)

    def _leave_open(self, track: Track, rival: Rival, frame: int) -> None:
        """Mark what was not settled in the time in which a body is given up."""
        self._marks.add(track, rival.since, frame, rival.score)
        track.rival = None
