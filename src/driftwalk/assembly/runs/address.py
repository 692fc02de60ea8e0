"""Random streams of the stage: one per run, drawn parameter set and drawn flow, by address."""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt

from driftwalk.core.seeds import world_keys
from driftwalk.core.streams import trial_in

Stream = Literal["run", "parameters", "flow"]


def stream_keys(
    stream: Stream, *, seed: int, trial: int, index: npt.ArrayLike
) -> npt.NDArray[np.uint64]:
    """Return the keys of random streams, one per index.

    Parameters
    ----------
    stream : {"run", "parameters", "flow"}
        Purpose of the numbers; streams of two kinds never meet.
    seed : int
        Seed of the whole work.
    trial : int
        Index of the parameter set within the work, 0 <= trial < 2**40.
    index : array_like of int
        Index of the run or of the draw.

    Examples
    --------
    >>> keys = stream_keys("run", seed=1, trial=0, index=[0, 1])
    >>> bool((keys == stream_keys("run", seed=1, trial=0, index=[1, 0])[::-1]).all())
    True
    """
    return world_keys(seed, trial=trial_in(stream, trial), replicate=index)
