"""Assignment of detections to tracks, within connected components of the gating graph.

An edge says that a detection may belong to a track, at a cost: the negative logarithm of its
likelihood over that of "the track was missed and the detection is something else". So an edge that
is worth taking is negative, and to leave both alone costs nothing. Groups that share no edge do not
see each other: one lost body never moves two distant ones.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Bools, Floats, Integers


class ExchangePolicy(NamedTuple):
    """Up to which cost another assignment is an alternative."""

    alternative: float = 12.0
    """Additional cost from which on it is none: a likelihood ratio of exp(-12); chosen by hand."""
    exchange: float = 20.0
    """Additional cost from which on an exchange is not noted: exp(-20); chosen by hand."""


_EXCHANGE: Final = ExchangePolicy()


class Assignment(NamedTuple):
    """Who got what, and how nearly it was another way."""

    detection: Integers
    """Detection of each track, -1 for none; shape (tracks,)."""
    score: Floats
    """Likelihood of the best other assignment that gives this track another detection, or its
    detection to another track, relative to the one taken: 0 none, 1 as likely; shape (tracks,)."""
    exchanges: list[tuple[int, int, float]]
    """Pairs of tracks of which one could have the other's detection, however unlikely, as long as
    that is not out of the question; with its score."""


def assign(cost: Floats) -> Assignment:
    """Assign detections to tracks at the least total cost.

    Parameters
    ----------
    cost : ndarray, shape (tracks, detections)
        Cost of each edge, infinite where there is none. Unassigned detections cost 0.

    Returns
    -------
    Assignment
        The detections, the scores of the alternatives, and who could be exchanged.

    Examples
    --------
    >>> assign(np.array([[-5.0, -1.0], [np.inf, -4.0]])).detection.tolist()
    [0, 1]
    """
    tracks = len(cost)
    detection = np.full(tracks, -1, dtype=np.int64)
    score = np.zeros(tracks)
    exchanges: list[tuple[int, int, float]] = []
    for rows, columns in connected_groups(np.isfinite(cost)):
        if not columns:
            continue
        if len(rows) == len(columns) == 1:
            # By far the most frequent case, and a frame with many bodies has many of it.
            alone = float(cost[rows[0], columns[0]])
            if alone < 0.0:
                detection[rows[0]] = columns[0]
            elif alone < _EXCHANGE.alternative:
                score[rows[0]] = math.exp(-alone)
            continue
        part = cost[np.ix_(rows, columns)]
        taken = _solve(part)
        detection[rows] = np.where(taken >= 0, np.array(columns)[taken], -1)
        excess = _excess(part, taken)
        score[rows] = _scores(excess, taken)
        exchanges += [
            (rows[one], rows[other], likely) for one, other, likely in _pairs(excess, taken)
        ]
    return Assignment(detection, score, exchanges)


def connected_groups(edges: Bools) -> list[tuple[list[int], list[int]]]:
    """Return the tracks and the detections of each connected group that has a track.

    Parameters
    ----------
    edges : ndarray of bool, shape (tracks, detections)
        Where a detection may belong to a track.

    Examples
    --------
    >>> connected_groups(np.array([[True, False], [True, False], [False, True]]))
    [([0, 1], [0]), ([2], [1])]
    """
    tracks = edges.shape[0]
    of_track: list[list[int]] = [[] for _ in range(tracks)]
    of_detection: dict[int, list[int]] = {}
    for track, detection in np.argwhere(edges).tolist():
        of_track[track].append(detection)
        of_detection.setdefault(detection, []).append(track)
    seen: set[int] = set()
    groups = []
    for first in range(tracks):
        if first in seen:
            continue
        seen.add(first)
        rows, columns = [first], set(of_track[first])
        for track in rows:
            columns.update(of_track[track])
            for other in (other for column in of_track[track] for other in of_detection[column]):
                if other not in seen:
                    seen.add(other)
                    rows.append(other)
        groups.append((sorted(rows), sorted(columns)))
    return groups


def _solve(cost: Floats) -> Integers:
    """Return the detection of each track, -1 for none."""
    rows, columns = cost.shape
    from scipy.optimize import linear_sum_assignment

    # One spare column for each track, at cost 0: to be left alone is always possible.
    padded = np.zeros((rows, columns + rows))
    # Costs of pairs without an edge are finite, because the solver wants that.
    padded[:, :columns] = np.where(np.isfinite(cost), cost, 1e9)
    taken = np.asarray(linear_sum_assignment(padded)[1], dtype=np.int64)
    return np.where(taken < columns, taken, -1)


def _excess(cost: Floats, taken: Integers) -> Floats:
    """Return the cost of the best assignment with each edge that was not taken, less the least.

    Another assignment differs by cycles, in which each track takes the detection of the next one.
    The cheapest cycle through an edge is that edge and the shortest way back. One more node
    represents detections without a track: a track that goes there takes a detection that was left,
    or none; from there it costs nothing to leave a track's detection unassigned.
    """
    tracks = np.arange(len(cost))
    has = taken >= 0
    own = np.where(has, cost[tracks, taken], 0.0)
    left = np.setdiff1d(np.arange(cost.shape[1]), taken)
    step = np.full((len(cost) + 1, len(cost) + 1), math.inf)
    step[:-1, :-1][:, has] = cost[:, taken[has]]
    step[:-1, -1] = np.min(cost[:, left], axis=1, initial=math.inf)
    step[:-1, -1][has] = np.minimum(step[:-1, -1][has], 0.0)
    step[:-1] -= own[:, None]
    step[-1] = 0.0
    np.fill_diagonal(step, 0.0)
    for node in range(len(step)):
        np.minimum(step, step[:, node, None] + step[node], out=step)
    owner = np.full(cost.shape[1], len(cost))
    owner[taken[has]] = tracks[has]
    excess = cost - own[:, None] + step[owner, :-1].T
    excess[tracks[has], taken[has]] = math.inf
    return np.asarray(excess)


def _scores(excess: Floats, taken: Integers) -> Floats:
    """Return the score of each track of a group; see `Assignment`."""
    has = taken >= 0
    least = excess.min(axis=1)
    least[has] = np.minimum(least[has], excess[:, taken[has]].min(axis=0))
    return np.where(least < _EXCHANGE.alternative, np.exp(-np.maximum(least, 0.0)), 0.0)


def _pairs(excess: Floats, taken: Integers) -> list[tuple[int, int, float]]:
    """Return each track with the owner of another detection that it could have, and the score."""
    owner = {column: row for row, column in enumerate(taken.tolist()) if column >= 0}
    return [
        (row, owner[column], math.exp(-max(float(excess[row, column]), 0.0)))
        for row, column in np.argwhere(excess < _EXCHANGE.exchange).tolist()
        if column in owner
    ]
