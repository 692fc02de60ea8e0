"""Settings that could have given a recording: draws by the synthetic likelihood in a box.

Summaries are close to normal about their expected values, so a setting's likelihood falls with its
misfit: exp(-misfit / 2) (Wood, Nature 466 (2010) 1102). Within the box of an emulator that costs
nothing to evaluate, and a Markov chain of many walkers samples it, with an even prior over the
ranges on their scales (emcee; Foreman-Mackey et al., Publ. Astron. Soc. Pac. 125 (2013) 306).
Where the draws reach the end of the box, a wider box about them is simulated.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.calibration.estimation.descend import (
    Simulate,
    drawn_settings,
    rounded,
    simulations_of,
)
from driftwalk.calibration.estimation.emulator import LocalEmulator, Solved, fit_emulator

Floats = npt.NDArray[np.float64]

DRAWS: Final = 512
WALKERS: Final = 64
STEPS: Final = 600
"""Of each walker; the first half is left out."""
BEGIN: Final = 0.3
"""Walkers begin about the solution, within this part of its standard deviations."""
MOST_ROUNDS: Final = 4
EDGE: Final = 0.9
"""Draws beyond this part of the box are at its end,"""
MOST_AT_EDGE: Final = 0.05
"""and no more than this share of them may be."""
WIDE: Final = 3.0
"""The next box ends so many standard deviations of the draws from their mean."""
WIDEST: Final = 0.3
REACH: Final = 1.25


class Posterior(NamedTuple):
    """Settings that could have given a recording."""

    draws: Floats
    """Settings in the unit cube, shape (512, parameters)."""
    emulator: LocalEmulator
    """Of the last box."""
    solved: Solved
    """The setting of least misfit in it."""
    others: tuple[Solved, ...]
    """Those for the other parts of the recording."""


def sample_posterior(
    simulate: Simulate, recorded: Floats, emulator: LocalEmulator, solved: Solved, *, seed: int
) -> Posterior:
    """Return settings that could have given a recording.

    Parameters
    ----------
    simulate : callable
        Summaries of settings in the unit cube.
    recorded : ndarray, shape (parts, summaries)
        Of the whole recording, then of parts of it.
    emulator : LocalEmulator
        About the setting of least misfit.
    solved : Solved
        That setting.
    seed : int
        Of the settings and of the chain.
    """
    others: tuple[Solved, ...] = ()
    for number in range(MOST_ROUNDS):
        draws = _chain(emulator, recorded[0], solved, seed + number)
        if number and (number == MOST_ROUNDS - 1 or _inside(draws, emulator)):
            break
        centre = rounded(draws.mean(axis=0))
        spread = WIDE * draws.std(axis=0)
        width = rounded(np.clip(spread, emulator.width if number else 0.01, WIDEST))
        settings = drawn_settings(centre, width, simulations_of(centre.size)[1], seed + number)
        summaries = simulate(settings, parts=len(recorded))
        emulators = [
            fit_emulator(settings, summaries[:, part], centre=centre, width=width)
            for part in range(len(recorded))
        ]
        emulator = emulators[0]
        solved, *rest = (
            one.solve(part, reach=REACH) for one, part in zip(emulators, recorded, strict=True)
        )
        others = tuple(rest)
    return Posterior(draws, emulator, solved, others)


def _inside(draws: Floats, emulator: LocalEmulator) -> bool:
    """Return whether few draws lie at an end of the box that is no end of the ranges."""
    place = (draws - emulator.centre) / emulator.width
    beyond = (np.abs(place) > EDGE) & (draws > 0.01) & (draws < 0.99)
    return bool((beyond.mean(axis=0) < MOST_AT_EDGE).all())


def _chain(emulator: LocalEmulator, recorded: Floats, solved: Solved, seed: int) -> Floats:
    """Return draws by the synthetic likelihood within the box and the ranges."""
    import emcee

    low = np.maximum(emulator.centre - REACH * emulator.width, 0.0)
    high = np.minimum(emulator.centre + REACH * emulator.width, 1.0)

    def log_likelihood(settings: Floats) -> Floats:
        inside = ((settings >= low) & (settings <= high)).all(axis=1)
        return np.where(inside, -0.5 * emulator.misfits(settings, recorded), -np.inf)

    # emcee takes a generator of the older kind, whose seeds have 32 bits.
    random = np.random.RandomState(seed % 2**32)
    about = solved.setting + BEGIN * solved.std * random.standard_normal(
        (WALKERS, solved.setting.size)
    )
    margin = 1e-6 * (high - low)
    sampler = emcee.EnsembleSampler(WALKERS, solved.setting.size, log_likelihood, vectorize=True)
    about = np.clip(about, low + margin * (1 + random.random(about.shape)), high - margin)
    begin = emcee.State(about, random_state=random.get_state())
    sampler.run_mcmc(begin, STEPS, skip_initial_state_check=True)
    steps = sampler.get_chain(discard=STEPS // 2, flat=True)
    return np.asarray(steps[np.linspace(0, len(steps) - 1, DRAWS).round().astype(np.int64)])
