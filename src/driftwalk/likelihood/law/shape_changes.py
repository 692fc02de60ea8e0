"""Changes of the flow's shape: the line spectrum of its strength by cell.

A fitted flow is steady but for its strength. Where eddies alternate or a jet turns, the strength in
one part of the tank goes to and fro against another's. The products of errors and derivatives by
the strength (as for pulses) of every cell then have a line in their spectra, at one frequency and
with phases of their own; the powers are added over the cells. A force with a memory raises the
spectrum as well, but without a line: each power is compared with the median of those around it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats, Integers
from driftwalk.likelihood.filter.series import Series
from driftwalk.likelihood.law.candidate_laws import STRENGTHS
from driftwalk.likelihood.law.score_tests import Scores, ScoreTests, StrengthScores
from driftwalk.likelihood.newton import Mode


class ShapePolicy(NamedTuple):
    """When a line in the spectra of the cells is a change of the flow's shape."""

    cell_sides: float = 1.5
    """Side of a cell, in sides of the block. Chosen by hand: a block averages what is smaller."""
    fewest_samples: int = 30
    """Samples of a cell that is looked at. Chosen by hand."""
    shortest_interval_s: float = 0.05
    """Samples are added up over this time at least: no flow changes its shape at 10 Hz; chosen by
    hand."""
    oversampled: int = 2
    """Frequencies for each period that the recording holds; chosen by hand."""
    block: int = 120
    """Frequencies in a block, whose median is the power without a line. Chosen by hand."""
    false_alarms: float = 1e-14
    """Chance that a steady flow has such a line at any frequency, were the errors normal. A body in
    a steady flow whose tracker made mistakes had 2e-13, in flows that change it is below 1e-100
    (development set of studies/verdict)."""
    efficiency: float = 0.2
    """Part of the information on a change that the cells hold: eddies that alternate by 11 to 46 %
    of the flow in 5 to 60 s had lines of 0.1 to 0.22 of it (docs/explanation/likelihood.md)."""
    candidates: int = 2
    """Lines of each spectrum that may be the change's where the strength has no significant one.
    Chosen by hand: an orbit adds lines."""
    least_periods: float = 3.0
    """Periods in the recording from which on the change is called periodic. Chosen by hand."""


SHAPE: Final = ShapePolicy()


class ShapeChange(NamedTuple):
    """The highest line in the spectra of the cells."""

    frequency: float
    """[Hz]; NaN where the strength itself has no line."""
    p_value: float
    """Chance that a steady flow has a line so high at any frequency."""
    periods: float
    """Of the line, in the recording."""
    found_nine_in_ten: float
    """Power of a line that is found nine times in ten: the non-centrality of its chi squared."""
    candidates: tuple[float, ...] = ()
    """The frequency, or where there is none, those of the highest lines of the strength and of the
    errors themselves [Hz]."""

    @property
    def significant(self) -> bool:
        """Return whether a steady flow hardly has such a line."""
        return self.p_value < SHAPE.false_alarms

    @property
    def period(self) -> float:
        """Period [s]; NaN where the recording holds too few of them."""
        return 1.0 / self.frequency if self.periods >= SHAPE.least_periods else math.nan

    @property
    def sentence(self) -> str:
        """Return a sentence for the user."""
        pace = ""
        if self.periods >= SHAPE.least_periods:
            pace = f" with a period of {self.period:.3g} s"
        elif self.periods < SHAPE.least_periods:
            pace = f" slowly, over {0.5 / self.frequency:.3g} s or more"
        return (
            f"the shape of the flow changes{pace}: the errors of prediction in different parts of "
            f"the tank go to and fro together (p = {self.p_value:.1g}). A steady flow does not "
            "describe it: the fitted C_d, σ_F and force law do not hold"
        )


def shape_change(scores: StrengthScores, mode: Mode) -> ShapeChange | None:
    """Return the change of the flow's shape at a mode; nothing with several flows."""
    passes = scores.passes
    if passes.flows > 1:
        return None
    return find_shape_change(passes.series, scores.at(mode), side=passes.body.side)


def find_shape_change(
    series: Sequence[Series], scores: Sequence[Scores], *, side: float
) -> ShapeChange | None:
    """Return the most significant line of all series; nothing where all are too short.

    The part that is constant in a cell, or linear in the place there, belongs to a steady flow and
    is taken out: on an orbit it comes again and again.
    """
    found = [
        _highest_line(one, score, SHAPE.cell_sides * side)
        for one, score in zip(series, scores, strict=True)
    ]
    lines = [line for line in found if line is not None]
    if not lines:
        return None
    best = min(lines, key=lambda one: one.p_value)
    return best._replace(p_value=min(1.0, len(lines) * best.p_value))


def shape_facts(found: ShapeChange | None, tests: ScoreTests | None) -> dict[str, Any]:
    """Return what stands in a fit of its flow's shape; `tests` tell how well its strength is known.

    A change with the amplitude of a cosine of the strength is known as well as that cosine.
    """
    if found is None:
        return {}
    known = tests is not None and STRENGTHS[-1] in tests.names
    std = tests.of(STRENGTHS[-1])[1] if tests is not None and known else math.nan
    facts = {
        "flow_shape_p_value": found.p_value,
        "flow_shape_frequency_Hz": found.frequency,
        "flow_shape_detectable": math.sqrt(found.found_nine_in_ten / SHAPE.efficiency) * std,
    }
    facts = {name: value for name, value in facts.items() if math.isfinite(value)}
    return facts | ({"flow_shape_change": found.sentence} if found.significant else {})


def _highest_line(series: Series, score: Scores, size: float) -> ShapeChange | None:
    from scipy.fft import next_fast_len
    from scipy.special import chdtrc, chdtri

    duration = float(series.time[-1] - series.time[0])
    usual = float(np.median(np.diff(series.time)))
    interval = max(usual, SHAPE.shortest_interval_s)
    place = np.rint((series.time - series.time[0]) / interval).astype(np.int64)
    padded = next_fast_len(SHAPE.oversampled * (int(place[-1]) + 1), real=True)
    frequencies = np.fft.rfftfreq(padded, interval)
    # From half a period in the recording on.
    inside = (frequencies >= 0.5 / max(duration, interval)) & (frequencies < 0.5 / interval)
    if np.count_nonzero(inside) < SHAPE.block:
        return None
    # Powers of the strength, and of the errors themselves: where a jet turns, the direction of the
    # flow changes and its strength may not.
    powers, degrees = np.zeros((2, np.count_nonzero(inside))), np.zeros(2)
    phased = np.zeros(powers.shape, dtype=np.complex128)
    for members in _cells(series, score, size):
        for row, values in _unexplained(series, score, members):
            wave = np.fft.rfft(np.bincount(place[members], weights=values), padded)[inside]
            norm = 2.0 / float((values**2).sum())
            powers[row] += norm * np.abs(wave) ** 2
            phased[row] += norm * wave**2
            degrees[row] += 2
    if not degrees.all():
        return None
    background = np.stack([_background(power) for power in powers])
    heights = powers * chdtri(degrees, 0.5)[:, None] / background
    chances = 2.0 * heights.shape[1] * chdtrc(degrees, heights.max(axis=1))
    # On an orbit each cell is seen once a round, so that there are lines beside the change's by the
    # frequency of the orbit. At the right one the cells have one phase, or the opposite one.
    frequency = math.nan
    together = (powers + np.abs(phased)) / background
    candidates: tuple[float, ...] = ()
    if chances[0] < SHAPE.false_alarms:
        frequency = float(frequencies[inside][together[0].argmax()])
        candidates = (frequency,)
    elif chances[1] < SHAPE.false_alarms:
        highest = [at for one in together for at in _highest(one)]
        candidates = tuple(dict.fromkeys(frequencies[inside][highest].tolist()))
    p_value = float(min(1.0, *chances))
    least = _found_nine_in_ten(float(degrees[0]), 2 * heights.shape[1])
    return ShapeChange(frequency, p_value, frequency * duration, least, candidates)


def _highest(power: Floats) -> list[int]:
    """Return the places of the highest lines; those next to a higher one are no lines."""
    inner = power[1:-1]
    peaks = 1 + np.flatnonzero((inner >= power[:-2]) & (inner > power[2:]))
    return [int(at) for at in peaks[np.argsort(power[peaks])[::-1][: SHAPE.candidates]]]


def _cells(series: Series, score: Scores, size: float) -> list[Integers]:
    """Return the samples that count in each cell, of the cells with enough of them."""
    there = np.flatnonzero(score.squares > 0.0)
    corners = np.stack([np.floor(axis[there] / size) for axis in (series.y, series.x)])
    _, cell = np.unique(corners, axis=1, return_inverse=True)
    order = np.argsort(cell.ravel(), kind="stable")
    ends = np.cumsum(np.bincount(cell.ravel()))[:-1]
    found = [there[one] for one in np.split(order, ends)]
    return [one for one in found if one.size >= SHAPE.fewest_samples]


def _unexplained(series: Series, score: Scores, members: Integers) -> Iterator[tuple[int, Floats]]:
    """Yield in which power they count, and the errors in a cell that no steady flow explains."""
    x, y = (axis[members] - axis[members].mean() for axis in (series.x, series.y))
    basis = np.stack([np.ones(members.size), x, y], axis=1)
    root = np.sqrt(score.squares[members])
    yield 0, root * _beyond(basis * root[:, None], score.products[members] / root)
    for component in score.errors[members].T:
        # A component may have no errors, as an angle that is missing.
        if component.any():
            yield 1, _beyond(basis, component)


def _beyond(basis: Floats, values: Floats) -> Floats:
    found, *_ = np.linalg.lstsq(basis, values, rcond=None)
    return np.asarray(values - basis @ found)


def _background(power: Floats) -> Floats:
    """Return the usual power around each frequency: medians of blocks, with lines between."""
    count = max(power.size // SHAPE.block, 1)
    blocks = np.array_split(power, count)
    sizes = np.cumsum([0, *(one.size for one in blocks)])
    centres = 0.5 * (sizes[:-1] + sizes[1:] - 1)
    return np.asarray(np.interp(np.arange(power.size), centres, [np.median(one) for one in blocks]))


def _found_nine_in_ten(degrees: float, frequencies: int) -> float:
    """Return the non-centrality at which nine lines in ten are significant."""
    from scipy.special import chdtri, chndtrinc

    limit = float(chdtri(degrees, SHAPE.false_alarms / frequencies))
    return float(chndtrinc(limit, degrees, 0.1))
