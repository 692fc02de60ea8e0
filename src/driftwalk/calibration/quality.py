"""How good the fit is, apart from how well the parameters are known."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from driftwalk import _core
from driftwalk.calibration.problem import Problem
from driftwalk.calibration.region import Bootstrap, recordings_at, simulated_steps
from driftwalk.calibration.search import Map, Window, refined_window, run_map, window_smoother
from driftwalk.calibration.surface import Optimum

FAR_ABOVE_FLOOR = 2.0
"""A distance more than this many noise floors is called far above it."""
FLOOR_REPLICATES = 8
VALIDATION_REPLICATES = 16


def noise_floor_at(problem: Problem, drag_coefficient: float, force_std: float) -> float:
    """Return the median KS distance between two simulated recordings of the same parameters."""
    steps = simulated_steps(
        problem,
        np.array([drag_coefficient]),
        np.array([force_std]),
        stage="floor",
        replicates=FLOOR_REPLICATES,
    )
    matrix = _core.ks_matrix(*steps, *steps, threads=problem.threads)
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
        return self.distance <= max(FAR_ABOVE_FLOOR * self.floor, self.floor_upper)


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

    drag_coefficient: float
    force_std: float
    """Optimum on the first half, [N]."""
    distance: float
    """Mean KS distance on the second half."""
    floor: float
    """Noise floor of recordings as long as the second half."""


def validate_on_halves(first: Problem, second: Problem, *, steps: tuple[float, float]) -> Halves:
    """Calibrate on the first half of a recording and measure the distance on the second.

    The search is the usual one with a single replicate per setting, then two on a refined grid
    of double steps: enough for an optimum, and a small part of the main calibration's time.

    Parameters
    ----------
    first, second : Problem
        The halves; `second` has the flow of `first`.
    steps : tuple of float
        Steps of the refined grid.
    """
    grid = first.study.calibration
    coarse = run_map(
        first,
        grid.drag_coefficients,
        grid.force_stds_N,
        stage="first_half",
        replicates=1,
        details="none",
    )
    doubled = (2 * steps[0], 2 * steps[1])
    window = refined_window(coarse, doubled, 0.0)
    optimum = refine(first, window, doubled, stage="first_half_refined", replicates=2)[1]
    recordings, distances = recordings_at(
        second, optimum, stage="second_half", count=VALIDATION_REPLICATES
    )
    among = _core.ks_matrix(*recordings, *recordings, threads=second.threads)
    floor = np.median(among[np.triu_indices(VALIDATION_REPLICATES, 1)])
    return Halves(
        optimum.drag_coefficient,
        optimum.force_std,
        float(distances.mean()),
        float(floor),
    )


def refine(
    problem: Problem,
    window: Window,
    steps: tuple[float, float],
    *,
    stage: str,
    replicates: int,
) -> tuple[Map, Optimum]:
    """Run a refined grid and return it with the optimum of its smooth surface."""
    found = run_map(
        problem,
        window.drag_coefficient,
        window.force_std,
        stage=stage,
        replicates=replicates,
        details="none",
    )
    return found, window_smoother(window, steps).optimum(found.mean)
