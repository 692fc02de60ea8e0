"""Settings that could have given a recording: draws by the synthetic likelihood in a region.

Summaries are close to normal about their expected values, so a setting's likelihood falls with its
discrepancy: exp(-discrepancy / 2) (Wood, Nature 466 (2010) 1102). Within the region of an emulator
that costs nothing to evaluate, and a Markov chain of many walkers samples it, with an even prior
over the ranges on their scales (emcee; Foreman-Mackey et al., Publ. Astron. Soc. Pac. 125 (2013)
306). Simulations follow the draws: the next ones fill a region about them, until the draws stay.

The region is an ellipsoid about the draws, along their own axes: parameters that make up for each
other lie on a narrow ridge, and a box about it is mostly empty of draws. A chain that begins at one
place that fits does not find the others, so every search that ends at a match has its own
posterior; these modes are weighed by their evidence, the likelihood there times the volume that the
draws fill.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

import numpy as np

from driftwalk.calibration.estimation.gauss_newton import LocalOptimum, Simulate, simulations_of
from driftwalk.calibration.estimation.synthetic_likelihood import (
    LocalEmulator,
    Solution,
    fit_emulator,
)
from driftwalk.calibration.evolution import rounded
from driftwalk.core.arrays import Bools, Floats


class SimulatedRegionPolicy(NamedTuple):
    """How large the region is that is simulated for a posterior sample. Chosen by hand."""

    spread: float = 1.5
    """Standard deviation of the settings along every axis, in those of the sample; chosen by
    hand."""
    widest: float = 0.3
    """Largest half-width, in parts of the ranges: an emulator does not hold in more; chosen by
    hand."""
    narrowest: float = 0.003
    """Smallest standard deviation, in parts of the ranges: keeps the covariance regular; chosen by
    hand."""


SIMULATED_REGION: Final = SimulatedRegionPolicy()


class Region(NamedTuple):
    """An ellipsoid in the unit cube."""

    centre: Floats
    """Shape (parameters,)."""
    root: Floats
    """Lower triangle whose product with its transpose is the covariance of the draws."""

    @property
    def std(self) -> Floats:
        """Standard deviations of the draws that it is made for."""
        return np.asarray(np.sqrt((self.root**2).sum(axis=1)))

    @property
    def radius(self) -> float:
        """How far it reaches along every axis, in standard deviations of the draws."""
        return radius_of(self.centre.size)

    @property
    def width(self) -> Floats:
        """Half-widths of the box about it."""
        return self.radius * self.std

    def distances(self, settings: Floats) -> Floats:
        """Return how far settings are from the centre: 1 is the end, shape (settings,)."""
        axes = np.linalg.solve(self.root, (settings - self.centre).T)
        return np.asarray(np.sqrt((axes**2).sum(axis=0)) / self.radius)

    def filled(self, count: int, seed: int) -> Floats:
        """Return settings that fill the region evenly; those beyond an end are mirrored at it."""
        from scipy.special import ndtri
        from scipy.stats import qmc

        parameters = self.centre.size
        drawn = qmc.Sobol(parameters + 1, seed=seed).random(count)
        way = ndtri(np.clip(drawn[:, :-1], 1e-12, 1.0 - 1e-12))
        way /= np.maximum(np.sqrt((way**2).sum(axis=1, keepdims=True)), 1e-12)
        place = self.radius * drawn[:, -1:] ** (1.0 / parameters) * way
        settings = self.centre + place @ self.root.T
        return rounded(np.clip(1.0 - np.abs(1.0 - np.abs(settings)), 0.0, 1.0))


def radius_of(parameters: int) -> float:
    """Return the radius of an even ball with the standard deviation 1.5 along every axis.

    Examples
    --------
    >>> round(radius_of(2), 3)
    3.0
    """
    return SIMULATED_REGION.spread * float(np.sqrt(parameters + 2.0))


def region_about(sample: Floats) -> Region:
    """Return the region of draws."""
    parameters = sample.shape[1]
    covariance = np.atleast_2d(np.cov(sample.T))
    covariance += SIMULATED_REGION.narrowest**2 * np.eye(parameters)
    most = SIMULATED_REGION.widest / radius_of(parameters)
    shrink = np.minimum(1.0, most / np.sqrt(np.diag(covariance)))
    covariance *= np.outer(shrink, shrink)
    root = np.asarray(np.linalg.cholesky(covariance), dtype=np.float64)
    return Region(rounded(np.clip(sample.mean(axis=0), 0.0, 1.0)), root)


class PosteriorPolicy(NamedTuple):
    """The Markov chain, and when the simulations for it have followed far enough.

    Chosen by hand; with these, 24 of 26 determined values of ten recordings of `two_state` lay in
    their intervals. `studies/motion_models/recover.py` counts the coverage.
    """

    size: int = 512
    """Settings of the posterior sample; chosen by hand."""
    walkers: int = 64
    """Walkers of the chain: several for each of at most a dozen parameters; chosen by hand."""
    steps: int = 600
    """Steps of each walker; the first half is left out; chosen by hand."""
    begin: float = 0.3
    """Walkers begin within this part of the standard deviations of the solution; chosen by hand."""
    inner: float = 0.9
    """Walkers begin within this part of the region; chosen by hand."""
    most_rounds: int = 8
    """A bound on the time; chosen by hand."""
    stays: float = 0.5
    """A mean that moves by less, in standard deviations, has come to rest; chosen by hand."""
    alike: float = 1.3
    """Largest growth of a standard deviation at rest; chosen by hand, as a sample cut off by a
    region grows by 1.5."""
    reach: float = 1.0
    """A solution lies within the box about the region; chosen by hand."""
    near: float = 1.1
    """Earlier simulations within this part of a region count for its emulator; chosen by hand."""
    fewest_estimates: int = 40
    """Estimates of simulated recordings without which their bias and scatter would be chance."""
    many: float = 1.5
    """Simulations near a region, in halves of those of a round, from which on it may be at rest;
    chosen by hand."""
    as_wide: float = 0.99
    """Part of the widest region from which on one counts as that wide; chosen by hand."""
    behind: float = 10.0
    """Deviance by which a mode is behind when it is ruled out; chosen by hand, as covariances come
    from simulations: a discrepancy of a hundred has an error of some 5."""


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
    simulate: Simulate, recorded: Floats, optimum: LocalOptimum, *, seed: int
) -> Posterior:
    """Return settings that could have given a recording, from the end of a search on."""
    emulator, solution = optimum.emulator, optimum.solution
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
        enough = np.count_nonzero(near) >= POSTERIOR.many * half
        if enough and _stayed(moved, std, region):
            break
        if number < POSTERIOR.most_rounds - 1:
            region = region_about(sample)
    return Posterior(sample, emulator, region, solution, tuple(others), moved / std)


def _stayed(moved: Floats, std: Floats, region: Region) -> bool:
    """Return whether draws are about where the simulations for them were made.

    A parameter along which the region cannot grow is as wide as it will be.
    """
    alike = (std < POSTERIOR.alike * region.std) | (
        region.width > POSTERIOR.as_wide * SIMULATED_REGION.widest
    )
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


class Modes(NamedTuple):
    """Posteriors at different places."""

    places: tuple[Posterior, ...]
    """The likeliest first."""
    weights: Floats
    """Shares of the evidence, shape (places,)."""

    @property
    def best(self) -> Posterior:
        """The likeliest."""
        return self.places[0]

    def mixed(self, sample: Sequence[Floats]) -> Floats:
        """Return 512 draws of all places, each with as many as its share of the evidence."""
        upper = np.round(POSTERIOR.size * np.cumsum(self.weights)).astype(np.int64)
        counts = np.diff(upper, prepend=0)
        taken = [
            one[np.linspace(0, len(one) - 1, count).round().astype(np.int64)]
            for one, count in zip(sample, counts, strict=True)
        ]
        return np.concatenate(taken)

    def apart(self, sample: Sequence[Floats]) -> Bools:
        """Return for which parameters a place has an interval that does not meet the first's."""
        low, high = np.quantile(np.array(sample), (0.05, 0.95), axis=1)
        return np.asarray(((low > high[0]) | (high < low[0])).any(axis=0))


def find_modes(
    optima: Sequence[LocalOptimum], sample_about: Callable[[LocalOptimum, int], Posterior]
) -> Modes:
    """Return the posteriors at the ends of searches, those alone that the recording allows."""
    found: list[Posterior] = []
    for number, optimum in enumerate(optima):
        if any(_reaches(one, optimum.solution.setting) for one in found):
            continue
        posterior = sample_about(optimum, number)
        if not any(_reaches(one, posterior.sample.mean(axis=0)) for one in found):
            found.append(posterior)
    deviance = np.array([_deviance(one) for one in found])
    behind = deviance - deviance.min()
    order = [k for k in np.argsort(deviance, kind="stable") if behind[k] < POSTERIOR.behind]
    weights = np.exp(-0.5 * (deviance[order] - deviance.min()))
    return Modes(tuple(found[place] for place in order), weights / weights.sum())


def _reaches(posterior: Posterior, setting: Floats) -> bool:
    """Return whether a setting lies where a posterior has been simulated."""
    return bool(posterior.region.distances(setting[None])[0] < 1.0)


def _deviance(posterior: Posterior) -> float:
    """Return -2 log of the evidence, but for a constant: of a normal law as wide as the draws."""
    volume = np.linalg.slogdet(np.atleast_2d(np.cov(posterior.sample.T)))[1]
    return posterior.solution.discrepancy + posterior.emulator.log_variance - float(volume)
