"""Objective of a calibration: the distance of simulated steps from the recorded ones.

A statistic is prepared once with the recording and is then given tables of steps, one row per
simulated world. `StepDistance` is the paper's: the two-dimensional Kolmogorov-Smirnov distance of
step lengths and turning angles. Their joint density is binned for pictures.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from driftwalk import _core
from driftwalk.comparison.ks import KsReference
from driftwalk.comparison.plan import StepPlan, apply_steps, plan_steps
from driftwalk.core.arrays import Floats, Integers
from driftwalk.core.errors import InputError
from driftwalk.core.processors import map_in_threads
from driftwalk.schema.trajectory import Track

FEWEST_PAIRS: Final = 30
"""Pairs of steps without which a distance means little. Chosen by hand."""


class StepTable(NamedTuple):
    """The steps of many worlds, one row each; a row's tail is unused."""

    length: Floats
    """Step lengths [m], shape (worlds, pairs)."""
    angle: Floats
    """Turning angles [rad], shape (worlds, pairs)."""
    pairs: Integers
    """How many entries of a row are used, shape (worlds,)."""

    def rows(self, chosen: slice) -> StepTable:
        """Return some of the rows."""
        length, angle = (np.ascontiguousarray(one[chosen]) for one in (self.length, self.angle))
        return StepTable(length, angle, np.ascontiguousarray(self.pairs[chosen]))


@dataclass(frozen=True, eq=False)
class StepReference:
    """The recording's steps, and how those of a simulated world are formed.

    Attributes
    ----------
    plan : StepPlan
        Which samples of a world form steps.
    steps : ndarray, shape (pairs, 2)
        The recording's step lengths [m] and turning angles [rad].
    length_limit, angle_limit : float
        Densities of steps cover [0, length_limit] m and [-angle_limit, angle_limit] rad.
    """

    plan: StepPlan
    steps: Floats
    length_limit: float
    angle_limit: float

    @property
    def table(self) -> StepTable:
        """The recording's steps as a table of one row."""
        length, angle = (np.ascontiguousarray(column[None]) for column in self.steps.T)
        return StepTable(length, angle, np.array([len(self.steps)], dtype=np.int64))


class Distances(NamedTuple):
    """How far worlds are from the recording, shape (worlds,) each."""

    distance: Floats
    step_length: Floats
    """Step length at which the difference is largest [m]; 0 where there is none."""
    turning_angle: Floats
    """Turning angle at which it is largest [rad]."""
    quadrant: npt.NDArray[np.int32]
    """Index into `driftwalk.comparison.QUADRANTS`; -1 where there is no difference."""


class Statistic(Protocol):
    """A distance between motions, of tables of steps."""

    def prepare(self, track: Track, *, step_interval: float | None = None) -> StepReference:
        """Return the reference of a recorded track."""

    def distances(
        self, reference: StepReference, worlds: StepTable, *, threads: int = 1
    ) -> Distances:
        """Return how far each world is from the recording."""

    def matrix(self, a: StepTable, b: StepTable, *, threads: int = 1) -> Floats:
        """Return the distance of every row of one table to every row of another."""


def distances_among(statistic: Statistic, table: StepTable, *, threads: int = 1) -> Floats:
    """Return the distances between every two rows of a table, each once.

    Parameters
    ----------
    statistic : Statistic
        The distance.
    table : StepTable
        The worlds.
    threads : int
        Threads; the result does not depend on it.

    Returns
    -------
    ndarray, shape (rows (rows - 1) / 2,)
        In the order of ``numpy.triu_indices(rows, 1)``.

    Examples
    --------
    >>> steps = np.random.default_rng(1).normal(size=(2, 3, 50))
    >>> table = StepTable(*steps, np.full(3, 50))
    >>> whole = StepDistance().matrix(table, table)
    >>> distances_among(StepDistance(), table).tolist() == whole[[0, 0, 1], [1, 2, 2]].tolist()
    True
    """
    count = table.pairs.size
    found = np.zeros((count, count))

    def fill(first: int, last: int) -> None:
        # The first half meets the second; then each meets itself.
        if last - first < 2:
            return
        middle = (first + last) // 2
        halves = table.rows(slice(first, middle)), table.rows(slice(middle, last))
        found[first:middle, middle:last] = statistic.matrix(*halves, threads=threads)
        fill(first, middle)
        fill(middle, last)

    fill(0, count)
    return found[np.triu_indices(count, 1)]


@dataclass(frozen=True)
class StepDistance:
    """The two-dimensional Kolmogorov-Smirnov distance of step lengths and turning angles.

    Examples
    --------
    >>> from driftwalk.schema import Track
    >>> random = np.random.default_rng(1)
    >>> x, y = np.cumsum(random.normal(size=(2, 100)), axis=1)
    >>> reference = StepDistance().prepare(Track(np.arange(100.0), x, y, 0 * x))
    >>> StepDistance().matrix(reference.table, reference.table).tolist()
    [[0.0]]
    """

    def prepare(self, track: Track, *, step_interval: float | None = None) -> StepReference:
        """Return the steps of a recorded track, and the plan by which worlds form theirs.

        Parameters
        ----------
        track : Track
            The present samples of one body.
        step_interval : float, optional
            Time between the positions of a step [s]; default: the median sampling interval.

        Raises
        ------
        InputError
            When the track forms fewer than 30 pairs of steps.
        """
        plan = plan_steps(track.time - track.time[0], step_interval=step_interval)
        found = apply_steps(plan, track.x, track.y)
        steps = np.ascontiguousarray(np.column_stack([found.step_length, found.turning_angle]))
        if len(steps) < FEWEST_PAIRS:
            raise InputError(
                f"the recording gives {len(steps)} pairs of steps, at least {FEWEST_PAIRS} are "
                "needed: it hardly moves, is too short, or its clock does not suit the step "
                "interval (`steps.step_interval_s`)"
            )
        return StepReference(
            plan,
            steps,
            length_limit=1.5 * float(np.quantile(steps[:, 0], 0.999)),
            angle_limit=min(np.pi, 2.5 * float(np.quantile(np.abs(steps[:, 1]), 0.98))) or np.pi,
        )

    def distances(
        self, reference: StepReference, worlds: StepTable, *, threads: int = 1
    ) -> Distances:
        """Return the KS distance of each world to the recording, and where it sits.

        Parameters
        ----------
        reference : StepReference
            The recording.
        worlds : StepTable
            Steps of the worlds; one without a pair is as far as can be, 1.
        threads : int
            Threads; the result does not depend on it.
        """
        native = KsReference(reference.steps).native
        recorded = len(reference.steps)

        def one(row: int) -> tuple[float, float, float, int]:
            count = int(worlds.pairs[row])
            if count == 0:
                # No distance is farther than 1.
                return 1.0, 0.0, 0.0, -1
            sample = np.column_stack([worlds.length[row, :count], worlds.angle[row, :count]])
            d1, d2, _, _, _, place1, place2 = native.compare(sample, False)
            x, y, quadrant, _ = place1 if d1 >= d2 else place2
            return (d1 + d2) / (2 * recorded * count), x, y, quadrant

        found = map_in_threads(one, range(worlds.pairs.size), threads)
        columns = np.array(found, dtype=np.float64).reshape(-1, 4).T
        return Distances(columns[0], columns[1], columns[2], columns[3].astype(np.int32))

    def matrix(self, a: StepTable, b: StepTable, *, threads: int = 1) -> Floats:
        """Return the KS distance of every row of a table to every row of another.

        Parameters
        ----------
        a, b : StepTable
            The tables.
        threads : int
            Threads; the result does not depend on it.

        Returns
        -------
        ndarray, shape (rows of a, rows of b)
            1 where either row holds no pair.
        """
        return _core.ks_matrix(*a, *b, threads=threads)


def step_table(
    plan: StepPlan, x: npt.NDArray[np.floating], y: npt.NDArray[np.floating]
) -> StepTable:
    """Return the steps of many worlds.

    Parameters
    ----------
    plan : StepPlan
        Which samples form steps.
    x, y : ndarray, shape (worlds, samples)
        Positions [m]; NaN where a sample is missing.

    Returns
    -------
    StepTable
        One row per world.

    Examples
    --------
    >>> plan = plan_steps([0.0, 1.0, 2.0])
    >>> table = step_table(plan, np.array([[0.0, 1.0, 1.0]]), np.array([[0.0, 0.0, 2.0]]))
    >>> table.length.tolist(), table.pairs.tolist()
    ([[2.0]], [1])
    """
    length, angle = np.zeros((2, len(x), plan.pairs))
    pairs = np.zeros(len(x), dtype=np.int64)
    for world in range(len(x)):
        found = apply_steps(plan, x[world], y[world])
        count = pairs[world] = found.step_length.size
        length[world, :count], angle[world, :count] = found.step_length, found.turning_angle
    return StepTable(length, angle, pairs)


BINS = 32
"""Bins of each axis of a density. Chosen by hand."""


def step_length_edges(*step_length: npt.ArrayLike, bins: int = BINS) -> Floats:
    """Return bin edges for step lengths [m]: from 0 over 99.95 % of all that are given.

    Parameters
    ----------
    *step_length : array_like
        Step lengths [m] of one or more motions.
    bins : int
        Number of bins.

    Examples
    --------
    >>> step_length_edges([0.0, 1.0], bins=2).size
    3
    """
    pooled = np.concatenate([np.asarray(lengths, dtype=np.float64) for lengths in step_length])
    if pooled.size == 0:
        raise InputError("bin edges need at least one step length")
    # The few longest steps would leave most bins empty.
    limit = float(np.quantile(pooled, 0.9995))
    return np.linspace(0.0, limit if limit > 0 else 1.0, bins + 1)


def turning_angle_edges(*, bins: int = BINS) -> Floats:
    """Return bin edges for turning angles [rad]: from -pi to pi.

    Parameters
    ----------
    bins : int
        Number of bins.

    Examples
    --------
    >>> turning_angle_edges(bins=2).round(3).tolist()
    [-3.142, 0.0, 3.142]
    """
    return np.linspace(-np.pi, np.pi, bins + 1)


def joint_density(
    step_length: npt.ArrayLike,
    turning_angle: npt.ArrayLike,
    *,
    step_length_edge: npt.ArrayLike,
    turning_angle_edge: npt.ArrayLike | None = None,
) -> Floats:
    """Return the fraction of steps in every bin of step length and turning angle.

    Parameters
    ----------
    step_length, turning_angle : array_like, shape (n,)
        Steps [m], [rad].
    step_length_edge : array_like, shape (bins + 1,)
        Edges [m], increasing. Longer steps count in the last bin.
    turning_angle_edge : array_like, shape (bins + 1,), optional
        Edges [rad]; default: 32 bins from -pi to pi.

    Returns
    -------
    ndarray, shape (bins of length, bins of angle)
        Fractions; they add up to 1.

    Examples
    --------
    >>> joint_density([0.1, 0.9], [0.0, 0.1], step_length_edge=[0, 0.5, 1]).sum()
    np.float64(1.0)
    """
    length = np.asarray(step_length, dtype=np.float64)
    angle = np.asarray(turning_angle, dtype=np.float64)
    if length.shape != angle.shape or length.ndim != 1 or length.size == 0:
        raise InputError(
            f"step_length {length.shape} and turning_angle {angle.shape} must be of one size, "
            "not empty"
        )
    angle_edge = turning_angle_edges() if turning_angle_edge is None else turning_angle_edge
    edges = [np.asarray(one, dtype=np.float64) for one in (step_length_edge, angle_edge)]
    if any(one.ndim != 1 or one.size < 2 or (np.diff(one) <= 0).any() for one in edges):
        raise InputError("bin edges must increase, and be at least two")
    lengths, angles = edges
    counts, _, _ = np.histogram2d(
        np.clip(length, lengths[0], lengths[-1]),
        np.clip(angle, angles[0], angles[-1]),
        bins=(lengths, angles),
    )
    return np.asarray(counts / length.size)
