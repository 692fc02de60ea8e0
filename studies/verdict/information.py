"""Whether a recording of this length could tell: the Fisher information at the truth.

**Blocks.** Between two samples the velocity changes by the drag and a random part of the variance
sigma_F^2 tau / M^2 a second, for each axis. The score of ln C_d is the drag itself, a sum over the
samples off the wall; the flow is unknown, so the part of the score that a change of the flow at the
knots of a lattice of 2 cm would imitate is taken away, with a prior of 5 cm/s on each. The camera
is left out: at 0.2 to 0.5 mm and 10 Hz it hides what is faster than some 0.2 s, and the drag
changes more slowly; `INFLATED` allows for it. The spin is left out too, which would add to the
information. The water's acceleration is a number with a score like C_d; where its share cannot be
told from 0 to 1 by four standard deviations, the law cannot be chosen, nor C_d be stated.

**Walkers.** Relative standard deviations of the numbers of their law, from counts: n bouts give
their mean length to 1/sqrt(n); n memories give a memory to sqrt(2/n); samples give the rotational
diffusion to sqrt(2/n).
"""

from __future__ import annotations

from typing import Final

import blocks
import numpy as np
import numpy.typing as npt
from blocks import Motion, Tanks, Water
from ranges import FORCE_INTERVAL_S, RADIUS_M, SAMPLE_S
from scipy import sparse
from walkers import Walker

Floats = npt.NDArray[np.float64]

INFLATED: Final = 1.2
MOST_STD: Final = 0.06
"""Of ln C_d: a 90 % interval of 10 % to either side."""
MOST_LAW_STD: Final = 0.25
MOST_WALKER_STD: Final = 0.15
MOST_WALL_SHARE: Final = 0.7
MOST_WALKER_WALL_SHARE: Final = 0.95
KNOTS_M: Final = 0.02
PRIOR_M_S: Final = 0.05
TILT_M_S: Final = 1e-4
"""Change of the water's velocity by which the drag is differentiated."""


def of_block(tanks: Tanks, k: int, motion: Motion) -> dict[str, float | bool]:
    """Return what a recording of one block could tell."""
    one = tanks.only(np.full(motion.place.shape[1], k))
    free = ~motion.touched[k]
    force, slopes, carried = _forces(one, Motion(*(part[k] for part in motion)))
    mass = tanks.body.mass_kg * (1.0 + tanks.added_mass[k])
    rate = tanks.force_std[k] ** 2 * FORCE_INTERVAL_S / mass**2
    unit = np.sqrt(SAMPLE_S / rate)
    scores = np.stack([_parts(force / mass), _parts(carried)], axis=1) * unit
    knots = _knots(motion.place[k])
    water = sparse.vstack(
        [
            sparse.hstack([knots.multiply(slope.real[:, np.newaxis]) for slope in slopes]),
            sparse.hstack([knots.multiply(slope.imag[:, np.newaxis]) for slope in slopes]),
        ]
    ).tocsr() * (unit * PRIOR_M_S / mass)
    kept = np.flatnonzero(np.tile(free, 2))
    water, scores = water[kept], scores[kept]
    inner = (water.T @ water).toarray() + np.eye(water.shape[1])
    cross = water.T @ scores
    information = scores.T @ scores - cross.T @ np.linalg.solve(inner, cross)
    wall = float(motion.touched[k].mean())
    drag_std = _std(information[0, 0])
    law_std = _std(information[1, 1] - information[0, 1] ** 2 / max(information[0, 0], 1e-12))
    samples = 2.0 * free.sum() * 0.5
    judgeable = drag_std < MOST_STD and law_std < MOST_LAW_STD and wall < MOST_WALL_SHARE
    return {
        "judgeable": bool(judgeable and 1.0 / np.sqrt(max(samples, 1.0)) < MOST_STD),
        "ln_drag_coefficient_std": drag_std,
        "water_acceleration_std": law_std,
        "wall_share": wall,
        "visited_share": visited(motion.place[k]),
    }


def of_walker(walker: Walker, seconds: float) -> dict[str, float | bool]:
    """Return what a recording of one walker could tell of its own numbers."""
    stds = {}
    if np.isfinite(walker.bout_s):
        cycle = walker.bout_s + (walker.rest_s if np.isfinite(walker.rest_s) else 0.0)
        stds["bout"] = 1.0 / np.sqrt(seconds / cycle)
    if walker.memory_s:
        stds["memory"] = np.sqrt(2.0 * walker.memory_s / seconds)
    if walker.rotational_diffusion:
        stds["rotational_diffusion"] = np.sqrt(2.0 * SAMPLE_S / seconds)
    if walker.turn_rate:
        stds["turn_rate"] = np.sqrt(2.0 * walker.rotational_diffusion / seconds) / abs(
            walker.turn_rate
        )
    largest = float(max(stds.values()))
    return {"judgeable": largest < MOST_WALKER_STD, "largest_relative_std": largest}


def visited(place: npt.NDArray[np.complex128]) -> float:
    """Return the share of the tank's area, in cells of 1 cm, in which the body has been."""
    cell = 0.01
    cells = np.unique(np.floor(np.stack([place.real, place.imag]) / cell), axis=1)
    return float(cells.shape[1] * cell**2 / (np.pi * RADIUS_M**2))


def _forces(
    one: Tanks, motion: Motion
) -> tuple[npt.NDArray[np.complex128], list[npt.NDArray[np.complex128]], npt.NDArray]:
    """Return the drag, its slopes along u and v of the water, and the water's acceleration."""
    water = Water(one.only(np.array([0])))
    water.base = np.zeros((1, 1), dtype=np.intp)
    time = SAMPLE_S * np.arange(motion.place.size)
    weights = water.weights(time)[:, :, 0]
    turned = np.exp(1j * motion.angle * (not one.body.radius_m))[:, np.newaxis]
    arms = one.body.points * turned
    here = water.layers(motion.place[:, np.newaxis] + arms)
    flow = water.velocity(here, weights[:, 0])
    forces = [
        blocks.drag(one, flow + shift, turned, arms, motion.velocity, motion.spin)[0]
        for shift in (0.0, TILT_M_S, 1j * TILT_M_S)
    ]
    slopes = [(force - forces[0]) / TILT_M_S for force in forces[1:]]
    return forces[0], slopes, _acceleration(one, motion, weights)


def _acceleration(one: Tanks, motion: Motion, weights: Floats) -> npt.NDArray[np.complex128]:
    first = one.only(np.array([0]))
    first.floating = np.array([True])
    water = Water(first)
    water.base = np.zeros((1, 1), dtype=np.intp)
    arms = first.body.inner * np.exp(1j * motion.angle)[:, np.newaxis]
    layers = water.layers(motion.place[:, np.newaxis] + arms)
    return water.acceleration(layers, weights[:, 0], weights[:, 1]) @ one.body.shares


def _knots(place: npt.NDArray[np.complex128]) -> sparse.csr_matrix:
    """Return the weights of the lattice's knots at places, bilinear, without those never near."""
    per_row = round(2.0 * RADIUS_M / KNOTS_M) + 3
    column, row = (part / KNOTS_M + per_row / 2 for part in (place.real, place.imag))
    i, j = np.floor(column).astype(int), np.floor(row).astype(int)
    fx, fy = column - i, row - j
    entries = [
        ((fx if right else 1 - fx) * (fy if up else 1 - fy), (j + up) * per_row + i + right)
        for up in (0, 1)
        for right in (0, 1)
    ]
    rows = np.tile(np.arange(place.size), 4)
    share, where = (np.concatenate(part) for part in zip(*entries, strict=True))
    all_knots = sparse.csr_matrix((share, (rows, where)), shape=(place.size, per_row**2))
    used = np.flatnonzero(np.asarray(all_knots.sum(axis=0)).ravel() > 0)
    return all_knots[:, used]


def _parts(values: npt.NDArray[np.complex128]) -> Floats:
    return np.concatenate([values.real, values.imag])


def _std(information: float) -> float:
    return float(INFLATED / np.sqrt(max(information, 1e-6)))
