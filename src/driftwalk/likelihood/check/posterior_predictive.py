"""Posterior predictive check of the motion: steps of the recording and of replicates.

Steps are formed by the same function for all. Replicates at the estimate give the distance and its
noise floor. Replicates with flow and parameters drawn from what the fit leaves open give the
judgement: if the model is right, the recording is to them as they are to each other, for each
differs from the fitted values as the truth does.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from driftwalk.comparison import step_length_edges
from driftwalk.comparison.statistic import StepDistance, StepTable, distances_among
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.core.processors import default_threads
from driftwalk.likelihood.check.power import POWER
from driftwalk.likelihood.check.replicates import Replicates
from driftwalk.schema.answers.facts import GOODNESS

BAND: Final = 0.9
"""Share of the replicates within the bands of the densities; by convention."""
BINS: Final = 40
"""Bins of a density. Chosen by hand."""
FEWEST_REPLICATES: Final = 4
"""Sound replicates of either set: two on either side of the noise floor; chosen by hand."""


class Density(NamedTuple):
    """Density of steps by bin: the recording's, and what the model makes likely."""

    edge: Floats
    """Edges of the bins, [m] or [rad], (bins + 1,)."""
    recording: Floats
    """[1/m] or [1/rad], (bins,)."""
    median: Floats
    low: Floats
    high: Floats


class MotionComparison(NamedTuple):
    """The recording against simulated ones."""

    distance: Floats
    """KS distance of the recording to each replicate at the estimate."""
    floor: Floats
    """KS distances between replicates at the estimate."""
    drawn_distance: Floats
    """KS distance of the recording to each replicate with drawn parameters."""
    drawn_between: Floats
    """Mean distance of each of those to the others."""
    step_length: Density
    turning_angle: Density

    @property
    def far(self) -> bool:
        """Whether the recording is far from replicates at the estimate."""
        floor = float(np.median(self.floor))
        return float(np.median(self.distance)) > GOODNESS.far_above_floor * floor

    @property
    def rank_p_value(self) -> float:
        """Share of drawn replicates that are as far from the others as the recording is from all.

        The recording counts as one of them, so that 1 / (1 + replicates) is the least.
        """
        further = np.count_nonzero(self.drawn_between >= self.drawn_distance.mean())
        return float((1 + further) / (1 + self.drawn_between.size))

    @property
    def p_value(self) -> float:
        """The same from a normal distribution of the logarithms, which goes beyond the ranks."""
        from scipy.stats import t

        mean, spread = self._logs
        off = (np.log(self.drawn_distance.mean()) - mean) / spread
        return float(t.sf(off, self.drawn_between.size - 1))

    def detectable(self, level: float) -> float:
        """Return the mean distance that fails at a level nine times in ten; above 1 none does."""
        from scipy.stats import norm, t

        mean, spread = self._logs
        sigmas = t.isf(level, self.drawn_between.size - 1) + norm.ppf(POWER.share)
        return float(np.exp(mean + spread * sigmas))

    @property
    def _logs(self) -> tuple[float, float]:
        """Mean and spread of the logarithm of a distance to the drawn replicates."""
        logs = np.log(self.drawn_between)
        spread = max(float(logs.std(ddof=1)), 1e-12) * np.sqrt(1.0 + 1.0 / logs.size)
        return float(logs.mean()), float(spread)


def distances_at_estimate(real: Floats, found: Replicates) -> tuple[Floats, Floats]:
    """Return the KS distances of replicates at the estimate: to the recording, to each other."""
    _require_replicates(found)
    half = len(found.steps) // 2
    floor = _distances(found.steps[:half], found.steps[half:])
    return _distances([real], found.steps)[0], floor.ravel()


def compare_motion(
    real: Floats, at_estimate: tuple[Floats, Floats], drawn: Replicates
) -> MotionComparison:
    """Compare a recording's steps with simulated ones."""
    from scipy.spatial.distance import squareform

    _require_replicates(drawn)
    pairs = distances_among(StepDistance(), _padded(drawn.steps), threads=default_threads())
    among = squareform(pairs)
    lengths = step_length_edges(*(steps[:, 0] for steps in (real, *drawn.steps)), bins=BINS)
    widest = max(float(np.abs(steps[:, 1]).max()) for steps in (real, *drawn.steps))
    return MotionComparison(
        *at_estimate,
        _distances([real], drawn.steps)[0],
        among.sum(axis=1) / (len(among) - 1),
        _density(real, drawn, 0, lengths),
        _density(real, drawn, 1, np.linspace(-widest, widest, BINS + 1)),
    )


def _require_replicates(found: Replicates) -> None:
    sound = len(found.steps)
    if sound < FEWEST_REPLICATES:
        raise InputError(
            f"{found.broken} of {found.broken + sound} simulated recordings broke down: the fitted "
            "model cannot be simulated"
        )


def _distances(first: Sequence[Floats], second: Sequence[Floats]) -> Floats:
    """Return the KS distances of every recording to every other, (first, second)."""
    return StepDistance().matrix(_padded(first), _padded(second), threads=default_threads())


def _padded(steps: Sequence[Floats]) -> StepTable:
    pairs = np.array([len(one) for one in steps], dtype=np.int64)
    length, angle = np.zeros((2, pairs.size, int(pairs.max())))
    for k, one in enumerate(steps):
        length[k, : len(one)], angle[k, : len(one)] = one.T
    return StepTable(length, angle, pairs)


def _density(real: Floats, drawn: Replicates, column: int, edge: Floats) -> Density:
    rows = np.array([_histogram(one[:, column], edge) for one in drawn.steps])
    tail = 0.5 * (1.0 - BAND)
    low, median, high = np.quantile(rows, [tail, 0.5, 1.0 - tail], axis=0)
    return Density(edge, _histogram(real[:, column], edge), median, low, high)


def _histogram(values: Floats, edge: Floats) -> Floats:
    """Return the density in each bin, as a share of all values and not of those shown."""
    count, _ = np.histogram(values, bins=edge)
    return np.asarray(count / values.size / np.diff(edge))
