"""Particle filter of the passages along the wall: the likelihood of a wall.

Passages are the parts of a recording near the wall, which the fit leaves out. The particles get the
fitted flow, drag and force, and the impacts of a wall of given restitution and friction. The
likelihood (Gordon, Salmond and Smith 1993) is the product of the mean densities of the recorded
poses. All walls get the same random numbers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk import _core
from driftwalk.core.arrays import Floats
from driftwalk.core.processors import default_threads
from driftwalk.core.random_streams import world_keys
from driftwalk.likelihood.filter.parameters import Point
from driftwalk.likelihood.filter.series import Series, corrected
from driftwalk.likelihood.preparation import Estimate
from driftwalk.schema.trajectory import wrap_angle
from driftwalk.simulation.backend import Camera, native_model
from driftwalk.simulation.initial import Start, world_table

if TYPE_CHECKING:
    import xarray as xr

    from driftwalk.model import Study


class PassagePolicy(NamedTuple):
    """Samples of a passage along the wall."""

    before: int = 3
    """Samples that a passage begins before the wall. Chosen by hand, as what follows."""
    after: int = 4
    """Samples that it ends after the wall; chosen by hand."""
    longest: int = 25
    """Most samples from the wall on; chosen by hand."""
    uneven: float = 0.2
    """Largest relative difference of an interval from the usual one; chosen by hand."""


PASSAGE: Final = PassagePolicy()


class Passages(NamedTuple):
    """Passages of the block along the wall; shapes (passages, samples)."""

    x: Floats
    y: Floats
    theta: Floats
    """Recorded poses, NaN after the end of a passage."""
    state: Floats
    """x, y, theta and their rates at the first sample, shape (passages, 6)."""


def passages_of(estimate: Estimate, series: Series) -> Passages:
    """Return the passages along the wall of one series."""
    point = estimate.point.in_flow(series.flow)
    x, y, theta = corrected(series, point)
    states = estimate.passes.states(series, point)
    usual = float(np.median(np.diff(series.time)))
    even = np.concatenate([[False], np.abs(np.diff(series.time) - usual) < PASSAGE.uneven * usual])
    whole = np.isfinite(x) & np.isfinite(y) & np.isfinite(theta)
    rows = []
    at = 0
    places = np.flatnonzero(series.excluded)
    while places.size:
        first = int(places[0])
        last = first
        while last + 1 < x.size and series.excluded[last + 1 : last + 1 + PASSAGE.after].any():
            last += 1
        begin = first - 1 - PASSAGE.before
        end = min(last + 1 + PASSAGE.after, first + PASSAGE.longest)
        places = places[places > max(last, end)]
        inside = slice(begin + 1, end)
        if begin <= at or end >= x.size or series.excluded[begin - 1 : first].any():
            continue
        if not (whole[begin:end].all() and even[inside].all() and np.isfinite(states[begin]).all()):
            continue
        at = end
        pad = PASSAGE.longest + PASSAGE.before + 1 - (end - begin - 1)
        poses = (np.pad(one[inside], (0, pad), constant_values=np.nan) for one in (x, y, theta))
        rows.append((*poses, states[begin]))
    if not rows:
        empty = np.zeros((0, PASSAGE.longest + PASSAGE.before + 1))
        return Passages(empty, empty, empty, np.zeros((0, 6)))
    return Passages(*(np.array(column) for column in zip(*rows, strict=True)))


def thinned(passages: Passages, share: float) -> Passages:
    """Return a share of the passages, evenly taken; one at least."""
    count = len(passages.x)
    retained = np.unique(np.linspace(0, count - 1, max(round(share * count), 1)).astype(np.intp))
    return Passages(*(part[retained] for part in passages))


class ParticlePolicy(NamedTuple):
    """The particles that follow a passage along the wall."""

    particles: int = 150
    """Particles of a passage. Chosen by hand: the scatter that they leave is in the intervals."""
    mistake: float = 1e-3
    """Chance that a sample is a mistake, anywhere in the tank: no particle need be near. Chosen by
    hand."""
    spread: float = 1.5
    """Factor on the spread of the first states. Chosen by hand: one that is too wide costs little,
    one too narrow misleads."""
    rough: float = 0.3
    """Noise that the particles get at each sample, as a share of the camera's, and of that a sample
    later for their rates: without it they soon are copies of a few (Gordon, Salmond and Smith
    1993). Chosen by hand."""
    wider: float = 2.0
    """Factor on the camera's noise. Chosen by hand."""
    force_draws: int = 2
    """Draws of the force from sample to sample, at least: a force that is held for longer comes out
    too weak; chosen by hand."""


PARTICLE: Final = ParticlePolicy()


class Part(NamedTuple):
    """Passages of one series, and the water in them."""

    passages: Passages
    flow: xr.Dataset
    """The fitted flow."""
    interval: float
    """Between samples [s]."""


class WallLikelihood:
    """Likelihoods of walls for the passages of some series."""

    def __init__(self, study: Study, point: Point, parts: Sequence[Part], seed: int) -> None:
        assert point.log_angle_noise is not None
        assert point.log_lever is not None
        self.study, self.parts, self.seed = study, parts, seed
        logs = (point.log_noise, point.log_noise, point.log_angle_noise)
        self.noises = [PARTICLE.wider * math.exp(one) for one in logs]
        intensity = math.exp(point.log_intensity)
        square = study.block.shape == "square"
        moment = study.block.side_m**2 / 6.0 if square else study.block.body().moment_m2
        turning = math.exp(point.log_lever) / moment
        self.intensity = np.array([intensity, intensity, intensity * turning**2])

    def log_likelihood(self, restitution: float, friction: float) -> float:
        """Return the log likelihood of a wall."""
        from driftwalk.model import apply_overrides

        wall = {"tank.wall_restitution": restitution, "tank.wall_friction": friction}
        study = apply_overrides(self.study, wall)
        return float(sum(self._of(study, part, index) for index, part in enumerate(self.parts)))

    def _of(self, study: Study, part: Part, index: int) -> float:
        study = _with_short_force_interval(study, part.interval)
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
            moved = _propagated(model, study, state, keys, step)
            logs = self._densities(passages, k, moved[:3])
            top = logs.max(axis=1, keepdims=True)
            weight = np.exp(logs - top)
            total += float((np.log(weight.mean(axis=1)) + top[:, 0])[running].sum())
            state = _resampled(moved, weight, uniform)
            for a, noise in enumerate(self.noises):
                rough = PARTICLE.rough * noise
                state[a] += rough * generator.normal(size=weight.shape)
                state[a + 3] += rough / part.interval * generator.normal(size=weight.shape)
        return total

    def _first(
        self, passages: Passages, interval: float, generator: np.random.Generator
    ) -> list[Floats]:
        """Return the first states of the particles, six of shape (passages, particles)."""
        shape = (len(passages.x), PARTICLE.particles)
        state = [np.empty(shape) for _ in range(6)]
        for a, (noise, intensity) in enumerate(zip(self.noises, self.intensity, strict=True)):
            covariance = filtered_covariance(noise, intensity, interval)
            root = PARTICLE.spread * np.linalg.cholesky(covariance)
            drawn = np.einsum("ab,bij->aij", root, generator.normal(size=(2, *shape)))
            state[a] = passages.state[:, a, None] + drawn[0]
            state[a + 3] = passages.state[:, a + 3, None] + drawn[1]
        return state

    def _densities(self, passages: Passages, k: int, pose: Sequence[Floats]) -> Floats:
        """Return the logarithms of the densities of the recorded poses at each particle."""
        seen = (passages.x[:, k, None], passages.y[:, k, None], passages.theta[:, k, None])
        apart = [one - own for one, own in zip(seen, pose, strict=True)]
        turned = wrap_angle(apart[2])
        noise, _, angle_noise = self.noises
        squares = (apart[0] ** 2 + apart[1] ** 2) / noise**2 + (turned / angle_noise) ** 2
        size = math.log(2.0 * math.pi) * 1.5 + 2.0 * math.log(noise) + math.log(angle_noise)
        anywhere = math.log(PARTICLE.mistake / (self.study.tank.extent_m[0] ** 2 * 2.0 * math.pi))
        # Of a passage that has ended all particles are alike.
        squares = np.where(np.isfinite(squares), squares, 0.0)
        return np.logaddexp(-0.5 * squares - size, anywhere)


def _with_short_force_interval(study: Study, interval: float) -> Study:
    """Return a study whose force is redrawn twice or more between samples, as strong as before.

    The particles get a new force at each sample. One that would be held for longer than from sample
    to sample comes out too weak.
    """
    from driftwalk.model import apply_overrides

    forces, held = study.forces, interval / PARTICLE.force_draws
    if forces.force_interval_s <= held:
        return study
    return apply_overrides(
        study,
        {
            "forces.force_interval_s": held,
            "forces.force_std_N": forces.force_std_N * math.sqrt(forces.force_interval_s / held),
            "simulation.time_step_s": "auto",
        },
    )


def _propagated(
    model: Any, study: Study, state: Sequence[Floats], keys: npt.NDArray[np.uint64], step: float
) -> list[Floats]:
    """Return poses and rates of the particles one interval later."""
    shape = state[0].shape
    start, forces = Start(*(part.ravel() for part in state)), study.forces
    worlds = world_table(
        start, keys, drag_coefficient=forces.drag_coefficient, force_std=forces.force_std_N
    )
    found = _core.simulate(model, worlds, keys, threads=default_threads(), precision="single")
    poses = np.stack(found[:3]).astype(np.float64)
    now, change = poses[:, :, 0], poses[:, :, 1] - poses[:, :, 0]
    change[2] = wrap_angle(change[2])
    return [one.reshape(shape) for one in (*now, *(change / step))]


def _resampled(state: Sequence[Floats], weight: Floats, uniform: Floats) -> list[Floats]:
    """Return the particles drawn by their weights, systematically."""
    passages, particles = weight.shape
    total = np.cumsum(weight, axis=1)
    places = (np.arange(particles) + uniform) / particles
    row = np.arange(passages)[:, None]
    chosen = np.searchsorted((total / total[:, -1:] + row).ravel(), (places + row).ravel())
    chosen = np.minimum(chosen, (row * particles + particles - 1).repeat(particles, 1).ravel())
    return [part.ravel()[chosen].reshape(weight.shape) for part in state]


def filtered_covariance(noise: float, intensity: float, interval: float) -> Floats:
    """Return the covariance of a coordinate and its rate after many samples, without drag.

    `noise` is the camera's, `intensity` the intensity of the white acceleration.
    """
    moved = np.array([[1.0, interval], [0.0, 1.0]])
    added = intensity * np.array(
        [[interval**3 / 3.0, interval**2 / 2.0], [interval**2 / 2.0, interval]]
    )
    known = np.diag([noise**2, (noise / interval) ** 2])
    # Sample by sample, and not the steady state from scipy's `solve_discrete_are`: the less noise
    # the turning has, the more samples the steady state takes, and where it has next to none the
    # pencil has its eigenvalues at the unit circle and scipy finds no stabilising solution.
    for _ in range(200):
        known = moved @ known @ moved.T + added
        gain = known[:, 0] / (known[0, 0] + noise**2)
        known = known - np.outer(gain, known[0])
    return known + np.diag([1e-18, 1e-12])
