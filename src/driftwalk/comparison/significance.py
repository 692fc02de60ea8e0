"""Permutation test in blocks, which respects serial correlation, and the autocorrelation time.

The steps of a trajectory remember their past, so single steps must not be exchanged between two
samples: at an autocorrelation time of 19 steps such a test rejects a true null 92 % of the time at
the 5 % level. Whole blocks, long against that memory, are exchanged instead.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk import _core
from driftwalk.comparison.ks import Ties, checked_points
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError


class AutocorrelationPolicy(NamedTuple):
    """How far an autocorrelation is summed, and when it counts."""

    window: float = 2.5
    """Largest lag, in autocorrelation times: five times 1/2 + sum of rho, the rule of Sokal, by
    convention."""
    fewest: int = 4
    """Values without which there is no correlation, and one more than the last lag that tells
    how much of a series is correlated; chosen by hand."""
    significant: float = 3.0
    """Standard errors of white noise from which on a correlation is significant: chance exceeds it
    in 0.3 % of white series."""


_AUTOCORRELATION: Final = AutocorrelationPolicy()


def autocorrelation_time(series: npt.ArrayLike) -> float:
    """Return the integrated autocorrelation time of a series, in samples.

    tau = 1 + 2 sum of rho(t) over the lags t up to the first one that exceeds 2.5 tau (Sokal).
    White noise gives 1, an AR(1) process of coefficient phi (1 + phi) / (1 - phi). Never below 1.

    Parameters
    ----------
    series : array_like, shape (n,)
        Values; a constant series gives 1.

    Examples
    --------
    >>> autocorrelation_time([1.0, 1.0, 1.0])
    1.0
    """
    return _integrated(_autocorrelation(np.asarray(series, dtype=np.float64)), 1.0)


def memory_time(series: npt.ArrayLike) -> float:
    """Return the autocorrelation time of the correlated part of a series, in samples.

    White noise on top of a slow motion makes every correlation smaller, and with it the integrated
    autocorrelation time, but the motion remembers as long as before. So the correlations are taken
    relative to the largest at lags 1 to 3; where that one is not significant, this is
    `autocorrelation_time`.

    Parameters
    ----------
    series : array_like, shape (n,)
        Values.

    Examples
    --------
    >>> memory_time([1.0, 1.0, 1.0])
    1.0
    """
    rho = _autocorrelation(np.asarray(series, dtype=np.float64))
    if rho.size < _AUTOCORRELATION.fewest:
        return 1.0
    share = float(rho[1 : _AUTOCORRELATION.fewest].max())
    significant = share > _AUTOCORRELATION.significant / np.sqrt(rho.size)
    return _integrated(rho, share if significant else 1.0)


def steps_memory_time(points: Floats) -> float:
    """Return the longest memory of what the KS statistic can see of a series of points.

    Taken over the ranks of either column, which a monotone map of an axis does not change, and over
    their distances from the middle rank, which show a slowly changing spread.

    Parameters
    ----------
    points : ndarray, shape (n, 2)
        The series in time order.
    """
    times = []
    for column in points.T:
        rank = np.argsort(np.argsort(column, kind="stable"), kind="stable").astype(np.float64)
        times += [memory_time(rank), memory_time(np.abs(rank - rank.mean()))]
    return max(times)


def usual_block_length(memory: float) -> int:
    """Return the points of a block that a permutation moves, for a memory [points]."""
    return math.ceil(_PERMUTATION.block_times * memory)


def _autocorrelation(values: Floats) -> Floats:
    """Return rho at every lag; empty where there is none."""
    centred = values - values.mean() if values.size else values
    power = float(centred @ centred)
    if values.size < _AUTOCORRELATION.fewest or power <= 0.0:
        return np.empty(0)
    length = 1 << (2 * values.size - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(centred, length)) ** 2
    rho: Floats = np.fft.irfft(spectrum, length)[: values.size] / power
    return rho


def _integrated(rho: Floats, share: float) -> float:
    """Return 1 + 2 sum of rho / share with Sokal's window."""
    if rho.size == 0:
        return 1.0
    tau = 1.0 + 2.0 * (np.cumsum(rho) - rho[0]) / share
    beyond = np.arange(rho.size) >= _AUTOCORRELATION.window * tau
    return max(1.0, float(tau[int(np.argmax(beyond)) if beyond.any() else -1]))


class PermutationPolicy(NamedTuple):
    """How blocks of steps are exchanged between two motions."""

    block_times: float = 6.0
    """Length of a block, in autocorrelation times: with shorter ones the test rejects too
    often; chosen by hand."""
    fewest_arrangements: int = 20
    """Ways to exchange the blocks without which no p-value can reach 5 %; in closed form."""
    labels_at_once: int = 1 << 24
    """Labels of blocks that are held at once; chosen by hand."""


_PERMUTATION: Final = PermutationPolicy()


class PermutationTest(NamedTuple):
    """Result of `block_permutation_test`."""

    p_value: float
    """(1 + permutations at least as far apart) / (1 + permutations)."""
    distance: float
    """D of the whole blocks that were used."""
    noise_floor: float
    """Median D of the permutations: how far apart two samples of one motion are by chance."""
    block_length: int
    """Steps of a block."""
    autocorrelation_time: float
    """The longest found in either series [steps], see `memory_time`; 1 for independent steps."""
    effective_a: float
    """Effective number of points of the first series: its points over that time."""
    effective_b: float
    """The same of the second series."""
    blocks_a: int
    """Blocks of the first series."""
    blocks_b: int
    """Blocks of the second series."""
    left_out: int
    """Steps at the ends of the series that filled no whole block."""
    permuted_distance: Floats
    """D of every permutation."""


def block_permutation_test(
    a: npt.ArrayLike,
    b: npt.ArrayLike,
    *,
    block_length: int | None = None,
    permutations: int = 999,
    seed: int = 1,
    ties: Ties = "strict",
) -> PermutationTest:
    """Test whether two serially correlated series of points have one distribution.

    This is the p-value of `ks_distance`. Both series are cut into blocks, the blocks are shuffled,
    and D is computed each time; p = (1 + #{D_permuted >= D}) / (1 + permutations), integers
    compared. Incomplete blocks at the ends are left out of the test.

    Parameters
    ----------
    a, b : array_like, shapes (n, 2), (m, 2)
        Series of points in time order, for example (step length, turning angle).
    block_length : int, optional
        Points of a block; default: six autocorrelation times (`memory_time` of the ranks of either
        column, the longest of both series).
    permutations : int
        Number of permutations, >= 1.
    seed : int
        Seed of the permutations, >= 0.
    ties : {"strict", "limits"}
        As in `ks_distance`.

    Returns
    -------
    PermutationTest
        D, the p-value, the noise floor, the block length that was used, and the effective number
        of points of either series.

    Raises
    ------
    InputError
        When a series is too short for the blocks, or an option is out of range.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> a, b = rng.normal(size=(300, 2)), rng.normal(size=(300, 2)) + 2.0
    >>> block_permutation_test(a, b, permutations=99, seed=1).p_value
    0.01
    """
    first, second = checked_points(a, "a"), checked_points(b, "b")
    if permutations < 1:
        raise InputError(f"permutations must be at least 1, got {permutations}")
    if seed < 0:
        raise InputError(f"seed must not be negative, got {seed}")
    memory = max(steps_memory_time(first), steps_memory_time(second))
    length = usual_block_length(memory) if block_length is None else int(block_length)
    if length < 1:
        raise InputError(f"block_length must be at least 1, got {block_length}")
    blocks_a, blocks_b = first.shape[0] // length, second.shape[0] // length
    arrangements = math.comb(blocks_a + blocks_b, blocks_a) if blocks_a and blocks_b else 0
    if arrangements < _PERMUTATION.fewest_arrangements:
        raise InputError(
            f"the series of {first.shape[0]} and {second.shape[0]} points hold only {blocks_a} and "
            f"{blocks_b} blocks of {length}, too few for a permutation test: record longer, or "
            "name a shorter block_length"
        )
    pooled = np.concatenate([first[: blocks_a * length], second[: blocks_b * length]])
    block_of = np.repeat(np.arange(blocks_a + blocks_b, dtype=np.int32), length)
    # D1 + D2 in integer units: of the series as they are, then of every permutation.
    statistic = np.concatenate(
        [
            _core.ks_permutations(pooled, blocks_a * length, block_of, labels, ties == "limits")
            for labels in _labels(blocks_a, blocks_b, permutations, seed)
        ]
    )
    unit = 2.0 * (blocks_a * length) * (blocks_b * length)
    reached = int((statistic[1:] >= statistic[0]).sum())
    return PermutationTest(
        p_value=(1 + reached) / (1 + permutations),
        distance=float(statistic[0] / unit),
        noise_floor=float(np.median(statistic[1:]) / unit),
        block_length=length,
        autocorrelation_time=memory,
        effective_a=first.shape[0] / memory,
        effective_b=second.shape[0] / memory,
        blocks_a=blocks_a,
        blocks_b=blocks_b,
        left_out=first.shape[0] + second.shape[0] - pooled.shape[0],
        permuted_distance=statistic[1:] / unit,
    )


def _labels(
    blocks_a: int, blocks_b: int, permutations: int, seed: int
) -> Iterator[npt.NDArray[np.uint8]]:
    """Yield the series of each block, one row as they are and one for every permutation."""
    as_they_are = np.r_[np.zeros(blocks_a, np.uint8), np.ones(blocks_b, np.uint8)]
    yield as_they_are[None, :]
    rng = np.random.default_rng(seed)
    rows = max(1, _PERMUTATION.labels_at_once // as_they_are.size)
    for begin in range(0, permutations, rows):
        count = min(rows, permutations - begin)
        yield rng.permuted(np.tile(as_they_are, (count, 1)), axis=1)
