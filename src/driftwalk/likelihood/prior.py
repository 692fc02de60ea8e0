"""The prior: smoothness of the flow, and weak normal priors of ln C_d, lever and angle noise.

Prior of the flow's coefficients: ``exp(-(lam_r c' R c + lam_s c' S c) / 2)`` per component, R and S
the roughness and the size of `driftwalk.likelihood.spline.penalties`; with several flows the
weights are the same for all. The two weights follow from the data: each step sets a weight to the
degrees of freedom that the data have taken from its prior, over ``c' R c`` or ``c' S c`` (MacKay's
fixed point of the evidence). A measured flow (`driftwalk.likelihood.measured_flow`) adds what it
says of the coefficients.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.likelihood.filter.filter_pass import Passes, Sums
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.law.candidate_laws import NUMBERS
from driftwalk.likelihood.measured_flow import MeasuredFlow
from driftwalk.likelihood.spline import penalties

if TYPE_CHECKING:
    from driftwalk.model.rigid_bodies import RigidBody


class PriorPolicy(NamedTuple):
    """Centres and widths of the weak priors."""

    drag: float = 0.5
    """Centre of the prior of C_d, and where the search begins. Chosen by hand."""
    log_drag_std: float = 0.7
    """Standard deviation of ln C_d: within a factor of two. Chosen by hand."""
    lever: float = 0.01
    """Centre of the prior of the force's lever, in sides of the block, and its first value. On
    recordings of the model it comes out at 0.001 to 0.004 (docs/explanation/likelihood.md)."""
    log_lever_std: float = 1.0
    """Within a factor of three. Chosen by hand."""
    angle_noise: float = 0.01
    """Centre of the prior of the angle's noise [rad]. Chosen by hand: half a degree."""
    log_angle_noise_std: float = 2.3
    """A factor of ten: it counts only where the turning is so restless that nothing is known of the
    noise. Chosen by hand."""
    most_factor: float = 10.0
    """Largest factor by which q, r^2 or the weight of a penalty changes in a step. Chosen by
    hand."""


PRIOR: Final = PriorPolicy()
LEVER, ANGLE_NOISE = 3, 4
"""Places of the lever and of the angle's noise, counted from C_d on."""


@dataclass(frozen=True)
class Weights:
    """Weights of the two penalties."""

    roughness: float
    size: float
    determined: float = 0.0
    """Coefficients that a measured flow of uncertain scale determines."""
    modes: float = 1.0
    """Factor of both for the modes of the flow in time, which may be weaker than its mean."""


def usual_lever(side: float, outline: RigidBody) -> float:
    """Return the centre of the prior of the force's lever [m], and its first value."""
    return outline.force_lever_m() or PRIOR.lever * side


class Earlier(NamedTuple):
    """Posterior of an earlier fit in the same water: a normal law of coefficients and ln C_d."""

    centre: Floats
    precision: Floats
    weights: Weights
    """Those of its smoothness, which the precision holds."""


class Prior:
    """The prior of all parameters as a quadratic form.

    That of an earlier fit holds the smoothness of the flow and the prior of C_d already: weights
    have no effect then.
    """

    def __init__(
        self,
        passes: Passes,
        measured: MeasuredFlow | None = None,
        *,
        earlier: Earlier | None = None,
    ) -> None:
        self.measured, self.earlier = measured, earlier
        self.roughness, self.size = penalties(passes.spline)
        self.layers = passes.layers
        self.log_lever = math.log(usual_lever(passes.body.side, passes.body.outline))

    def matrix(self, weights: Weights) -> Floats:
        """Return the precision of one component's coefficients, of the modes' but for a factor."""
        return weights.roughness * self.roughness + weights.size * self.size

    def factors(self, weights: Weights, components: int) -> Floats:
        """Return the factor of that precision for each component of all flows or layers."""
        factors = np.ones(components)
        if self.layers > 1:
            factors[2:] = weights.modes
        return factors

    def log_determinant(self, weights: Weights, components: int) -> float:
        """Return the logarithm of the determinant of the precision of all coefficients."""
        one = float(np.linalg.slogdet(self.matrix(weights))[1])
        scales = np.log(self.factors(weights, components)).sum()
        return components * one + len(self.roughness) * float(scales)

    def add(self, sums: Sums, point: Point, weights: Weights) -> Sums:
        """Return the sums with the prior of the coefficients, of C_d and of the lever in them."""
        precision = self.matrix(weights)
        count = len(precision)
        coefficients = point.coefficients.reshape(-1, count)
        score, information = sums.score.copy(), sums.information.copy()
        factors = self.factors(weights, len(coefficients))
        if self.earlier is not None:
            factors = np.zeros_like(factors)
        pull = (factors[:, None] * coefficients) @ precision
        for component, factor in enumerate(factors):
            part = slice(component * count, (component + 1) * count)
            information[part, part] += factor * precision
            score[part] -= pull[component]
        deviance = sums.deviance + 0.5 * float((pull * coefficients).sum())
        drag = coefficients.size
        if self.measured is not None:
            off, force, curvature = self.measured.deviance(point.coefficients, weights.determined)
            deviance += off
            score[:drag] += force
            information[:drag, :drag] += curvature
        single = [(drag, point.log_drag - math.log(PRIOR.drag), PRIOR.log_drag_std)]
        if self.earlier is not None:
            away = np.append(point.coefficients.ravel(), point.log_drag) - self.earlier.centre
            pulled = self.earlier.precision @ away
            deviance += 0.5 * float(away @ pulled)
            score[: drag + 1] -= pulled
            information[: drag + 1, : drag + 1] += self.earlier.precision
            single = []
        if point.log_lever is not None:
            single.append((drag + LEVER, point.log_lever - self.log_lever, PRIOR.log_lever_std))
        if point.log_angle_noise is not None:
            off = point.log_angle_noise - math.log(PRIOR.angle_noise)
            single.append((drag + ANGLE_NOISE, off, PRIOR.log_angle_noise_std))
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
        if self.earlier is not None:
            return weights
        inverse = np.linalg.inv(self.matrix(weights))
        count = len(inverse)
        coefficients = point.coefficients.reshape(-1, count)
        parts = [
            covariance[k * count : (k + 1) * count, k * count : (k + 1) * count]
            for k in range(len(coefficients))
        ]
        steady = parts if self.layers == 1 else parts[:2]
        new = []
        for old, form in ((weights.roughness, self.roughness), (weights.size, self.size)):
            prior = len(steady) * float((form * inverse).sum())
            posterior = sum(float((form * part).sum()) for part in steady)
            of_steady = coefficients[: len(steady)]
            value = float(np.einsum("ka,ab,kb->", of_steady, form, of_steady))
            wanted = old * (prior - posterior) / max(value, 1e-300)
            new.append(float(np.clip(wanted, old / PRIOR.most_factor, old * PRIOR.most_factor)))
        determined = 0.0
        if self.measured is not None:
            determined = self.measured.determined(
                point.coefficients, covariance, weights.determined
            )
        if self.layers == 1:
            return Weights(new[0], new[1], determined)
        # The same step for the factor of the modes.
        form, modes = self.matrix(weights), coefficients[2:]
        taken = modes.size - weights.modes * sum(float((form * one).sum()) for one in parts[2:])
        value = float(np.einsum("ka,ab,kb->", modes, form, modes))
        least, most = weights.modes / PRIOR.most_factor, weights.modes * PRIOR.most_factor
        factor = float(np.clip(taken / max(value, 1e-300), least, most))
        return Weights(new[0], new[1], determined, factor)

    def log_scale(self, point: Point, weights: Weights) -> float:
        """Return what of the deviance goes with the scale of a measured flow alone.

        The determinant of the information goes with it as well, so criteria that hold both leave it
        out.
        """
        if self.measured is None:
            return 0.0
        k, _ = self.measured.scale(point.coefficients, weights.determined)
        return weights.determined * math.log(k)
