"""Posterior predictive check of the motion: steps of the recording and of replicates.

Steps are formed by the same function for all. Replicates at the estimate give the distance and its
noise floor. Replicates with flow and parameters drawn from what the fit leaves open give the
judgement: if the model is right, the recording is to them as they are to each other, for each
differs from the fitted values as the truth does.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk import _core
from driftwalk.calibration.problem import Problem, prepare_problem
from driftwalk.comparison import apply_steps, plan_steps, step_length_edges
from driftwalk.conditions import recorded_camera
from driftwalk.core.arrays import Floats, Integers
from driftwalk.core.errors import InputError
from driftwalk.core.processors import map_in_threads
from driftwalk.core.random_streams import CheckStream
from driftwalk.core.seeds import world_keys
from driftwalk.likelihood.filter.series import Series
from driftwalk.likelihood.flow_intervals import fitted_flow, fitted_intervals
from driftwalk.likelihood.preparation import Estimate
from driftwalk.schema.answers.facts import fitted_value

if TYPE_CHECKING:
    import xarray as xr


Keys = npt.NDArray[np.uint64]

Path = tuple[Floats, Floats, Floats]


class Replicates(NamedTuple):
    """Simulated recordings, those that broke down left out."""

    steps: list[Floats]
    """Step lengths [m] and turning angles [rad] of each, (pairs, 2)."""
    paths: list[list[Path]]
    """Each one's recordings: times [s], x and y [m]."""
    flow: Integers
    """Which drawn flow each was in."""
    broken: int
    """How many were left out."""


def problems_of(
    fit: xr.Dataset, estimate: Estimate, recordings: Sequence[xr.Dataset]
) -> list[Problem]:
    """Return the series ready for comparison, each in its fitted flow, with one step interval."""
    from driftwalk.model import apply_overrides

    study, tracks, series = estimate.study, estimate.tracks, estimate.passes.series
    intervals = fitted_intervals(fit)
    flows = [
        fitted_flow(fit, interval=intervals.of_flow(flow)[0])
        for flow in range(len(intervals.labels))
    ]
    if study.steps.step_interval_s == "auto":
        interval = max(plan_steps(track.time).step_interval for track in tracks)
        study = apply_overrides(study, {"steps.step_interval_s": interval})
    noise = fitted_value(fit, "tracking_noise")
    problems = []
    for track, one in zip(tracks, series, strict=True):
        quantum = float(recordings[one.recording].attrs.get("position_quantum_m", 0.0))
        # The rounding of the file is part of the noise that the fit finds, and is simulated apart.
        plain = float(np.sqrt(max(noise**2 - quantum**2 / 12.0, 0.0)))
        camera = {"observation.position_noise_m": plain, "observation.orientation_noise_rad": 0.0}
        seen = apply_overrides(study, camera)
        made = recorded_camera(track, seen, position_quantum=quantum)
        problems.append(prepare_problem(track, seen, flows[one.flow], camera=made))
    return problems


def replicates_at_estimate(
    fit: xr.Dataset, problems: Sequence[Problem], *, count: int, seed: int
) -> Replicates:
    """Simulate the recordings with what the fit found."""
    drag, force = fitted_value(fit, "drag_coefficient"), fitted_value(fit, "force_std")
    parts = [
        _simulated(problem, _keys(seed, CheckStream.ESTIMATE, index, count), drag, force)
        for index, problem in enumerate(problems)
    ]
    return _joined(parts, np.zeros(count, dtype=np.int64))


def posterior_replicates(
    fit: xr.Dataset,
    estimate: Estimate,
    problems: Sequence[Problem],
    spread: Floats,
    *,
    count: int,
    seed: int,
) -> Replicates:
    """Simulate the recordings with flow and parameters drawn from what the fit leaves open."""
    # Eight flow fields: a world on its own takes as long as eight together.
    flows = min(8, count)
    flow_of = np.arange(count) % flows
    coefficients, factors = _posterior_samples(fit, estimate, spread, flows, seed)
    drag = fitted_value(fit, "drag_coefficient") * factors[:, 0]
    force = fitted_value(fit, "force_std") * factors[:, 1]
    parts: list[list[_World]] = []
    for index, problem in enumerate(problems):
        keys = _keys(seed, CheckStream.DRAWN, index, count)
        series = estimate.passes.series[index]

        def simulated(
            k: int, problem: Problem = problem, keys: Keys = keys, series: Series = series
        ) -> list[_World]:
            like = problem.like
            assert like.flow is not None
            x, y = like.flow["x"].values, like.flow["y"].values
            point = replace(estimate.point, coefficients=coefficients[k]).in_flow(series.flow)
            u, v = estimate.passes.spline.values(point.coefficients, x, y)
            flow = like.flow.assign(u=(("y", "x"), u), v=(("y", "x"), v))
            noise = like.camera.position_noise * float(factors[k, 2])
            camera = replace(like.camera, position_noise=noise)
            own = replace(problem, like=replace(like, flow=flow, camera=camera, threads=1))
            begin = float(series.time[0])
            return _simulated(own, keys[flow_of == k], float(drag[k]), float(force[k]), begin)

        found = map_in_threads(simulated, range(flows), problem.like.threads)
        parts.append([found[k][j // flows] for j, k in enumerate(flow_of)])
    return _joined(parts, flow_of)


def _posterior_samples(
    fit: xr.Dataset, estimate: Estimate, spread: Floats, count: int, seed: int
) -> tuple[Floats, Floats]:
    """Return drawn coefficients of the flow, and factors of C_d, force_std and tracking noise.

    C_d has the variance of the restricted likelihood; the flow follows it as far as the two are
    correlated.
    """
    generator = np.random.default_rng([seed, CheckStream.PARAMETERS])
    size = estimate.point.coefficients.size
    found = fit["covariance"].values[:3, :3]
    widest = float(np.sqrt(np.diag(found).max()))
    # Samples of a parameter that is known to a factor of ten only mean nothing.
    if not widest < math.log(10.0):
        raise InputError(
            "the fit leaves C_d, the force or the tracking noise uncertain by more "
            "than a factor of ten"
        )
    logs = generator.multivariate_normal(np.zeros(3), found, size=count)
    free = generator.normal(size=(count, len(spread))) @ spread.T
    along = spread[:size] @ spread[size] / (spread[size] @ spread[size])
    moved = free[:, :size] + (logs[:, :1] - free[:, size : size + 1]) * along
    shape = (count, *estimate.point.coefficients.shape)
    coefficients = estimate.point.coefficients + moved.reshape(shape)
    return coefficients, np.exp(logs * (1.0, 0.5, 1.0))


class _World(NamedTuple):
    steps: Floats
    path: Path
    sound: bool


def _keys(seed: int, kind: int, index: int, count: int) -> Keys:
    return world_keys(seed, trial=2 * index + kind, replicate=np.arange(count))


def _simulated(
    problem: Problem, keys: Keys, drag: float, force: float, begin: float = 0.0
) -> list[_World]:
    like = problem.like
    values = {"drag_coefficient": np.full(keys.size, drag), "force_std": np.full(keys.size, force)}
    x, y, _, status = problem.model.simulate(values, like, keys)
    worlds = []
    for k in range(keys.size):
        found = apply_steps(problem.reference.plan, x[k], y[k])
        steps = np.column_stack([found.step_length, found.turning_angle])
        path = (begin + like.sample_time, x[k].astype(np.float64), y[k].astype(np.float64))
        worlds.append(_World(steps, path, bool(status[k] == 0 and len(steps) > 0)))
    return worlds


def _joined(parts: Sequence[Sequence[_World]], flow_of: Integers) -> Replicates:
    """Put the recordings of each replicate together."""
    whole = list(zip(*parts, strict=True))
    sound = np.array([all(world.sound for world in one) for one in whole])
    retained = [whole[k] for k in np.flatnonzero(sound)]
    return Replicates(
        [np.concatenate([world.steps for world in one]) for one in retained],
        [[world.path for world in one] for one in retained],
        flow_of[sound],
        int(np.count_nonzero(~sound)),
    )


BAND: Final = 0.9
"""Share of the replicates within the bands of the densities."""
BINS: Final = 40
"""Bins of a density. Chosen by hand."""
FEWEST_REPLICATES: Final = 4
"""Sound replicates of either set: two on either side of the noise floor."""


class Density(NamedTuple):
    """Density of steps by bin: the recording's, and what the model makes likely."""

    edge: Floats
    """Edges of the bins, [m] or [rad], (bins + 1,)."""
    recording: Floats
    """[1/m] or [1/rad], (bins,)."""
    median: Floats
    low: Floats
    high: Floats


class MotionComparison(NamedTuple):
    """The recording against simulated ones."""

    distance: Floats
    """KS distance of the recording to each replicate at the estimate."""
    floor: Floats
    """KS distances between replicates at the estimate."""
    drawn_distance: Floats
    """KS distance of the recording to each replicate with drawn parameters."""
    drawn_between: Floats
    """Mean distance of each of those to the others that are in another flow."""
    flows: int
    """Number of drawn flows."""
    step_length: Density
    turning_angle: Density

    @property
    def rank_p_value(self) -> float:
        """Share of drawn replicates that are as far from the others as the recording is from all.

        The recording counts as one of them, so that 1 / (1 + replicates) is the least.
        """
        further = np.count_nonzero(self.drawn_between >= self.drawn_distance.mean())
        return float((1 + further) / (1 + self.drawn_between.size))

    @property
    def p_value(self) -> float:
        """The same from a normal distribution of the logarithms, which goes beyond the ranks.

        Replicates in one flow are alike, so the flows count the degrees of freedom.
        """
        from scipy.stats import t

        logs = np.log(self.drawn_between)
        spread = max(float(logs.std(ddof=1)), 1e-12) * np.sqrt(1.0 + 1.0 / logs.size)
        off = (np.log(self.drawn_distance.mean()) - logs.mean()) / spread
        return float(t.sf(off, self.flows - 1))


def compare_motion(
    real: Floats, at_estimate: Replicates, drawn: Replicates, *, threads: int
) -> MotionComparison:
    """Compare a recording's steps with simulated ones."""
    for replicates in (at_estimate, drawn):
        alone = replicates is drawn and np.unique(drawn.flow).size < 2
        if len(replicates.steps) < FEWEST_REPLICATES or alone:
            raise InputError(
                f"{replicates.broken} of {replicates.broken + len(replicates.steps)} simulated "
                "recordings broke down: the fitted model cannot be simulated"
            )
    half = len(at_estimate.steps) // 2
    floor = _distances(at_estimate.steps[:half], at_estimate.steps[half:], threads)
    among = _distances(drawn.steps, drawn.steps, threads)
    among[drawn.flow[:, None] == drawn.flow[None, :]] = np.nan
    lengths, angles = (
        np.abs(np.concatenate([real[:, k], *(steps[:, k] for steps in drawn.steps)]))
        for k in (0, 1)
    )
    widest = float(angles.max())
    return MotionComparison(
        _distances([real], at_estimate.steps, threads)[0],
        floor.ravel(),
        _distances([real], drawn.steps, threads)[0],
        np.nanmean(among, axis=1),
        int(np.unique(drawn.flow).size),
        _density(real, drawn, 0, step_length_edges(lengths, bins=BINS)),
        _density(real, drawn, 1, np.linspace(-widest, widest, BINS + 1)),
    )


def _distances(first: Sequence[Floats], second: Sequence[Floats], threads: int) -> Floats:
    """Return the KS distances of every recording to every other, (first, second)."""
    return np.asarray(_core.ks_matrix(*_padded(first), *_padded(second), threads=threads))


def _padded(steps: Sequence[Floats]) -> tuple[Floats, Floats, np.ndarray]:
    pairs = np.array([len(one) for one in steps], dtype=np.int64)
    length, angle = np.zeros((2, pairs.size, int(pairs.max())))
    for k, one in enumerate(steps):
        length[k, : len(one)], angle[k, : len(one)] = one.T
    return length, angle, pairs


def _density(real: Floats, drawn: Replicates, column: int, edge: Floats) -> Density:
    rows = np.array([_histogram(one[:, column], edge) for one in drawn.steps])
    tail = 0.5 * (1.0 - BAND)
    low, median, high = np.quantile(rows, [tail, 0.5, 1.0 - tail], axis=0)
    return Density(edge, _histogram(real[:, column], edge), median, low, high)


def _histogram(values: Floats, edge: Floats) -> Floats:
    """Return the density in each bin, as a share of all values and not of those shown."""
    count, _ = np.histogram(values, bins=edge)
    return np.asarray(count / values.size / np.diff(edge))
