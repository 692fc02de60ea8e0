"""Likelihoods of a short stretch of a track under the lengths that its intervals may have.

A window has four samples on either side of the interval in question. Its path is a parabola, which
the window itself has to tell, plus an integrated Wiener process (the velocity under random
accelerations), plus white tracking noise. A longer interval stretches the path: that is the only
thing it does, in x, y and the orientation alike. The alternatives are what else may happen there: a
sample that is wrong, a bounce (another velocity from one moment on), a jump to another place.

The parabola's coefficients have a flat prior in units of the displacement over the window: where
the block does not move, no length of an interval is more likely than another.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.likelihood.spline import Floats

WIDTH: Final = 8
"""Samples of a window, four on either side of the interval in question."""
MIDDLE: Final = 3
"""Which of the window's intervals is the one in question."""
MOST_MISSING: Final = 3
"""Missing frames in one interval that are looked for."""
CONTROL_LENGTHS: Final = (0.5, 1.5, 2.5)
"""Lengths that no dropped frame makes. Quick movements of an animal, or a clock that is not
regular, make them as often as double ones."""
DROPS: Final = tuple(range(1, MOST_MISSING + 1))
CONTROL, WRONG, BOUNCE, JUMP = range(MOST_MISSING + 1, MOST_MISSING + 5)
CLEAN: Final = 0
CLASSES: Final = JUMP + 1


class Axis(NamedTuple):
    """One coordinate of a track, and what its noise and its accelerations are."""

    values: Floats
    """Shape (n,); NaN where missing."""
    noise: float
    """Standard deviation of the tracking noise."""
    intensity: float
    """Of the white acceleration [1/s^3 times the unit squared]."""
    step: float
    """Root mean square of the change from sample to sample."""


class Pattern(NamedTuple):
    """One thing that may have happened in a window."""

    kind: int
    at: int
    """Interval, or sample of a wrong one."""
    lengths: Floats
    """Of the window's intervals, in intervals of the clock."""
    shift: Floats | None
    """Shape of what is added to the path, whose size is unknown; None for nothing."""


def patterns_of(lengths: Floats, stamped: float) -> list[Pattern]:
    """Return what may have happened in a window."""
    plain = lengths.copy()
    plain[MIDDLE] = stamped
    found = [Pattern(CLEAN, MIDDLE, plain, None)]

    def longer(at: int, by: float) -> Floats:
        other = plain.copy()
        other[at] += by
        return other

    found += [Pattern(DROPS[0], at, longer(at, 1.0), None) for at in range(WIDTH - 1)]
    found += [
        Pattern(kind, MIDDLE, longer(MIDDLE, missing), None)
        for missing, kind in enumerate(DROPS[1:], start=2)
    ]
    found += [
        Pattern(CONTROL, MIDDLE, longer(MIDDLE, length - 1.0), None) for length in CONTROL_LENGTHS
    ]
    number = np.arange(WIDTH)
    time = np.concatenate([[0.0], np.cumsum(plain)])
    found += [Pattern(WRONG, at, plain, (number == at).astype(np.float64)) for at in range(WIDTH)]
    for at in range(WIDTH - 1):
        since = np.maximum(time - 0.5 * (time[at] + time[at + 1]), 0.0)
        found.append(Pattern(BOUNCE, at, plain, since))
        found.append(Pattern(JUMP, at, plain, (number > at).astype(np.float64)))
    return found


_USUAL: Final = patterns_of(np.ones(WIDTH - 1), 1.0)
KIND: Final = np.array([one.kind for one in _USUAL])
"""Of each pattern; the same for every window."""
AT_MIDDLE: Final = np.array([one.at == MIDDLE for one in _USUAL])
HERE: Final = np.bincount(KIND[AT_MIDDLE], minlength=CLASSES)
"""Number of patterns of each kind at the middle interval."""


def log_likelihoods(
    axes: Sequence[Axis],
    starts: npt.NDArray[np.intp],
    lengths: Floats,
    stamped: Floats,
    *,
    dt: float,
) -> Floats:
    """Return the log likelihood of every window under every pattern, relative to the first."""
    around = starts[:, None] + np.arange(WIDTH - 1)
    key = lengths[around]
    key[:, MIDDLE] = stamped[starts + MIDDLE]
    unique, group = np.unique(key, axis=0, return_inverse=True)
    chi = np.zeros((starts.size, KIND.size))
    constant = np.zeros((starts.size, KIND.size))
    dof = np.zeros(starts.size)
    for number, one in enumerate(unique):
        rows = np.flatnonzero(group.ravel() == number)
        patterns = patterns_of(one, one[MIDDLE])
        members = starts[rows, None] + np.arange(WIDTH)
        for axis in axes:
            factor, half = _factors(patterns, axis, dt)
            values = axis.values[members]
            known = np.isfinite(values).all(axis=1)
            values = np.where(known[:, None], values - values[:, :1], 0.0)
            chi[rows] += (np.tensordot(values, factor, axes=(1, 1)) ** 2).sum(axis=2)
            constant[rows] += np.where(known[:, None], half, 0.0)
            dof[rows] += np.where(known, WIDTH - 3, 0)
    # Where the model of the path is too narrow, as in a flow with sharp bends, so are all of these.
    usual = max(float(np.median(chi[:, CLEAN])) / max(float(np.median(dof)) - 2.0 / 3.0, 1.0), 1.0)
    # Student's law with 6 degrees of freedom, chosen by hand, in place of the normal one:
    # accelerations are not the same everywhere.
    found: Floats = constant - 0.5 * (6.0 + dof[:, None]) * np.log1p(chi / (usual * 6.0))
    return found - found[:, :1]


def _factors(patterns: Sequence[Pattern], axis: Axis, dt: float) -> tuple[Floats, Floats]:
    """Return for each pattern the matrix whose product with a window is white, and a constant.

    Shapes (p, WIDTH, WIDTH - 3) and (p,): the matrix is blind for parabolas, and the
    constant is the logarithm of its normalisation.
    """
    time = dt * np.array([np.concatenate([[0.0], np.cumsum(one.lengths)]) for one in patterns])
    early = np.minimum(time[:, :, None], time[:, None, :])
    late = np.maximum(time[:, :, None], time[:, None, :])
    covariance = axis.intensity * early**2 * (late / 2.0 - early / 6.0)
    covariance += axis.noise**2 * np.eye(WIDTH)
    # A wrong sample and a jump may be many times the noise, a bounce turns the velocity round.
    size = {
        WRONG: 10.0 * axis.noise + 2.0 * axis.step,
        BOUNCE: 2.0 * axis.step,
        JUMP: 10.0 * axis.noise + 3.0 * axis.step,
    }
    for number, one in enumerate(patterns):
        if one.shift is not None:
            covariance[number] += size[one.kind] ** 2 * np.outer(one.shift, one.shift)
    span = time[:, -1:, None]
    basis = (time[:, :, None] / span) ** np.arange(3)
    root = np.linalg.cholesky(covariance)
    q, r = np.linalg.qr(np.linalg.solve(root, basis), mode="complete")
    blind = q[:, :, 3:]
    half = np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1)
    half += np.log(np.abs(np.diagonal(r, axis1=1, axis2=2))).sum(axis=1)
    return np.linalg.solve(np.swapaxes(root, 1, 2), blind), -half
