"""How well the parameters are known: a parametric bootstrap on a stored surface.

Recordings are simulated at the optimum, with the length, gaps and camera noise of the real one, and
each is estimated anew with the same smooth surface, against steps that were simulated once around
the optimum. (It meets two of their four replicates, in turn, so that the noise of the surface is
part of what chance does.) For each, the truth is known: it is the optimum. How far D at the truth
lies above the smallest D of its own surface, the excess, is what chance does; its 90 % quantile is
the level up to which the real recording's surface is plausible. So the region follows the valley,
whatever its shape, and holds the truth in 90 % of recordings if the model is true. Intervals come
from profiles, the smallest D over the other parameter, in the same way.

Where D at the optimum stays above the noise floor the model is not quite true; the level is then
raised by their ratio, as a reduced chi-square above one widens the errors of a least-squares fit
(Birge, Phys. Rev. 40, 207, 1932).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk import _core
from driftwalk.calibration.problem import Floats, Problem, score_worlds, worlds_of
from driftwalk.calibration.search import BANDWIDTH_STEPS, Map, Progress, Window, window_smoother
from driftwalk.calibration.surface import FINENESS, Optimum, Smoother, make_smoother
from driftwalk.sweep import Store, WorkUnit, grid, run_sweep

SURFACE_POINTS = (13, 15)
"""Most settings along each axis of the stored surface."""
SURFACE_MARGIN = 3
"""Refined steps around the settings that could be the optimum."""
SURFACE_REPLICATES = 4
MET_BY_EACH = 2
"""Replicates of the surface that one recording is compared with."""
RECORDINGS_PER_UNIT = 10
FLOOR_REFERENCES = 8


class Steps(NamedTuple):
    """The steps of many simulated recordings, one row each; a row's tail is unused."""

    length: npt.NDArray[np.float64]
    angle: npt.NDArray[np.float64]
    pairs: npt.NDArray[np.int64]

    def rows(self, chosen: slice) -> Steps:
        """Return some of the rows."""
        return Steps(
            np.ascontiguousarray(self.length[chosen]),
            np.ascontiguousarray(self.angle[chosen]),
            np.ascontiguousarray(self.pairs[chosen]),
        )


@dataclass(frozen=True, eq=False)
class StoredSurface:
    """Simulated steps of the settings around an optimum, to estimate any recording against."""

    smoother: Smoother
    parts: tuple[Steps, ...]
    """Each holds `MET_BY_EACH` replicates of every setting, replicates fastest."""
    threads: int

    def distances(self, recordings: Steps, part: int) -> Floats:
        """Return the mean KS distance of each recording to each setting, (recording, setting)."""
        chosen = self.parts[part % len(self.parts)]
        matrix = _core.ks_matrix(*recordings, *chosen, threads=self.threads)
        return np.asarray(matrix.reshape(len(matrix), -1, MET_BY_EACH).mean(axis=2))


def build_surface(
    problem: Problem,
    refined: Map,
    optimum: Optimum,
    steps: tuple[float, float],
    *,
    margin: float,
) -> StoredSurface:
    """Simulate the settings that could be a recording's optimum.

    Parameters
    ----------
    problem : Problem
        The recording.
    refined : Map
        The second pass of the search.
    optimum : Optimum
        Its minimum.
    steps : tuple of float
        Steps of the refined grid.
    margin : float
        Settings whose smooth distance is within `margin` of the minimum are covered: the noise
        floor.

    Returns
    -------
    StoredSurface
        On the refined grid, or on every k-th value of it where that has too many settings.
    """
    axes, bandwidth = [], []
    ranges = _plausible_ranges(refined, optimum, steps, margin)
    for axis, (low, high), step, most in zip(
        (refined.drag_coefficient, refined.force_std), ranges, steps, SURFACE_POINTS, strict=True
    ):
        stride = max(int(np.ceil((high - low) / (most - 1))), 1)
        axes.append(axis[low : high + 1 : stride])
        bandwidth.append((BANDWIDTH_STEPS if stride == 1 else 1.5 * stride) * step)
    drag, force = (values.ravel() for values in np.meshgrid(*axes, indexing="ij"))
    parts = tuple(
        simulated_steps(
            problem,
            drag,
            force,
            stage="surface",
            replicates=MET_BY_EACH,
            first=part * drag.size,
        )
        for part in range(SURFACE_REPLICATES // MET_BY_EACH)
    )
    smoother = make_smoother(axes[0], axes[1], bandwidth=(bandwidth[0], bandwidth[1]))
    return StoredSurface(smoother, parts, problem.threads)


def _plausible_ranges(
    refined: Map, optimum: Optimum, steps: tuple[float, float], margin: float
) -> list[tuple[int, int]]:
    """Return the index ranges of the refined grid that hold what could be the optimum."""
    window = Window(refined.drag_coefficient, refined.force_std)
    surface = window_smoother(window, steps).surface(refined.mean.ravel())[::FINENESS, ::FINENESS]
    inside = np.argwhere(surface <= optimum.distance + margin)
    return [
        (max(int(low) - SURFACE_MARGIN, 0), min(int(high) + SURFACE_MARGIN, axis.size - 1))
        for axis, low, high in zip(window, inside.min(axis=0), inside.max(axis=0), strict=True)
    ]


def simulated_steps(
    problem: Problem,
    drag_coefficient: Floats,
    force_std: Floats,
    *,
    stage: str,
    replicates: int,
    first: int = 0,
) -> Steps:
    """Simulate settings and return the steps of every world, replicates fastest."""
    worlds = worlds_of(
        problem, drag_coefficient, force_std, stage=stage, first=first, replicates=replicates
    )
    found = score_worlds(problem, problem.model(), worlds, keep_steps="yes")
    return Steps(found["step_length"], found["turning_angle"], found["pairs"])


def recordings_at(
    problem: Problem, optimum: Optimum, *, stage: str, count: int
) -> tuple[Steps, Floats]:
    """Simulate recordings at an optimum; return their steps and distances to the real one."""
    worlds = worlds_of(
        problem,
        [optimum.drag_coefficient],
        [optimum.force_std],
        stage=stage,
        first=0,
        replicates=count,
    )
    found = score_worlds(problem, problem.model(), worlds, keep_steps="yes")
    steps = Steps(found["step_length"], found["turning_angle"], found["pairs"])
    return steps, np.asarray(found["ks_distance"])


class Bootstrap(NamedTuple):
    """Recordings simulated at the optimum, and what is learnt from them."""

    drag_coefficient: Floats
    force_std: Floats
    """Their estimates, [N]."""
    excess: Floats
    """D at the truth above the smallest D: jointly, and of the profile along each parameter;
    shape (recording, 3)."""
    to_recording: Floats
    """KS distance of each to the real recording."""
    to_each_other: Floats
    """KS distance of the first few to each of the rest: two realisations of the same truth."""


def run_bootstrap(
    problem: Problem,
    optimum: Optimum,
    surface: StoredSurface,
    *,
    count: int,
    store: Store | None = None,
    progress: Progress | None = None,
) -> Bootstrap:
    """Simulate recordings at the optimum and estimate each anew.

    Parameters
    ----------
    problem : Problem
        The recording.
    optimum : Optimum
        Where to simulate.
    surface : StoredSurface
        What to estimate against.
    count : int
        Number of recordings, at least 2.
    store : Store, optional
        Where finished work units are kept.
    progress : callable, optional
        Told the number of recordings done and in all.
    """
    recordings, to_recording = recordings_at(problem, optimum, stage="bootstrap", count=count)

    def compute(unit: WorkUnit) -> dict[str, npt.NDArray[Any]]:
        rows = recordings.rows(slice(unit.start, unit.stop))
        distances = surface.distances(rows, unit.start // RECORDINGS_PER_UNIT)
        estimates = [surface.smoother.optimum(row) for row in distances]
        return {
            "drag_coefficient": np.array([found.drag_coefficient for found in estimates]),
            "force_std": np.array([found.force_std for found in estimates]),
            "excess": np.array([_excess(surface.smoother, row, optimum) for row in distances]),
        }

    units = grid(recording=np.arange(count)).units(RECORDINGS_PER_UNIT)
    estimates = run_sweep(compute, units, store=store, progress=progress)
    few = min(FLOOR_REFERENCES, count // 2)
    among = _core.ks_matrix(
        *recordings.rows(slice(0, few)),
        *recordings.rows(slice(few, count)),
        threads=problem.threads,
    )
    return Bootstrap(
        estimates["drag_coefficient"],
        estimates["force_std"],
        estimates["excess"],
        to_recording,
        among,
    )


def _excess(smoother: Smoother, distance: Floats, truth: Optimum) -> tuple[float, float, float]:
    """Return how far D at the truth lies above the minimum: jointly, and along each profile."""
    surface = smoother.surface(distance)
    row = int(np.argmin(np.abs(smoother.drag_coefficient - truth.drag_coefficient)))
    column = int(np.argmin(np.abs(smoother.force_std - truth.force_std)))
    low = surface.min()
    return (
        float(surface[row, column] - low),
        float(surface[row].min() - low),
        float(surface[:, column].min() - low),
    )


class Region(NamedTuple):
    """Where the true parameters may be."""

    drag_coefficient_interval: tuple[float, float]
    force_std_interval: tuple[float, float]
    """[N]"""
    drag_coefficient: Floats
    """Vertices of the border of the joint region, closed."""
    force_std: Floats
    level: float
    """The smooth surface is below it in the region."""


def confidence_region(
    smoother: Smoother,
    surface: Floats,
    bootstrap: Bootstrap,
    *,
    confidence: float,
    stretch: float = 1.0,
) -> Region:
    """Return intervals and a joint region of the stated confidence.

    Parameters
    ----------
    smoother : Smoother
        Of the refined grid; its lattice is that of `surface`.
    surface : ndarray
        Smooth distances of the real recording on the lattice.
    bootstrap : Bootstrap
        Its excesses set the levels.
    confidence : float
        Such as 0.9.
    stretch : float
        Factor by which the levels are raised above the minimum, >= 1.

    Returns
    -------
    Region
        Where the region has several parts the border is that of the largest.
    """
    joint, along_drag, along_force = (
        float(surface.min() + max(stretch, 1.0) * value)
        for value in np.quantile(bootstrap.excess, confidence, axis=0)
    )
    border = _largest_contour(smoother, surface, joint)
    return Region(
        _interval(smoother.drag_coefficient, surface.min(axis=1), along_drag),
        _interval(smoother.force_std, surface.min(axis=0), along_force),
        border[:, 0],
        border[:, 1],
        joint,
    )


def _interval(axis: Floats, profile: Floats, level: float) -> tuple[float, float]:
    """Return the ends of what lies below the level, between lattice points by interpolation."""
    below = np.flatnonzero(profile <= level)
    ends = []
    for inner, step in ((below[0], -1), (below[-1], 1)):
        outer = inner + step
        if not 0 <= outer < axis.size:
            ends.append(float(axis[inner]))
            continue
        share = (level - profile[inner]) / (profile[outer] - profile[inner])
        ends.append(float(axis[inner] + share * (axis[outer] - axis[inner])))
    return ends[0], ends[1]


def _largest_contour(smoother: Smoother, surface: Floats, level: float) -> Floats:
    """Return the longest closed border of the part below the level, shape (vertices, 2)."""
    from contourpy import contour_generator

    # A high rim closes a region that reaches the end of the lattice, along that end.
    high = level + 10.0 * max(float(np.ptp(surface)), 1e-6)
    rimmed = np.pad(surface, 1, constant_values=high)
    axes = [
        np.concatenate([[axis[0] - 1e-9 * step], axis, [axis[-1] + 1e-9 * step]])
        for axis in (smoother.drag_coefficient, smoother.force_std)
        for step in (axis[1] - axis[0] if axis.size > 1 else 1.0,)
    ]
    lines = contour_generator(x=axes[1], y=axes[0], z=rimmed).lines(level)
    longest = max((np.asarray(line) for line in lines), key=lambda line: line.shape[0])
    return np.ascontiguousarray(longest[:, ::-1])
