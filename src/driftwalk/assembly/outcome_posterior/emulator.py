"""Gaussian-process emulator of multinomial shares, which states its own error."""

from __future__ import annotations

from typing import NamedTuple, Self

import numpy as np

from driftwalk.core.arrays import Floats, Integers
from driftwalk.core.processors import one_blas_thread


class EmulatorPolicy(NamedTuple):
    """How the emulator is fitted and integrated."""

    pseudo_count: float = 0.5
    """Added to the count of each category: Jeffreys' prior of a multinomial; a closed form without
    tuning."""
    mean_variance: float = 25.0
    """Prior variance of the mean of a log share: e^5 up or down, so that the nodes decide; chosen
    by hand."""
    length: float = 0.3
    """Median of the prior of a length scale, in parts of a range; chosen by hand."""
    length_spread: float = 1.0
    """Its standard deviation in logarithms: a factor of e; chosen by hand."""
    draws: int = 64
    """Draws of the emulator's error, a power of two; chosen by hand."""
    at_once: int = 4_000_000
    """Log likelihoods held at a time: 32 MB. Chosen by hand."""


EMULATOR_POLICY = EmulatorPolicy()


class Emulator(NamedTuple):
    """Independent Gaussian processes of the logarithms of Gamma variables, one per category.

    A Dirichlet variable is Gamma variables over their sum. So with counts n of a node the logarithm
    of a category's Gamma variable has mean ψ(n + 1/2) and variance ψ'(n + 1/2) (the
    Dirichlet-based processes of Milios et al., NeurIPS 2018).
    """

    node: Floats
    """In parts of the ranges, shape (node, parameter)."""
    length: Floats
    """Length scales of the Matérn kernel, shape (category, parameter)."""
    variance: Floats
    """Its variances, shape (category,)."""
    factor: Floats
    """Cholesky factors of the covariances of the nodes, shape (category, node, node)."""
    solved: Floats
    """Inverse covariance times what the nodes say, shape (category, node)."""

    # Small matrices: more threads would mostly wait for each other.
    @classmethod
    @one_blas_thread()
    def fitted(cls, node: Floats, count: Integers) -> Self:
        """Return the emulator of the counts of nodes, by the largest posterior of its scales.

        Parameters
        ----------
        node : ndarray, shape (nodes, parameters)
            In parts of the ranges.
        count : ndarray of int, shape (nodes, categories)
            Simulated runs of each category.
        """
        from scipy.linalg import cho_solve
        from scipy.special import digamma, polygamma

        filled = count + EMULATOR_POLICY.pseudo_count
        said, noise = digamma(filled), polygamma(1, filled)
        rows = []
        for k in range(count.shape[1]):
            scales = _fitted_scales(node, said[:, k], noise[:, k])
            covariance = _kernel(node, node, scales) + np.diag(noise[:, k])
            root = np.linalg.cholesky(covariance)
            solved = cho_solve((root, True), said[:, k])
            rows.append((np.exp(scales[1:]), np.exp(scales[0]), root, solved))
        return cls(node, *map(np.array, zip(*rows, strict=True)))

    def predict(self, point: Floats) -> tuple[Floats, Floats]:
        """Return mean and variance of the logarithms at points, shape (point, category) each."""
        from scipy.linalg import solve_triangular

        mean, variance = (np.empty((len(point), len(self.variance))) for _ in range(2))
        for k, scale in enumerate(self.variance):
            scales = np.log(np.r_[scale, self.length[k]])
            cross = _kernel(self.node, point, scales)
            mean[:, k] = self.solved[k] @ cross
            left = solve_triangular(self.factor[k], cross, lower=True)
            variance[:, k] = EMULATOR_POLICY.mean_variance + scale - (left**2).sum(axis=0)
        return mean, np.maximum(variance, 1e-12)


def _kernel(a: Floats, b: Floats, scales: Floats) -> Floats:
    """Return the covariances of points: a constant, and a Matérn kernel of order 5/2."""
    from scipy.spatial.distance import cdist

    lengths = np.exp(scales[1:])
    far = np.sqrt(5.0) * cdist(a / lengths, b / lengths)
    matern: Floats = np.exp(scales[0]) * (1.0 + far + far**2 / 3.0) * np.exp(-far)
    return matern + EMULATOR_POLICY.mean_variance


def _fitted_scales(node: Floats, said: Floats, noise: Floats) -> Floats:
    """Return the logarithms of variance and length scales of the largest posterior density."""
    from scipy.linalg import LinAlgError, cho_factor, cho_solve
    from scipy.optimize import minimize

    policy = EMULATOR_POLICY

    def loss(scales: Floats) -> float:
        try:
            root = cho_factor(_kernel(node, node, scales) + np.diag(noise), lower=True)
        except LinAlgError:
            return 1e10
        misfit = said @ cho_solve(root, said)
        prior = ((scales[1:] - np.log(policy.length)) / policy.length_spread) ** 2
        half = np.log(np.diag(root[0])).sum()
        return float(0.5 * misfit + half + 0.5 * prior.sum() + 0.5 * (scales[0] / 3.0) ** 2)

    start = np.r_[np.log(max(said.var(), 0.1)), np.full(node.shape[1], np.log(policy.length))]
    bounds = [(-7.0, 7.0), *[(np.log(0.03), np.log(20.0))] * node.shape[1]]
    return np.asarray(minimize(loss, start, method="L-BFGS-B", bounds=bounds).x)


def log_likelihoods(mean: Floats, variance: Floats, count: Integers, *, seed: int = 0) -> Floats:
    """Return multinomial log likelihoods, integrated over the error of the emulator.

    Parameters
    ----------
    mean, variance : ndarray, shape (points, categories)
        As `Emulator.predict` returns them.
    count : ndarray of int, shape (data sets, categories)
        Observed runs of each category.
    seed : int
        Of the draws of the error, the same at all points.

    Returns
    -------
    ndarray, shape (data sets, points)
        ln E[Π p_k^n_k], without the multinomial coefficient.
    """
    from scipy.special import log_softmax
    from scipy.stats import norm, qmc

    draws, sets = EMULATOR_POLICY.draws, len(count)
    cube = qmc.Sobol(mean.shape[1], seed=seed).random(draws)
    drawn = norm.ppf(np.clip(cube, 1e-9, 1.0 - 1e-9))
    found = np.empty((sets, len(mean)))
    step = max(EMULATOR_POLICY.at_once // (draws * max(sets, 1)), 1)
    for begin in range(0, len(mean), step):
        part = slice(begin, begin + step)
        level = mean[part, None, :] + np.sqrt(variance[part, None, :]) * drawn
        share = log_softmax(level, axis=2)
        each = np.tensordot(count.astype(np.float64), share, axes=(1, 2))
        most = each.max(axis=2, keepdims=True)
        found[:, part] = most[..., 0] + np.log(np.exp(each - most).mean(axis=2))
    return found
