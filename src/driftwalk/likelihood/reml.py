"""C_d from the restricted likelihood, which allows for the flow being estimated along with it.

The maximum of the likelihood over C_d and hundreds of flow coefficients together gives too large a
C_d: the fitted flow takes up part of the scatter of the velocity, and what is left seems to be
pulled back to it more strongly (as a mean-reversion rate is biased upwards when means are
estimated). The restricted likelihood integrates the coefficients out instead. To first order
(Laplace) that adds ``ln det(J' J + Lambda) / 2`` of the coefficients' block of the information to
the profile of the negative log likelihood; its minimum over ln C_d is the estimate. The stochastic
force comes out too small in the same way, as a variance does when means are estimated, by one or
two parts in a hundred: one Newton step with the slope of the same determinant puts it right.

**How much of the correction is due** where velocities do not forget. With dv = -kappa (v - phi'c)
dt + sigma dW, c fitted and A the information on c with its prior in M = (A + Lambda)^-1, the score
of ln kappa at the fitted c is too large by

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
from dataclasses import replace
from typing import Any, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Bools, Floats
from driftwalk.likelihood.filter.filter_pass import Passes, Sums
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.filter.series import FILTER, Series
from driftwalk.likelihood.law.candidate_laws import INTENSITIES
from driftwalk.likelihood.newton import Mode, ModeSearch, known_numbers_variance
from driftwalk.likelihood.refuse import cholesky


class RemlPolicy(NamedTuple):
    """Where the restricted criterion is computed, and when it has a minimum."""

    span: float = 2.0
    """Standard deviations around the first guess of the minimum at which the profile is computed.
    Chosen by hand."""
    near: float = 1.0
    """A first guess within this many standard deviations of the likelihood's maximum is the
    minimum. Chosen by hand."""
    apart: float = 0.1
    """Profiles nearer than this many standard deviations say the same. Chosen by hand."""
    intensity_step: float = 0.05
    """Change of ln q for the slope of the determinant. Chosen by hand."""
    most_std_ratio: float = 4.0
    """A criterion that is this many times flatter or sharper than the likelihood has no minimum:
    the motion does not follow the model, or tells nothing of C_d. Chosen by hand."""
    true_pull: float = 0.67
    """The pull of a disc's prior on the true flow, over that on the fitted one, whose errors add to
    it. Measured on the first 29 recordings of known flow; it was not chosen by their C_d."""
    most_noise_move: float = 1.0
    """Largest move of ln(tracking noise) along the ridge of a criterion that has a minimum: beyond
    it nothing holds the noise. Chosen by hand: in recordings of the model it moves by some
    hundredths."""


REML: Final = RemlPolicy()


class Profile(NamedTuple):
    """The profile of the likelihood at one C_d."""

    log_drag: float
    deviance: float
    """Negative log likelihood, with the priors, at the best coefficients."""
    slope: float
    """Its derivative by ln C_d."""
    half_log_determinant: float
    """Of the coefficients' block of the information."""
    coefficients: Floats
    """The best coefficients, flat."""
    pull: Pull
    """Of the prior, on a disc's; else nothing."""


class Restricted(NamedTuple):
    """The minimum of the restricted criterion."""

    point: Point
    log_drag_std: float
    """From the curvature of the criterion."""
    profiles: list[Profile]
    """Where it was computed, in the order of C_d."""
    has_minimum: bool
    """Whether the criterion has a minimum; if not, point and std are the likelihood's."""


def profile_at(search: ModeSearch, mode: Mode, log_drag: float, coefficients: Floats) -> Profile:
    """Return the profile at a C_d, from one pass at coefficients that are nearly the best."""
    from scipy.linalg import cho_solve

    point = replace(
        mode.point,
        log_drag=log_drag,
        coefficients=coefficients.reshape(mode.point.coefficients.shape),
    )
    alone = search.passes.sums(point, noise="without")
    sums = search.prior.add(alone, point, mode.weights)
    factor = cholesky(sums.information[:-1, :-1])
    step = cho_solve(factor, sums.score[:-1])
    disc = search.passes.body.outline.disc_radius_m
    return Profile(
        log_drag,
        sums.deviance - 0.5 * float(step @ sums.score[:-1]),
        -float(sums.score[-1] - sums.information[-1, :-1] @ step),
        float(np.log(np.diag(factor[0])).sum()) - search.prior.log_scale(point, mode.weights),
        coefficients.ravel() + step,
        pull_of_prior(alone, sums, factor, step, REML.true_pull) if disc else Pull(),
    )


def restricted_drag(search: ModeSearch, mode: Mode, *, intensity: bool = True) -> Restricted:
    """Minimise the restricted criterion over ln C_d."""
    start = mode.point
    drag = start.coefficients.size
    # The profile takes the opened numbers for known.
    sd = math.sqrt(known_numbers_variance(mode))
    slopes = mode.covariance[:, drag] / mode.covariance[drag, drag]
    found = [profile_at(search, mode, start.log_drag, start.coefficients.ravel())]
    share = 1.0
    if search.passes.body.outline.disc_radius_m:
        share = due_share(search.passes, search.prior.matrix(mode.weights), start)
        share += found[0].pull.share

    def add_profile(log_drag: float) -> None:
        near = min(found, key=lambda one: abs(one.log_drag - log_drag))
        if abs(near.log_drag - log_drag) < REML.apart * sd:
            return
        guess = near.coefficients + slopes[:drag] * (log_drag - near.log_drag)
        found.append(profile_at(search, mode, log_drag, guess))

    add_profile(start.log_drag - REML.span * sd)
    # Two points give the slope of the determinant and with it a first guess of the minimum.
    guess, _ = _minimum(found, share)
    ends = start.log_drag - 2 * REML.span * sd, start.log_drag + REML.span * sd
    guess = float(np.clip(guess, *ends))
    if abs(guess - start.log_drag) > REML.near * sd:
        add_profile(guess)
        add_profile(guess - REML.span * sd)
    found.sort(key=lambda one: one.log_drag)
    log_drag, std = _minimum(found, share)
    if not sd / REML.most_std_ratio <= std <= sd * REML.most_std_ratio:
        return Restricted(start, sd, found, has_minimum=False)
    nearest = min(found, key=lambda one: abs(one.log_drag - log_drag))
    coefficients = _coefficients_at(found, nearest, log_drag)
    # The noises that belong to this C_d follow along the ridge of the likelihood.
    point = start.moved(slopes * (log_drag - start.log_drag))
    if abs(point.log_noise - start.log_noise) > REML.most_noise_move:
        return Restricted(start, sd, found, has_minimum=False)
    point = replace(
        point, log_drag=log_drag, coefficients=coefficients.reshape(start.coefficients.shape)
    )
    if intensity:
        point = _with_restricted_intensity(search, mode, point)
    return Restricted(point, std, found, has_minimum=True)


def _with_restricted_intensity(search: ModeSearch, mode: Mode, point: Point) -> Point:
    """Return the point after one Newton step in ln q of each flow on the restricted criterion.

    The other noises go along the ridge of the likelihood; their own slopes, and the slope of
    the lever, are too small to matter.
    """

    def determinant(at: Point) -> float:
        moved = replace(mode, point=at)
        found = profile_at(search, moved, point.log_drag, point.coefficients.ravel())
        return found.half_log_determinant

    here = determinant(point)
    drag = point.coefficients.size
    with_drag = mode.covariance[drag + 1 :, drag]
    step = np.zeros(drag + 1 + with_drag.size)
    for row, (name, value) in enumerate(point.extras.items()):
        if name != "log_intensity" and name not in INTENSITIES:
            continue
        there = determinant(point.with_extra(name, value + REML.intensity_step))
        slope = (there - here) / REML.intensity_step
        # Of the noises with this ln q, at this C_d.
        column = mode.covariance[drag + 1 :, drag + 1 + row] - with_drag * (
            with_drag[row] / mode.covariance[drag, drag]
        )
        step[drag + 1 :] -= column * slope
    return point.moved(step)


def _minimum(found: list[Profile], share: float = 1.0) -> tuple[float, float]:
    """Return the minimum of the criterion through some points, and its standard deviation.

    A share of the determinant's slope counts, and the pull of the prior
    (`driftwalk.likelihood.reml`).

    The standard deviation is infinite where there is no minimum near the points. The pull is not in
    it: with the true coefficients it hardly depends on C_d, so its slope is an error of the fitted.

    Of the likelihood only the slopes are used. They come from the predictions, as in the search;
    its values also hold what the covariances of the innovations have to say about C_d, which is
    wrong to the order in which a Kalman filter is.
    """
    centre = found[0].log_drag
    scale = max(abs(one.log_drag - other.log_drag) for one in found for other in found)
    at = (np.array([one.log_drag for one in found]) - centre) / scale
    degree = min(2, len(found) - 1)
    polynomial = np.polynomial.Polynomial
    slopes = [one.slope * scale for one in found]
    pulls = [one.pull.slope * scale for one in found]
    determinants = [
        share * (one.half_log_determinant - found[0].half_log_determinant) for one in found
    ]
    slope = polynomial.fit(at, slopes, degree).convert()
    slope = slope + polynomial.fit(at, determinants, degree).convert().deriv()
    steepness = slope.deriv()
    if any(pulls):
        slope = slope + polynomial.fit(at, pulls, degree).convert()
    lattice = np.linspace(at.min() - 0.5, at.max() + 0.5, 2001)
    values = slope(lattice)
    upward = np.flatnonzero((values[:-1] < 0.0) & (values[1:] >= 0.0))
    if not upward.size:
        downhill = -1 if values.sum() < 0.0 else 0
        return centre + scale * float(lattice[downhill]), math.inf
    best = lattice[upward[np.argmin(np.abs(lattice[upward]))]]
    curvature = float(steepness(best))
    std = scale / math.sqrt(curvature) if curvature > 0.0 else math.inf
    return centre + scale * float(best), std


def _coefficients_at(found: list[Profile], nearest: Profile, log_drag: float) -> Floats:
    """Return the best coefficients at a C_d on the line through the two nearest profiles."""
    others = [one for one in found if one is not nearest]
    second = min(others, key=lambda one: abs(one.log_drag - log_drag))
    share = (log_drag - nearest.log_drag) / (second.log_drag - nearest.log_drag)
    return nearest.coefficients + share * (second.coefficients - nearest.coefficients)


SAMPLES_AT_ONCE = 4096
"""Samples whose bases are held at once."""


class Pull(NamedTuple):
    """The part of the score of ln C_d that comes from the prior's pull on the coefficients."""

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
    study, spline = passes.body.study, passes.spline
    # Many samples within a tenth of a second tell the same.
    states, time = passes.states(series, point)[:: series.pooled], series.time[:: series.pooled]
    excluded = np.maximum.reduceat(series.excluded, np.arange(0, series.time.size, series.pooled))
    mean = point.coefficients.reshape(-1, spline.size)[:2]
    block, density = study.block, study.water.density_kg_m3
    scale = 0.5 * density * block.side_m * study.wetted_depth_m / block.mass_kg
    step = np.diff(time, prepend=time[0])
    seen = np.asarray(np.isfinite(states).all(axis=1))
    states = np.where(seen[:, None], states, 0.0)
    lost = np.any([excluded != 0, ~seen, step > FILTER.longest_gap_s], axis=0)
    memory = np.zeros(spline.size)
    for begin in range(0, time.size, SAMPLES_AT_ONCE):
        part = slice(begin, begin + SAMPLES_AT_ONCE)
        along_x, along_y = spline.design(states[part, 0], states[part, 1])
        rows = (along_y[:, :, None] * along_x[:, None, :]).reshape(len(along_x), -1)
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
