"""One pass of the innovations filter over the recordings: likelihood, score and information.

The filter predicts each position from the past. Its innovations e_k are independent normals with
covariances S_k if the parameters are right, so twice the negative log likelihood is the sum of
``ln det S_k + e_k' S_k^-1 e_k``. The parameters are, in this order, the flow's coefficients,
ln C_d, and the noises: ln q (intensity of the stochastic acceleration), ln r (tracking noise) and,
where the angle is a part of the state, the logarithms of the force's lever and of the angle's
noise. For the first two the filter itself adds up the products of the derivatives of its
predictions; for the noises it is run again with slightly larger values, and the derivatives of S_k
enter as well. Where the pumps were switched each flow has its own coefficients; a series is in
one flow and adds to the block of that flow alone, and to the parameters that all share.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from driftwalk import _core
from driftwalk.core.arrays import Bools, Floats
from driftwalk.likelihood.filter.difference_pairs import (
    Pair,
    difference_of,
    factor,
    forward,
    noise_derivatives,
    used_of,
)
from driftwalk.likelihood.filter.parameters import Body, Point
from driftwalk.likelihood.filter.series import (
    FILTER,
    Series,
    corrected,
    layer_strengths,
    slow_change,
)
from driftwalk.likelihood.law.candidate_laws import INTENSITIES, OF_PREDICTIONS, STRENGTHS
from driftwalk.likelihood.spline import Spline

Place = tuple[slice, slice]


class Sums(NamedTuple):
    """Sums of a pass over all samples."""

    deviance: float
    """Negative log likelihood, without its constant."""
    score: Floats
    """Its derivatives, with the sign turned."""
    information: Floats
    """Expected second derivatives."""
    used: int
    """Samples whose innovations were used."""


@dataclass(frozen=True, eq=False)
class Passes:
    """Passes of the innovations filter over the recordings of one tank."""

    series: Sequence[Series]
    body: Body
    spline: Spline
    flows: int = 1
    """Number of flows, each with its own coefficients."""
    layers: int = 1
    """Layers of each flow: its mean, and its modes in time."""

    def columns_of(self, flow: int, others: int) -> tuple[Place, Place]:
        """Return where a flow's coefficients and the `others` stand: in one flow, and among all."""
        count = 2 * self.spline.size * self.layers
        shared = self.flows * count
        return (
            (slice(0, count), slice(flow * count, (flow + 1) * count)),
            (slice(count, count + others), slice(shared, shared + others)),
        )

    def sums(self, point: Point, *, noise: str = "with", tried: Sequence[str] = ()) -> Sums:
        """Return likelihood, score and information at a point.

        With noise="without" they end with ln C_d. The closed numbers that are `tried` have
        derivatives too, at the end.
        """
        names = [*point.extras, *tried] if noise == "with" else []
        others = 1 + len(names)
        size = 2 * self.spline.size * self.layers * self.flows + others
        deviance, used = 0.0, 0
        score, information = np.zeros(size), np.zeros((size, size))
        for series in self.series:
            local = point.in_flow(series.flow)
            if names or series.pooled == 1:
                base = self._errors(series, local)
                pairs = self._pairs(series, local, names, base)
                one = self._sums_of(series, local, base, pairs)
                del base, pairs
            else:
                one = self._sums_of_flow(series, local)
            # A series is in one flow: it adds to that flow's block, and to what all flows share.
            places = self.columns_of(series.flow, others)
            for own, row in places:
                score[row] += one.score[own]
                for own_column, column in places:
                    information[row, column] += one.information[own, own_column]
            deviance, used = deviance + one.deviance, used + one.used
        return Sums(deviance, score, information, used)

    def _pairs(
        self, series: Series, point: Point, names: Sequence[str], base: dict[str, Any]
    ) -> list[Pair]:
        """Return two passes for each parameter.

        The kernel is called from here, and not from a function for each pass: a call of it is then
        at most eight frames below `driftwalk.fit`.
        """
        count = series.time.size

        # A closed number of the flow's slow change has the derivative by a constant change of the
        # strength, times its shape: all of them share one pair.
        waves = [name for name in names if name in STRENGTHS and name not in point.opened]
        found: dict[str, Pair] = {}
        for name in [*names, *(["strength_0"] if waves else [])]:
            if name in waves:
                continue
            if name in INTENSITIES:
                # The point has the q of this flow: its own number is ln q, those of others nothing.
                own = INTENSITIES[series.flow - 1] == name if series.flow else False
                found[name] = found["log_intensity"] if own else Pair(base, base, 1.0)
                continue
            low, high, step, most, *_ = difference = difference_of(point, name)
            one = base
            if low is not None:
                closed = self.kernel(series, point.with_extra(name, low))
                one = dict(closed.run(count, states=False))
            moved = self.kernel(series, point.with_extra(name, high))
            other = dict(moved.run(count, states=False))
            pair = Pair(one, other, step, most, spreads=name not in OF_PREDICTIONS)
            if difference.shortens and (excess := pair.excess) > 1.0:
                # Where positions are known to some micrometres, a tenth of a millisecond is a long
                # step in time: the second pass is made again with a shorter one.
                _, high, step, *_ = difference_of(point, name, shorter=excess)
                moved = self.kernel(series, point.with_extra(name, high))
                other = dict(moved.run(count, states=False))
                pair = pair._replace(other=other, step=step)
            found[name] = pair
        for name in waves:
            found[name] = found["strength_0"]._replace(wave=slow_change(series, name))
        return [found[name] for name in names]

    def _sums_of(
        self, series: Series, point: Point, base: dict[str, Any], pairs: list[Pair]
    ) -> Sums:
        """Return the sums of one series: of coefficients and ln C_d by the kernel, then noises."""
        # A sample counts only where every pass has used it: else a difference of two passes would
        # mix the effect of the parameter with the effect of leaving a sample out.
        used = np.logical_and.reduce([used_of(base), *(pair.comparable for pair in pairs)])
        white, changes, spreads = noise_derivatives(base, pairs, used)
        # The kernel multiplies its derivatives, which are never held, with the whitened
        # innovations (the score) and with their changes by each noise (the mixed information).
        right = np.zeros((used.size, white.shape[1], 1 + len(changes)))
        right[used] = np.stack([white, *changes], axis=-1)
        kernel = self.kernel(series, point, sensitivities=True)
        found = kernel.sums(used.astype(np.uint8), right)
        # ln det S / 2 is the sum of the logarithms on the diagonal of its Cholesky factor.
        deviance = 0.5 * float((white**2).sum()) + float(
            np.log(np.einsum("aan->an", factor(base["covariance"][used]))).sum()
        )
        count = len(found["information"])
        size = count + len(changes)
        score, information = np.empty(size), np.empty((size, size))
        score[:count] = found["products"][0]
        information[:count, :count] = found["information"]
        information[count:, :count] = found["products"][1:]
        information[:count, count:] = found["products"][1:].T
        # A noise changes the predictions and S: with w white and V = L^-1 dS L^-T the score is
        # dw' w + (w' V w - tr V) / 2, the expected information dw' dw + tr(V V) / 2.
        for k, (change, spread) in enumerate(zip(changes, spreads, strict=True)):
            bent = np.einsum("abn,na,nb->", spread, white, white, optimize=True)
            score[count + k] = (change * white).sum() + 0.5 * (bent - np.einsum("aan->", spread))
            for other in range(len(changes)):
                information[count + k, count + other] = (change * changes[other]).sum() + 0.5 * (
                    spread * spreads[other]
                ).sum()
        return Sums(deviance, score, information, int(used.sum()))

    def _sums_of_flow(self, series: Series, point: Point) -> Sums:
        """Return the sums of coefficients and ln C_d alone, from a single pass."""
        kernel = self.kernel(series, point, sensitivities=True)
        found = kernel.sums(None, None, pooled=series.pooled)
        used = used_of(found)
        root = factor(found["covariance"][used])
        white = forward(root, found["innovation"][used].T)
        deviance = 0.5 * float((white**2).sum()) + float(np.log(np.einsum("aan->an", root)).sum())
        return Sums(deviance, found["products"][0], found["information"], int(used.sum()))

    def innovations(self, point: Point) -> list[tuple[Floats, Bools]]:
        """Return each recording's whitened innovations, shape (n, D), and which were used.

        D is 3 with the angle in the state, else 2. The innovation of a missing angle is 0.
        """
        found = [self._errors(series, point.in_flow(series.flow)) for series in self.series]
        return [(whitened(one), used_of(one)) for one in found]

    def states(self, series: Series, point: Point) -> Floats:
        """Return coordinates and velocities after each sample, shape (n, 2 D); NaN without."""
        return np.asarray(self.run(series, point)["state"])

    def strength_products(self, series: Series, point: Point) -> tuple[Floats, Floats, Floats]:
        """Return products of the errors with their derivatives by the flow's strength, and squares.

        Shapes (n,); the whitened errors themselves come third, (n, D). 0 where a sample is not
        used.
        """
        base = self._errors(series, point)
        (pair,) = self._pairs(series, point, ["strength_0"], base)
        used = pair.comparable
        white, (change,), _ = noise_derivatives(base, [pair], used)
        products, squares = np.zeros(used.size), np.zeros(used.size)
        products[used] = (white * change).sum(axis=1)
        squares[used] = (change**2).sum(axis=1)
        errors = np.zeros((used.size, white.shape[1]))
        errors[used] = white
        return products, squares, errors

    def run(self, series: Series, point: Point) -> dict[str, Any]:
        """Return innovations, covariances and states of a pass over one series."""
        return dict(self.kernel(series, point).run(series.time.size))

    def _errors(self, series: Series, point: Point) -> dict[str, Any]:
        """Return innovations and covariances alone: the states are the larger half of a pass."""
        return dict(self.kernel(series, point).run(series.time.size, states=False))

    def kernel(self, series: Series, point: Point, *, sensitivities: bool = False) -> Any:
        """Return the native filter, before the first sample of a series."""
        body, spline = self.body, self.spline
        plain = ("water_acceleration", "water_spin", "drag_power", "force_memory")
        numbers: dict[str, Any] = {name: point.number(name) for name in plain}
        if point.log_lever is not None and point.log_angle_noise is not None:
            numbers["force_lever"] = math.exp(point.log_lever)
            numbers["angle_noise"] = math.exp(point.log_angle_noise)
        # Offsets of marker and angle move the data and not the model: the core knows the centre of
        # mass and the angle of the faces only.
        x, y, theta = corrected(series, point)
        share = point.number("linear_share")
        return _core.InnovationsFilter(
            series.time,
            x,
            y,
            theta,
            series.omega,
            series.excluded,
            **body.native(point),
            **vars(spline),
            coefficients=np.ascontiguousarray(
                point.coefficients.reshape(-1, spline.rows, spline.columns)
            ),
            drag_coefficient=math.exp(point.log_drag),
            noise_intensity=math.exp(point.log_intensity),
            position_noise=math.exp(point.log_noise),
            largest_step=FILTER.largest_step_s,
            longest_gap=FILTER.longest_gap_s,
            sensitivities=sensitivities,
            strength=layer_strengths(series, point),
            quadratic=1.0 - share,
            # Linear drag acts on all four faces, windward or not: a quarter on each. At a speed of
            # one side of the block a second it is as strong as the quadratic one in its place.
            linear=0.25 * share * body.side,
            time_noise=math.sqrt(point.number("time_variance")),
            velocity_prior=series.velocity_prior,
            **numbers,
        )


def whitened(found: dict[str, Any]) -> Floats:
    """Return the whitened innovations of a pass, shape (n, D)."""
    white = forward(factor(found["covariance"]), found["innovation"].T).T
    # To the filter a missing angle is one measured where it was predicted, with an enormous error.
    return np.where(found["innovation"] == 0.0, 0.0, white)


def log_densities(passes: Passes, series: Series, point: Point) -> Floats:
    """Return the logarithm of the predicted density of each sample, shape (n,); NaN without one.

    Those that the filter takes for mistakes have one, too: a law pays for what it cannot predict.
    """
    found = passes.run(series, point)
    there = np.isfinite(found["innovation"]).all(axis=1) & (series.excluded == 0)
    root = factor(found["covariance"][there])
    white = forward(root, found["innovation"][there].T)
    size = len(white)
    density = np.full(there.size, np.nan)
    density[there] = -0.5 * (white**2).sum(axis=0) - np.log(np.einsum("aan->an", root)).sum(axis=0)
    return density - 0.5 * size * math.log(2.0 * math.pi)
