"""Findings of a recording on a law, the same for each command: against it, and those left open.

One law has one verdict: `calibrate` and `compare-models` both ask here. A comparison adds what
other models say, a calibration what the values of the parameters say. Among the findings is how
long a body's slow and fast bouts last, against those of a model's own recordings.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.calibration.held_out.candidates import Candidate, takes_recorded_clearance
from driftwalk.calibration.held_out.held_out_score import (
    HELD_OUT_VERDICT,
    HeldOutScore,
    held_out_differences,
)
from driftwalk.calibration.held_out.recorded import CHECKS, RecordedMotion, short_steps
from driftwalk.calibration.stationarity import unsteady_motion
from driftwalk.comparison.aspects import AspectPlan
from driftwalk.core.arrays import Floats
from driftwalk.core.units import in_percent
from driftwalk.motion import Worlds
from driftwalk.simulation.series import is_series


class BoutPolicy(NamedTuple):
    """When the lengths of a body's bouts are unlike a model's."""

    level: float = 0.5
    """Step that separates slow bouts from fast ones, in 90 % quantiles of the recorded ones: it
    lies between rest and motion where the body moves more than a tenth of the time. Chosen by
    hand."""
    distance_level: float = 0.001
    """Chance of so large a distance of the recorded lengths from the model's, by the distribution
    of Kolmogorov's statistic."""
    longest_share: float = 0.05
    """Part of the bouts, the longest ones, whose share of the time is the tail. Measured: of 2, 5
    and 10 % it has the most power on rests of a power law of 1.1 to 1.5, with the mean that they
    share."""
    tail_level: float = 0.002
    """Chance of such a tail in a recording of the law itself. Measured on Weibull laws of shapes
    0.5 to 1.4: 3 of 900. Power on those power laws against the nearest Weibull law: 61 % with 60
    rests, 96 % with 120, all with 350."""
    quiet: float = 6.0
    """Ratio of the level to the noise of a position above which the camera cuts up no rest: chance:
    its noise takes a step of a body at rest beyond it once in 8,000."""
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
    """Up to which it is by chance, or like that of a simulated recording from the others."""
    tail: float
    """Share of the time of these bouts that the longest twentieth of them takes."""
    tail_limit: float
    """Up to which it is like that of simulated recordings."""


def bout_distances(motion: RecordedMotion, worlds: Worlds) -> tuple[BoutDistance, ...]:
    """Compare the lengths of slow and fast bouts with simulated recordings.

    A law of the family has bouts of a Weibull distribution. Rests with a power law may have the
    same distribution but for the longest: so the share of the time that the longest ones take is
    compared too, by its logarithm, which is nearly normal among simulated recordings.
    """
    from scipy.special import kolmogi

    level = BOUTS.level * float(np.quantile(motion.steps.points[:, 0], 0.9))
    # Over so many steps, so that the noise is below the level.
    span = max(1, math.ceil(BOUTS.quiet * motion.like.camera.position_noise / level))
    recorded = _lengths(motion.own_plan, motion.track.x, motion.track.y, level, span)
    simulated = [
        _lengths(motion.plan, x, y, level, span) for x, y in zip(worlds.x, worlds.y, strict=True)
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
        pooled = np.concatenate(others)
        count = recorded[at].size * pooled.size / (recorded[at].size + pooled.size)
        found.append(
            BoutDistance(
                kind,
                _distance(recorded[at], pooled),
                max(*own, float(kolmogi(BOUTS.distance_level)) / math.sqrt(count)),
                _tail(recorded[at]),
                _tail_limit(others),
            )
        )
    return tuple(found)


def bout_sentences(found: tuple[BoutDistance, ...]) -> Iterator[str]:
    """Yield which bouts last unlike a model's.

    Examples
    --------
    >>> list(bout_sentences((BoutDistance("slow", 0.31, 0.14, 0.2, 0.3),)))
    ["slow bouts differ in length: D = 0.310, in the model's own recordings below 0.140"]
    """
    for one in found:
        if one.distance > one.limit:
            yield (
                f"{one.kind} bouts differ in length: D = {one.distance:.3f}, in the model's own "
                f"recordings below {one.limit:.3f}"
            )
        if one.tail > one.tail_limit:
            yield (
                f"the lengths of {one.kind} bouts have a heavier tail: the longest twentieth takes "
                f"{in_percent(one.tail)} of their time, in the model's own recordings below "
                f"{in_percent(one.tail_limit)}"
            )


def _lengths(
    plan: AspectPlan, x: npt.ArrayLike, y: npt.ArrayLike, level: float, span: int
) -> tuple[Floats, Floats]:
    """Return how many steps each slow and each fast bout has; those at a gap are left out.

    Slow is what gets less far than so many levels in so many steps.
    """
    px, py, there = short_steps(plan, x, y)
    broken = np.concatenate([[0], np.cumsum(~there)])
    length = np.hypot(px[span:] - px[:-span], py[span:] - py[:-span])
    whole = broken[span:] == broken[:-span]
    kind = np.where(whole, length > span * level, 2).astype(np.int64)
    begins = np.concatenate([[0], np.flatnonzero(np.diff(kind)) + 1])
    lasts = np.diff(np.concatenate([begins, [kind.size]])).astype(np.float64)
    kinds = kind[begins]
    ended = np.zeros(begins.size, dtype=bool)
    ended[1:-1] = (kinds[:-2] != 2) & (kinds[2:] != 2)
    return lasts[ended & (kinds == 0)], lasts[ended & (kinds == 1)]


def _distance(first: Floats, second: Floats) -> float:
    from scipy.stats import ks_2samp

    # The p-value, which is not read, takes long where it is exact.
    return float(ks_2samp(first, second, method="asymp").statistic)


def _tail(lengths: Floats) -> float:
    longest = np.sort(lengths)[-max(1, round(BOUTS.longest_share * lengths.size)) :]
    return float(longest.sum() / lengths.sum())


def _tail_limit(simulated: Sequence[Floats]) -> float:
    """Return the tail that one more recording of the same law exceeds at the level (Student)."""
    from scipy.stats import t

    logs = np.log([_tail(one) for one in simulated])
    sigmas = float(t.isf(BOUTS.tail_level, logs.size - 1)) * np.sqrt(1.0 + 1.0 / logs.size)
    # Bouts that are alike in all of them differ by rounding.
    return (1.0 + 1e-9) * float(np.exp(logs.mean() + sigmas * logs.std(ddof=1)))


class DiscrepancyPolicy(NamedTuple):
    """Which discrepancy of the summaries of a motion speaks against a law."""

    usual_quantile: float = 0.95
    """Quantile of the discrepancies of the law's own recordings up to which one is usual: by chance
    one in twenty is called unlike it."""
    against: float = 1.5
    """Discrepancy, in that quantile, from which it speaks against the law: at most 1.23 in 160
    recordings of the law itself (studies/motion_models), 3.5 and more on wrong ones."""


DISCREPANCY: Final = DiscrepancyPolicy()


class Discrepancy(NamedTuple):
    """How far the summaries of a recording are from a law's own recordings."""

    value: float
    """Sum of squares of the summaries' deviations, in standard deviations."""
    median: float
    """Its median over the law's own recordings,"""
    upper: float
    """and their 95 % quantile."""

    @classmethod
    def of(cls, value: float, own: Floats) -> Discrepancy:
        """Return the discrepancy of a recording, with its quantiles in the law's own recordings."""
        upper = float(np.quantile(own, DISCREPANCY.usual_quantile))
        return cls(value, float(np.median(own)), upper)

    @property
    def usual(self) -> bool:
        """Whether the summaries are like the law's own recordings."""
        return self.value <= self.upper

    @property
    def against(self) -> bool:
        """Whether they speak against the law, and are not just less usual."""
        return self.value > DISCREPANCY.against * self.upper

    def sentence(self) -> str:
        """Return it in words.

        Examples
        --------
        >>> Discrepancy(812.3, 90.1, 140.2).sentence()
        "summaries of the motion: discrepancy 812, in the model's own recordings below 140"
        """
        return (
            f"summaries of the motion: discrepancy {self.value:.0f}, in the model's own recordings "
            f"below {self.upper:.0f}"
        )


def law_findings(
    entry: Candidate,
    held_out: HeldOutScore,
    motion: RecordedMotion,
    *,
    discrepancy: Discrepancy | None,
    bouts: Sequence[BoutDistance] = (),
) -> tuple[list[str], list[str]]:
    """Return what a recording says of a law.

    Against it are the aspects and facts of the odd blocks that it misses, a discrepancy of the
    summaries far beyond its own limit, and bouts of other lengths. Open is a discrepancy just
    beyond it, or in a flow that has errors; whether a place near the wall fits that a doubtful
    clearance decides; and a motion that is not steady, in a flow that is.

    Parameters
    ----------
    entry : Candidate
        The law.
    held_out : HeldOutScore
        How it does on the odd blocks.
    motion : RecordedMotion
        The recording.
    discrepancy : Discrepancy or None
        Of the summaries; None where they were not matched.
    bouts : sequence of BoutDistance
        How long bouts last.
    """
    recorded = takes_recorded_clearance(entry.model, motion)
    allowed = motion.clearance_distance if recorded else 0.0
    against = held_out_differences(held_out, motion, allowed=allowed)
    unable: list[str] = []
    if discrepancy is not None and not discrepancy.usual:
        if entry.model.needs_flow:
            # Its own recordings have the flow without error.
            unable.append(
                f"{discrepancy.sentence()}; errors of the flow may do that: fit flow and body "
                "together (`driftwalk fit`)"
            )
        else:
            (against if discrepancy.against else unable).append(discrepancy.sentence())
    if discrepancy is None or not discrepancy.against:
        against += bout_sentences(tuple(bouts))
    if allowed > _wall_limit(motion):
        unable.append(
            "the body was hardly at the wall, so that its distance from it at contact is "
            f"uncertain ({1e3 * motion.clearance.distance:.1f} ± "
            f"{1e3 * motion.clearance.std:.1f} mm): state the clearance"
        )
    # In a flow that changes the model is not steady either.
    unable += [] if is_series(motion.like.flow) else unsteady_motion(motion)
    share = motion.recorded_checks[CHECKS.index("wall_share")]
    if share > HELD_OUT_VERDICT.most_wall_share:
        unable.insert(
            0,
            f"the body was at the wall for {in_percent(share, decimals=1)} of the time: how it "
            "moves away from it was hardly recorded; record it in a larger tank",
        )
        return [], [*unable, *against]
    return against, unable


def _wall_limit(motion: RecordedMotion) -> float:
    """Return the KS distance up to which the place near the wall is like the recording's."""
    own = dict(zip(motion.held.names, motion.own, strict=True))
    return HELD_OUT_VERDICT.most_over_own * float(own.get("wall", np.inf))
