"""False links of particle tracks: normalised median test, and continuity of the track."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.flow.track_steps import Steps

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


class LinkPolicy(NamedTuple):
    """Which steps are false links."""

    threshold: float = 4.0
    """Normalised deviation of a false link. With 16 neighbours, 0.2 % of steps that scatter as
    a Gaussian around the same velocity reach it."""
    neighbours: int = 16
    """Steps of other tracks with which a step is compared; chosen by hand."""
    fewest: int = 8
    """Neighbours without which a step is not judged: as a vector on a grid of PIV has."""
    searched: tuple[int, ...] = (32, 128)
    """Nearest steps among which those of other tracks are looked for: few, then more; chosen by
    hand."""


LINKS: Final = LinkPolicy()
_CHUNK: Final = 1 << 14
"""Steps whose neighbours are looked up at once: some 40 MB."""


class Judged(NamedTuple):
    """The verdict of the test on every step."""

    deviation: Array
    """Normalised deviation, shape (n,); NaN where a step is not judged."""

    def is_false(self, threshold: float) -> Mask:
        """Return which steps are false links."""
        return np.asarray(self.deviation > threshold)

    @property
    def unjudged(self) -> int:
        """Steps with too few neighbours."""
        return int(np.count_nonzero(np.isnan(self.deviation)))


def judge_steps(steps: Steps, *, noise: float) -> Judged:
    """Compare every step with its neighbours, and with the steps before and after it.

    The normalised median test (Westerweel and Scarano, Exp. Fluids 39 (2005) 1096), on the
    nearest steps of other tracks, at any time: with the median m of their velocities, by component,
    and the median r of their distances |v_i - m| from it, a step deviates by
    ``|v - m| / (r + e)``, where ``e = sqrt(2) noise / interval`` is the noise of a velocity.

    Where the velocity changes within the distance of the neighbours, a step may differ from them
    and be right: then it is like the step before or after it in its own track, which a false link
    is not. So the smallest of the distances from m and from these two counts.

    Parameters
    ----------
    steps : Steps
        Steps in order of body and time.
    noise : float
        Position noise per axis [m].

    Examples
    --------
    >>> from driftwalk.flow.track_steps import track_steps
    >>> from driftwalk.schema import build_trajectory
    >>> x = np.arange(5.0)[:, None] + np.linspace(0.0, 1.0, 20)
    >>> x[3:, 7] += 9.0
    >>> steps = track_steps(build_trajectory(np.arange(5.0), x, 0.0 * x)).steps
    >>> np.flatnonzero(judge_steps(steps, noise=0.01).is_false(LINKS.threshold)).tolist()
    [30]
    """
    middle, spread = _neighbourhood(steps)
    apart = np.minimum(_length(steps.velocity - middle), _from_own(steps))
    own_noise = np.sqrt(2.0) * noise / steps.interval
    with np.errstate(divide="ignore", invalid="ignore"):
        deviation = apart / (spread + own_noise)
    # Neighbours that all agree, and a step that agrees with them.
    deviation[(apart == 0.0) & np.isfinite(spread)] = 0.0
    return Judged(deviation)


def _from_own(steps: Steps) -> Array:
    """Return how far a velocity is from the nearer one of its neighbours in time, inf without."""
    apart = np.full(steps.time.size, np.inf)
    at = np.flatnonzero(steps.goes_on)
    change = _length(steps.velocity[at + 1] - steps.velocity[at])
    apart[at] = change
    apart[at + 1] = np.minimum(apart[at + 1], change)
    return apart


def _neighbourhood(steps: Steps) -> tuple[Array, Array]:
    """Return the median velocity of the neighbours and the median distance from it."""
    from scipy.spatial import cKDTree

    count = steps.time.size
    middle, spread = np.full((count, 2), np.nan), np.full(count, np.nan)
    tree = cKDTree(steps.position)
    left = np.arange(count)
    for searched in LINKS.searched:
        lacking = []
        for start in range(0, left.size, _CHUNK):
            at = left[start : start + _CHUNK]
            _, near = tree.query(steps.position[at], min(searched, count))
            near = near.reshape(at.size, -1)
            other = steps.body[near] != steps.body[at][:, None]
            enough = np.count_nonzero(other, axis=1) >= LINKS.neighbours
            last = searched == LINKS.searched[-1]
            judged = enough | (last & (np.count_nonzero(other, axis=1) >= LINKS.fewest))
            lacking.append(at[~enough])
            chosen = near[judged], other[judged]
            middle[at[judged]], spread[at[judged]] = _medians(steps.velocity, *chosen)
        left = np.concatenate(lacking) if lacking else left[:0]
    return middle, spread


def _medians(velocity: Array, near: npt.NDArray[np.intp], other: Mask) -> tuple[Array, Array]:
    """Return both medians over the nearest steps of other tracks."""
    first = np.argsort(~other, axis=1, kind="stable")[:, : LINKS.neighbours]
    there = np.take_along_axis(other, first, axis=1)
    around = velocity[np.take_along_axis(near, first, axis=1)]
    around[~there] = np.nan
    if there.all():
        middle = np.median(around, axis=1)
        return middle, np.median(_length(around - middle[:, None]), axis=1)
    middle = np.nanmedian(around, axis=1)
    return middle, np.nanmedian(_length(around - middle[:, None]), axis=1)


def _length(vectors: Array) -> Array:
    return np.hypot(vectors[..., 0], vectors[..., 1])
