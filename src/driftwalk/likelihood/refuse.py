"""Fits that are refused, with the remedies: recordings too short or at the wall, no solution."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.conditions import is_stated
from driftwalk.core.arrays import Floats
from driftwalk.core.errors import InputError
from driftwalk.core.processors import machine_memory
from driftwalk.core.units import in_percent
from driftwalk.likelihood.filter.series import FILTER, Series, usable_intervals

if TYPE_CHECKING:
    from driftwalk.model import Study
    from driftwalk.schema import Track


class LengthPolicy(NamedTuple):
    """The precision of C_d that a recording of usual length gives."""

    usual_precision: float = 0.1
    """Standard error of ln C_d above which a fit warns, where the user states no precision. Chosen
    by hand."""
    usual_s: float = 1200.0
    """Length [s] in which C_d comes out to the two precisions that follow: 20 minutes, 10 to 30 by
    the flow. A rule of thumb, chosen by hand."""
    without_angle: float = 0.1
    """Standard error of ln C_d in that time without orientations. Cautious: half an hour has 6 % on
    the bundled recording (docs/explanation/likelihood.md)."""
    with_angle: float = 0.05
    """Standard error of ln C_d in that time with orientations. Cautious: half an hour has 1 % on
    the bundled recording (docs/explanation/likelihood.md)."""


LENGTH: Final = LengthPolicy()


def needed_duration(duration: float, std: float, precision: float) -> float:
    """Return how long a recording like this one has to be for a precision [s].

    Examples
    --------
    >>> needed_duration(600.0, 0.2, 0.1)
    2400.0
    """
    return duration * (std / precision) ** 2


def in_words(seconds: float) -> str:
    """Return a length of time, rounded up to two digits.

    Examples
    --------
    >>> in_words(61.0), in_words(1234.0), in_words(30000.0)
    ('61 s', '21 min', '8.4 h')
    """
    unit, name = (1.0, "s") if seconds < 120 else (60.0, "min") if seconds < 5400 else (3600.0, "h")
    value = seconds / unit
    grain = 10.0 ** (math.floor(math.log10(max(value, 1e-9))) - 1)
    return f"{grain * math.ceil(value / grain - 1e-9):.6g} {name}"


def length_advice(precision: float | None) -> str:
    """Return the sentence on how long to record, for a precision or in general."""
    if precision is None:
        return (
            "As a rule 10 to 30 min give C_d to 10 % without orientations, to about 5 % with them"
        )
    with_angle, without = (
        in_words(needed_duration(LENGTH.usual_s, usual, precision))
        for usual in (LENGTH.with_angle, LENGTH.without_angle)
    )
    return (
        f"For C_d to {100 * precision:.3g} % record some {with_angle} with orientations, "
        f"{without} without, as a rule"
    )


class LimitPolicy(NamedTuple):
    """Which recordings a fit refuses, and what it announces."""

    fewest_samples: int = 100
    """Positions, or intervals between them, that a flow needs at least. Chosen by hand."""
    most_wall_share: float = 0.3
    """Share of intervals at the wall above which C_d means little (docs/explanation/likelihood.md).
    The accuracy is measured below it."""
    least_scatter: float = 0.25
    """Standard deviation of the positions, over the side of the block, below which it stays in one
    place. In a sink or in the core of a vortex it was 0.1 to 0.2, on a narrow orbit 0.6. Chosen by
    hand."""
    most_at_own_wall: float = 0.9
    """Share of the intervals at the wall of a tank that was fitted to the positions themselves.
    Chosen by hand."""
    most_coefficients: int = 4400
    """Coefficients of all flows together: about six flows in the paper's tank. Chosen by hand, from
    the memory and the time that `require_size` states."""
    sample_bytes: float = 5200.0
    """Memory of a fit for each sample. Measured: 0.27 GB at 18,000 samples, 0.49 GB at 60,000, with
    the angle in the state; a million took 4 GB."""
    sample_s: float = 1.2e-3
    """Time of one processor for each sample, with the check. Measured: 0.8 ms for the fit at 18,000
    and at 60,000 samples in the paper's tank, and half as much for the check."""
    notable_bytes: float = 2e9
    """A fit that takes more memory is announced. Chosen by hand."""
    notable_s: float = 600.0
    """A fit that takes longer is announced [s]. Chosen by hand."""


LIMIT: Final = LimitPolicy()


class Work(NamedTuple):
    """Memory and time that a fit takes."""

    samples: int
    memory: float
    """[bytes]"""
    seconds: float

    @property
    def notable(self) -> bool:
        """Whether it is so much that it should be said before."""
        return self.memory > LIMIT.notable_bytes or self.seconds > LIMIT.notable_s

    def describe(self) -> str:
        """Return "a fit of 1000000 samples takes about 5.2 GB of memory and 20 min".

        Examples
        --------
        >>> fit_work(1_000_000).describe()
        'a fit of 1000000 samples takes about 5.2 GB of memory and 20 min'
        """
        return (
            f"a fit of {self.samples} samples takes about {self.memory / 1e9:.2g} GB of memory and "
            f"{in_words(self.seconds)}"
        )

    def advice(self) -> str:
        """Return how to take fewer samples."""
        excess = max(self.memory / LIMIT.notable_bytes, self.seconds / LIMIT.notable_s)
        every = max(math.ceil(excess), 2)
        return (
            "fit a part of the time (`start`, `stop` of `load`), or fewer samples a second, such "
            f"as one row in {every} of the file"
        )


def fit_work(samples: int) -> Work:
    """Return the memory and the time of a fit, as measured.

    Parameters
    ----------
    samples : int
        Samples of all recordings together.

    Returns
    -------
    Work
        Memory [bytes] and time of one processor [s].

    Examples
    --------
    >>> round(fit_work(100_000).seconds)
    120
    """
    return Work(samples, LIMIT.sample_bytes * samples, LIMIT.sample_s * samples)


def require_memory(samples: int) -> None:
    """Refuse more samples than this machine has memory for."""
    work, there = fit_work(samples), machine_memory()
    if there is not None and work.memory > there:
        raise InputError(
            f"{work.describe()}, and this machine has {there / 1e9:.2g} GB: {work.advice()}"
        )


def require_length(track: Track, study: Study, *, where: str) -> None:
    """Refuse a recording with too few positions."""
    if track.time.size < LIMIT.fewest_samples:
        raise InputError(
            f"{where}the recording has {track.time.size} positions of this body; the fit needs "
            f"{LIMIT.fewest_samples} at least. "
            f"{length_advice(study.fit.drag_coefficient_precision)}"
        )


def require_own_arena(series: Sequence[Series], study: Study, *, where: str) -> None:
    """Refuse a tank that was fitted to the positions and then excludes nearly all of them."""
    intervals, near_wall = _intervals_of(series)
    if near_wall <= LIMIT.most_at_own_wall * intervals:
        return
    reason = (
        "the body stays in a region too small to find the tank from. State the tank with "
        '`tank="circle:D"`, and check the scale and the side of the block'
        if is_stated(study, "block.side_m")
        else "the side was not stated, so this is the default. State the side of your body with "
        "`block.side_m`, and check the scale"
    )
    raise InputError(
        f'{where}`tank="fit"` found a tank {1e3 * max(study.tank.extent_m):.3g} mm across, in '
        f"which a block of {1e3 * study.block.side_m:.3g} mm is at the wall in {near_wall} of "
        f"{intervals} intervals: {reason}"
    )


def require_usable(series: Sequence[Series], study: Study, *, where: str = "") -> None:
    """Refuse when too few intervals are left after those at the wall and in gaps."""
    usable = usable_intervals(series)
    if usable >= LIMIT.fewest_samples:
        return
    (intervals, near_wall), tank = _intervals_of(series), study.tank.describe()
    advice = (
        "check size and place of the tank, and record where the block stays away from the wall"
        if near_wall > intervals / 2
        else "check the tank, or record for longer"
    )
    left_out = (
        f"all {intervals} intervals are at the wall of the tank (a {tank})"
        if near_wall == intervals
        else f"only {usable} of {intervals} intervals can be used, at least "
        f"{LIMIT.fewest_samples} are needed: {near_wall} are at the wall of the tank (a {tank}), "
        f"the others are longer than {FILTER.longest_gap_s:g} s or have no orientation near"
    )
    raise InputError(f"{where}{left_out}; {advice}")


def _intervals_of(series: Sequence[Series]) -> tuple[int, int]:
    """Return how many intervals between samples there are, and how many are at the wall."""
    return sum(one.time.size - 1 for one in series), sum(one.near_wall for one in series)


def require_size(flows: int, coefficients: int) -> None:
    """Refuse more flows than can be fitted together in sensible memory and time."""
    total = flows * coefficients
    if flows == 1 or total <= LIMIT.most_coefficients:
        return
    # Half a dozen matrices of doubles; inverse and factors take some 3 n^3 operations in each of
    # about twenty steps.
    memory = 6 * 8 * total**2 / 1e9
    fitting = LIMIT.most_coefficients // coefficients
    minutes = 20 * 3 * float(total) ** 3 / 3e10 / 60
    raise InputError(
        f"{flows} flows of {coefficients} coefficients are too many to fit together: they would "
        f"take about {memory:.1f} GB and {minutes:.0f} min, {fitting} "
        "can be fitted; set knots further apart (`fit.spline_spacing_m`), give flows that come "
        "back the same name (`fit.flow_labels`), or fit parts of the recording (`start`, `stop` "
        "of `load`)"
    )


BREAKDOWN = (np.linalg.LinAlgError, ArithmeticError, ValueError)
"""Errors of a search that diverges: a matrix that is not positive definite, a parameter that
is no longer a number, the root of a negative variance, a value that the filter refuses."""


@contextmanager
def solved(reason: str) -> Iterator[None]:
    """Turn every way in which a search breaks down into one error for people."""
    try:
        with np.errstate(all="ignore"):
            yield
    except InputError:
        raise
    except BREAKDOWN as error:
        raise InputError(f"the fit has no solution for this recording: {reason}") from error


def reason_of_no_solution(wall_share: float, tracks: Sequence[Track], study: Study) -> str:
    """Return why a search may break down, and what to do."""
    scatter, side = _scatter(tracks), study.block.side_m
    if scatter < LIMIT.least_scatter * side:
        return (
            f"the block stays in one place (its positions scatter by {1e3 * scatter:.2g} mm, and "
            f"its side is {1e3 * side:.3g} mm), and nothing is learned there of the flow and the "
            "drag; record it on a wider path, with another setting of the pumps"
        )
    if wall_share > LIMIT.most_wall_share:
        return (
            f"{in_percent(wall_share)} of the intervals are at the wall and were left out, and the "
            "motion in the others does not follow the model; record where the body stays away from "
            "the wall, or check the tank, the side of the block and the units"
        )
    return (
        "the motion does not follow the model at all, or the tank, the block or the units are wrong"
    )


def cholesky(information: Floats) -> Any:
    """Return scipy's Cholesky factor of an information matrix."""
    from scipy.linalg import cho_factor

    if not np.isfinite(information).all():
        raise np.linalg.LinAlgError("the information matrix is not finite")
    return cho_factor(information, check_finite=False)


def require_noise_below_motion(noise: float, tracks: Sequence[Track], reason: str) -> None:
    """Refuse a solution that takes the whole motion for tracking noise."""
    scatter = _scatter(tracks)
    if noise > scatter:
        raise InputError(
            "the fit has no solution for this recording: it attributes the whole "
            f"motion to tracking noise ({1e3 * noise:.3g} mm, while the positions "
            f"scatter by {1e3 * scatter:.3g} mm); {reason}"
        )


def _scatter(tracks: Sequence[Track]) -> float:
    """Return the standard deviation of the positions along the axis where it is largest [m]."""
    return max(float(axis.std()) for track in tracks for axis in (track.x, track.y))
