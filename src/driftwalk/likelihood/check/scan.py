"""Scan for a change of the flow: velocities in the same cell at different times.

The errors of prediction see a change of the flow badly: a wrong flow makes the fit lower C_d until
one sample tells little of the next. So the body's own velocity is looked at. For every stretch of
the recording (one part, or several that follow each other) its mean in each cell is compared with
the mean in the same cell during the rest; how far apart chance alone brings them is known from
simulated recordings, whose flow changes as the fitted one does. Compared is the mean over the cells
of the squared differences in units of what so many samples leave open, because a body that stays in
one place has many samples in few cells, and one that travels has few in many.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from driftwalk.core.arrays import Floats
from driftwalk.likelihood.check.place import Layout, cell_of
from driftwalk.likelihood.check.power import POWER
from driftwalk.likelihood.check.replicates import Path


class ScanPolicy(NamedTuple):
    """Which velocities are compared, and how far replicates scatter at least."""

    fewest_in_cell: int = 5
    """Velocities in a cell, on either side of the comparison. Chosen by hand."""
    longest_intervals: float = 1.5
    """A velocity is taken between samples at most this many usual intervals apart. Chosen by
    hand."""
    least_spread: float = 0.02
    """Least standard deviation of the logarithm of a difference among replicates: with a dozen
    replicates, a smaller one is chance. Chosen by hand."""


SCAN: Final = ScanPolicy()


class Scan(NamedTuple):
    """The stretch of the recording that differs most from the rest."""

    first: int
    """First part of the stretch."""
    last: int
    """Its last part."""
    difference: float
    """Root mean square difference of the velocities in the same cells [m/s]."""
    expected: float
    """Its median among simulated recordings [m/s]."""
    expected_std: float
    p_value: float
    detectable: float
    """Difference of a usual stretch that fails at the level nine times in ten [m/s]."""


def scan_of(
    real: Sequence[Path], simulated: Sequence[Sequence[Path]], layout: Layout, *, level: float
) -> Scan | None:
    """Return the stretch that differs most from the rest; None where there is only one part.

    `level` is the p value at which a change is found.
    """
    from scipy.stats import gumbel_r, norm

    stretches = _stretches(layout)
    if not stretches:
        return None
    found = np.array([_differences(one, stretches, layout) for one in (real, *simulated)])
    known = (found > 0.0).all(axis=(0, 1))
    if not known.any():
        return None
    differences, samples = found[..., known].swapaxes(0, 1)
    logs = np.log(differences * np.sqrt(samples))
    mine, theirs = logs[0], logs[1:]
    spread = max(float(np.sqrt(theirs.var(axis=0, ddof=1).mean())), SCAN.least_spread)
    off = (mine - theirs.mean(axis=0)) / spread
    # Each replicate against the others, as the recording is against all.
    others = (theirs.sum(axis=0) - theirs) / (len(theirs) - 1)
    largest = ((theirs - others) / spread).max(axis=1)
    best = int(off.argmax())
    # The largest of many has a tail like Gumbel's: two numbers, from mean and standard deviation.
    scale = largest.std(ddof=1) * np.sqrt(6.0) / np.pi
    largest_of = gumbel_r(largest.mean() - np.euler_gamma * scale, scale)
    first, last = stretches[int(np.flatnonzero(known)[best])]
    chosen = differences[1:, best]
    sigmas = float(largest_of.isf(level) + norm.ppf(POWER.share))
    return Scan(
        first,
        last,
        float(differences[0, best]),
        float(np.median(chosen)),
        float(chosen.std(ddof=1)),
        float(largest_of.sf(off[best])),
        float(np.median(np.exp(theirs.mean(axis=0) + sigmas * spread) / np.sqrt(samples[0]))),
    )


def _stretches(layout: Layout) -> list[tuple[int, int]]:
    """Return the first and last part of every stretch of one series, but not of a whole flow."""
    found = []
    in_flow = np.bincount([layout.flow(part) for part in range(layout.parts)])
    for first in range(layout.parts):
        for last in range(first, layout.parts):
            same = layout.series[first] == layout.series[last]
            if same and last - first + 1 < in_flow[layout.flow(first)]:
                found.append((first, last))
    return found


def _differences(
    paths: Sequence[Path], stretches: Sequence[tuple[int, int]], layout: Layout
) -> Floats:
    """Return the root mean square difference of each stretch to the rest [m/s], and samples a cell.

    The rest is that in the same flow. Both are 0 where no cell has enough of either.
    """
    sums = np.concatenate([_sums(path, index, layout) for index, path in enumerate(paths)])
    flows = np.array([layout.flow(part) for part in range(layout.parts)])
    whole = {int(flow): sums[flows == flow].sum(axis=0) for flow in np.unique(flows)}
    running = np.concatenate([np.zeros((1, *sums.shape[1:])), np.cumsum(sums, axis=0)])
    found = np.zeros((2, len(stretches)))
    for k, (first, last) in enumerate(stretches):
        inside = running[last + 1] - running[first]
        rest = whole[int(flows[first])] - inside
        both = (inside[0] >= SCAN.fewest_in_cell) & (rest[0] >= SCAN.fewest_in_cell)
        if both.any():
            inside, rest = inside[:, both], rest[:, both]
            apart = inside[1:] / inside[0] - rest[1:] / rest[0]
            weight = 1.0 / (1.0 / inside[0] + 1.0 / rest[0])
            found[0, k] = np.sqrt((weight * (apart**2).sum(axis=0)).sum() / weight.sum())
            found[1, k] = weight.mean()
    return found


def _sums(path: Path, series: int, layout: Layout) -> Floats:
    """Return number and sums of the velocities by part and cell, (parts, 3, cells)."""
    time, x, y = (np.asarray(one, dtype=np.float64) for one in path)
    step = np.diff(time)
    parts = np.flatnonzero(layout.series == series)
    part = np.searchsorted(layout.start[parts][1:], time[:-1], side="right")
    cell = cell_of(layout, 0.5 * (x[:-1] + x[1:]), 0.5 * (y[:-1] + y[1:]))
    retained = step <= SCAN.longest_intervals * np.median(step)
    group = (part * layout.cells + cell)[retained]
    size = parts.size * layout.cells
    weights = (None, (np.diff(x) / step)[retained], (np.diff(y) / step)[retained])
    found = [np.bincount(group, one, minlength=size) for one in weights]
    return np.asarray(np.stack(found).reshape(3, parts.size, -1).transpose(1, 0, 2), np.float64)
