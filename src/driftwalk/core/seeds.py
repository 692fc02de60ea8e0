"""Addresses of random numbers: the 64-bit key of a world's stream.

A world's key is a hash of (seed, trial, replicate); the counter within its stream is made of the
index of the force interval, the body, the draw and the purpose (`cpp/include/driftwalk/random`).
A random number is thus a function of its address alone, whatever ran before it or at the same time.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Keys
from driftwalk.core.errors import InputError

_GAMMA = np.uint64(0x9E3779B97F4A7C15)


def world_keys(seed: int, *, trial: npt.ArrayLike, replicate: npt.ArrayLike) -> Keys:
    """Return the keys of the random streams of worlds.

    Three rounds of the SplitMix64 finaliser (Steele, Lea and Flood, OOPSLA 2014), one per part of
    the address, so that neighbouring addresses have unrelated keys.

    Parameters
    ----------
    seed : int
        Seed of the whole run, 0 <= seed < 2**63.
    trial, replicate : array_like of int
        Index of the parameter set and of the repetition; broadcast against each other.

    Returns
    -------
    ndarray of uint64
        One key per world, flattened in C order.

    Raises
    ------
    InputError
        When the seed is out of range.

    Examples
    --------
    >>> world_keys(1, trial=[0, 0, 1], replicate=[0, 1, 0]).size
    3
    """
    if not 0 <= seed < 2**63:
        raise InputError(f"seed: expected a whole number from 0 to 2**63 - 1, got {seed}")
    trials, replicates = np.broadcast_arrays(
        np.asarray(trial, dtype=np.uint64), np.asarray(replicate, dtype=np.uint64)
    )
    with np.errstate(over="ignore"):
        key = np.full(trials.size, _mix(np.array([seed], dtype=np.uint64))[0])
        key = _mix(key ^ trials.ravel())
        return _mix(key ^ replicates.ravel())


def _mix(value: Keys) -> Keys:
    value = value + _GAMMA
    value = (value ^ (value >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    value = (value ^ (value >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    result: Keys = value ^ (value >> np.uint64(31))
    return result
