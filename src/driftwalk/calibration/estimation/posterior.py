"""Settings that could have given a recording: draws by the synthetic likelihood in a region.

Summaries are close to normal about their expected values, so a setting's likelihood falls with its
discrepancy: exp(-discrepancy / 2) (Wood, Nature 466 (2010) 1102). Within the region of an emulator
that costs nothing to evaluate, and a Markov chain of many walkers samples it, with an even prior
over the ranges on their scales (emcee; Foreman-Mackey et al., Publ. Astron. Soc. Pac. 125 (2013)
306). Simulations follow the draws: the next ones fill a region about them, until the draws stay.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from driftwalk.calibration.estimation.emulator import LocalEmulator, Solution, fit_emulator
from driftwalk.calibration.estimation.gauss_newton import Simulate, simulations_of
from driftwalk.calibration.estimation.region import REGION, Region, region_about
from driftwalk.core.arrays import Floats


class PosteriorPolicy(NamedTuple):
    """The Markov chain, and when the simulations for it have followed far enough.

    Chosen by hand; with these, 24 of 26 determined values of ten recordings of `two_state` lay in
    their intervals. `studies/motion_models/recover.py` counts the coverage.
    """

    size: int = 512
    """Settings of the posterior sample."""
    walkers: int = 64
    """Walkers of the chain: several for each of at most a dozen parameters."""
    steps: int = 600
    """Steps of each walker; the first half is left out."""
    begin: float = 0.3
    """Walkers begin within this part of the standard deviations of the solution."""
    inner: float = 0.9
    """Walkers begin within this part of the region."""
    most_rounds: int = 8
    """A bound on the time."""
    stays: float = 0.5
    """A mean that moves by less, in standard deviations, has come to rest."""
    alike: float = 1.3
    """Largest growth of a standard deviation at rest; a sample cut off by a region grows by 1.5."""
    reach: float = 1.0
    """A solution lies within the box about the region."""
    near: float = 1.1
    """Earlier simulations within this part of a region count for its emulator."""


POSTERIOR: Final = PosteriorPolicy()


class Posterior(NamedTuple):
    """Settings that could have given a recording."""

    sample: Floats
    """Settings in the unit cube, shape (512, parameters)."""
    emulator: LocalEmulator
    """Of the last region,"""
    region: Region
    """and that region."""
    solution: Solution
    """The setting of least discrepancy in it."""
    others: tuple[Solution, ...]
    """Those for the other parts of the recording."""
    moved: Floats
    """How far the last round moved the mean of the draws, in their standard deviations."""


def sample_posterior(
    simulate: Simulate, recorded: Floats, emulator: LocalEmulator, solution: Solution, *, seed: int
) -> Posterior:
    """Return settings that could have given a recording."""
    count = emulator.centre.size
    half = simulations_of(count)[1] // 2
    sample = _chain(emulator, None, recorded[0], solution, seed)
    region = region_about(sample)
    known, seen = np.empty((0, count)), np.empty((0, *recorded.shape))
    for number in range(POSTERIOR.most_rounds):
        settings = region.filled(half, seed + number)
        known = np.concatenate([known, settings])
        seen = np.concatenate([seen, simulate(settings, parts=len(recorded))])
        near = region.distances(known) < POSTERIOR.near
        near[-half:] = True
        emulators = [
            fit_emulator(known[near], seen[near, part], centre=region.centre, width=region.width)
            for part in range(len(recorded))
        ]
        emulator = emulators[0]
        solution, *others = (
            one.solve(part, reach=POSTERIOR.reach)
            for one, part in zip(emulators, recorded, strict=True)
        )
        sample = _chain(emulator, region, recorded[0], solution, seed + number + 1)
        moved = sample.mean(axis=0) - region.centre
        std = sample.std(axis=0)
        enough = np.count_nonzero(near) >= 1.5 * half
        if enough and _stayed(moved, std, region):
            break
        if number < POSTERIOR.most_rounds - 1:
            region = region_about(sample)
    return Posterior(sample, emulator, region, solution, tuple(others), moved / std)


def _stayed(moved: Floats, std: Floats, region: Region) -> bool:
    """Return whether draws are about where the simulations for them were made.

    A parameter along which the region cannot grow is as wide as it will be.
    """
    alike = (std < POSTERIOR.alike * region.std) | (region.width > 0.99 * REGION.widest)
    return bool((np.abs(moved) < POSTERIOR.stays * std).all() and alike.all())


def _chain(
    emulator: LocalEmulator, region: Region | None, recorded: Floats, solution: Solution, seed: int
) -> Floats:
    """Return draws by the synthetic likelihood within a region and the ranges."""
    import emcee

    low = np.maximum(emulator.centre - emulator.width, 0.0)
    high = np.minimum(emulator.centre + emulator.width, 1.0)

    def log_likelihood(settings: Floats) -> Floats:
        inside = ((settings >= low) & (settings <= high)).all(axis=1)
        if region is not None:
            inside &= region.distances(settings) <= 1.0
        return np.where(inside, -0.5 * emulator.discrepancies(settings, recorded), -np.inf)

    # emcee takes a generator of the older kind, whose seeds have 32 bits.
    random = np.random.RandomState(seed % 2**32)
    about = solution.setting + POSTERIOR.begin * solution.std * random.standard_normal(
        (POSTERIOR.walkers, solution.setting.size)
    )
    margin = 1e-6 * (high - low)
    about = np.clip(about, low + margin * (1 + random.random(about.shape)), high - margin)
    if region is not None:
        pull = np.minimum(1.0, POSTERIOR.inner / np.maximum(region.distances(about), 1e-12))
        about = region.centre + pull[:, None] * (about - region.centre)
    sampler = emcee.EnsembleSampler(
        POSTERIOR.walkers, solution.setting.size, log_likelihood, vectorize=True
    )
    begin = emcee.State(about, random_state=random.get_state())
    sampler.run_mcmc(begin, POSTERIOR.steps, skip_initial_state_check=True)
    steps = sampler.get_chain(discard=POSTERIOR.steps // 2, flat=True)
    return np.asarray(
        steps[np.linspace(0, len(steps) - 1, POSTERIOR.size).round().astype(np.int64)]
    )
