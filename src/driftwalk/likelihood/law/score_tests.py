"""Rao's score tests of closed numbers at a mode, and the spectrum of the flow's strength.

At the mode the derivatives of the likelihood by all fitted parameters are zero. Those by a closed
number are not, if the number is not what the model says. With the information of all parameters the
derivative gives, without another search, an estimate of the number and its standard deviation
(Rao's score test).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.likelihood.filter.filter_pass import Passes
from driftwalk.likelihood.filter.series import Series
from driftwalk.likelihood.newton import WORK, Mode, ModeSearch, work_of_pass
from driftwalk.likelihood.refuse import BREAKDOWN, cholesky


class PulsePolicy(NamedTuple):
    """When a line in the spectrum of errors times derivatives is a pulse of the flow."""

    oversampled: int = 4
    """Frequencies of the spectrum for each period that the recording holds. In closed form, a line
    between two of them loses 5 % of its height at most."""
    finer: int = 10
    """Places on either side of the highest of those frequencies, at which it is looked for; chosen
    by hand."""
    least_periods: float = 6.0
    """Periods that a recording holds at least. A slower change is one of the six cosines, or the
    line, of the flow's strength; chosen by hand."""
    false_alarms: float = 1e-6
    """Chance that a steady flow seems to pulse at any frequency. Chosen by hand."""


PULSE: Final = PulsePolicy()


class ScoreTests(NamedTuple):
    """Estimates of some closed numbers, near the values that they have."""

    names: tuple[str, ...]
    estimate: Floats
    """Each alone, the others closed."""
    std: Floats
    information: Floats
    score: Floats

    @property
    def sigmas(self) -> Mapping[str, float]:
        """Return the estimates in standard deviations."""
        found = zip(self.names, self.estimate / self.std, strict=True)
        return {name: float(value) for name, value in found}

    def of(self, name: str) -> tuple[float, float]:
        """Return estimate and standard deviation of a number."""
        at = self.names.index(name)
        return float(self.estimate[at]), float(self.std[at])

    def together(self, names: Sequence[str]) -> Mapping[str, float]:
        """Return the joint estimate of some of the numbers, the others closed."""
        at = [self.names.index(name) for name in names]
        found = np.linalg.solve(self.information[np.ix_(at, at)], self.score[at])
        return dict(zip(names, found.tolist(), strict=True))

    def chi_squared(self, values: Mapping[str, float]) -> float:
        """Return how far the joint estimate is from some values of these numbers alone."""
        at = [self.names.index(name) for name in values]
        information = self.information[np.ix_(at, at)]
        apart = np.linalg.solve(information, self.score[at]) - np.array(list(values.values()))
        return float(apart @ information @ apart)


def score_tests(search: ModeSearch, mode: Mode, names: Sequence[str]) -> ScoreTests | None:
    """Return the score tests of closed numbers at the mode; None where they break down."""
    from scipy.linalg import cho_solve

    passes = search.passes
    try:
        sums = search.prior.add(passes.sums(mode.point, tried=names), mode.point, mode.weights)
        fitted = sums.score.size - len(names)
        factor = cholesky(sums.information[:fitted, :fitted])
        right = np.column_stack([sums.information[:fitted, fitted:], sums.score[:fitted]])
        found = cho_solve(factor, right)
        across = sums.information[fitted:, :fitted]
        information = sums.information[fitted:, fitted:] - across @ found[:, :-1]
        score = sums.score[fitted:] - across @ found[:, -1]
        # Estimates from an information that is not positive definite would be nonsense.
        cholesky(information)
    except BREAKDOWN:
        return None
    finally:
        search.passed(WORK.score_tests * work_of_pass(passes))
    own = np.diag(information)
    return ScoreTests(tuple(names), score / own, 1.0 / np.sqrt(own), information, score)


class Pulses(NamedTuple):
    """The highest line in the spectrum of the flow's strength, which may be a pulse."""

    frequency: float
    """[Hz]"""
    cosine: float
    sine: float
    """Amplitudes of its parts, as of `PULSES`; too small while the flow is fitted without them."""
    height: float
    """Of chi squared with two degrees of freedom."""
    frequencies: int
    """How many were looked at."""

    @property
    def amplitude(self) -> float:
        """Return the amplitude of the pulse."""
        return math.hypot(self.cosine, self.sine)

    @property
    def significant(self) -> bool:
        """Return whether a steady flow hardly has such a line."""
        return self.height > 2.0 * float(np.log(self.frequencies / PULSE.false_alarms))


class Scores(NamedTuple):
    """Products of the errors of one series with their derivatives by the flow's strength."""

    products: Floats
    """Shape (n,); 0 where a sample is not used."""
    squares: Floats
    """Of the derivatives."""
    errors: Floats
    """Whitened, (n, D)."""


class StrengthScores:
    """Scores of the flow's strength in every series; those at the last mode are kept."""

    def __init__(self, passes: Passes) -> None:
        self.passes = passes
        self._mode: Mode | None = None
        self._found: list[Scores] = []

    def at(self, mode: Mode) -> list[Scores]:
        """Return the scores at a mode."""
        if mode is not self._mode:
            points = [mode.point.in_flow(one.flow) for one in self.passes.series]
            pairs = zip(self.passes.series, points, strict=True)
            self._found = [Scores(*self.passes.strength_products(*pair)) for pair in pairs]
            self._mode = mode
        return self._found


def find_pulses(series: Sequence[Series], scores: Sequence[Scores]) -> Pulses | None:
    """Return the strongest pulse of the flow, or nothing where the recording is too short.

    The derivative of the errors by a constant change of the flow's strength is, at each sample,
    nearly that by a change then. So the products of errors and derivatives have a line in their
    spectrum where the strength pulses. The median of the spectrum is its height without pulses.
    """
    found = [_highest_line(one, score) for one, score in zip(series, scores, strict=True)]
    lines = [line for line in found if line is not None]
    return max(lines, key=lambda one: one.height) if lines else None


def _highest_line(series: Series, score: Scores) -> Pulses | None:
    """Return the highest line of one series; nothing where it is too short."""
    products, squares, _ = score
    time = series.time - series.time[0]
    interval = float(np.median(np.diff(time)))
    place = np.round(time / interval).astype(np.intp)
    padded = PULSE.oversampled * (int(place[-1]) + 1)
    wave = np.fft.rfft(np.bincount(place, weights=products), padded)
    frequencies = np.fft.rfftfreq(padded, interval)
    slowest = PULSE.least_periods / max(float(time[-1]), interval)
    inside = (frequencies > slowest) & (frequencies < 0.5 / interval)
    if np.count_nonzero(inside) < PULSE.oversampled * PULSE.least_periods:
        return None
    wave, frequencies = wave[inside], frequencies[inside]
    total = float(squares.sum())
    heights = 2.0 * np.abs(wave) ** 2 / total
    # 1.3863 is the median of chi squared with two degrees of freedom.
    heights *= 1.3863 / float(np.median(heights))
    best = int(heights.argmax())
    # A quarter of a line's width off, a pulse leaves a tenth of itself in the errors.
    apart = float(frequencies[1] - frequencies[0])
    near = frequencies[best] + apart * np.linspace(-1.0, 1.0, 2 * PULSE.finer + 1)
    sums = np.array([products @ np.exp(-2j * np.pi * one * time) for one in near])
    frequency, highest = near[int(np.abs(sums).argmax())], sums[int(np.abs(sums).argmax())]
    # The spectrum counts time from the first sample, the numbers of a pulse from time 0.
    turned = 2.0 * highest / total * np.exp(-2j * np.pi * frequency * series.time[0])
    return Pulses(
        float(frequency),
        float(turned.real),
        float(-turned.imag),
        float(heights[best]),
        frequencies.size,
    )
