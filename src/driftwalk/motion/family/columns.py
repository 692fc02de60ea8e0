"""The native core's table of a particle's numbers: one row per world.

The columns are the ones of `cpp/include/driftwalk/particle/columns.hpp`, in the same order.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats

Numbers = Mapping[str, npt.ArrayLike]

SHARED: Final = (
    "clearance", "diffusion", "slow_std", "slow_time", "stroke", "stroke_frequency", "wall_turn",
    "wall_follow", "wall_slowing", "wall_range", "wall_gap",
    "neighbour_push", "neighbour_range",
)  # fmt: skip
"""Columns that all states share."""
STATE: Final = (
    "dwell_scale", "dwell_power", "start_share", "speed", "speed_cv", "relaxation_time", "coasting",
    "rotational_diffusion", "turn_rate", "turn_rate_std", "turn_std", "reversal_share",
)  # fmt: skip
"""Columns of each state; the chances of the states that follow it come after them."""
INERTIAL: Final = ("clearance", "speed_std", "memory_time", "turn_rate")
"""Columns of a particle whose velocity forgets."""

FOREVER_S: Final = 1e30
"""Time of a bout that never ends: a number that a float can hold."""


@dataclass(frozen=True)
class State:
    """One state of a particle: numbers, or arrays with one entry per world.

    Attributes
    ----------
    speed : array_like
        Mean speed of its bouts [m/s].
    speed_cv : array_like
        Their standard deviation over the mean.
    dwell : array_like
        Mean time of a bout [s]; infinite if it never ends.
    dwell_cv : array_like
        Standard deviation over the mean: 1 is exponential, 0 a clock.
    next : sequence
        Chances of the states that follow; empty: the next one in turn.
    relaxation_time : array_like
        Time over which the speed comes to that of the bout [s]; 0: at once.
    coasting : bool
        A bout begins at its speed and glides to rest over the relaxation time.
    rotational_diffusion : array_like
        Of the heading [rad^2/s].
    turn_rate, turn_rate_std : array_like
        Mean of the bouts' turn rates, and their standard deviation [rad/s].
    turn_std : array_like
        Standard deviation of the turn at the beginning of a bout [rad].
    reversal_share : array_like
        Share of the bouts that begin with a turn by half a circle.
    """

    speed: npt.ArrayLike
    speed_cv: npt.ArrayLike = 0.0
    dwell: npt.ArrayLike = np.inf
    dwell_cv: npt.ArrayLike = 1.0
    next: Sequence[npt.ArrayLike] = ()
    relaxation_time: npt.ArrayLike = 0.0
    coasting: bool = False
    rotational_diffusion: npt.ArrayLike = 0.0
    turn_rate: npt.ArrayLike = 0.0
    turn_rate_std: npt.ArrayLike = 0.0
    turn_std: npt.ArrayLike = 0.0
    reversal_share: npt.ArrayLike = 0.0


@dataclass(frozen=True)
class ParticleTable:
    """A kind of particle and its columns, shape (worlds, columns)."""

    kind: Literal["switching", "inertial"]
    states: int
    columns: Floats


def switching_table(states: Sequence[State], shared: Numbers, *, worlds: int) -> ParticleTable:
    """Return the table of particles that switch between states.

    Parameters
    ----------
    states : sequence of State
        One to four.
    shared : mapping of str to array_like
        Columns of `SHARED`; those that are missing are 0.
    worlds : int
        Number of rows.

    Examples
    --------
    >>> switching_table([State(speed=0.1)], {"diffusion": 1e-6}, worlds=2).columns.shape
    (2, 26)
    """
    laws = [_law(one, worlds) for one in states]
    chances = [_chances(states, k, worlds) for k in range(len(states))]
    shares = _start_shares(states, chances, worlds)
    columns = [_column(shared.get(name, 0.0), worlds) for name in SHARED]
    for k, state in enumerate(states):
        drawn: Numbers = {
            "dwell_scale": laws[k][0],
            "dwell_power": laws[k][1],
            "start_share": shares[k],
            "coasting": float(state.coasting),
        }
        columns += [
            _column(drawn[name] if name in drawn else getattr(state, name), worlds)
            for name in STATE
        ]
        columns += chances[k]
    return ParticleTable("switching", len(states), _as_single(columns))


def inertial_table(numbers: Numbers, *, worlds: int) -> ParticleTable:
    """Return the table of particles whose velocity forgets: columns of `INERTIAL`.

    Examples
    --------
    >>> inertial_table({"speed_std": 0.01, "memory_time": 2.0}, worlds=3).columns.shape
    (3, 4)
    """
    columns = [_column(numbers.get(name, 0.0), worlds) for name in INERTIAL]
    return ParticleTable("inertial", 0, _as_single(columns))


def _as_single(columns: Sequence[Floats]) -> Floats:
    """Return the columns as rows, rounded to the numbers that the batch kernels hold.

    The last bits of a gamma function are not the same on all machines; those of a float are.
    """
    return np.ascontiguousarray(np.stack(columns, axis=1).astype(np.float32).astype(np.float64))


def _column(value: npt.ArrayLike, worlds: int) -> Floats:
    return np.broadcast_to(np.asarray(value, dtype=np.float64), (worlds,))


def _law(state: State, worlds: int) -> tuple[Floats, Floats]:
    mean, cv = _column(state.dwell, worlds), _column(state.dwell_cv, worlds)
    ends = np.isfinite(mean)
    law = dwell_law(np.where(ends, mean, 1.0), np.where(ends, cv, 0.0))
    return np.where(ends, law.scale, FOREVER_S), np.where(ends, law.power, 0.0)


def _chances(states: Sequence[State], k: int, worlds: int) -> list[Floats]:
    given = states[k].next
    if not given:
        given = [float(j == (k + 1) % len(states)) for j in range(len(states))]
    return [_column(one, worlds) for one in given]


def _start_shares(
    states: Sequence[State], chances: Sequence[Sequence[Floats]], worlds: int
) -> list[Floats]:
    """Return the share of its time that a particle spends in each state.

    How often it enters each is the stationary law of the chances; that times the mean time there.
    """
    count = len(states)
    if count == 1:
        return [np.ones(worlds)]
    matrix = np.stack([np.stack(row, axis=-1) for row in chances], axis=-2)
    # Entries v solve v (P - 1) = 0 and sum to 1.
    system = np.concatenate(
        [np.swapaxes(matrix, -1, -2) - np.eye(count), np.ones((worlds, 1, count))], axis=-2
    )
    target = np.zeros(count + 1)
    target[-1] = 1.0
    entries = np.linalg.pinv(system) @ target
    dwell = np.stack([np.minimum(_column(one.dwell, worlds), FOREVER_S) for one in states], axis=-1)
    time = np.maximum(entries, 0.0) * dwell
    shares = time / time.sum(axis=-1, keepdims=True)
    return [shares[:, k] for k in range(count)]


class DwellLaw(NamedTuple):
    """The law ``scale * (-ln U)**power`` of a bout's time, U uniform."""

    scale: Floats
    """[s]"""
    power: Floats
    """1 / shape: 1 is exponential, 0 a clock."""


def dwell_law(mean: npt.ArrayLike, cv: npt.ArrayLike) -> DwellLaw:
    """Return the Weibull law with these means and spreads.

    Its moments are ``E[T^n] = scale^n Gamma(1 + n power)``, so the power solves
    ``Gamma(1 + 2 power) / Gamma(1 + power)^2 = 1 + cv^2``.

    Parameters
    ----------
    mean : array_like
        Mean time [s], > 0; infinite where a bout never ends.
    cv : array_like
        Standard deviation over the mean, from 0 to 10.

    Examples
    --------
    >>> law = dwell_law([2.0, 2.0], [1.0, 0.0])
    >>> law.scale.round(9).tolist(), law.power.round(9).tolist()
    ([2.0, 2.0], [1.0, 0.0])
    """
    from scipy.special import gammaln, psi

    mean, cv = np.broadcast_arrays(np.asarray(mean, float), np.asarray(cv, float))
    wanted = np.log1p(cv**2)
    # The logarithm of the left side is convex in the power, and pi^2 / 6 power^2 at its beginning.
    power = np.sqrt(6.0 * wanted) / np.pi
    for _ in range(30):
        excess = gammaln(1.0 + 2.0 * power) - 2.0 * gammaln(1.0 + power) - wanted
        slope = 2.0 * (psi(1.0 + 2.0 * power) - psi(1.0 + power))
        power = np.where(slope > 0.0, power - excess / np.where(slope > 0.0, slope, 1.0), power)
    scale = mean / np.exp(gammaln(1.0 + power))
    return DwellLaw(np.asarray(scale), np.asarray(power))
