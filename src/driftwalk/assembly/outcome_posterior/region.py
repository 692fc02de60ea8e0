"""Posteriors on a sample of the prior, their regions, and the self-check of their coverage."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from driftwalk.core.arrays import Bools, Floats


class CredibleRegionPolicy(NamedTuple):
    """How regions are stated, and when they are not."""

    confidence: float = 0.9
    """Of intervals and regions; by convention the same in all of driftwalk."""
    slack: float = 2.35
    """Standard errors by which the coverage in the self-check may be smaller: to 85 % with 200
    truths. Of exact regions, 1 % are smaller by chance."""
    powers: tuple[float, ...] = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3)
    """Powers of the likelihood that are tried; below that, none is offered; chosen by hand."""
    tried: int = 41
    """Intervals of which the shortest is taken; chosen by hand."""
    prior_like: float = 0.8
    """A parameter whose interval is this part of the prior's one is not determined; chosen by
    hand."""
    edge: float = 0.01
    """Share of a range within which an end of an interval is that of the range; chosen by hand."""
    least_p: float = 0.01
    """p-value of the outcomes below which no region is stated: one false alarm in a hundred. With
    few data sets in the self-check, less than all of them."""


CREDIBLE_REGION = CredibleRegionPolicy()


def weights_of(log_likelihood: Floats, *, power: float = 1.0) -> Floats:
    """Return posterior weights of a sample of the prior, shape (..., point)."""
    weight = np.exp(power * (log_likelihood - log_likelihood.max(axis=-1, keepdims=True)))
    return np.asarray(weight / weight.sum(axis=-1, keepdims=True))


def quantiles_of(point: Floats, weight: Floats, at: Floats) -> Floats:
    """Return quantiles of a weighted sample, shape (..., parameter, quantile).

    The weights have shape (..., point).
    """
    found = np.empty((*weight.shape[:-1], point.shape[1], len(at)))
    for k, values in enumerate(point.T):
        order = np.argsort(values)
        own = weight[..., order]
        # The middle of each point's share, so that a uniform sample has its own quantiles.
        below = np.cumsum(own, axis=-1) - 0.5 * own
        for row in np.ndindex(weight.shape[:-1]):
            # The prior begins and ends with its range.
            share, place = np.r_[0.0, below[row], 1.0], np.r_[0.0, values[order], 1.0]
            found[(*row, k)] = np.interp(at, share, place)
    return found


def intervals_of(point: Floats, weight: Floats) -> Floats:
    """Return lower end, median and upper end of the shortest intervals, (..., parameter, 3).

    Where a posterior lies at an end of its range, the interval begins there.
    """
    policy = CREDIBLE_REGION
    low = np.linspace(0.0, 1.0 - policy.confidence, policy.tried)
    found = quantiles_of(point, weight, np.r_[low, low + policy.confidence, 0.5])
    first, last = found[..., : low.size], found[..., low.size : -1]
    best = np.argmin(last - first, axis=-1)[..., None]
    ends = [np.take_along_axis(one, best, axis=-1) for one in (first, last)]
    return np.concatenate([ends[0], found[..., -1:], ends[1]], axis=-1)


class Coverage(NamedTuple):
    """Result of the self-check for one kind of data."""

    power: float
    """Power of the likelihood with which regions hold; NaN where none does."""
    joint: float
    """Share of the truths in their joint region, with that power or else the last one."""
    marginal: Floats
    """Share of the truths in their intervals, shape (parameter,)."""
    width: Floats
    """Median width of the intervals over that of the prior, shape (parameter,)."""

    @property
    def offered(self) -> bool:
        """Whether regions from this kind of data are stated."""
        return bool(np.isfinite(self.power))


def covered(
    point: Floats, truth: Floats, log_likelihood: Floats, own: Floats, *, power: float
) -> tuple[Bools, Bools, Floats]:
    """Return which truths lie in their regions and intervals, and how wide the intervals are.

    Parameters
    ----------
    point : ndarray, shape (points, parameters)
        Sample of the prior.
    truth : ndarray, shape (truths, parameters)
        Parameters of the data sets.
    log_likelihood : ndarray, shape (truths, points)
        Of each data set at the points.
    own : ndarray, shape (truths,)
        Of each data set at its truth.
    power : float
        Power of the likelihood.

    Returns
    -------
    tuple of ndarray
        Shapes (truth,), (truth, parameter), (truth, parameter).
    """
    weight = weights_of(log_likelihood, power=power)
    denser = np.where(log_likelihood > own[:, None], weight, 0.0).sum(axis=1)
    low, _, high = np.moveaxis(intervals_of(point, weight), -1, 0)
    return denser <= CREDIBLE_REGION.confidence, (low <= truth) & (truth <= high), high - low


def log_score(log_likelihood: Floats, own: Floats, *, power: float) -> float:
    """Return the mean logarithm of the posterior density at the truths, over that of the prior.

    Parameters as of `covered`. No density has a larger mean than that from which truths are drawn
    (Good 1952), so that it chooses between powers.
    """
    most = log_likelihood.max(axis=1)
    whole = np.exp(power * (log_likelihood - most[:, None])).mean(axis=1)
    return float((power * (own - most) - np.log(whole)).mean())


def self_check(point: Floats, truth: Floats, log_likelihood: Floats, own: Floats) -> Coverage:
    """Return the power of the likelihood that suits the truths best, smaller if regions need it.

    A power below one widens the posterior. Parameters as of `covered`.
    """
    policy, tried = CREDIBLE_REGION, None
    nominal = policy.confidence
    least = nominal - policy.slack * np.sqrt(nominal * (1.0 - nominal) / len(truth))
    scores = [log_score(log_likelihood, own, power=power) for power in policy.powers]
    for power in policy.powers[int(np.argmax(scores)) :]:
        joint, marginal, width = covered(point, truth, log_likelihood, own, power=power)
        part = np.median(width, axis=0) / policy.confidence
        tried = Coverage(power, float(joint.mean()), marginal.mean(axis=0), part)
        if min(tried.joint, *tried.marginal) >= least:
            return tried
    assert tried is not None
    return tried._replace(power=np.nan)
