"""Innovations at the estimate of a fit, and what fitting has taken out of them.

With J the whitened derivatives of the predictions and Lambda the precision of the prior, the
whitened innovations at the estimate have the covariance ``I - J C J'``, ``C = (J'J + Lambda)^-1``,
if the model is right: what was fitted is missing in them. So for any sum ``s = W' w`` of whitened
innovations the variance is ``W'W - A C A'`` with ``A = W'J``, exactly. The rows A of all sums
that the check needs are collected in one pass; J itself is never held.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Bools, Floats, Integers
from driftwalk.likelihood.filter.difference_pairs import used_of
from driftwalk.likelihood.filter.filter_pass import Place, Sums, whitened
from driftwalk.likelihood.filter.series import Series, layer_strengths
from driftwalk.likelihood.preparation import Estimate
from driftwalk.likelihood.spline import DEGREE, Spline, basis

SAMPLES_AT_ONCE: Final = 2048
"""Rows of derivatives that are held at a time: some 20 MB."""


@dataclass(frozen=True, eq=False)
class Innovations:
    """The errors of prediction of one series, whitened, and where they were made."""

    series: Series
    white: Floats
    """Shape (n, D); zero where not used."""
    used: Bools
    """Samples whose errors count: not the first ones of a stretch."""
    outlier: Bools
    """Samples that the filter did not take, so far were they from where it had predicted them."""
    speed: Floats
    """Speed of the water past the block at the sample before [m/s], NaN where unknown; (n,)."""

    @property
    def components(self) -> int:
        """Number of numbers that are predicted at each sample."""
        return int(self.white.shape[1])


def innovations_of(estimate: Estimate) -> list[Innovations]:
    """Run the filter over every series at the estimate."""
    found = []
    for series in estimate.passes.series:
        point = estimate.point.in_flow(series.flow)
        passed = estimate.passes.run(series, point)
        states, white, used = passed["state"], whitened(passed), used_of(passed)
        speed = np.full(series.time.size, np.nan)
        # The state before the sample: to sort errors by what they caused would bias them.
        before = states[:-1]
        spline, (x, y) = estimate.passes.spline, before[:, :2].T
        layers = point.coefficients.reshape(-1, *point.coefficients.shape[-3:])
        strengths = layer_strengths(series, point)
        if strengths is None:
            flow = velocity_at(spline, layers[0], x, y)
        else:
            parts = zip(strengths, layers, strict=True)
            flow = sum(strength[:-1] * velocity_at(spline, one, x, y) for strength, one in parts)
        # Coordinates come first, as many as velocities.
        velocity = before[:, before.shape[1] // 2 :]
        speed[1:] = np.hypot(flow[0] - velocity[:, 0], flow[1] - velocity[:, 1])
        there = np.isfinite(white).all(axis=1)
        # The first error after a gap or a contact gives the velocity, and is no mistake.
        known = np.flatnonzero(there | series.begins)
        first = np.zeros_like(there)
        first[known[1:]] = series.begins[known[:-1]]
        outlier = there & ~used & ~first & (series.excluded == 0)
        white = np.where(used[:, None], white, 0.0)
        found.append(Innovations(series, white, used, outlier, speed))
    return found


def velocity_at(spline: Spline, coefficients: Floats, x: Floats, y: Floats) -> Floats:
    """Return the flow [m/s] at points, shape (2, n); NaN where a coordinate is."""
    total = np.zeros((2, x.size))
    along = []
    axes = ((x, spline.origin_x, spline.columns), (y, spline.origin_y, spline.rows))
    for position, origin, count in axes:
        share = np.nan_to_num((position - origin) / spline.spacing)
        cell = np.clip(np.floor(share).astype(np.intp), 0, count - DEGREE - 1)
        along.append((cell, basis(share - cell)))
    (column, weight_x), (row, weight_y) = along
    for j in range(DEGREE + 1):
        for i in range(DEGREE + 1):
            total += coefficients[:, row + j, column + i] * weight_y[:, j] * weight_x[:, i]
    total[:, ~(np.isfinite(x) & np.isfinite(y))] = np.nan
    return total


@dataclass(eq=False)
class Contrast:
    """Weighted sums of whitened innovations, one for each group of rows.

    Attributes
    ----------
    groups : sequence of ndarray, shapes (n, D)
        Of each series: the group of each innovation, -1 for none.
    size : int
        Number of groups.
    by : {"one", "flow", "drag"}
        Weight of an innovation: one; its derivative by a factor of the flow; by ln C_d.
    """

    groups: Sequence[Integers]
    size: int
    by: str = "one"
    score: Floats = field(init=False)
    """The sums, (size,)."""
    power: Floats = field(init=False)
    """Sums of the squared weights, (size,)."""
    slope: Floats = field(init=False)
    """Their derivatives by the parameters, with the sign turned, (size, parameters)."""

    def begin(self, parameters: int) -> None:
        """Make room for the sums."""
        self.score, self.power = np.zeros(self.size), np.zeros(self.size)
        self.slope = np.zeros((self.size, parameters))

    def add(
        self, part: Part, weights: Mapping[str, Floats], jacobian: Floats, moving: Integers | None
    ) -> None:
        """Add the rows of one part, with their weights by name.

        Rows of `weights` and `jacobian` are means of the part's pooled samples. `jacobian` holds
        the columns `moving`, or all; the others are zero.
        """
        from scipy.sparse import csr_matrix

        weight = weights[self.by]
        group = self.groups[part.series][part.start : part.start + len(part.white)]
        group, white, number = _pooled_rows(group, part.white, part.pooled)
        retained = np.flatnonzero(group >= 0)
        if not retained.size:
            return
        present, local = np.unique(group[retained], return_inverse=True)

        def matrix_of(values: Floats) -> Any:
            at = (local, retained)
            return csr_matrix((values[retained], at), shape=(present.size, group.size))

        self.score[present] += np.asarray(matrix_of(weight) @ white)
        self.power[present] += np.bincount(local, (number * weight**2)[retained])
        slope = np.asarray(matrix_of(number * weight) @ jacobian)
        if moving is not None:
            known, slope = slope, np.zeros((present.size, int(moving[-1]) + 1))
            slope[:, moving] = known
        for own, columns in part.places:
            self.slope[present, columns] += slope[:, own]


def _pooled_rows(group: Integers, white: Floats, pooled: int) -> tuple[Integers, Floats, Floats]:
    """Return the group of each row of means, the sum of its errors, and how many there are.

    Samples of one row that are in several groups count for the first one's.
    """
    if pooled == 1:
        return group.ravel(), white.ravel(), np.ones(group.size)
    missing = -len(group) % pooled
    shape = (-1, pooled, group.shape[1])
    groups = np.pad(group, ((0, missing), (0, 0)), constant_values=-1).reshape(shape)
    counted = groups >= 0
    sums = np.where(counted, np.pad(white, ((0, missing), (0, 0))).reshape(shape), 0.0).sum(axis=1)
    first = np.take_along_axis(groups, counted.argmax(axis=1)[:, None], axis=1)
    return first.ravel(), sums.ravel(), counted.sum(axis=1).ravel().astype(np.float64)


@dataclass(frozen=True, eq=False)
class Leverage:
    """The part of the errors that fitting absorbed."""

    spread: Floats
    """A matrix whose product with standard normals has the covariance C: its root."""
    parameters: float
    """Effective number of parameters: the trace of J C J'."""
    autocovariance: Floats
    """Mean of J C J' at lags 0, 1, ..., shape (D, lags + 1)."""

    @property
    def covariance(self) -> Floats:
        """C, of the flow's coefficients and ln C_d."""
        return np.asarray(self.spread @ self.spread.T)


class Part(NamedTuple):
    """Some samples of one series."""

    series: int
    flow: int
    start: int
    jacobian: Floats
    """By the coefficients of the part's flow and ln C_d, shape (rows, columns): the components of
    a sample one after the other; sums over `pooled` samples."""
    used: Floats
    """Samples in each row of sums."""
    white: Floats
    """Shape (samples, D)."""
    places: Sequence[Place]
    """Where its columns stand among the parameters of all flows."""
    pooled: int


def collect(
    estimate: Estimate, errors: Sequence[Innovations], contrasts: Sequence[Contrast], *, lags: int
) -> Leverage:
    """Fill the contrasts in one pass with derivatives, and return what fitting absorbed."""
    from scipy.linalg import solve_triangular
    from scipy.linalg.blas import dsyrk

    size = estimate.point.coefficients.size + 1
    count = sum(len(_starts(one.series)) for one in errors)
    # Derivatives of four parts are kept, for the correction of the autocorrelation.
    chosen = set(np.linspace(0, count - 1, 4).astype(int).tolist())
    retained: list[Part] = []
    for contrast in contrasts:
        contrast.begin(size)
    # J'J by flow, its lower half alone: a series has derivatives by the coefficients of its flow.
    lower: dict[int, Any] = {}
    for part in _parts(estimate, errors, chosen, retained):
        jacobian, moving = part.jacobian, None
        coefficients = estimate.point.in_flow(part.flow).coefficients.ravel()
        if part.flow not in lower:
            lower[part.flow] = np.zeros((jacobian.shape[1],) * 2, order="F")
        if part.pooled == 1:
            lower[part.flow] = dsyrk(
                1.0, jacobian.T, beta=1.0, c=lower[part.flow], overwrite_c=1, lower=1
            )
        else:
            # In the seconds of such a part the block comes near few of the coefficients.
            moving = np.flatnonzero(jacobian.any(axis=0))
            moving = np.union1d(moving, [jacobian.shape[1] - 1])
            rows, number = jacobian[:, moving], np.maximum(part.used, 1.0)[:, None]
            lower[part.flow][np.ix_(moving, moving)] += dsyrk(
                1.0, (rows / np.sqrt(number)).T, lower=1
            )
            jacobian, coefficients = rows / number, coefficients[moving[:-1]]
        weights = {
            "one": np.ones(len(jacobian)),
            "flow": jacobian[:, :-1] @ coefficients,
            "drag": jacobian[:, -1],
        }
        for contrast in contrasts:
            contrast.add(part, weights, jacobian, moving)
    data = np.zeros((size, size))
    for flow, part_of in lower.items():
        whole = np.tril(part_of) + np.tril(part_of, -1).T
        places = estimate.passes.columns_of(flow, 1)
        for own, row in places:
            for own_column, column in places:
                data[row, column] += whole[own, own_column]
    # C = (J'J + Lambda)^-1, held as a root so that samples and traces take one product.
    sums = Sums(0.0, np.zeros(len(data)), data, 0)
    full = estimate.prior.add(sums, estimate.point, estimate.weights).information
    spread = solve_triangular(np.linalg.cholesky(full), np.eye(len(full)), lower=True).T
    parameters = float(((data @ spread) * spread).sum())
    return Leverage(spread, parameters, _autocovariance(spread, errors, retained, lags))


def _starts(series: Series) -> range:
    """Return the first samples of the parts, each a whole number of pools."""
    step = max(SAMPLES_AT_ONCE // series.pooled, 1) * series.pooled
    return range(0, series.time.size, step)


def _parts(
    estimate: Estimate, errors: Sequence[Innovations], chosen: set[int], retained: list[Part]
) -> Iterator[Part]:
    """Run the filter with derivatives over every series, some samples at a time.

    The `chosen` parts are retained with the derivatives of every sample.
    """
    number = 0
    for index, one in enumerate(errors):
        flow, pooled = one.series.flow, one.series.pooled
        places = estimate.passes.columns_of(flow, 1)
        point = estimate.point.in_flow(flow)
        running = estimate.passes.kernel(one.series, point, sensitivities=True)
        starts = _starts(one.series)
        for start in starts:
            whole = number in chosen
            number += 1
            found = running.run(starts.step, states=False, pooled=1 if whole else pooled)
            white = np.asarray(found["whitened"]).reshape(-1, one.components)
            jacobian = np.asarray(found["jacobian"])
            pools = np.arange(0, len(white), pooled)
            used = np.repeat(
                np.add.reduceat(found["used"], pools, dtype=np.float64), one.components
            )
            if whole:
                retained.append(Part(index, flow, start, jacobian, used, white, places, 1))
                if pooled > 1:
                    by_sample = jacobian.reshape(len(white), -1)
                    jacobian = np.add.reduceat(by_sample, pools).reshape(used.size, -1)
            yield Part(index, flow, start, jacobian, used, white, places, pooled)


def used_pairs(used: Bools, lags: int) -> Iterator[tuple[int, Bools]]:
    """Yield each lag, and by the earlier sample whether both samples of a pair count."""
    for lag in range(min(lags, used.size - 1) + 1):
        yield lag, used[lag:] & used[: used.size - lag]


def _autocovariance(
    spread: Floats, errors: Sequence[Innovations], retained: Sequence[Part], lags: int
) -> Floats:
    """Return the mean of J C J' by component and lag, from samples of the posterior."""
    components = errors[0].components
    generator = np.random.default_rng(0)
    count = 16  # samples of the posterior
    samples = spread @ generator.normal(size=(len(spread), count))
    total, pairs = np.zeros((components, lags + 1)), np.zeros(lags + 1)
    for part in retained:
        own = np.concatenate([samples[columns] for _, columns in part.places])
        moved = (part.jacobian @ own).reshape(-1, components, count)
        used = errors[part.series].used[part.start : part.start + len(moved)]
        for lag, both in used_pairs(used, lags):
            products = moved[lag:][both] * moved[: used.size - lag][both]
            total[:, lag] += products.sum(axis=(0, 2)) / count
            pairs[lag] += both.sum()
    return np.asarray(total / np.maximum(pairs, 1.0))
