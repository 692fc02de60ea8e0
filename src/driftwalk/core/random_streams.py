"""Addresses of random numbers: the numbers of all streams, and the 64-bit key of a world's.

A world's key is a hash of (seed, trial, replicate); the counter within its stream is made of the
index of the force interval, the body, the draw and the purpose (`cpp/include/driftwalk/random`).
A random number is thus a function of its address alone, whatever ran before it or at the same time.

Each stream is part of the address of random numbers (`world_keys`): to change one changes every
result that it is part of. A new stream takes the next free number of its table, and no number is
used again.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Keys
from driftwalk.core.errors import InputError


class Purpose(IntEnum):
    """Purpose of a number within a world's stream; the last word of its counter.

    The native core's table, `cpp/include/driftwalk/random/purpose.hpp`, is the same.
    """

    FORCE = 1
    OBSERVATION = 2
    START = 3
    MOTION = 4
    BOUT = 5
    FLOW = 6
    TORQUE = 7
    STIRRING = 8
    BOND = 9


WORK: Final[dict[str, int]] = {
    # the stages of a calibration
    "coarse": 1,
    "refined": 2,
    "surface": 3,
    "bootstrap": 4,
    "floor": 5,
    "first_half": 6,
    "first_half_refined": 7,
    "second_half": 8,
    "coverage": 9,
    "drawn": 15,
    # the search over several parameters: its settings, worlds to judge its answer by, and a trial
    "evolution": 10,
    "judged": 11,
    "tried": 12,
    # the second stage of an estimation: its boxes, and worlds by which both stages are judged
    "estimation": 13,
    "weighed": 14,
    # self-assembly: its runs, the parameters drawn for them, the flows drawn for them, and what a
    # fit of glued blocks says
    "run": 32,
    "parameters": 33,
    "flow": 34,
    "glued": 35,
}
"""Work that worlds are simulated for: the part of their trial from bit 40 on."""


class CheckStream(IntEnum):
    """Streams of the check of a fit: its two sets of recordings, and the draws for the second."""

    ESTIMATE = 0
    DRAWN = 1
    PARAMETERS = 2


class RecoveryStream(IntEnum):
    """Streams of one recording of a recovery study."""

    FLOW = 0
    WORLD = 1
    GAPS = 2
    SEARCH = 3


class MotionStream(IntEnum):
    """Streams of a world of a motion model written in Python."""

    MOTION = 1
    CAMERA = 2


class VideoStream(IntEnum):
    """Streams of a synthetic video."""

    BARS = 1
    GLARE = 2
    IMAGE = 3


def trial_in(work: str, index: npt.ArrayLike) -> Keys:
    """Return the trials of a work's settings: their place in the addresses of random numbers.

    Parameters
    ----------
    work : str
        A key of `WORK`.
    index : array_like of int
        Number of the setting within the work, 0 <= index < 2**40.

    Examples
    --------
    >>> int(trial_in("coarse", 3)) == 2**40 + 3
    True
    """
    return (np.uint64(WORK[work]) << np.uint64(40)) + np.asarray(index, dtype=np.uint64)


_GAMMA = np.uint64(0x9E3779B97F4A7C15)
"""Increment of SplitMix64, 2^64 over the golden ratio (Steele, Lea and Flood 2014)."""


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
