"""How good the fit is, apart from how well the parameters are known."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from driftwalk.calibration.grid.bootstrap_region import Bootstrap, simulated_steps
from driftwalk.calibration.grid.energy_score import EnergyScore
from driftwalk.calibration.grid.grid_map import Map, MapSimulator
from driftwalk.calibration.grid.grid_refinement import first_window, locate_minimum
from driftwalk.calibration.problem import FlowSource, Problem, limits_of, prepare_problem
from driftwalk.comparison.statistic import distances_among
from driftwalk.core.arrays import Bools, Floats
from driftwalk.core.errors import InputError
from driftwalk.core.progress import Progress
from driftwalk.schema import Track
from driftwalk.schema.answers.facts import GOODNESS, is_explained
from driftwalk.simulation.series import flow_since


def noise_floor_at(problem: Problem, point: Sequence[float]) -> float:
    """Return the median distance between two simulated recordings of the same parameters."""
    steps, _ = simulated_steps(problem, point, stage="floor", replicates=8)
    among = distances_among(problem.statistic, steps, threads=problem.like.threads)
    return float(np.median(among))


class GoodnessOfFit(NamedTuple):
    """Distance at the optimum against what chance alone gives."""

    distance: float
    """Mean KS distance of simulated recordings at the optimum to the real one."""
    standard_error: float
    floor: float
    """Median KS distance between two simulated recordings of these parameters."""
    floor_upper: float
    """Its upper quantile (`GOODNESS.floor_quantile`)."""

    @property
    def stretch(self) -> float:
        """Factor by which errors are widened for what the model leaves unexplained, >= 1."""
        return max(self.distance / self.floor, 1.0)

    @property
    def explained(self) -> bool:
        """Whether the distance is within reach of the floor."""
        return is_explained(self.distance, self.floor, self.floor_upper, GOODNESS.far_above_floor)


def goodness_of_fit(bootstrap: Bootstrap) -> GoodnessOfFit:
    """Return the quality of fit from the recordings that the bootstrap simulated."""
    to_recording = bootstrap.to_recording
    return GoodnessOfFit(
        float(to_recording.mean()),
        float(to_recording.std(ddof=1) / np.sqrt(to_recording.size)),
        float(np.median(bootstrap.to_each_other)),
        float(np.quantile(bootstrap.to_each_other, GOODNESS.floor_quantile)),
    )


def within_chance(energy_score: EnergyScore, bootstrap: Bootstrap, stretch: float) -> Floats:
    """Return the surface of a recording, raised where a setting is too far from it for chance.

    No recording simulated at the optimum is farther from the others, in floors. A setting whose own
    distance is larger cannot have made the recording, however low the surface is there: the height
    in floors is low where two recordings of one setting differ much.
    """
    surface, floor = energy_score.surface, energy_score.floor
    to_others = bootstrap.to_each_other
    farthest = to_others.mean(axis=0).max() / np.median(to_others)
    beyond = energy_score.mean > stretch * farthest * floor
    return np.where(beyond & (surface > surface.min()), 2.0 * surface.max(), surface)


class Halves(NamedTuple):
    """A calibration on the first half of a recording, judged on the second."""

    point: tuple[float, ...]
    """Coordinates of the optimum on the first half."""
    distance: float
    """Mean KS distance on the second half."""
    floor: float
    """Noise floor of recordings as long as the second half."""


def validate_on_halves(
    track: Track,
    whole: Problem,
    coarse: Map,
    flow_of: FlowSource,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Halves | None:
    """Calibrate on the first half of a recording and measure the distance on the second.

    None where a half is too short.

    The search is the usual one with a single replicate per setting on the coarse map, and ends
    with the window that locates the valley: enough for an optimum, and a small part of the main
    calibration's time. Settings of the coarse map that the triangle inequality excludes are not
    simulated again: see `could_be_best`.
    """
    middle = 0.5 * (track.time[0] + track.time[-1])
    others = whole.like.neighbours
    if others is not None:
        others = others.since(-float(track.time[0]))
    early = Track(*(values[track.time <= middle] for values in track))
    late = Track(*(values[track.time > middle] for values in track))
    try:
        flow = flow_of(early)
        first, second = (
            prepare_problem(
                half,
                whole.study,
                # A flow that changes has the clock of the whole recording.
                flow_since(flow, float(half.time[0] - track.time[0])),
                camera=whole.like.camera,
                model=whole.model,
                statistic=whole.statistic,
                neighbours=others,
                threads=whole.like.threads,
            )
            for half in (early, late)
        )
    except InputError:
        return None
    halves = MapSimulator(first, "first_half", apart=False, executor=executor, progress=progress)
    map_of_half = halves.full(coarse.axes, 1, could_be_best(whole, coarse, first))
    lowest = map_of_half.point(map_of_half.cell_of_minimum())
    window = first_window(map_of_half, noise_floor_at(first, lowest))
    maps = replace(halves, stage="first_half_refined", apart=True)
    optimum = locate_minimum(maps, window, limits_of(first)).energy_score.optimum
    recordings, distances = simulated_steps(
        second, optimum.point, stage="second_half", replicates=16
    )
    among = distances_among(second.statistic, recordings, threads=second.like.threads)
    return Halves(optimum.point, float(distances.mean()), float(np.median(among)))


def could_be_best(whole: Problem, coarse: Map, part: Problem) -> Bools:
    """Return which settings of a coarse map could be nearest to a part of the recording.

    With d for the distance of the part from the whole, D of the part to a setting is within d of
    that of the whole. So a setting that is more than 2 d farther from the whole than the best one
    is farther from the part, too. Chance adds to that: a floor of the part for each of the two.
    """
    between = whole.statistic.matrix(
        part.reference.table, whole.reference.table, threads=whole.like.threads
    )
    lowest = coarse.point(coarse.cell_of_minimum())
    margin = 2.0 * float(between[0, 0]) + 2.0 * noise_floor_at(part, lowest)
    return np.asarray(coarse.mean <= coarse.mean.min() + margin)
