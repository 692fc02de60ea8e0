"""How much of the restricted likelihood's correction is due where velocities do not forget.

With dv = -kappa (v - phi'c) dt + sigma dW, c fitted and A the information on c with its prior in
M = (A + Lambda)^-1, the score of ln kappa at the fitted c is too large by

    tr(M B),   B = integral of kappa_t^2 phi_t psi_t' / q,   dpsi/dt = kappa (phi - psi)

to first order; psi is what the velocity remembers of the flow. The slope of ln det / 2 in the
restricted likelihood is tr(M A), which is the same only where the velocity forgets faster than the
body crosses the support of a coefficient (Nickell 1981).
"""

from __future__ import annotations

import math

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.likelihood.filter.filter_pass import Passes
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.filter.series import FILTER, Series
from driftwalk.likelihood.newton import Mode, ModeSearch
from driftwalk.likelihood.spline import basis_matrix


def due_share(search: ModeSearch, mode: Mode) -> float:
    """Return tr(M B) / tr(M A) at a mode; for a disc, whose drag is that of its slip.

    A flow in layers or in intervals counts with the mean of each.
    """
    passes, point = search.passes, mode.point
    prior = search.prior.matrix(mode.weights)
    due = whole = 0.0
    for flow in range(passes.flows):
        one, other = (np.zeros_like(prior) for _ in range(2))
        for series in passes.series:
            if series.flow == flow:
                rows, kept, gains = _memory(passes, series, point.in_flow(flow))
                one += rows.T @ (gains[:, None] * rows)
                other += rows.T @ (gains[:, None] * kept)
        weight = np.linalg.inv(one + prior)
        due += float(np.sum(weight * other.T))
        whole += float(np.sum(weight * one))

    return due / whole


def _memory(passes: Passes, series: Series, point: Point) -> tuple[Floats, Floats, Floats]:
    """Return phi and psi, shape (n, coefficients), and kappa^2 dt / q, (n,), at the samples."""
    body, spline = passes.body, passes.spline
    state = passes.states(series, point)
    seen = np.isfinite(state).all(axis=1)
    x, y, vx, vy = np.where(seen[:, None], state, 0.0).T
    along_x = basis_matrix((x - spline.origin_x) / spline.spacing, spline.columns)
    along_y = basis_matrix((y - spline.origin_y) / spline.spacing, spline.rows)
    rows = (along_y[:, :, None] * along_x[:, None, :]).reshape(x.size, -1)
    mean = point.coefficients.reshape(-1, spline.size)[:2]
    slip = np.hypot(*(mean @ rows.T - np.stack([vx, vy])))
    scale = 0.5 * body.water_density * body.side * body.depth / body.mass
    # Along the slip the drag k |w| w pulls with 2 k |w|, across it with k |w|: their mean.
    rate = 1.5 * scale * math.exp(point.log_drag) * slip
    step = np.diff(series.time, prepend=series.time[0])
    lost = (series.excluded != 0) | ~seen | (step > FILTER.longest_gap_s)
    gains = np.where(lost, 0.0, rate**2 * step / math.exp(point.log_intensity))
    left = np.where(lost, 0.0, np.exp(-rate * step))
    kept = np.zeros_like(rows)
    memory = np.zeros(rows.shape[1])
    for k in range(1, len(rows)):
        # The mean of psi over the step, of a phi that is constant in it.
        ahead = left[k] * memory + (1.0 - left[k]) * rows[k]
        kept[k] = rows[k] if lost[k] else _mean(memory, rows[k], left[k], rate[k] * step[k])
        memory = ahead if not lost[k] else np.zeros_like(memory)
    return rows, kept, gains


def _mean(memory: Floats, row: Floats, left: float, turns: float) -> Floats:
    """Return the mean of psi over a step of so many memory times."""
    share = (1.0 - left) / turns if turns > 1e-9 else 1.0
    return share * memory + (1.0 - share) * row
