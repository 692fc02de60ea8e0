"""The l1 distance of two distributions of outcomes (Eq. 5), and its noise floor."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import TYPE_CHECKING, Final, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

    Distribution: TypeAlias = xr.Dataset | xr.DataArray | Mapping[str, float] | npt.ArrayLike


ENTRIES_AT_ONCE: Final = 1 << 22
"""Random numbers of one draw: 32 MB."""


class L1NoiseFloor(NamedTuple):
    """Result of `l1_noise_floor`: the l1 distance between two samples of one distribution."""

    mean: float
    """Mean distance."""
    quantile: float
    """The quantile that was asked for."""
    standard_error: float
    """Of the mean, for the number of simulated pairs."""
    normal_mean: float
    """Mean distance in the normal approximation; too high where classes are rare."""


class PairwiseL1(NamedTuple):
    """Result of `pairwise_l1`."""

    mean: float
    """Mean distance over the pairs."""
    largest: float
    """Largest distance of a pair."""
    distance: Floats
    """Distance of every two, shape (n, n)."""


def l1_distance(a: Distribution, b: Distribution) -> float:
    """Return the l1 distance between two distributions of outcomes (Eq. 5), from 0 to 2.

    The sum over the classes of ``|x_a - x_b|``. Half of it is the share of runs that would have to
    change their class.

    Parameters
    ----------
    a, b : xarray.Dataset, xarray.DataArray, mapping or array_like
        Two distributions with class names (an `outcome_distribution`, proportions along ``class``,
        or proportions by name), aligned by name; a class that one of them does not have counts as
        0 there. Or two arrays, shape (class,), with the same classes in the same order.

    Returns
    -------
    float
        Distance.

    Raises
    ------
    InputError
        When they are no proportions or have no common classes.

    Examples
    --------
    >>> round(l1_distance({"O": 0.7, "I": 0.3}, {"O": 0.5, "I": 0.4, "2+2": 0.1}), 12)
    0.4
    """
    first, second = _aligned(a, b)
    return float(np.abs(first - second).sum())


def pairwise_l1(distributions: Sequence[Distribution]) -> PairwiseL1:
    """Return the l1 distances between all pairs of several distributions.

    With realisations of one setting the mean is its noise floor as measured: the paper has 0.065
    for 10 realisations of 1000 runs. `l1_noise_floor` says what to expect.

    Parameters
    ----------
    distributions : sequence
        At least two distributions, each as in `l1_distance`.

    Returns
    -------
    PairwiseL1
        Mean, largest, and the distance of every two.

    Raises
    ------
    InputError
        When there are fewer than two, or two of them cannot be compared.

    Examples
    --------
    >>> pairwise_l1([[0.5, 0.5], [0.25, 0.75], [0.5, 0.5]]).distance[0].tolist()
    [0.0, 0.5, 0.0]
    """
    from scipy.spatial.distance import squareform

    number = len(distributions)
    if number < 2:
        raise InputError(f"distances between pairs need at least two distributions, got {number}")
    pairs = np.array([l1_distance(b, a) for a, b in combinations(distributions, 2)])
    return PairwiseL1(float(pairs.mean()), float(pairs.max()), squareform(pairs))


def l1_noise_floor(
    proportions: Distribution,
    runs_a: int,
    runs_b: int | None,
    *,
    quantile: float = 0.95,
    samples: int = 20_000,
    seed: int = 1,
) -> L1NoiseFloor:
    """Return the l1 distance between two samples of the same distribution that chance alone gives.

    Pairs of multinomial samples are drawn and their l1 distances taken. A distance above the
    quantile is more than chance at that level; a distance near the mean is none.

    Parameters
    ----------
    proportions : xarray.Dataset, xarray.DataArray, mapping or array_like, shape (class,)
        The distribution, as in `l1_distance`. A class of which no run was seen counts as
        impossible, so estimate it from many runs.
    runs_a : int
        Runs of the first sample, >= 1.
    runs_b : int or None
        Runs of the second sample, >= 1; None when it is the distribution itself, known exactly.
    quantile : float
        Which quantile to return, in (0, 1).
    samples : int
        Pairs to draw, >= 100.
    seed : int
        Seed of the draws, >= 0.

    Returns
    -------
    L1NoiseFloor
        Mean, quantile, standard error of the mean, and the mean in closed form:
        ``sum over classes of sqrt(2/pi p (1 - p) (1/runs_a + 1/runs_b))``, which holds where every
        class that occurs has many runs, and is too high for rare classes.

    Raises
    ------
    InputError
        When they are no proportions or an option is out of range.

    Examples
    --------
    >>> floor = l1_noise_floor([0.4, 0.3, 0.2, 0.1], 1000, 1000)
    >>> round(floor.mean, 3), round(floor.normal_mean, 3)
    (0.059, 0.059)
    """
    p = _proportions(proportions)[1]
    for name, runs in (("runs_a", runs_a), ("runs_b", runs_b)):
        if runs is not None and (runs < 1 or runs != int(runs)):
            raise InputError(f"{name} must be a whole number of at least 1, got {runs}")
    if not 0 < quantile < 1:
        raise InputError(f"quantile must lie between 0 and 1, got {quantile}")
    if samples < 100:
        raise InputError(f"samples must be at least 100, got {samples}")
    if seed < 0:
        raise InputError(f"seed must not be negative, got {seed}")
    p = p[p > 0] / p.sum()
    distance = _drawn_distances(p, int(runs_a), runs_b, samples, seed)
    per_run = 1.0 / runs_a + (0.0 if runs_b is None else 1.0 / runs_b)
    return L1NoiseFloor(
        mean=float(distance.mean()),
        quantile=float(np.quantile(distance, quantile)),
        standard_error=float(distance.std(ddof=1) / math.sqrt(samples)),
        normal_mean=float(_normal_mean(p, np.array(per_run))),
    )


def l1_in_floors(
    proportions: npt.ArrayLike,
    reference: npt.ArrayLike,
    *,
    runs: npt.ArrayLike,
    reference_runs: int | None,
) -> Floats:
    """Return l1 distances to a reference, divided by the distance that chance alone would give.

    The noise makes every distance too long, and the more so the more classes share the runs, so
    a map of plain distances has no zero. Here each is divided by the mean distance of two samples
    of the pooled distribution of that setting and the reference (normal approximation): about 1
    where they do not differ, below 2 hardly more than chance.

    Parameters
    ----------
    proportions : array_like, shape (..., class)
        Distributions; one with a value that is not finite counts as missing.
    reference : array_like, shape (class,)
        The reference, with the same classes in the same order.
    runs : array_like of int, shape (...)
        Runs of each distribution; 0 counts as missing.
    reference_runs : int or None
        Runs of the reference; None when it is exact.

    Returns
    -------
    ndarray, shape (...)
        Distances in floors; NaN where missing, 0 where the distance is 0, infinite where a
        reference without any scatter was left.

    Raises
    ------
    InputError
        When the shapes disagree or the reference is no distribution.

    Examples
    --------
    >>> l1_in_floors([[0.5, 0.5], [0.9, 0.1]], [0.5, 0.5], runs=100, reference_runs=None).round(1)
    array([ 0., 10.])
    """
    p, known = np.asarray(proportions, dtype=np.float64), _proportions(np.asarray(reference))[1]
    if p.ndim < 1 or p.shape[-1] != known.size:
        raise InputError(
            f"proportions of shape {p.shape} do not end with the {known.size} classes of the "
            "reference"
        )
    if reference_runs is not None and reference_runs < 1:
        raise InputError(f"reference_runs must be at least 1, got {reference_runs}")
    try:
        n = np.broadcast_to(np.asarray(runs, dtype=np.float64), p.shape[:-1])
    except ValueError as error:
        raise InputError(
            f"runs of shape {np.shape(runs)} do not fit proportions of shape {p.shape}"
        ) from error
    if (n < 0).any():
        raise InputError("runs: a number of runs is negative")
    present = np.isfinite(p).all(axis=-1) & (n > 0)
    p, n = p[present], n[present]
    distance = np.abs(p - known).sum(axis=1)
    if reference_runs is None:
        pooled, per_run = np.broadcast_to(known, p.shape), 1.0 / n
    else:
        weight = (n / (n + reference_runs))[:, None]
        pooled = weight * p + (1 - weight) * known
        per_run = 1.0 / n + 1.0 / reference_runs
    floors = np.full(present.shape, np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        floors[present] = np.where(distance > 0, distance / _normal_mean(pooled, per_run), 0.0)
    return floors


def _normal_mean(p: Floats, per_run: Floats) -> Floats:
    """Return the mean l1 distance of normal deviations; `per_run` is 1/runs_a + 1/runs_b."""
    # A rounded proportion may exceed one by a hair.
    variance = np.maximum(p * (1 - p), 0.0)
    return np.asarray(np.sqrt(2 / np.pi * variance).sum(axis=-1) * np.sqrt(per_run))


def _drawn_distances(p: Floats, runs_a: int, runs_b: int | None, samples: int, seed: int) -> Floats:
    rng = np.random.default_rng(seed)
    rows = max(1, ENTRIES_AT_ONCE // p.size)
    parts = []
    for begin in range(0, samples, rows):
        size = min(rows, samples - begin)
        a = rng.multinomial(runs_a, p, size=size) / runs_a
        b = p if runs_b is None else rng.multinomial(int(runs_b), p, size=size) / runs_b
        parts.append(np.abs(a - b).sum(axis=1))
    return np.concatenate(parts)


def _aligned(a: Distribution, b: Distribution) -> tuple[Floats, Floats]:
    """Return the proportions of two distributions over the same classes."""
    (names_a, first), (names_b, second) = _proportions(a), _proportions(b)
    if (names_a is None) != (names_b is None):
        raise InputError(
            "one distribution has class names and the other has none: give both with names, or "
            "both as arrays"
        )
    if names_a is None or names_b is None:
        if first.size != second.size:
            raise InputError(
                f"distributions over {first.size} and {second.size} classes cannot be aligned "
                "without class names"
            )
        return first, second
    _check_same_naming(a, b, names_a, names_b)
    by_name = dict(zip(names_a, first, strict=True)), dict(zip(names_b, second, strict=True))
    union = list(dict.fromkeys([*names_a, *names_b]))
    table = np.array([[values.get(name, 0.0) for name in union] for values in by_name])
    return table[0], table[1]


def _check_same_naming(a: object, b: object, names_a: list[str], names_b: list[str]) -> None:
    if not set(names_a) & set(names_b):
        raise InputError(
            f"the distributions have no class in common ('{names_a[0]}', ... and '{names_b[0]}', "
            "...): are they of the same number of blocks?"
        )
    # "S" means another thing where mirror images are counted apart.
    chirality = [getattr(item, "attrs", {}).get("chirality") for item in (a, b)]
    if None not in chirality and chirality[0] != chirality[1]:
        raise InputError(
            f"the distributions count mirror images differently (chirality '{chirality[0]}' and "
            f"'{chirality[1]}'): classify both in the same way"
        )


def _proportions(distribution: Distribution) -> tuple[list[str] | None, Floats]:
    """Return the class names, None for a plain array, and the proportions, checked."""
    import xarray as xr

    names: list[str] | None = None
    if isinstance(distribution, xr.Dataset):
        if "proportion" not in distribution:
            raise InputError("not a distribution of outcomes: variable 'proportion' is missing")
        distribution = distribution["proportion"]
    if isinstance(distribution, xr.DataArray):
        if distribution.dims != ("class",) or "class" not in distribution.coords:
            raise InputError(
                "a distribution needs the one dimension 'class' with names, got dimensions "
                f"{distribution.dims}"
            )
        names = [str(name) for name in distribution["class"].values]
        distribution = distribution.values
    elif isinstance(distribution, Mapping):
        names = [str(name) for name in distribution]
        distribution = [float(share) for share in distribution.values()]
    values = np.asarray(distribution, dtype=np.float64)
    if names is not None and len(set(names)) < len(names):
        raise InputError("a distribution names a class twice")
    if values.ndim != 1 or values.size == 0:
        raise InputError(f"a distribution is a row of proportions, got shape {values.shape}")
    if not (np.isfinite(values) & (values >= 0)).all():
        raise InputError("a distribution has a proportion that is negative or not finite")
    # Proportions that went through a file in single precision still sum to one.
    if abs(values.sum() - 1) > 1e-5:
        raise InputError(
            f"proportions must sum to 1, these sum to {values.sum():g}: divide counts by the "
            "number of runs"
        )
    return names, values
