"""Restitution and friction of the wall, from the contacts that a recording has.

The fit leaves out the intervals in which the block may touch the wall. Here they are used: a
particle filter follows the block through each of them, with the fitted flow, drag and force, and
the impacts of a wall of given restitution and friction. Its likelihood (Gordon, Salmond and Smith
1993), the product of the mean densities of the recorded poses, says which wall the contacts speak
for. All walls are tried with the same random numbers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk import _core
from driftwalk.conditions import estimated_study
from driftwalk.core.processors import default_threads
from driftwalk.core.seeds import world_keys
from driftwalk.likelihood.check.errors import Estimate, estimate_of
from driftwalk.likelihood.filter_pass import Series, corrected
from driftwalk.likelihood.intervals import fitted_intervals
from driftwalk.likelihood.newton import Tell, silent
from driftwalk.likelihood.result import fitted_flow
from driftwalk.likelihood.spline import Floats
from driftwalk.schema.check import described
from driftwalk.simulation.backend import Camera, native_model, world_table

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study

LEAST_CONTACTS: Final = 8
"""Fewer passages along the wall say nothing of it."""
MOST_CONTACTS: Final = 50
"""More are thinned to so many, evenly."""
BEFORE: Final = 3
"""Samples that a passage begins before the wall,"""
AFTER: Final = 4
"""ends after it,"""
LONGEST: Final = 25
"""and has at most, from the wall on."""
PARTICLES: Final = 150
MISTAKE: Final = 1e-3
"""Chance that a sample is a mistake, anywhere in the tank: no particle need be near."""
SPREAD: Final = 1.5
"""Factor on the spread of the first states: what is too wide costs little, too narrow misleads."""
ROUGH: Final = 0.3
"""Noise that the particles get at each sample, as a share of the camera's, and of that a sample
later for their rates: without it they soon are copies of a few (Gordon, Salmond and Smith 1993)."""
WIDER: Final = 2.0
"""Factor on the camera's noise."""
UNEVEN: Final = 0.2
"""Largest relative difference of an interval from the usual one."""
RESTITUTIONS: Final = (0.0, 0.5, 1.0)
HOLDS: Final = (0.0, 0.1, 0.25, 0.45, 0.65)
"""The friction mu of the walls that are tried, as mu / (1 + mu): from about 1 on every contact
sticks, and more friction changes nothing."""
MOST_HOLD: Final = 0.8
FINER: Final = ((0.25, 0.12), (0.15, 0.05))
"""Half the widths of the finer lattices, in restitution and hold."""
NEAR: Final = 80.0
"""Walls whose log likelihood is so near the largest ones form the parabola, at least"""
LEAST_WALLS: Final = 14
"""so many."""
HALF_WEIGHT: Final = 15.0
"""A wall with a log likelihood so far below the largest one counts half."""
LEAST_CURVATURE: Final = 0.5


class Passages(NamedTuple):
    """Passages of the block along the wall; shapes (passages, samples)."""

    x: Floats
    y: Floats
    theta: Floats
    """Recorded poses, NaN after the end of a passage."""
    state: Floats
    """x, y, theta and their rates at the first sample, shape (passages, 6)."""


def estimate_wall(
    fit: xr.Dataset,
    recordings: Sequence[xr.Dataset],
    *,
    body: str | None = None,
    seed: int = 0,
    tell: Tell | None = None,
) -> xr.Dataset:
    """Estimate restitution and friction of the wall from the contacts of the recordings of a fit.

    Parameters
    ----------
    fit : xarray.Dataset
        A `fit` with the orientation in the state.
    recordings : sequence of xarray.Dataset
        Those that it was made of.
    body : str, optional
        The body, where a recording has several.
    seed : int
        Of the particles.
    tell : callable, optional
        Called with the number of walls that were tried, their number, and the task.

    Returns
    -------
    xarray.Dataset
        The fit, with ``wall_contacts``, the number of passages along the wall, and with enough of
        them ``wall_restitution`` and ``wall_friction`` with their intervals.

    Raises
    ------
    InputError
        When the recordings are not those of the fit.

    Examples
    --------
    >>> import driftwalk as dw
    >>> recording = dw.tank30_recording()
    >>> fit = dw.fit_motion(recording)  # doctest: +SKIP
    >>> found = estimate_wall(fit, [recording])  # doctest: +SKIP
    >>> int(found["wall_contacts"])  # the block never touches the wall  # doctest: +SKIP
    0
    """
    estimate = estimate_of(fit, recordings, body=body)
    oriented = fit.attrs["angle"] == "state"
    found = [_passages_of(estimate, one) for one in estimate.passes.series] if oriented else []
    count = sum(len(one.x) for one in found)
    if count < LEAST_CONTACTS:
        return described(fit.assign(wall_contacts=((), np.int64(count))))
    intervals = fitted_intervals(fit)
    parts = [
        _Part(
            _thinned(passages, min(1.0, MOST_CONTACTS / count)),
            fitted_flow(fit, interval=intervals.of_flow(series.flow)[0]),
            float(np.median(np.diff(series.time))),
        )
        for series, passages in zip(estimate.passes.series, found, strict=True)
        if len(passages.x)
    ]
    walls = _tried(_Trial(estimated_study(fit), estimate, parts, seed), tell or silent)
    data = _answer(walls, float(fit["confidence"]))
    return described(fit.assign(wall_contacts=((), np.int64(count)), **data))


def _thinned(passages: Passages, share: float) -> Passages:
    """Return a share of the passages, evenly taken; one at least."""
    count = len(passages.x)
    kept = np.unique(np.linspace(0, count - 1, max(round(share * count), 1)).astype(np.intp))
    return Passages(*(part[kept] for part in passages))


def _passages_of(estimate: Estimate, series: Series) -> Passages:
    """Return the passages along the wall of one series."""
    point = estimate.point.in_flow(series.flow)
    x, y, theta = corrected(series, point)
    states = estimate.passes.states(series, point)
    usual = float(np.median(np.diff(series.time)))
    even = np.concatenate([[False], np.abs(np.diff(series.time) - usual) < UNEVEN * usual])
    whole = np.isfinite(x) & np.isfinite(y) & np.isfinite(theta)
    rows = []
    at = 0
    places = np.flatnonzero(series.excluded)
    while places.size:
        first = int(places[0])
        last = first
        while last + 1 < x.size and series.excluded[last + 1 : last + 1 + AFTER].any():
            last += 1
        begin, end = first - 1 - BEFORE, min(last + 1 + AFTER, first + LONGEST)
        places = places[places > max(last, end)]
        inside = slice(begin + 1, end)
        if begin <= at or end >= x.size or series.excluded[begin - 1 : first].any():
            continue
        if not (whole[begin:end].all() and even[inside].all() and np.isfinite(states[begin]).all()):
            continue
        at = end
        pad = LONGEST + BEFORE + 1 - (end - begin - 1)
        rows.append(
            (
                *(np.pad(part[inside], (0, pad), constant_values=np.nan) for part in (x, y, theta)),
                states[begin],
            )
        )
    if not rows:
        empty = np.zeros((0, LONGEST + BEFORE + 1))
        return Passages(empty, empty, empty, np.zeros((0, 6)))
    return Passages(*(np.array(column) for column in zip(*rows, strict=True)))


class _Part(NamedTuple):
    passages: Passages
    flow: xr.Dataset
    interval: float
    """Between samples [s]."""


class _Wall(NamedTuple):
    restitution: float
    hold: float
    log_likelihood: float


class _Trial:
    """Likelihoods of walls for the passages of some series."""

    def __init__(self, study: Study, estimate: Estimate, parts: Sequence[_Part], seed: int) -> None:
        point = estimate.point
        assert point.log_angle_noise is not None
        assert point.log_lever is not None
        self.study, self.parts, self.seed = study, parts, seed
        self.noise = WIDER * math.exp(point.log_noise)
        self.angle_noise = WIDER * math.exp(point.log_angle_noise)
        intensity = math.exp(point.log_intensity)
        turning = 6.0 * math.exp(point.log_lever) / study.block.side_m**2
        self.intensity = np.array([intensity, intensity, intensity * turning**2])

    def at(self, restitution: float, hold: float) -> _Wall:
        """Return the log likelihood of a wall."""
        from driftwalk.model import apply_overrides

        friction = hold / (1.0 - hold)
        wall = {"tank.wall_restitution": restitution, "tank.wall_friction": friction}
        study = apply_overrides(self.study, wall)
        total = sum(self._of(study, part, index) for index, part in enumerate(self.parts))
        return _Wall(restitution, hold, float(total))

    def _of(self, study: Study, part: _Part, index: int) -> float:
        passages, step = part.passages, study.time_step_s
        generator = np.random.default_rng([self.seed, index])
        state = self._first(passages, part.interval, generator)
        model = native_model(
            study, part.flow, np.array([part.interval, part.interval + step]), Camera()
        )
        total = 0.0
        for k in range(passages.x.shape[1]):
            keys = world_keys(self.seed, trial=k, replicate=np.arange(state[0].size))
            uniform = generator.uniform(size=(len(passages.x), 1))
            running = np.isfinite(passages.x[:, k])
            if not running.any():
                break
            pose, motion = _moved(model, study, state, keys, step)
            logs = self._densities(passages, k, pose)
            top = logs.max(axis=1, keepdims=True)
            weight = np.exp(logs - top)
            total += float((np.log(weight.mean(axis=1)) + top[:, 0])[running].sum())
            state = _drawn([*pose, *motion], weight, uniform)
            for a, noise in enumerate((self.noise, self.noise, self.angle_noise)):
                state[a] += ROUGH * noise * generator.normal(size=weight.shape)
                state[a + 3] += ROUGH * noise / part.interval * generator.normal(size=weight.shape)
        return total

    def _first(
        self, passages: Passages, interval: float, generator: np.random.Generator
    ) -> list[Floats]:
        """Return the first states of the particles, six of shape (passages, particles)."""
        shape = (len(passages.x), PARTICLES)
        state = [np.empty(shape) for _ in range(6)]
        noises = (self.noise, self.noise, self.angle_noise)
        for a, (noise, intensity) in enumerate(zip(noises, self.intensity, strict=True)):
            root = SPREAD * np.linalg.cholesky(_known(noise, intensity, interval))
            drawn = np.einsum("ab,bij->aij", root, generator.normal(size=(2, *shape)))
            state[a] = passages.state[:, a, None] + drawn[0]
            state[a + 3] = passages.state[:, a + 3, None] + drawn[1]
        return state

    def _densities(self, passages: Passages, k: int, pose: Sequence[Floats]) -> Floats:
        """Return the logarithms of the densities of the recorded poses at each particle."""
        seen = (passages.x[:, k, None], passages.y[:, k, None], passages.theta[:, k, None])
        apart = [one - own for one, own in zip(seen, pose, strict=True)]
        turned = np.remainder(apart[2] + math.pi, 2.0 * math.pi) - math.pi
        squares = (apart[0] ** 2 + apart[1] ** 2) / self.noise**2 + (turned / self.angle_noise) ** 2
        size = (
            math.log(2.0 * math.pi) * 1.5 + 2.0 * math.log(self.noise) + math.log(self.angle_noise)
        )
        anywhere = math.log(MISTAKE / (self.study.tank.extent_m[0] ** 2 * 2.0 * math.pi))
        # Of a passage that has ended all particles are alike.
        squares = np.where(np.isfinite(squares), squares, 0.0)
        return np.logaddexp(-0.5 * squares - size, anywhere)


def _known(noise: float, intensity: float, interval: float) -> Floats:
    """Return the covariance of a coordinate and its rate after many samples, without drag."""
    moved = np.array([[1.0, interval], [0.0, 1.0]])
    added = intensity * np.array(
        [[interval**3 / 3.0, interval**2 / 2.0], [interval**2 / 2.0, interval]]
    )
    known = np.diag([noise**2, (noise / interval) ** 2])
    for _ in range(200):
        known = moved @ known @ moved.T + added
        gain = known[:, 0] / (known[0, 0] + noise**2)
        known = known - np.outer(gain, known[0])
    return known + np.diag([1e-18, 1e-12])


def _moved(
    model: Any, study: Study, state: Sequence[Floats], keys: npt.NDArray[np.uint64], step: float
) -> tuple[list[Floats], list[Floats]]:
    """Return poses and rates of the particles one interval later."""
    shape = state[0].shape
    names = ("x", "y", "theta", "vx", "vy", "omega")
    worlds = world_table(
        **{name: part.ravel() for name, part in zip(names, state, strict=True)},
        drag_coefficient=np.full(keys.size, study.forces.drag_coefficient),
        force_std=study.forces.force_std_N,
    )
    found = _core.simulate(model, worlds, keys, threads=default_threads(), precision="single")
    pose, motion = [], []
    for index, part in enumerate(found[:3]):
        now, then = part[:, 0].astype(np.float64), part[:, 1].astype(np.float64)
        change = then - now
        if index == 2:
            change = np.remainder(change + math.pi, 2.0 * math.pi) - math.pi
        pose.append(now.reshape(shape))
        motion.append((change / step).reshape(shape))
    return pose, motion


def _drawn(state: Sequence[Floats], weight: Floats, uniform: Floats) -> list[Floats]:
    """Return the particles drawn by their weights, systematically."""
    passages, particles = weight.shape
    total = np.cumsum(weight, axis=1)
    places = (np.arange(particles) + uniform) / particles
    row = np.arange(passages)[:, None]
    chosen = np.searchsorted((total / total[:, -1:] + row).ravel(), (places + row).ravel())
    chosen = np.minimum(chosen, (row * particles + particles - 1).repeat(particles, 1).ravel())
    return [part.ravel()[chosen].reshape(weight.shape) for part in state]


def _tried(trial: _Trial, tell: Tell) -> list[_Wall]:
    """Return the walls of a coarse lattice, then of finer ones around the best of them."""
    count = len(RESTITUTIONS) * len(HOLDS) + 25 * len(FINER)
    walls: list[_Wall] = []

    def look(restitutions: Floats, holds: Floats) -> None:
        for restitution in restitutions.tolist():
            for hold in holds.tolist():
                tell(len(walls), count, "wall")
                walls.append(trial.at(restitution, hold))

    look(np.array(RESTITUTIONS), np.array(HOLDS))
    for wide, high in FINER:
        best = max(walls, key=lambda wall: wall.log_likelihood)
        look(
            np.linspace(max(best.restitution - wide, 0.0), min(best.restitution + wide, 1.0), 5),
            np.linspace(max(best.hold - high, 0.0), min(best.hold + high, MOST_HOLD), 5),
        )
    return walls


def _answer(walls: Sequence[_Wall], confidence: float) -> dict[str, Any]:
    """Return the estimates with their intervals, from a parabola through the likely walls.

    The likelihoods scatter, since the particles are few. Their distances from the parabola say by
    how much, and the intervals hold the uncertainty of its top that follows.
    """
    from scipy.special import ndtri

    table = np.array(walls)
    order = np.argsort(-table[:, 2])
    top = table[order[:3], 2].mean()
    near = table[table[:, 2] > top - NEAR]
    if len(near) < LEAST_WALLS:
        near = table[order[:LEAST_WALLS]]
    e, hold, height = near.T
    terms = np.column_stack([np.ones_like(e), e, hold, e**2, e * hold, hold**2])
    # Far from its top the likelihood is no parabola.
    weight = 1.0 / (1.0 + np.maximum(top - height, 0.0) / HALF_WEIGHT)
    root = np.sqrt(weight)
    fitted, *_ = np.linalg.lstsq(terms * root[:, None], (height - top) * root, rcond=None)
    scatter = (height - top) - terms @ fitted
    variance = float((weight * scatter**2).sum() / (weight.sum() - 0.5 * terms.shape[1]))
    curvature = -np.array([[2 * fitted[3], fitted[4]], [fitted[4], 2 * fitted[5]]])
    values, vectors = np.linalg.eigh(curvature)
    # A direction along which the likelihood does not fall is not determined.
    inverse = vectors @ np.diag(1.0 / np.maximum(values, LEAST_CURVATURE)) @ vectors.T
    best = inverse @ fitted[1:3]
    slopes = np.column_stack(
        [np.zeros(2), inverse, *(-inverse @ part @ best for part in _CURVATURES)]
    )
    own = variance * np.linalg.pinv(terms.T @ (weight[:, None] * terms))
    covariance = inverse + slopes @ own @ slopes.T
    reach = float(ndtri(0.5 + 0.5 * confidence)) * np.sqrt(np.diag(covariance))
    restitution = np.clip([best[0], best[0] - reach[0], best[0] + reach[0]], 0.0, 1.0)
    friction = _friction(np.clip([best[1], best[1] - reach[1], best[1] + reach[1]], 0.0, 1.0))
    return {
        "wall_restitution": ((), restitution[0]),
        "wall_restitution_interval": ("bound", restitution[1:]),
        "wall_friction": ((), friction[0]),
        "wall_friction_interval": ("bound", friction[1:]),
    }


_CURVATURES: Final = (
    np.array([[-2.0, 0.0], [0.0, 0.0]]),
    np.array([[0.0, -1.0], [-1.0, 0.0]]),
    np.array([[0.0, 0.0], [0.0, -2.0]]),
)
"""Derivatives of the curvature by the parabola's last three numbers."""


def _friction(hold: Floats) -> Floats:
    """Return the friction of a hold; from `MOST_HOLD` on it only sticks."""
    with np.errstate(divide="ignore"):
        return np.where(hold < MOST_HOLD, hold / (1.0 - hold), np.inf)
