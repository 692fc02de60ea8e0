"""The numbers of all random streams, in one place.

Each is part of the address of random numbers (`driftwalk.core.seeds`): to change one changes every
result that it is part of. A new stream takes the next free number of its table, and no number is
used again.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Keys


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
