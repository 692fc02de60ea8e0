"""The worlds of a call: which of them go together, where each starts, their setting in words."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats, Keys
from driftwalk.simulation.initial import Start, world_orientations


def world_batches(columns: Sequence[Floats], *, most: int, one_setting: bool) -> list[slice]:
    """Return consecutive batches of worlds.

    Parameters
    ----------
    columns : sequence of ndarray, shape (worlds,)
        The values of each parameter.
    most : int
        Worlds that a batch may have.
    one_setting : bool
        Whether the worlds of a batch share one setting of the parameters.
    """
    settings = np.column_stack(columns)
    changes = np.flatnonzero((np.diff(settings, axis=0) != 0).any(axis=1)) + 1
    inner = changes.tolist() if one_setting else []
    return [
        slice(first, min(first + most, stop))
        for begin, stop in itertools.pairwise([0, *inner, len(settings)])
        for first in range(begin, stop, most)
    ]


def world_starts(start: Start, keys: Keys) -> Start:
    """Return the start with one entry per world each."""
    values: dict[str, npt.ArrayLike] = {
        name: np.full(keys.size, value, dtype=np.float64) for name, value in start._asdict().items()
    }
    return Start(**{**values, "theta": world_orientations(start.theta, keys)})


def no_numbers(model: str, setting: Mapping[str, float]) -> str:
    """Return what there is to say of a model without a sound world, with one of its settings."""
    return (
        f"the model {model} gave positions that are no finite numbers in every world that was "
        f"tried, such as at {in_words(setting)}"
    )


def in_words(setting: Mapping[str, float]) -> str:
    """Return a setting of the parameters for a message: "speed=0.1, tumble_rate=2"."""
    return ", ".join(f"{name}={value:g}" for name, value in setting.items())
