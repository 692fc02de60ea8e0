"""Whiteness and normality of the innovations: autocorrelation, Ljung-Box statistic, kurtosis."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats, Integers
from driftwalk.likelihood.check.errors import Innovations, Leverage, used_pairs

LAGS: Final = 20
"""Lags of the portmanteau statistic: two seconds at 10 Hz. Chosen by hand."""


class ClusterPolicy(NamedTuple):
    """When errors that go together count as one."""

    length_s: float = 10.0
    """Length of a cluster [s]: longer than a block takes to pass a place where the flow is not
    known. Chosen by hand."""
    least_ratio: float = 1.3
    """Cluster-robust standard error, over the one of independent errors, from which it counts. With
    60 clusters chance exceeds it at one lag in 1600 and for one kurtosis in 29, with 18 in 28 and
    in 12: in short recordings the criteria are a little milder."""


CLUSTER: Final = ClusterPolicy()


class WhitenessTests(NamedTuple):
    """How white and how normal the errors are; arrays by component, or by component and lag."""

    autocorrelation: Floats
    """At lags of 1, 2, ... samples."""
    expected: Floats
    """Value after fitting the flow if the model is right."""
    std: Floats
    """Its standard deviation if the model is right."""
    portmanteau: float
    """Ljung and Box's statistic about the expected autocorrelation, all components together."""
    portmanteau_dof: int
    p_value: float
    chi_squared: Floats
    """Mean square."""
    expected_chi_squared: Floats
    excess_kurtosis: Floats
    kurtosis_std: Floats
    kurtosis_p_value: Floats
    """Of the excess kurtosis, two-sided (Anscombe and Glynn; by its standard error where that is
    cluster-robust)."""
    tail_share: Floats
    """Share beyond three standard deviations."""
    largest: tuple[int, int]
    """Component and lag (from 1) that are furthest from what is expected."""


def whiteness_tests(
    errors: Sequence[Innovations], leverage: Leverage, *, lags: int = LAGS
) -> WhitenessTests:
    """Return the statistics of whiteness of all recordings together.

    Ljung and Box's statistic takes the residuals of a fit for errors. Here each autocorrelation is
    first freed of what the fitted flow has put into it (minus the mean of J C J' at that lag); the
    degrees of freedom are then the number of lags. The two noises, which are fitted too, take up
    to four of the forty: p is up to four times too large, on the safe side.

    The errors of one passage through a place where the flow is not known go together, so that a
    single passage could reject a model that is right elsewhere. The standard errors are those of
    independent errors or, where these are clearly larger, cluster-robust ones, from the scatter of
    the sums of clusters (Liang and Zeger 1986).
    """
    from scipy.stats import chi2, kurtosistest, norm

    clusters = _clusters(errors)
    number = int(clusters[-1].max()) + 1
    components = errors[0].components
    sums, counts = np.zeros((lags + 1, number, components)), np.zeros((lags + 1, number))
    for one, cluster in zip(errors, clusters, strict=True):
        for lag, both in used_pairs(one.used, lags):
            earlier, at = one.white[: one.used.size - lag], cluster[lag:][both]
            np.add.at(sums[lag], at, one.white[lag:][both] * earlier[both])
            counts[lag] += np.bincount(at, minlength=number)
    products, pairs = sums.sum(axis=1).T, counts.sum(axis=1)
    # Where gaps leave no pair at a lag, that lag says nothing and takes no degree of freedom.
    known = np.broadcast_to(pairs[1:] > 0.0, (components, lags))
    pairs = np.maximum(pairs, 1.0)
    mean = products / pairs
    variance = np.maximum(mean[:, :1], 1e-300)
    found = mean[:, 1:] / variance
    expected = -leverage.autocovariance[:, 1 : lags + 1]
    robust = _cluster_std(sums, counts).T[:, 1:] / variance
    std = np.broadcast_to(1.0 / np.sqrt(pairs[1:]), found.shape)
    off = np.where(known, (found - expected) / _larger(std, robust), 0.0)
    samples = pairs[0]
    # Each term is divided by its own number of pairs, which allows for gaps too.
    portmanteau = float((1.0 + 2.0 / samples) * (off**2).sum())
    dof = int(np.count_nonzero(known))
    values = np.concatenate([one.white[one.used] for one in errors])
    unit = values / np.sqrt(variance[:, 0])
    excess = (unit**4).mean(axis=0) - 3.0
    of_kurtosis = np.zeros((1, number, components))
    at = np.concatenate([cluster[one.used] for one, cluster in zip(errors, clusters, strict=True)])
    # The influence of a sample on the excess kurtosis.
    np.add.at(of_kurtosis[0], at, unit**4 - 6.0 * unit**2 + 3.0)
    independent = np.full(components, math.sqrt(24.0 / samples))
    kurtosis_std = _larger(independent, _cluster_std(of_kurtosis, counts[:1])[0])
    p_value = np.atleast_1d(kurtosistest(unit, axis=0).pvalue)
    clustered = kurtosis_std > independent
    p_value = np.where(clustered, 2.0 * norm.sf(np.abs(excess) / kurtosis_std), p_value)
    component, lag = divmod(int(np.abs(off).argmax()), lags)
    return WhitenessTests(
        found,
        expected,
        np.array(std),
        portmanteau,
        dof,
        float(chi2.sf(portmanteau, dof)) if dof else math.nan,
        variance[:, 0],
        1.0 - leverage.autocovariance[:, 0],
        excess,
        kurtosis_std,
        p_value,
        (np.abs(values) > 3.0).mean(axis=0),
        (component, lag + 1),
    )


def _clusters(errors: Sequence[Innovations]) -> list[Integers]:
    """Return the number of the cluster of each sample, counted through all recordings."""
    found, first = [], 0
    for one in errors:
        number = ((one.series.time - one.series.time[0]) / CLUSTER.length_s).astype(np.intp)
        found.append(first + number)
        first += int(number[-1]) + 1
    return found


def _larger(std: Floats, robust: Floats) -> Floats:
    """Return the standard errors, and the robust ones where they are clearly larger."""
    return np.where(robust > CLUSTER.least_ratio * std, robust, std)


def _cluster_std(sums: Floats, counts: Floats) -> Floats:
    """Return the standard errors of means from their sums by cluster, (lags, components)."""
    total = np.maximum(counts.sum(axis=1), 1.0)[:, None]
    mean = sums.sum(axis=1) / total
    off = sums - counts[:, :, None] * mean[:, None]
    return np.asarray(np.sqrt((off**2).sum(axis=1)) / total)
