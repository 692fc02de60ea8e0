"""Random numbers for models written in Python: one stream per world, from the world's address."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from driftwalk.core.streams import MotionStream

Floats = npt.NDArray[np.float64]
Keys = npt.NDArray[np.uint64]


class WorldRandom:
    """Random numbers of many worlds, each from a stream of its own.

    A stream is NumPy's Philox generator with the world's key, so a world draws the same numbers
    alone or in any batch.

    Parameters
    ----------
    keys : ndarray of uint64, shape (worlds,)
        The address of every world.
    purpose : MotionStream
        Purpose of the numbers.

    Attributes
    ----------
    generators : tuple of numpy.random.Generator
        The streams, for distributions that have no method here.

    Examples
    --------
    >>> alone = WorldRandom(np.array([7], dtype=np.uint64)).normal(3)
    >>> among = WorldRandom(np.array([5, 7], dtype=np.uint64)).normal(3)
    >>> bool((alone[0] == among[1]).all())
    True
    """

    def __init__(self, keys: Keys, purpose: MotionStream = MotionStream.MOTION) -> None:
        self.generators = tuple(
            np.random.Generator(np.random.Philox(key=np.array([key, purpose], dtype=np.uint64)))
            for key in keys
        )

    def normal(self, *shape: int) -> Floats:
        """Return standard normal numbers, shape (worlds, *shape)."""
        return self._rows([one.standard_normal(shape) for one in self.generators], shape)

    def uniform(self, *shape: int) -> Floats:
        """Return uniform numbers from 0 to below 1, shape (worlds, *shape)."""
        return self._rows([one.random(shape) for one in self.generators], shape)

    def exponential(self, *shape: int) -> Floats:
        """Return exponential numbers of mean 1, shape (worlds, *shape)."""
        return self._rows([one.standard_exponential(shape) for one in self.generators], shape)

    def _rows(self, rows: list[Floats], shape: tuple[int, ...]) -> Floats:
        return np.asarray(rows, dtype=np.float64).reshape(len(self.generators), *shape)
