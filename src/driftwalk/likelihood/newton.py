"""The maximum of the penalised likelihood, by Gauss-Newton, and the smoothness of the flow.

Prior of the flow's coefficients: ``exp(-(lam_r c' R c + lam_s c' S c) / 2)`` per component, R and S
the roughness and the size of `driftwalk.likelihood.spline.penalties`; with several flows the
weights are the same for all. The two weights follow from the data: each step sets a weight to the
degrees of freedom that the data have taken from its prior, over ``c' R c`` or ``c' S c`` (MacKay's
fixed point of the evidence).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from driftwalk.core.run_stages import tell_nobody
from driftwalk.likelihood.filter_pass import Passes, Point, Sums
from driftwalk.likelihood.law.departures import NUMBERS
from driftwalk.likelihood.solution import cholesky
from driftwalk.likelihood.spline import Floats, penalties

PRIOR_DRAG = 0.5
"""Centre of the weak prior of C_d, and where the search begins."""
PRIOR_LOG_DRAG_STD = 0.7
Held = Sequence[Sequence[int]]
"""Parameters, counted from C_d on, that the first steps leave as they are."""
FROM_AFAR: Final[Held] = ((0, 2, 3, 4), (0,))
"""Flow and q have to settle before a step of C_d or of the other noises means anything."""
FROM_ANOTHER: Final[Held] = ((1, 2, 3, 4), (1, 2, 3, 4))
"""Where the search begins at the mode of other samples, the flow has to follow the new ones before
a step of the noises means anything."""
FROM_NEAR: Final[Held] = ()
PRIOR_LEVER = 0.01
"""Centre of the weak prior of the force's lever, in sides of the block, and its first value."""
NOTABLE_LEVER = 0.005
"""Lever of the force, in sides of the block, above which the turning is not that of the model: on
recordings of the model it comes out at 0.001 to 0.004, with angles 5 degrees off at 0.015."""
PRIOR_LOG_LEVER_STD = 1.0
PRIOR_ANGLE_NOISE = 0.01
"""Centre of the prior of the angle's noise [rad], so weak that it counts only where the turning is
so restless that nothing is known of the noise."""
PRIOR_LOG_ANGLE_NOISE_STD = 2.3
LEVER, ANGLE_NOISE = 3, 4
"""Places of the lever and of the angle's noise, counted from C_d on."""
MOST_LOG_STEP = 1.0
"""Of the lever and of the angle's noise."""
MOST_LOG_DRAG_STEP = 0.5
MOST_FACTOR = 10.0
"""By which q, r^2 or the weight of a penalty may change in a step."""
CLOSE = 0.25
"""Converged when the steps of C_d and the noises, and in the mean those of the coefficients, are
below this part of their standard deviations: what is left is a tenth of such a step."""
CLOSE_ENOUGH = 0.5
"""The same where a search of many more samples begins: what is saved here costs more there."""
MOST_LEFT: Final = 2.0
"""Standard deviations: an interval around a place further from the maximum does not hold it. A body
that is driven on a circle without any force was given up 5 to 80 away."""
CLOSE_NATS: Final = 1.0
"""Converged when a whole step would also raise the log likelihood by less than this. Hundreds of
coefficients may each move by a small part of their standard deviations and gain 100 nats together:
on the plateau at the edge of a narrow jet a search ended 170 nats above its minimum."""


@dataclass(frozen=True)
class Weights:
    """Weights of the two penalties."""

    roughness: float
    size: float


class Prior:
    """The prior of all parameters as a quadratic form."""

    def __init__(self, passes: Passes) -> None:
        self.roughness, self.size = penalties(passes.spline)
        self.log_lever = math.log(PRIOR_LEVER * passes.body.side)

    def matrix(self, weights: Weights) -> Floats:
        """Return the precision of one component's coefficients."""
        return weights.roughness * self.roughness + weights.size * self.size

    def add(self, sums: Sums, point: Point, weights: Weights) -> Sums:
        """Return the sums with the prior of the coefficients, of C_d and of the lever in them."""
        precision = self.matrix(weights)
        count = len(precision)
        coefficients = point.coefficients.reshape(-1, count)
        score, information = sums.score.copy(), sums.information.copy()
        pull = coefficients @ precision
        for component in range(len(coefficients)):
            part = slice(component * count, (component + 1) * count)
            information[part, part] += precision
            score[part] -= pull[component]
        deviance = sums.deviance + 0.5 * float((pull * coefficients).sum())
        drag = coefficients.size
        single = [(drag, point.log_drag - math.log(PRIOR_DRAG), PRIOR_LOG_DRAG_STD)]
        if point.log_lever is not None:
            single.append((drag + LEVER, point.log_lever - self.log_lever, PRIOR_LOG_LEVER_STD))
        if point.log_angle_noise is not None:
            off = point.log_angle_noise - math.log(PRIOR_ANGLE_NOISE)
            single.append((drag + ANGLE_NOISE, off, PRIOR_LOG_ANGLE_NOISE_STD))
        first = drag + 1 + len(point.noises)
        for index, (name, value) in enumerate(point.opened.items(), first):
            single.append((index, value - NUMBERS[name].model, NUMBERS[name].prior_std))
        for index, off, std in single:
            deviance += 0.5 * (off / std) ** 2
            # Without derivatives by the noises there is no row of the lever.
            if index < score.size:
                information[index, index] += 1.0 / std**2
                score[index] -= off / std**2
        return Sums(deviance, score, information, sums.used)

    def updated(self, weights: Weights, point: Point, covariance: Floats) -> Weights:
        """Return the weights after one step of the evidence's fixed point."""
        inverse = np.linalg.inv(self.matrix(weights))
        count = len(inverse)
        coefficients = point.coefficients.reshape(-1, count)
        parts = [
            covariance[k * count : (k + 1) * count, k * count : (k + 1) * count]
            for k in range(len(coefficients))
        ]
        new = []
        for old, form in ((weights.roughness, self.roughness), (weights.size, self.size)):
            prior = len(parts) * float((form * inverse).sum())
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
    deviance: float
    """Negative log likelihood with the priors, at the last step."""
    left: float = 0.0
    """How far Newton's whole step would have moved C_d, a noise or an opened number at the last
    step, in standard deviations: how far the maximum seems to be."""

    @property
    def lost(self) -> bool:
        """Whether the search was given up so far from a maximum that its numbers mean nothing."""
        return not self.converged and not self.left <= MOST_LEFT

    def value_of(self, name: str) -> tuple[float, float]:
        """Return a noise or an opened number, and its standard deviation by theory."""
        extras = self.point.extras
        at = self.point.coefficients.size + 1 + list(extras).index(name)
        return extras[name], math.sqrt(float(self.covariance[at, at]))


def known_numbers_variance(mode: Mode) -> float:
    """Return the variance of ln C_d by theory, were the opened numbers known."""
    drag = mode.point.coefficients.size
    first = drag + 1 + len(mode.point.noises)
    own = mode.covariance[drag, drag]
    if first == len(mode.covariance):
        return float(own)
    across = mode.covariance[drag, first:]
    return float(own - across @ np.linalg.solve(mode.covariance[first:, first:], across))


Tell = Callable[[int, int, str], None]
Passed = Callable[[float], None]
"""Hears of work as it is done, see `work_of_pass`."""
BESIDE_SAMPLES: Final = 2000
"""A pass takes as much time besides its samples as that of so many (the bundled recording, and the
first 100 and 300 s of it)."""


def work_of_pass(passes: Passes) -> float:
    """Return the work of one pass of the filter with derivatives, in samples."""
    return float(sum(one.time.size for one in passes.series) + BESIDE_SAMPLES)


def find_mode(
    passes: Passes,
    start: Point,
    weights: Weights,
    prior: Prior,
    *,
    iterations: int,
    passed: Passed = tell_nobody,
    held: Held = FROM_AFAR,
    close: float = CLOSE,
    close_nats: float = CLOSE_NATS,
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
    passed : callable
        Called after every pass of the filter with its work.
    held : sequence of sequence of int
        Parameters that the first steps leave as they are: `FROM_AFAR`, `FROM_ANOTHER` or
        `FROM_NEAR`.
    close : float
        The search ends when its steps are below this part of the standard deviations,
    close_nats : float
        and when a whole step would gain less than this [nat].
    """
    point, used, converged = start, 0, False
    covariance = np.zeros((0, 0))
    deviance = ahead = math.inf
    last = np.zeros(start.coefficients.size + 1 + len(start.extras))
    for index in range(iterations):
        drag = point.coefficients.size
        left = [drag + k for k in (held[index] if index < len(held) else ())]
        left = [one for one in left if one <= drag + len(point.noises)]
        others = range(drag + 1, drag + 1 + len(point.extras))
        moving = "without" if set(others) <= set(left) else "with"
        sums = _of_all(prior.add(passes.sums(point, noise=moving), point, weights), last.size)
        passed(work_of_pass(passes))
        used, deviance = sums.used, sums.deviance
        covariance = inverse(sums.information)
        whole = newton_step(sums, covariance, held=left)
        step = limited(whole, drag, list(point.opened))
        step = last = damped(step, last, sums.information)
        point = point.moved(step)
        weights = prior.updated(weights, point, covariance)
        stds = np.sqrt(np.diag(covariance))
        moves, ways = np.abs(step) / stds, np.abs(whole) / stds
        # A lever that is known from its prior alone may go to and fro without moving anything else.
        if point.log_lever is not None:
            moves[drag + LEVER] = ways[drag + LEVER] = 0.0
        ahead = float(ways[drag:].max())
        near = max(float(moves[drag:].max()), float(np.sqrt((moves[:drag] ** 2).mean())))
        gain = 0.5 * float(sums.score @ covariance @ sums.score)
        if len(left) == 0 and near < close and gain < close_nats:
            converged = True
            break
    return Mode(point, weights, covariance, used, index + 1, converged, deviance, ahead)


def _of_all(sums: Sums, count: int) -> Sums:
    """Return the sums with rows of parameters that have no derivatives, and no step, behind."""
    information, score = np.eye(count), np.zeros(count)
    known = sums.score.size
    information[:known, :known], score[:known] = sums.information, sums.score
    return sums._replace(score=score, information=information)


def newton_step(sums: Sums, covariance: Floats, *, held: Sequence[int] = ()) -> Floats:
    """Return the Gauss-Newton step, the best one that leaves the `held` parameters as they are."""
    step = covariance @ sums.score
    if held:
        at = list(held)
        step = step - covariance[:, at] @ np.linalg.solve(covariance[np.ix_(at, at)], step[at])
    return np.asarray(step)


def damped(step: Floats, last: Floats, information: Floats) -> Floats:
    """Return the step, shortened where it takes back the last one.

    Gauss and Newton's step leaves out how the derivatives change; where they change much it goes
    too far, and back again. If a step is lambda times the last one, lambda < 0, then the sum of all
    the steps to come is 1 / (1 - lambda) of it.
    """
    length = float(last @ information @ last)
    ratio = float(step @ information @ last) / length if length > 0.0 else 0.0
    return step / (1.0 - ratio) if ratio < 0.0 else step


def limited(step: Floats, drag: int, opened: Sequence[str] = ()) -> Floats:
    """Return the step, shortened where it would jump, with q and r taken as factors.

    The step is the same whether it is made in the logarithm of a variance or in the variance; made
    in the variance it finds a wrong one in one step, from whatever side. Lever and noise of the
    angle are another matter: they may be known from their priors alone, which are those of
    logarithms.

    Parameters
    ----------
    step : ndarray
        In (coefficients, ln C_d, noises, numbers).
    drag : int
        Where ln C_d stands in it.
    opened : sequence of str
        The numbers, at its end.
    """
    shorter = step * min(1.0, MOST_LOG_DRAG_STEP / max(abs(float(step[drag])), 1e-300))
    for index, power in ((1, 1.0), (2, 2.0)):
        factor = np.clip(1.0 + power * step[drag + index], 1.0 / MOST_FACTOR, MOST_FACTOR)
        shorter[drag + index] = math.log(factor) / power
    numbers = step.size - len(opened)
    levers = slice(drag + LEVER, numbers)
    shorter[levers] = np.clip(step[levers], -MOST_LOG_STEP, MOST_LOG_STEP)
    for index, name in enumerate(opened, numbers):
        most = NUMBERS[name].most
        shorter[index] = min(max(float(step[index]), -most), most)
    return np.asarray(shorter)


def inverse(information: Floats) -> Floats:
    """Return the inverse of a symmetric positive definite matrix."""
    from scipy.linalg import cho_solve

    return np.asarray(cho_solve(cholesky(information), np.eye(len(information))))
