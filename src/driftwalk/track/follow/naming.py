"""Re-identification: whether a new track is a lost body or a new one."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.track.follow.assign import assign
from driftwalk.track.follow.kalman import reach
from driftwalk.track.follow.marks import MARKS, Marks
from driftwalk.track.follow.settings import TrackerSettings
from driftwalk.track.follow.tracks import Track


class Naming:
    """Names bodies.

    Parameters
    ----------
    settings : TrackerSettings
        How many bodies there are, and how fast.
    marks : Marks
        Where to mark what is uncertain.
    """

    def __init__(self, settings: TrackerSettings, marks: Marks) -> None:
        self._settings = settings
        self._marks = marks
        self.names: list[str] = []
        self._last: dict[int, Track] = {}

    def name_new(self, tracks: Sequence[Track], times: Sequence[float]) -> set[Track]:
        """Say which body each track is that has been seen often enough.

        Parameters
        ----------
        tracks : sequence of Track
            The tracks followed.
        times : sequence of float
            Of all frames so far [s].

        Returns
        -------
        set of Track
            Those that are over, because their body has a new one.
        """
        over: set[Track] = set()
        for track in tracks:
            if track.body is None and track.key is not None:
                known = track.key in self.names
                body = self.names.index(track.key) if known else self._one_more(track.key)
                over |= self._take(track, body)
        new = [
            track
            for track in tracks
            if track.body is None and len(track.samples) >= self._settings.confirm_after
        ]
        if not new:
            return over
        came_back = self._come_back(new, times)
        for track in new:
            if track in came_back:
                over |= self._take(track, came_back[track])
            elif self._settings.bodies is None or len(self.names) < self._settings.bodies:
                over |= self._take(track, self._one_more(str(len(self.names))))
        return over

    def _come_back(self, new: Sequence[Track], times: Sequence[float]) -> dict[Track, int]:
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
        cost = np.array([[self._return_cost(gone, track, times) for track in new] for gone in lost])
        chosen = assign(cost)
        full = self._settings.bodies is not None and len(self.names) >= self._settings.bodies
        found: dict[Track, int] = {}
        for gone, column, score in zip(lost, chosen.detection, chosen.score.tolist(), strict=True):
            uncertain = score >= self._settings.ambiguous_above
            if uncertain and not full:
                continue
            came_back = [new[column]] if column >= 0 else []
            since = [gone.samples.last_frame]
            together = [track for track in came_back if _seen_together(gone, track)]
            since += [track.samples.first_frame for track in together]
            for track in came_back:
                # What it was before that, it was as something else.
                track.samples.leave_out_first(self._first_within_reach(gone, track, times) or 0)
            found.update((track, gone.body) for track in came_back if gone.body is not None)
            beside = gone.lost_beside if came_back else {}
            if uncertain or beside or together:
                first = min([*beside.values(), *since])
                likely = max(score, MARKS.parted if beside or together else 0.0)
                for marked in (gone, *came_back, *beside):
                    self._marks.add(marked, first, len(times) - 1, likely)
        return found

    def _return_cost(self, gone: Track, track: Track, times: Sequence[float]) -> float:
        """Return the cost of taking a new track for one that was lost, for `assign`."""
        first = self._first_within_reach(gone, track, times)
        if first is None:
            return math.inf
        apart, limit = self._apart(gone, track, times, slice(first, first + 1))
        # A body that could come back is taken for a lost one rather than for a new one.
        cost = 0.5 * (3.0 * float(apart[0] / limit[0])) ** 2 - 50.0
        # Two that were seen at once are one only if one of them was something else for a
        # while.
        return cost + (20.0 if _seen_together(gone, track) else 0.0)

    def _first_within_reach(self, gone: Track, track: Track, times: Sequence[float]) -> int | None:
        """Return the first sample of a new track that a lost body could have reached."""
        after = int(np.searchsorted(track.samples.frames, gone.samples.last_frame, side="right"))
        apart, limit = self._apart(gone, track, times, slice(after, None))
        within = np.flatnonzero(apart <= limit)
        return after + int(within[0]) if within.size else None

    def _apart(
        self, gone: Track, track: Track, times: Sequence[float], part: slice
    ) -> tuple[Floats, Floats]:
        """Return how far samples are from where a body was lost, and how far it could be [m]."""
        values = track.samples.values[part]
        apart = np.hypot(*(values[:, :2] - gone.seen_at).T)
        noise = np.sqrt(values[:, 3] + values[:, 5])
        elapsed = np.array([times[frame] for frame in track.samples.frames[part]]) - gone.seen
        return apart, reach(elapsed, noise, self._settings)

    def _one_more(self, name: str) -> int:
        self.names.append(name)
        return len(self.names) - 1

    def _take(self, track: Track, body: int) -> set[Track]:
        """Make a track that of a body; return the one that it had, which is over."""
        old = self._last.get(body)
        track.body, self._last[body] = body, track
        return set() if old is None else {old}


def _seen_together(gone: Track, track: Track) -> bool:
    """Return whether a new track began before a lost one was seen last."""
    return track.samples.first_frame <= gone.samples.last_frame
