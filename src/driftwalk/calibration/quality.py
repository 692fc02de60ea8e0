"""How good the fit is, apart from how well the parameters are known."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from typing import NamedTuple

import numpy as np

from driftwalk.calibration.problem import Axes, Problem
from driftwalk.calibration.region import Bootstrap, recordings_at, simulated_steps
from driftwalk.calibration.search import Map, refined_window, run_map, window_smoother
from driftwalk.calibration.surface import Optimum
from driftwalk.schema.calibration_facts import is_explained

FAR_ABOVE_FLOOR = 2.0
"""A distance more than this many noise floors is called far above it."""
FLOOR_REPLICATES = 8
VALIDATION_REPLICATES = 16


def noise_floor_at(problem: Problem, point: Sequence[float]) -> float:
    """Return the median distance between two simulated recordings of the same parameters."""
    steps = simulated_steps(problem, point, stage="floor", replicates=FLOOR_REPLICATES)
    matrix = problem.statistic.matrix(steps, steps, threads=problem.like.threads)
    return float(np.median(matrix[np.triu_indices(FLOOR_REPLICATES, 1)]))


class Quality(NamedTuple):
    """Distance at the optimum against what chance alone gives."""

    distance: float
    """Mean KS distance of simulated recordings at the optimum to the real one."""
    standard_error: float
    floor: float
    """Median KS distance between two simulated recordings of these parameters."""
    floor_upper: float
    """Its 95 % quantile."""

    @property
    def stretch(self) -> float:
        """Factor by which errors are widened for what the model leaves unexplained, >= 1."""
        return max(self.distance / self.floor, 1.0)

    @property
    def explained(self) -> bool:
        """Whether the distance is within reach of the floor."""
        return is_explained(self.distance, self.floor, self.floor_upper, FAR_ABOVE_FLOOR)


def quality_of_fit(bootstrap: Bootstrap) -> Quality:
    """Return the quality of fit from the recordings that the bootstrap simulated."""
    to_recording = bootstrap.to_recording
    return Quality(
        float(to_recording.mean()),
        float(to_recording.std(ddof=1) / np.sqrt(to_recording.size)),
        float(np.median(bootstrap.to_each_other)),
        float(np.quantile(bootstrap.to_each_other, 0.95)),
    )


class Halves(NamedTuple):
    """A calibration on the first half of a recording, judged on the second."""

    point: tuple[float, ...]
    """Coordinates of the optimum on the first half."""
    distance: float
    """Mean KS distance on the second half."""
    floor: float
    """Noise floor of recordings as long as the second half."""


def validate_on_halves(
    first: Problem, second: Problem, *, executor: Executor | None = None
) -> Halves:
    """Calibrate on the first half of a recording and measure the distance on the second.

    The search is the usual one with a single replicate per setting, then two on a refined grid
    of double steps: enough for an optimum, and a small part of the main calibration's time.

    Parameters
    ----------
    first, second : Problem
        The halves; `second` has the flow of `first`.
    executor : concurrent.futures.Executor, optional
        Computes the maps' work units elsewhere, with one thread each.
    """
    coarse = run_map(
        first,
        [parameter.coordinates for parameter in first.parameters],
        stage="first_half",
        replicates=1,
        executor=executor,
    )
    doubled = [2 * step for step in first.refined_steps]
    window = refined_window(coarse, doubled, 0.0)
    optimum = refine(
        first, window, doubled, stage="first_half_refined", replicates=2, executor=executor
    )[1]
    recordings, distances = recordings_at(
        second, optimum, stage="second_half", count=VALIDATION_REPLICATES
    )
    among = second.statistic.matrix(recordings, recordings, threads=second.like.threads)
    floor = np.median(among[np.triu_indices(VALIDATION_REPLICATES, 1)])
    return Halves(optimum.point, float(distances.mean()), float(floor))


def refine(
    problem: Problem,
    window: Axes,
    steps: Sequence[float],
    *,
    stage: str,
    replicates: int,
    executor: Executor | None = None,
) -> tuple[Map, Optimum]:
    """Run a refined grid and return it with the optimum of its smooth surface."""
    found = run_map(problem, window, stage=stage, replicates=replicates, executor=executor)
    return found, window_smoother(window, steps).optimum(found.mean)
