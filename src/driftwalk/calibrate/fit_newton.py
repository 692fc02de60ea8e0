"""The maximum of the penalised likelihood, by Gauss-Newton, and the smoothness of the flow.

Prior of the flow's coefficients: ``exp(-(lam_r c' R c + lam_s c' S c) / 2)`` per component, R and S
the roughness and the size of `driftwalk.calibrate.fit_spline.penalties`. The two weights follow
from the data: each step sets a weight to the degrees of freedom that the data have taken from its
prior, over ``c' R c`` or ``c' S c`` (MacKay's fixed point of the evidence).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from driftwalk.calibrate.fit_pass import Passes, Point, Sums
from driftwalk.calibrate.fit_spline import Floats, penalties

PRIOR_DRAG = 0.5
"""Centre of the weak prior of C_d, and where the search begins."""
PRIOR_LOG_DRAG_STD = 0.7
HELD = ((-3, -1), (-3,))
"""Parameters (from the end) that the first steps leave as they are: flow and q have to settle
before a step of C_d or r means anything."""
MOST_LOG_DRAG_STEP = 0.5
MOST_FACTOR = 10.0
"""By which q, r^2 or the weight of a penalty may change in a step."""
CLOSE = 0.1
"""Converged when the steps of C_d, q and r, and in the mean those of the coefficients, are below
this part of their standard deviations."""


@dataclass(frozen=True)
class Weights:
    """Weights of the two penalties."""

    roughness: float
    size: float


class Prior:
    """The prior of all parameters as a quadratic form."""

    def __init__(self, passes: Passes) -> None:
        self.roughness, self.size = penalties(passes.spline)

    def matrix(self, weights: Weights) -> Floats:
        """Return the precision of one component's coefficients."""
        return weights.roughness * self.roughness + weights.size * self.size

    def add(self, sums: Sums, point: Point, weights: Weights) -> Sums:
        """Return the sums with the prior of the coefficients and of C_d in them."""
        precision = self.matrix(weights)
        count = len(precision)
        coefficients = point.coefficients.reshape(2, -1)
        score, information = sums.score.copy(), sums.information.copy()
        pull = coefficients @ precision
        for component in range(2):
            part = slice(component * count, (component + 1) * count)
            information[part, part] += precision
            score[part] -= pull[component]
        off = point.log_drag - math.log(PRIOR_DRAG)
        drag = 2 * count
        information[drag, drag] += 1.0 / PRIOR_LOG_DRAG_STD**2
        score[drag] -= off / PRIOR_LOG_DRAG_STD**2
        deviance = sums.deviance + 0.5 * float((pull * coefficients).sum())
        deviance += 0.5 * (off / PRIOR_LOG_DRAG_STD) ** 2
        return Sums(deviance, score, information, sums.used)

    def updated(self, weights: Weights, point: Point, covariance: Floats) -> Weights:
        """Return the weights after one step of the evidence's fixed point."""
        inverse = np.linalg.inv(self.matrix(weights))
        coefficients = point.coefficients.reshape(2, -1)
        count = len(inverse)
        parts = [
            covariance[k * count : (k + 1) * count, k * count : (k + 1) * count] for k in (0, 1)
        ]
        new = []
        for old, form in ((weights.roughness, self.roughness), (weights.size, self.size)):
            prior = 2.0 * float((form * inverse).sum())
            posterior = sum(float((form * part).sum()) for part in parts)
            value = float(np.einsum("ka,ab,kb->", coefficients, form, coefficients))
            wanted = old * (prior - posterior) / max(value, 1e-300)
            new.append(float(np.clip(wanted, old / MOST_FACTOR, old * MOST_FACTOR)))
        return Weights(*new)


@dataclass(frozen=True, eq=False)
class Mode:
    """Where the search has come to."""

    point: Point
    weights: Weights
    covariance: Floats
    """Of all parameters, at the last step."""
    used: int
    iterations: int
    converged: bool


Tell = Callable[[int, int, str], None]


def find_mode(
    passes: Passes, start: Point, weights: Weights, prior: Prior, *, iterations: int, tell: Tell
) -> Mode:
    """Search the maximum of the penalised likelihood.

    Parameters
    ----------
    passes : Passes
        The filter.
    start : Point
        Where to begin.
    weights : Weights
        Of the penalties, at the beginning.
    prior : Prior
        Their forms.
    iterations : int
        Most steps.
    tell : callable
        Told the number of steps done, the most, and what is done.
    """
    point, used, converged = start, 0, False
    covariance = np.zeros((0, 0))
    for index in range(iterations):
        tell(index, iterations, "likelihood")
        sums = prior.add(passes.sums(point), point, weights)
        used = sums.used
        held = HELD[index] if index < len(HELD) else ()
        covariance = inverse(sums.information)
        step = limited(newton_step(sums, covariance, held=held))
        point = point.moved(step)
        weights = prior.updated(weights, point, covariance)
        moves = np.abs(step) / np.sqrt(np.diag(covariance))
        near = max(float(moves[-3:].max()), float(np.sqrt((moves[:-3] ** 2).mean())))
        if len(held) == 0 and near < CLOSE:
            converged = True
            break
    return Mode(point, weights, covariance, used, index + 1, converged)


def newton_step(sums: Sums, covariance: Floats, *, held: Sequence[int] = ()) -> Floats:
    """Return the Gauss-Newton step, the best one that leaves the `held` parameters as they are."""
    step = covariance @ sums.score
    if held:
        at = list(held)
        step = step - covariance[:, at] @ np.linalg.solve(covariance[np.ix_(at, at)], step[at])
    return np.asarray(step)


def limited(step: Floats) -> Floats:
    """Return the step, shortened where C_d would jump, with those of q and r^2 taken as factors.

    The step is the same whether it is made in ln q or in q; made in q it finds a wrong variance in
    one step, from whatever side.
    """
    shorter = step * min(1.0, MOST_LOG_DRAG_STEP / max(abs(float(step[-3])), 1e-300))
    factors = np.clip(1.0 + step[-2:] * (1.0, 2.0), 1.0 / MOST_FACTOR, MOST_FACTOR)
    shorter[-2:] = np.log(factors) / (1.0, 2.0)
    return np.asarray(shorter)


def inverse(information: Floats) -> Floats:
    """Return the inverse of a symmetric positive definite matrix."""
    from scipy.linalg import cho_factor, cho_solve

    factor = cho_factor(information)
    return np.asarray(cho_solve(factor, np.eye(len(information))))
