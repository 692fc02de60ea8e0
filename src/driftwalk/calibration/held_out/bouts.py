"""How long a body's slow and fast bouts last, against those of a model's own recordings."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.calibration.held_out.recorded import RecordedMotion
from driftwalk.comparison.aspects import AspectPlan, resampled
from driftwalk.core.arrays import Floats
from driftwalk.motion import Worlds


class BoutPolicy(NamedTuple):
    """When the lengths of a body's bouts are unlike a model's."""

    level: float = 0.5
    """Step that separates slow bouts from fast ones, in 90 % quantiles of the recorded ones: it
    lies between rest and motion where the body moves more than a tenth of the time. Chosen by
    hand."""
    most_ratio: float = 1.5
    """Distance of the recorded lengths from the model's, in largest ones of 20 simulated
    recordings, and longest bout in longest ones of these. By the distribution of Kolmogorov's
    statistic, and of the largest of exponential lengths, the right law exceeds either once in a
    thousand."""
    fewest: int = 20
    """Bouts without which nothing is said; chosen by hand."""


BOUTS: Final = BoutPolicy()


class BoutDistance(NamedTuple):
    """How far the lengths of one kind of bouts are from a model's."""

    kind: str
    """"slow" or "fast"."""
    distance: float
    """Kolmogorov-Smirnov distance of the recorded lengths from those of all simulated ones."""
    limit: float
    """Up to which it is like that of a simulated recording from the others."""
    longest: float
    """The longest recorded one [s]."""
    longest_limit: float
    """Up to which it is like that of simulated recordings [s]."""


def bout_distances(motion: RecordedMotion, worlds: Worlds) -> tuple[BoutDistance, ...]:
    """Compare the lengths of slow and fast bouts with those of simulated recordings.

    A law of the family has bouts of a Weibull distribution. Rests with a power law may have the
    same distribution but for the longest.
    """
    steps = motion.steps.points[:, 0]
    level = BOUTS.level * float(np.quantile(steps, 0.9))
    recorded = _lengths(motion.own_plan, motion.track.x, motion.track.y, level)
    simulated = [
        _lengths(motion.plan, x, y, level) for x, y in zip(worlds.x, worlds.y, strict=True)
    ]
    found = []
    for at, kind in enumerate(("slow", "fast")):
        others = [one[at] for one in simulated]
        if min(recorded[at].size, *(one.size for one in others)) < BOUTS.fewest:
            continue
        own = [
            _distance(one, np.concatenate(others[:k] + others[k + 1 :]))
            for k, one in enumerate(others)
        ]
        apart = _distance(recorded[at], np.concatenate(others))
        interval = motion.plan.short.step_interval
        longest, others_longest = (
            interval * float(one.max()) for one in (recorded[at], np.concatenate(others))
        )
        found.append(
            BoutDistance(
                *(kind, apart, BOUTS.most_ratio * max(own)),
                *(longest, BOUTS.most_ratio * others_longest),
            )
        )
    return tuple(found)


def bout_sentences(found: tuple[BoutDistance, ...]) -> Iterator[str]:
    """Yield which bouts last unlike a model's.

    Examples
    --------
    >>> list(bout_sentences((BoutDistance("slow", 0.31, 0.14, 9.1, 12.0),)))
    ['slow bouts last otherwise: D = 0.310, of its own recordings below 0.140']
    """
    for one in found:
        if one.distance > one.limit:
            yield (
                f"{one.kind} bouts last otherwise: D = {one.distance:.3f}, "
                f"of its own recordings below {one.limit:.3f}"
            )
        if one.longest > one.longest_limit:
            yield (
                f"the longest {one.kind} bout lasts {one.longest:.3g} s, of its own recordings "
                f"below {one.longest_limit:.3g} s"
            )


def _lengths(
    plan: AspectPlan, x: npt.ArrayLike, y: npt.ArrayLike, level: float
) -> tuple[Floats, Floats]:
    """Return how many steps each slow and each fast bout has; those at a gap are left out."""
    length = np.hypot(np.diff(resampled(plan.short, x)), np.diff(resampled(plan.short, y)))
    there = np.zeros(length.size, dtype=bool)
    there[plan.step] = True
    kind = np.where(there & np.isfinite(length), length > level, 2).astype(np.int64)
    begins = np.concatenate([[0], np.flatnonzero(np.diff(kind)) + 1])
    lasts = np.diff(np.concatenate([begins, [kind.size]])).astype(np.float64)
    kinds = kind[begins]
    whole = np.ones(begins.size, dtype=bool)
    whole[[0, -1]] = False
    whole[1:-1] = (kinds[:-2] != 2) & (kinds[2:] != 2)
    return lasts[whole & (kinds == 0)], lasts[whole & (kinds == 1)]


def _distance(first: Floats, second: Floats) -> float:
    from scipy.stats import ks_2samp

    # The p-value, which is not read, takes long where it is exact.
    return float(ks_2samp(first, second, method="asymp").statistic)
