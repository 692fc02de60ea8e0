"""Recordings that cannot be fitted, and the remedies: too short, or at the wall."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

from driftwalk.conditions import is_stated
from driftwalk.core.errors import InputError
from driftwalk.core.processors import machine_memory
from driftwalk.likelihood.length import in_words, length_advice

if TYPE_CHECKING:
    from driftwalk.model import Study
    from driftwalk.schema import Track


class LimitPolicy(NamedTuple):
    """Which recordings a fit refuses, and what it announces."""

    fewest_samples: int = 100
    """Positions, or intervals between them, that a flow needs at least. Chosen by hand."""
    most_wall_share: float = 0.3
    """Share of intervals at the wall above which C_d means little (docs/explanation/likelihood.md).
    The accuracy is measured below it."""
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
        every = max(
            math.ceil(self.memory / LIMIT.notable_bytes),
            math.ceil(self.seconds / LIMIT.notable_s),
            2,
        )
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


def require_own_arena(study: Study, *, intervals: int, near_wall: int, where: str) -> None:
    """Refuse a tank that was fitted to the positions and then excludes nearly all of them."""
    if near_wall <= LIMIT.most_at_own_wall * intervals:
        return
    reason = (
        "the body stays in a region too small to find the tank from. State the tank with "
        '`tank="circle:D"`, and check the scale and the side of the block'
        if is_stated(study, "block.side_m")
        else "the side was not stated, and this is the default. State that of your body with "
        "`block.side_m`, and check the scale"
    )
    raise InputError(
        f'{where}`tank="fit"` found a tank {1e3 * max(study.tank.extent_m):.3g} mm across, in '
        f"which a block of {1e3 * study.block.side_m:.3g} mm is at the wall in {near_wall} of "
        f"{intervals} intervals: {reason}"
    )


def require_usable(
    usable: int, *, intervals: int, near_wall: int, tank: str, longest_gap: float, where: str
) -> None:
    """Refuse when too few intervals are left after those at the wall and in gaps."""
    if usable >= LIMIT.fewest_samples:
        return
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
        f"the others are longer than {longest_gap:g} s or have no orientation near"
    )
    raise InputError(f"{where}{left_out}; {advice}")


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
