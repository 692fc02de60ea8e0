"""Walls that are tried: where, and each of them once."""

from __future__ import annotations

import numpy as np

from driftwalk.likelihood.contacts.estimate import search_walls


def test_each_wall_is_tried_once_and_the_progress_ends() -> None:
    """At its best in a corner, whose place is in all three lattices."""
    tried: list[tuple[float, float]] = []
    told: list[tuple[int, int]] = []

    def log_likelihood(restitution: float, friction: float) -> float:
        tried.append((restitution, friction))
        return -restitution - friction

    walls = search_walls(log_likelihood, lambda done, count, task: told.append((done, count)))
    places = {(round(restitution, 6), round(friction, 6)) for restitution, friction in tried}
    assert len(places) == len(tried) == len(walls) < told[-1][1]
    assert [done for done, _ in told] == list(range(told[-1][1] + 1))
    assert len({count for _, count in told}) == 1


def test_the_finer_lattices_close_in_on_the_best_wall() -> None:
    best, hold = 0.62, 0.31

    def log_likelihood(restitution: float, friction: float) -> float:
        apart = (restitution - best) / 0.1, (friction / (1.0 + friction) - hold) / 0.04
        return -0.5 * (apart[0] ** 2 + apart[1] ** 2)

    walls = search_walls(log_likelihood, lambda done, count, task: None)
    found = max(walls, key=lambda wall: wall.log_likelihood)
    assert np.hypot((found.restitution - best) / 0.1, (found.hold - hold) / 0.04) < 0.8
