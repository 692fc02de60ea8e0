"""Tests of the innovations by place, time and speed.

All statistics here are sums of whitened innovations over groups (a cell of the tank, a part of the
recording, a range of speeds) with their exact variance after fitting, see
`driftwalk.likelihood.check.errors`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Bools, Floats, Integers
from driftwalk.flow.arena import outline_of
from driftwalk.likelihood.check.errors import Contrast, Innovations, Leverage, collect
from driftwalk.likelihood.check.whiteness import LAGS, WhitenessTests, whiteness_tests
from driftwalk.likelihood.preparation import Estimate


class GroupPolicy(NamedTuple):
    """Sizes of the groups of innovations, and what a group has to hold."""

    cells_per_side: float = 1.5
    """Cells along a side of the block. Chosen by hand, as what follows."""
    most_cells: int = 24
    """Most cells across the tank; chosen by hand."""
    time_bins: int = 10
    """Most parts of the recordings; chosen by hand."""
    fewest_in_part: int = 300
    """Samples of a part of the recordings; chosen by hand."""
    speed_bins: int = 6
    """Ranges of the speed of the water past the block; chosen by hand."""
    fewest_in_cell: int = 20
    """Samples of a cell for the mean of its innovations: in cells of 11 to 15 one contact near
    the margin of the wall made it 10 to 20 sd (development set of studies/verdict)."""
    fewest_for_spread: int = 50
    """Samples that make the mean of their squares about normal; chosen by hand."""
    least_visible: float = 0.5
    """Share of a group's change that must be left by the fit for its estimate to mean something;
    chosen by hand."""
    least_freedom: float = 0.1
    """A direction in which fitting has left less than this share of the variance says nothing;
    chosen by hand."""
    cell_freedom: float = 0.3
    """Share of the variance that counts as left at least, in a direction of one cell. The share is
    that of the linearised model: on a path that was taken once, shares of 0.09 and 0.12 made errors
    of 2.4 and 1.9 sd look like 8 and 6 (development set of studies/verdict)."""


GROUP: Final = GroupPolicy()


@dataclass(frozen=True, eq=False)
class Layout:
    """Cells of the tank, parts of the recordings, ranges of speed."""

    x: Floats
    """Centres of the cells [m]."""
    y: Floats
    size: float
    """Side of a cell [m]."""
    series: Integers
    """Which series each part belongs to: a recording, or what is between two switching times."""
    start: Floats
    """When each part begins, from the first sample of its recording [s]."""
    end: Floats
    speed: Floats
    """Edges of the ranges of the speed of the water past the block [m/s]."""
    sources: tuple[tuple[int, int], ...] = ()
    """Recording and flow of each series; without them every series is a recording in one flow."""

    def recording(self, part: int) -> int:
        """Return the recording that a part belongs to."""
        series = int(self.series[part])
        return self.sources[series][0] if self.sources else series

    def flow(self, part: int) -> int:
        """Return the flow that a part is in."""
        return self.sources[int(self.series[part])][1] if self.sources else 0

    def place_of(self, cell: int) -> str:
        """Return "x = 0.060 m, y = -0.100 m"."""
        row, column = divmod(cell, self.x.size)
        return f"x = {self.x[column]:.3f} m, y = {self.y[row]:.3f} m"

    def time_of(self, part: int, last: int | None = None) -> str:
        """Return "between 600 s and 1200 s", from the start of a part to its or another's end."""
        end = self.end[part if last is None else last]
        found = f"between {self.start[part]:.0f} s and {end:.0f} s"
        if len({self.recording(one) for one in range(self.parts)}) > 1:
            found += f" of recording {self.recording(part) + 1}"
        return found

    @property
    def cells(self) -> int:
        """Number of cells."""
        return int(self.x.size * self.y.size)

    @property
    def parts(self) -> int:
        """Number of parts of the recordings."""
        return int(self.start.size)


def lay_out(
    errors: Sequence[Innovations], bounds: tuple[float, float, float, float], *, side: float
) -> Layout:
    """Lay cells over the tank, and cut the recordings and the speeds into parts."""
    x_min, y_min, x_max, y_max = bounds
    widest = max(x_max - x_min, y_max - y_min)
    size = max(side / GROUP.cells_per_side, widest / GROUP.most_cells)
    axes = []
    for low, high in ((x_min, x_max), (y_min, y_max)):
        count = max(1, int(np.ceil((high - low) / size - 1e-9)))
        middle = size * (np.arange(count, dtype=np.float64) - 0.5 * (count - 1))
        axes.append(0.5 * (low + high) + middle)
    samples = sum(int(one.used.sum()) for one in errors)
    parts = int(np.clip(samples // GROUP.fewest_in_part, 1, GROUP.time_bins))
    numbers, start, end = [], [], []
    duration = sum(float(one.series.time[-1] - one.series.time[0]) for one in errors)
    for index, one in enumerate(errors):
        first, last = float(one.series.time[0]), float(one.series.time[-1])
        count = max(1, round(parts * (last - first) / duration))
        edges = np.linspace(first, last, count + 1)
        numbers += [index] * count
        start += edges[:-1].tolist()
        end += edges[1:].tolist()
    speeds = np.concatenate([one.speed[one.used] for one in errors])
    speeds = speeds[np.isfinite(speeds)]
    shares = np.linspace(0.0, 1.0, GROUP.speed_bins + 1)
    edges = np.quantile(speeds, shares) if speeds.size else np.zeros(0)
    return Layout(
        axes[0],
        axes[1],
        size,
        np.array(numbers),
        np.array(start),
        np.array(end),
        np.unique(edges),
        tuple((one.series.recording, one.series.flow) for one in errors),
    )


class Groups(NamedTuple):
    """The groups of every sample of one series, -1 for none."""

    cell: Integers
    part: Integers
    speed: Integers


def groups_of(layout: Layout, errors: Sequence[Innovations]) -> list[Groups]:
    """Return the groups of the samples of every series."""
    found = []
    for index, one in enumerate(errors):
        # Where the body was at the sample before: known when the prediction was made.
        x, y = (np.concatenate([axis[:1], axis[:-1]]) for axis in (one.series.x, one.series.y))
        parts = np.flatnonzero(layout.series == index)
        part = parts[0] + np.searchsorted(layout.start[parts][1:], one.series.time, side="right")
        speed = np.searchsorted(layout.speed[1:-1], np.nan_to_num(one.speed), side="right")
        known = one.used & np.isfinite(one.speed) & (layout.speed.size > 1)
        cell = np.where(one.used, cell_of(layout, x, y), -1)
        found.append(Groups(cell, np.where(one.used, part, -1), np.where(known, speed, -1)))
    return found


def cell_of(layout: Layout, x: Floats, y: Floats) -> Integers:
    """Return the cells that points are in, those at the rim for points outside."""
    found = []
    for values, axis in ((x, layout.x), (y, layout.y)):
        share = np.floor((values - axis[0]) / layout.size + 0.5)
        found.append(np.clip(share.astype(np.int64), 0, axis.size - 1))
    return np.asarray(found[1] * layout.x.size + found[0])


class LocalMeans(NamedTuple):
    """Sums over cells, with their distance from zero; the first axis counts the groups."""

    samples: Floats
    mean: Floats
    """Mean whitened innovation, (groups, D)."""
    chi_squared: Floats
    """Squared distance of the mean from zero in its own standard deviations; NaN where there are
    too few samples."""
    drag_change: Floats
    """Change of the fitted ln C_d by the mean errors, (groups,)."""


def local_scores(score: Floats, count: Floats, slope: Floats, covariance: Floats) -> LocalMeans:
    """Return the means of groups with their chi squared of D degrees of freedom."""
    mean = score / np.maximum(count, 1.0)[:, None]
    chi_squared = np.full(count.size, np.nan)
    enough = np.flatnonzero(count >= GROUP.fewest_in_cell)
    if enough.size:
        rows = slope[enough]
        taken = np.einsum("gdp,gep->gde", (rows @ covariance), rows)
        left = np.eye(score.shape[1]) - taken / count[enough][:, None, None]
        value, vector = np.linalg.eigh(left)
        along = np.einsum("gde,gd->ge", vector, score[enough]) / np.sqrt(count[enough])[:, None]
        chi_squared[enough] = (along**2 / np.maximum(value, GROUP.cell_freedom)).sum(axis=1)
    # A step of Gauss and Newton from errors that are nothing but these means.
    drag_change = np.einsum("gd,gdp,p->g", mean, slope, covariance[-1])
    return LocalMeans(count, mean, chi_squared, drag_change)


class Trend(NamedTuple):
    """A factor (of the flow, of C_d) that should be one everywhere."""

    change: Floats
    """By how much the factor seems to be off in each group, relative."""
    std: Floats
    """Its standard deviation."""
    chi_squared: float
    dof: int
    visible: Bools
    """Whether most of a change in a group could be seen: the fit may have absorbed it."""


def trend_of(contrast: Contrast, covariance: Floats) -> Trend:
    """Return the estimated changes of a factor, about their common mean, and their chi squared.

    The sums have covariance V = diag(power) - A C A', and a change d of the factor in the groups
    moves them by V d. The part that the fit absorbed (the mean of the factor, mostly) cannot be
    seen.
    """
    variance = np.diag(contrast.power) - contrast.slope @ covariance @ contrast.slope.T
    value, vector = np.linalg.eigh(variance)
    typical = float(contrast.power.max(initial=0.0))
    seen = value > GROUP.least_freedom * typical
    if not typical > 0.0 or not seen.any():
        nothing = np.full(contrast.size, np.nan)
        return Trend(nothing, nothing, 0.0, 0, np.zeros(contrast.size, dtype=bool))
    inverse = (vector[:, seen] / value[seen]) @ vector[:, seen].T
    change = inverse @ contrast.score
    return Trend(
        change,
        np.sqrt(np.diag(inverse)),
        float(contrast.score @ change),
        int(seen.sum()),
        (vector[:, seen] ** 2).sum(axis=1) > GROUP.least_visible,
    )


class Spread(NamedTuple):
    """Mean square of the errors in each group, relative to all groups."""

    ratio: Floats
    """NaN where there are too few samples."""
    std: Floats
    """Standard deviation of the ratio if it is one."""


def spread_of(errors: Sequence[Innovations], groups: Sequence[Integers], size: int) -> Spread:
    """Return the mean square of the errors in each group: the noise should be the same in all."""
    group = np.concatenate(list(groups))
    square = np.concatenate([(one.white**2).mean(axis=1) for one in errors])[group >= 0]
    group = group[group >= 0]
    count = np.bincount(group, minlength=size).astype(np.float64)
    mean = max(float(square.mean()), 1e-300) if square.size else 1.0
    enough = count >= GROUP.fewest_for_spread
    ratio, std = np.full(size, np.nan), np.full(size, np.nan)
    total = np.bincount(group, square, minlength=size)
    ratio[enough] = total[enough] / count[enough] / mean
    # The mean of all is made of the groups as well.
    share = 1.0 - count[enough] / max(square.size, 1)
    std[enough] = float(square.std()) / mean * np.sqrt(share / count[enough])
    return Spread(ratio, std)


@dataclass(frozen=True, eq=False)
class Residuals:
    """The statistics of the errors of prediction."""

    layout: Layout
    leverage: Leverage
    white: WhitenessTests
    place: LocalMeans
    """By cell."""
    part: LocalMeans
    """By part of the recording and cell, in that order."""
    strength: Trend
    """Of the flow, by part of the recording."""
    drag: Trend
    """Of C_d, by the speed of the water past the block."""
    noise_by_part: Spread
    noise_by_place: Spread


def residuals_of(estimate: Estimate, errors: Sequence[Innovations]) -> Residuals:
    """Return the statistics of the errors of prediction."""
    study = estimate.study
    bounds = outline_of(study.tank.to_arena()).bounds
    layout = lay_out(errors, bounds, side=study.block.side_m)
    groups = groups_of(layout, errors)
    components = errors[0].components
    at_place, at_time, at_speed = [], [], []
    for one in groups:
        both = np.where(one.cell >= 0, one.part * layout.cells + one.cell, -1)[:, None]
        at_place.append(np.where(both >= 0, both * components + np.arange(components), -1))
        at_time.append(np.repeat(one.part[:, None], components, axis=1))
        at_speed.append(np.repeat(one.speed[:, None], components, axis=1))
    # By part of the recording, cell and component, in that order.
    place = Contrast(at_place, layout.parts * layout.cells * components)
    # Weighted with what a stronger flow would do, and with what a stronger drag would do.
    strength = Contrast(at_time, layout.parts, by="flow")
    drag = Contrast(at_speed, max(layout.speed.size - 1, 1), by="drag")
    leverage = collect(estimate, errors, [place, strength, drag], lags=LAGS)
    covariance = leverage.covariance
    shape = (layout.parts, layout.cells, components)
    score, power = place.score.reshape(shape), place.power.reshape(shape)[:, :, 0]
    slope = place.slope.reshape(*shape, -1)
    by_part = (layout.parts * layout.cells, components)
    return Residuals(
        layout=layout,
        leverage=leverage,
        white=whiteness_tests(errors, leverage),
        place=local_scores(score.sum(axis=0), power.sum(axis=0), slope.sum(axis=0), covariance),
        part=local_scores(
            score.reshape(by_part), power.ravel(), slope.reshape(*by_part, -1), covariance
        ),
        strength=trend_of(strength, covariance),
        drag=trend_of(drag, covariance),
        noise_by_part=spread_of(errors, [one.part for one in groups], layout.parts),
        noise_by_place=spread_of(errors, [one.cell for one in groups], layout.cells),
    )
