"""How much of the restricted likelihood's correction is due where velocities do not forget.

With dv = -kappa (v - phi'c) dt + sigma dW, c fitted and A the information on c with its prior in
M = (A + Lambda)^-1, the score of ln kappa at the fitted c is too large by

    tr(M B),   B = integral of kappa_t^2 phi_t psi_t' / q,   dpsi/dt = kappa (phi - psi)

to first order; psi is what the velocity remembers of the flow. The slope of ln det / 2 in the
restricted likelihood is tr(M A), which is the same only where the velocity forgets faster than the
body crosses the support of a coefficient (Nickell 1981).

The prior pulls the fitted c from the true one by M Lambda c, which adds

    tr(M A M Lambda) - c' Lambda M A M Lambda c + D' M Lambda c

with D = -integral of kappa_t^2 (v - phi'c) phi / q, the information that c shares with ln kappa. Of
flows as the prior has them all of it is tr(M A) on average: the restricted likelihood is right.
Real flows are smoother, so the sum is that of the fitted c.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from driftwalk.core.arrays import Bools, Floats
from driftwalk.likelihood.filter.filter_pass import Passes, Sums
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.filter.series import FILTER, Series
from driftwalk.likelihood.spline import Spline, basis_matrix

BLOCK = 4096
"""Samples whose bases are held at once."""


class Pull(NamedTuple):
    """What the prior's pull on the coefficients adds to the score of ln C_d."""

    slope: float = 0.0
    """D' M Lambda c."""
    share: float = 0.0
    """The rest, as a share of tr(M A)."""


def pull_of_prior(sums: Sums, added: Sums, factor: Any, step: Floats, part: float = 1.0) -> Pull:
    """Return what the pull adds at `step` from the coefficients of the sums, a part of it.

    `added` are the sums with the prior in them, `factor` the Cholesky factor of their information
    on the coefficients.
    """
    from scipy.linalg import cho_solve

    information = sums.information[:-1, :-1]
    prior = added.information[:-1, :-1] - information
    away = cho_solve(factor, sums.score[:-1] - added.score[:-1] + prior @ step)
    lost = cho_solve(factor, prior)
    both = float(np.trace(lost) - np.sum(lost * lost.T))
    whole = len(lost) - float(np.trace(lost))
    return Pull(
        part * float(sums.information[-1, :-1] @ away),
        part * (both - float(away @ information @ away)) / whole,
    )


def due_share(passes: Passes, prior: Floats, point: Point) -> float:
    """Return tr(M B) / tr(M A) at a point, of a disc: its drag depends on the slip alone.

    `prior` is Lambda of one component. Of a flow in layers the mean counts.
    """
    due = whole = 0.0
    for flow in range(passes.flows):
        one, other = (np.zeros_like(prior) for _ in range(2))
        for series in passes.series:
            if series.flow == flow:
                _add_series(passes, series, point.in_flow(flow), one, other)
        weight = np.linalg.inv(one + prior)
        due += float(np.sum(weight * other.T))
        whole += float(np.sum(weight * one))
    return due / whole


def _add_series(passes: Passes, series: Series, point: Point, one: Floats, other: Floats) -> None:
    """Add A and B of a series."""
    body, spline = passes.body, passes.spline
    # Many samples within a tenth of a second tell the same.
    states, time = passes.states(series, point)[:: series.pooled], series.time[:: series.pooled]
    excluded = np.maximum.reduceat(series.excluded, np.arange(0, series.time.size, series.pooled))
    mean = point.coefficients.reshape(-1, spline.size)[:2]
    scale = 0.5 * body.water_density * body.side * body.depth / body.mass
    step = np.diff(time, prepend=time[0])
    seen = np.asarray(np.isfinite(states).all(axis=1))
    states = np.where(seen[:, None], states, 0.0)
    lost = np.any([excluded != 0, ~seen, step > FILTER.longest_gap_s], axis=0)
    memory = np.zeros(spline.size)
    for begin in range(0, time.size, BLOCK):
        part = slice(begin, begin + BLOCK)
        rows = _bases(spline, states[part, 0], states[part, 1])
        slip = np.hypot(*(mean @ rows.T - states[part, 2:].T))
        # Along the slip the drag k |w| w pulls with 2 k |w|, across it with k |w|: their mean.
        rate = 1.5 * scale * math.exp(point.log_drag) * slip
        kept, memory = remembered(rows, rate * step[part], lost[part], memory)
        gains = np.where(lost[part], 0.0, rate**2 * step[part] / math.exp(point.log_intensity))
        one += rows.T @ (gains[:, None] * rows)
        other += rows.T @ (gains[:, None] * kept)


def remembered(rows: Floats, turns: Floats, lost: Bools, memory: Floats) -> tuple[Floats, Floats]:
    """Return the means of psi over steps of constant phi, shape (n, coefficients), and psi after.

    `turns` are the lengths of the steps in memory times, (n,); nothing is remembered over a step
    that is lost.
    """
    left = np.where(lost, 0.0, np.exp(-turns))
    share = np.where(turns > 1e-9, -np.expm1(-turns) / np.maximum(turns, 1e-9), 1.0)
    kept = np.empty_like(rows)
    for k, row in enumerate(rows):
        kept[k] = share[k] * memory + (1.0 - share[k]) * row
        memory = np.zeros_like(memory) if lost[k] else left[k] * memory + (1.0 - left[k]) * row
    return kept, memory


def _bases(spline: Spline, x: Floats, y: Floats) -> Floats:
    """Return all basis functions at places, shape (n, coefficients of one component)."""
    along_x = basis_matrix((x - spline.origin_x) / spline.spacing, spline.columns)
    along_y = basis_matrix((y - spline.origin_y) / spline.spacing, spline.rows)
    return (along_y[:, :, None] * along_x[:, None, :]).reshape(x.size, -1)
