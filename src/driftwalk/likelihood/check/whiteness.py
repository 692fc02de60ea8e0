"""Whiteness and normality of the innovations: autocorrelation, Ljung-Box statistic, kurtosis."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.likelihood.check.errors import Innovations, Leverage, used_pairs

LAGS: Final = 20
"""Lags of the portmanteau statistic: two seconds at 10 Hz. Chosen by hand."""


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
    kurtosis_std: float
    kurtosis_p_value: Floats
    """Of the excess kurtosis, two-sided (Anscombe and Glynn)."""
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
    """
    from scipy.stats import chi2, kurtosistest

    components = errors[0].components
    products, pairs = np.zeros((components, lags + 1)), np.zeros(lags + 1)
    for one in errors:
        for lag, both in used_pairs(one.used, lags):
            earlier = one.white[: one.used.size - lag]
            products[:, lag] += (one.white[lag:][both] * earlier[both]).sum(axis=0)
            pairs[lag] += np.count_nonzero(both)
    # Where gaps leave no pair at a lag, that lag says nothing and takes no degree of freedom.
    known = np.broadcast_to(pairs[1:] > 0.0, (components, lags))
    pairs = np.maximum(pairs, 1.0)
    mean = products / pairs
    variance = np.maximum(mean[:, :1], 1e-300)
    found = mean[:, 1:] / variance
    expected = -leverage.autocovariance[:, 1 : lags + 1]
    std = np.broadcast_to(1.0 / np.sqrt(pairs[1:]), found.shape)
    off = np.where(known, (found - expected) / std, 0.0)
    samples = pairs[0]
    # Each term is divided by its own number of pairs, which allows for gaps too.
    portmanteau = float((1.0 + 2.0 / samples) * (off**2).sum())
    dof = int(np.count_nonzero(known))
    values = np.concatenate([one.white[one.used] for one in errors])
    unit = values / np.sqrt(variance[:, 0])
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
        (unit**4).mean(axis=0) - 3.0,
        float(np.sqrt(24.0 / samples)),
        np.atleast_1d(kurtosistest(unit, axis=0).pvalue),
        (np.abs(values) > 3.0).mean(axis=0),
        (component, lag + 1),
    )
