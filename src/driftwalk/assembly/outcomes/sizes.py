"""Sizes of assemblies: distribution, means over time, compactness.

Of many blocks nearly every run ends in a different class. Sizes are what runs have in common.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from driftwalk.assembly.lattice.joined_faces import JOINING, PARTING
from driftwalk.assembly.lattice.polyomino import shape_size
from driftwalk.assembly.outcomes.distribution import (
    at_times,
    attrs_of_runs,
    duration,
    require_assembly,
    runs_with_outcome,
    with_limits,
)
from driftwalk.assembly.outcomes.outcome_classes import MOST_BLOCKS
from driftwalk.assembly.outcomes.survival import checked_times
from driftwalk.core.arrays import Bools, Floats, Integers
from driftwalk.core.intervals import check_confidence
from driftwalk.schema.check import build_dataset
from driftwalk.schema.shapes import cells_of_shape, counts_of_shape, discs_of, joins_of_cells

if TYPE_CHECKING:
    import xarray as xr


METHOD: Final = "Student's t over runs, each interval on its own"


def assembly_sizes(
    assembly: xr.Dataset, *, times: npt.ArrayLike | None = None, confidence: float = 0.9
) -> xr.Dataset:
    """Return the sizes of the assemblies at the end of the runs, and how they grow.

    Parameters
    ----------
    assembly : xarray.Dataset
        An `assembly` dataset. Runs without an outcome (-1) are left out and counted.
    times : array_like, shape (time,), optional
        Times from the start of the runs [s], increasing, within their duration; default: 201 from 0
        to the duration.
    confidence : float
        Probability with which an interval holds, each on its own, in (0, 1).

    Returns
    -------
    xarray.Dataset
        Kind "assembly_sizes". By ``size``, at the end: ``number`` of assemblies per run, and
        ``block_share``, the share of the blocks that are in them. Each size up to 8 stands alone,
        beyond that come groups that double, from ``size`` to ``size_to`` blocks. Over ``time``:
        ``mean_size`` (blocks over assemblies), ``largest_share`` (share of the blocks that are in
        the largest assembly), ``free_share`` (that of the blocks that are alone) and
        ``compactness``. ``attrs``: the assembly's, ``runs``, ``left_out``, ``confidence``,
        ``method``, ``compactness`` at the end, and ``compactness_runs``, the runs that have one.
        All are means over runs, with ``_low`` and ``_high``.

    Raises
    ------
    InputError
        When it is no `assembly` dataset, has no run with an outcome, or an option is out of range.

    Notes
    -----
    Runs are independent: an interval is the mean over runs ± Student's t times its standard error,
    cut at what is possible. It is NaN of a single run, and has no width where all runs agree.

    An assembly of n blocks has the perimeter P: 4 n less 2 for every two of them side by side,
    holes counted. The least that n squares can have is 2 ceil(2 sqrt(n)) (Harary and Harborth,
    Extremal animals, J. Combin. Inform. System Sci. 1, 1, 1976). Compactness is their ratio::

        C = 2 ceil(2 sqrt(n)) / P

    It is 1 of the most compact polyominoes; a row has the least, near 2 / sqrt(n). That of a run is
    the mean over its assemblies of at least four blocks, weighted by their blocks: up to three
    blocks, all shapes have C = 1. A run without such an assembly has none, and the mean is that
    of the others.

    Examples
    --------
    >>> import xarray as xr
    >>> two_blocks = xr.Dataset(
    ...     {
    ...         "event_time": (("run", "event"), [[20.0], [np.nan]]),
    ...         "event_shape": (("run", "event", "part"), [[[0, 0, 1]], [[-1, -1, -1]]]),
    ...         "outcome": ("run", [0, 1]),
    ...     },
    ...     coords={"class": ["2", "1+1"], "shape": ["1", "2"]},
    ...     attrs={"kind": "assembly", "blocks": 2, "duration_s": 60.0},
    ... )
    >>> found = assembly_sizes(two_blocks, times=[10.0, 60.0])
    >>> found["number"].values.tolist(), found["mean_size"].values.tolist()
    ([1.0, 0.5], [1.0, 1.5])
    """
    require_assembly(assembly, "outcome", "event_time", "event_shape", "shape")
    check_confidence(confidence)
    time = checked_times(times, duration(assembly))
    sound = runs_with_outcome(assembly)
    blocks = int(assembly.attrs["blocks"])
    shapes = [str(name) for name in assembly["shape"].values]
    size = np.array([shape_size(name) for name in shapes], dtype=np.int64)
    event_shape = assembly["event_shape"].values[sound].astype(np.int64)
    sign = _signs(assembly, sound)
    number = _numbers_at_end(event_shape, sign, size, blocks)
    # Beyond eight blocks in groups whose width doubles, so that each has enough runs.
    first, last = _groups(blocks)
    grouped = np.add.reduceat(number, first - 1, axis=1)
    share = np.add.reduceat(number * np.arange(1, blocks + 1), first - 1, axis=1) / blocks
    event_time = assembly["event_time"].values[sound]
    courses = _courses(event_time, size[event_shape], sign, time, blocks)
    moments = np.append(time, np.inf)
    compact = _compactness_of_runs(event_time, event_shape, sign, shapes, size, moments)
    at_end = compact[:, -1:]
    data: dict[str, Any] = {}
    for name, dim, values, possible in (
        ("number", "size", grouped, (0.0, blocks / first)),
        ("block_share", "size", share, (0.0, 1.0)),
        ("mean_size", "time", courses[0], (1.0, blocks)),
        ("largest_share", "time", courses[1], (1.0 / blocks, 1.0)),
        ("free_share", "time", courses[2], (0.0, 1.0)),
        ("compactness", "time", compact[:, :-1], (0.0, 1.0)),
    ):
        data |= with_limits(name, dim, *_over_runs(values, confidence, possible))
    ends = _over_runs(at_end, confidence, (0.0, 1.0))
    names = ("compactness", "compactness_low", "compactness_high")
    attrs = {name: float(end[0]) for name, end in zip(names, ends, strict=True)}
    return build_dataset(
        "assembly_sizes",
        data,
        {"size": ("size", first), "size_to": ("size", last), "time": ("time", time)},
        {
            **attrs_of_runs(assembly, sound, confidence),
            **attrs,
            "compactness_runs": int(np.isfinite(at_end).sum()),
            "method": METHOD,
        },
    )


def compactness(shape: str) -> float:
    """Return the least perimeter of as many squares over the perimeter of a shape.

    Examples
    --------
    >>> compactness("O"), compactness("I")
    (1.0, 0.8)
    """
    size, joins = counts_of_shape(shape)
    if not size:
        cells = set(cells_of_shape(shape))
        size, joins = len(cells), joins_of_cells(cells)
    # ceil(2 sqrt(n)), in whole numbers.
    least = 2 * (math.isqrt(4 * size - 1) + 1)
    return least / (4 * size - 2 * joins)


def _signs(assembly: xr.Dataset, sound: Bools) -> Integers:
    """Return what each event does to the assemblies: 1 joins two, -1 parts one, 0 neither."""
    if "event_kind" not in assembly:
        return (assembly["event_shape"].values[sound][..., 2] >= 0).astype(np.int64)
    kind = assembly["event_kind"].values[sound]
    return np.asarray((kind == JOINING).astype(np.int64) - (kind == PARTING), dtype=np.int64)


def _numbers_at_end(event_shape: Integers, sign: Integers, size: Integers, blocks: int) -> Integers:
    """Return how many assemblies of each size a run ends with, shape (run, size - 1)."""
    number = np.zeros((event_shape.shape[0], blocks), dtype=np.int64)
    number[:, 0] = blocks
    run, _ = real = np.nonzero(sign)
    for part, change in ((0, -1), (1, -1), (2, 1)):
        np.add.at(number, (run, size[event_shape[real][:, part]] - 1), change * sign[real])
    return number


def _groups(blocks: int) -> tuple[Integers, Integers]:
    """Return the first and the last size of each group: 1, 2, ..., 8, 9 to 16, 17 to 32, ..."""
    doubling = (MOST_BLOCKS * 2**k + 1 for k in range(blocks.bit_length()))
    first = [start for start in (*range(1, MOST_BLOCKS + 1), *doubling) if start <= blocks]
    return np.array(first), np.array([*(start - 1 for start in first[1:]), blocks])


def _courses(
    event_time: Floats, event_size: Integers, sign: Integers, time: Floats, blocks: int
) -> tuple[Floats, Floats, Floats]:
    """Return mean size, share of the largest, share of free blocks, each of shape (run, time)."""
    real = np.isfinite(event_time)
    joined = sign.cumsum(axis=1)
    freed = ((event_size[..., :2] == 1).sum(axis=2) * sign).cumsum(axis=1)
    largest = np.maximum.accumulate(np.where(real, event_size[..., 2], 1), axis=1)
    if (sign < 0).any():
        largest = _largest(event_size, sign, blocks)
    joined, freed, largest = (
        at_times(event_time, course, start, time)
        for course, start in ((joined, 0), (freed, 0), (largest, 1))
    )
    return blocks / (blocks - joined), largest / blocks, 1.0 - freed / blocks


def _largest(event_size: Integers, sign: Integers, blocks: int) -> Integers:
    """Return the blocks of the largest assembly after each event, where some part again."""
    largest = np.ones(sign.shape, dtype=np.int64)
    for run, signs in enumerate(sign):
        number = np.zeros(blocks + 1, dtype=np.int64)
        number[1] = blocks
        for event, change in enumerate(signs.tolist()):
            one, other, both = event_size[run, event].tolist()
            if change:
                number[one] -= change
                number[other] -= change
                number[both] += change
            largest[run, event] = np.flatnonzero(number)[-1]
    return largest


def _compactness_of_runs(
    event_time: Floats,
    event_shape: Integers,
    sign: Integers,
    shapes: list[str],
    size: Integers,
    time: Floats,
) -> Floats:
    """Return the compactness of each run, shape (run, time); NaN where it has none."""
    # Up to three blocks, all shapes are equally compact; contact graphs have no perimeter.
    graphs = np.array([discs_of(name) > 0 for name in shapes])
    shaped = np.where((size >= 4) & ~graphs, size, 0)
    weighted = np.array([n and n * compactness(one) for n, one in zip(shaped, shapes, strict=True)])
    changes = (((one[event_shape] * (-1, -1, 1)).sum(axis=2) * sign) for one in (weighted, shaped))
    total, blocks = (at_times(event_time, one.cumsum(axis=1), 0, time) for one in changes)
    unknown = np.full(total.shape, np.nan)
    return np.asarray(np.divide(total, blocks, out=unknown, where=blocks > 0))


def _over_runs(
    values: npt.NDArray[Any], confidence: float, possible: tuple[float, float | Floats]
) -> tuple[Floats, Floats, Floats]:
    """Return the mean over runs (the first axis) and its interval, NaN where it has none.

    A run whose value is NaN is left out.
    """
    from scipy.special import stdtrit

    known = np.isfinite(values)
    runs = known.sum(axis=0)
    mean = np.where(known, values, 0.0).sum(axis=0) / np.where(runs > 0, runs, np.nan)
    squares = np.where(known, (values - mean) ** 2, 0.0).sum(axis=0)
    free = np.where(runs > 1, runs - 1, np.nan)
    reach = stdtrit(free, (1 + confidence) / 2) * np.sqrt(squares / free / np.maximum(runs, 1))
    least, most = possible
    return np.asarray(mean), np.maximum(mean - reach, least), np.minimum(mean + reach, most)
