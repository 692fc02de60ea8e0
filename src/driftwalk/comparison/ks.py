"""The two-sample, two-dimensional Kolmogorov-Smirnov statistic, for any two sets of points.

The statistic of Fasano and Franceschini (1987, MNRAS 225, 155): for every point of the first sample
as origin the plane falls into four quadrants; D1 is the largest absolute difference, over origins
and quadrants, of the fractions of the two samples in a quadrant; D2 the same with the points of the
second sample as origins; D = (D1 + D2) / 2. Computed exactly, in O(n log n) sorting and a blocked
sweep, with integers up to the last division.

Conventions, and why. Quadrants are open: a point that shares a coordinate with the origin is in
none; then D is 0 for identical samples and unchanged by mirroring, by swapping the axes or the
samples, and by strictly monotone maps of an axis. ``ties="limits"`` takes instead the largest
difference over the open and closed choices of either axis, which still sees a sample with a
constant column. Angles are cut at +-pi: D depends on the cut, so it is fixed.
"""

from __future__ import annotations

import warnings
from typing import Final, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk import _core
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError


class ComparisonWarning(UserWarning):
    """A comparison was made, but the data limit its meaning."""


Points = Floats
Ties = Literal["strict", "limits"]
Combine = Literal["mean", "max"]
Method = Literal["fasano-franceschini", "peacock"]

QUADRANTS: tuple[str, ...] = ("left below", "right below", "left above", "right above")
"""Names of the quadrants 0 to 3, as seen from the origin."""


class KsPlace(NamedTuple):
    """Place of the largest difference."""

    x: float
    """First coordinate of the origin; NaN when the difference is zero everywhere."""
    y: float
    """Second coordinate of the origin."""
    quadrant: int
    """Index into `QUADRANTS`; -1 when the difference is zero everywhere."""
    row: int
    """Row of the origin in its own sample; -1 where the origin is no point of a sample."""


class KsComparison(NamedTuple):
    """The statistic between two samples, and the place of its maximum."""

    distance: float
    """D, between 0 and 1."""
    distance_a: float
    """D1: origins in the first sample."""
    distance_b: float
    """D2: origins in the second sample."""
    difference_a: int
    """D1 in units of 1 / (n_a n_b): exact."""
    difference_b: int
    """D2 in units of 1 / (n_a n_b): exact."""
    n_a: int
    """Points of the first sample."""
    n_b: int
    """Points of the second sample."""
    place_a: KsPlace
    """Where D1 sits."""
    place_b: KsPlace
    """Where D2 sits."""
    tied_fraction: float
    """Fraction of all points that share a coordinate with another."""

    @property
    def place(self) -> KsPlace:
        """Where the larger of D1 and D2 sits."""
        return self.place_a if self.difference_a >= self.difference_b else self.place_b


class KsReference:
    """A fixed sample, sorted once, to which many samples are compared.

    Made by `ks_reference`. `native` is its form in the core; any number of threads may share it.
    """

    def __init__(self, sample: npt.ArrayLike) -> None:
        # A copy: the caller may change the array, and this one travels.
        self._points = checked_points(sample, "sample").copy()
        self.native = _core.KsReference(self._points)

    def __reduce__(self) -> tuple[type[KsReference], tuple[Points]]:
        """Travel to another process as the points; they are sorted again there."""
        return KsReference, (self._points,)

    def __len__(self) -> int:
        """Return the number of points."""
        return int(self.native.size)

    def distance(
        self,
        other: npt.ArrayLike,
        *,
        ties: Ties = "strict",
        combine: Combine = "mean",
        method: Method = "fasano-franceschini",
    ) -> float:
        """Return the distance to another sample, as `ks_distance` does."""
        points = checked_points(other, "other")
        return _compare(self.native, points, ties, combine, method, counts_ties=False).distance

    def compare(
        self,
        other: npt.ArrayLike,
        *,
        ties: Ties = "strict",
        combine: Combine = "mean",
        method: Method = "fasano-franceschini",
    ) -> KsComparison:
        """Return the comparison with another sample, as `ks_compare` does."""
        return _compare(self.native, checked_points(other, "other"), ties, combine, method)


def ks_reference(sample: npt.ArrayLike) -> KsReference:
    """Prepare a fixed sample for many comparisons.

    Parameters
    ----------
    sample : array_like, shape (n, 2)
        Points; finite, n >= 1.

    Returns
    -------
    KsReference
        Its `distance` and `compare` take the other sample.

    Raises
    ------
    InputError
        When the shape is wrong, the sample is empty or a row is not finite.

    Examples
    --------
    >>> ks_reference([[0.0, 0.0], [1.0, 1.0]]).distance([[2.0, 2.0]])
    1.0
    """
    return KsReference(sample)


def ks_distance(
    a: npt.ArrayLike,
    b: npt.ArrayLike,
    *,
    ties: Ties = "strict",
    combine: Combine = "mean",
    method: Method = "fasano-franceschini",
) -> float:
    """Return the two-sample, two-dimensional KS distance between two sets of points.

    A distance alone says nothing of significance: `driftwalk.block_permutation_test` of the same
    two series gives its p-value, which allows for steps that remember their past.

    Parameters
    ----------
    a, b : array_like, shapes (n, 2), (m, 2)
        Points in any units; finite, n, m >= 1. -0.0 equals 0.0.
    ties : {"strict", "limits"}
        Open quadrants, or the largest difference over the open and closed choices of either axis.
    combine : {"mean", "max"}
        D = (D1 + D2) / 2, or the larger of the two.
    method : {"fasano-franceschini", "peacock"}
        Origins at the points, or at every cut of the plane between pooled coordinates (Peacock
        1983, MNRAS 202, 615; exact). Peacock's cuts pass between points, so `ties` and `combine`
        do not matter to it.

    Returns
    -------
    float
        D, between 0 and 1. 1 - D is the score that the paper plots.

    Raises
    ------
    InputError
        When a shape is wrong, a sample is empty or a row is not finite.

    Warns
    -----
    ComparisonWarning
        When more than 5 % of the points share a coordinate with another and ``ties="strict"``.

    Examples
    --------
    >>> ks_distance([[0, 0], [1, 1], [2, 2]], [[10, 10], [11, 11]])
    1.0
    """
    first, second = checked_points(a, "a"), checked_points(b, "b")
    return _compare(first, second, ties, combine, method, counts_ties=False).distance


def ks_compare(
    a: npt.ArrayLike,
    b: npt.ArrayLike,
    *,
    ties: Ties = "strict",
    combine: Combine = "mean",
    method: Method = "fasano-franceschini",
) -> KsComparison:
    """Return the KS distance with its two parts and the place where each sits.

    Parameters
    ----------
    a, b : array_like, shapes (n, 2), (m, 2)
        Points; see `ks_distance`, whose errors these are as well.
    ties, combine, method : str
        As in `ks_distance`.

    Examples
    --------
    >>> QUADRANTS[ks_compare([[0, 0], [1, 1]], [[5, 5], [6, 6]]).place.quadrant]
    'right above'
    """
    return _compare(checked_points(a, "a"), checked_points(b, "b"), ties, combine, method)


def _compare(
    first: _core.KsReference | Points,
    second: Points,
    ties: Ties,
    combine: Combine,
    method: Method,
    *,
    counts_ties: bool = True,
) -> KsComparison:
    """Return the comparison of two samples, the first of which may be sorted already."""
    _check_options(ties, combine, method)
    if method == "peacock":
        native = first if isinstance(first, _core.KsReference) else _core.KsReference(first)
        return _peacock(native, second)
    if isinstance(first, _core.KsReference):
        most = _most_tied(first.size + len(second), ties, counts_ties)
        found = first.compare(second, ties == "limits", most)
    else:
        most = _most_tied(len(first) + len(second), ties, counts_ties)
        found = _core.ks_compare(first, second, ties == "limits", most)
    return _comparison(found, ties, combine, counts_ties)


class TiePolicy(NamedTuple):
    """How many points may be tied."""

    one_in: int = 20
    """One point in this many may be tied before a warning: 5 %; chosen by hand."""


TIED: Final = TiePolicy()


def _most_tied(points: int, ties: Ties, counts_ties: bool) -> int:
    """Return how many tied points to count: all, or those that decide on a warning."""
    if counts_ties:
        return points
    return points // TIED.one_in if ties == "strict" else 0


def checked_points(points: npt.ArrayLike, name: str) -> Points:
    """Return points as a contiguous (n, 2) float64 array, or raise `InputError`."""
    try:
        array = np.ascontiguousarray(points, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} is not an array of numbers: {error}") from error
    if array.ndim != 2 or array.shape[1] != 2:
        raise InputError(f"{name} must have shape (n, 2), got {array.shape}")
    if array.shape[0] == 0:
        raise InputError(f"{name} is empty: a distance needs at least one point in either sample")
    if not np.isfinite(array).all():
        row = int(np.flatnonzero(~np.isfinite(array).all(axis=1))[0])
        raise InputError(
            f"{name} has a value that is not a finite number in row {row}: "
            f"({array[row, 0]}, {array[row, 1]})"
        )
    return array


def _place(place: tuple[float, float, int, int]) -> KsPlace:
    x, y, quadrant, row = place
    return KsPlace(x, y, quadrant, row) if quadrant >= 0 else KsPlace(np.nan, np.nan, -1, -1)


def _comparison(
    raw: _core.KsResult, ties: Ties, combine: Combine, counts_ties: bool
) -> KsComparison:
    d1, d2, n1, n2, tied, place1, place2 = raw
    product = n1 * n2
    tied_fraction = tied / (n1 + n2)
    if ties == "strict" and tied * TIED.one_in > n1 + n2:
        share = f"{100 * tied_fraction:.0f}" if counts_ties else f"more than {100 // TIED.one_in}"
        warnings.warn(
            f"{share} % of the points share a coordinate with another point, "
            'and open quadrants leave such points out: consider ties="limits"',
            ComparisonWarning,
            stacklevel=4,  # the caller of the public function
        )
    return KsComparison(
        distance=max(d1, d2) / product if combine == "max" else (d1 + d2) / (2 * product),
        distance_a=d1 / product,
        distance_b=d2 / product,
        difference_a=d1,
        difference_b=d2,
        n_a=n1,
        n_b=n2,
        place_a=_place(place1),
        place_b=_place(place2),
        tied_fraction=tied_fraction,
    )


def _peacock(reference: _core.KsReference, points: Points) -> KsComparison:
    d, tied, cut = reference.peacock(points)
    n1, n2 = reference.size, points.shape[0]
    distance, place = d / (n1 * n2), _place(cut)
    return KsComparison(distance, distance, distance, d, d, n1, n2, place, place, tied / (n1 + n2))


def _check_options(ties: str, combine: str, method: str) -> None:
    for option, word, words in (
        ("ties", ties, ("strict", "limits")),
        ("combine", combine, ("mean", "max")),
        ("method", method, ("fasano-franceschini", "peacock")),
    ):
        if word not in words:
            raise InputError(f"{option} must be one of {', '.join(words)}, got {word!r}")
