"""The protocol of a motion model: parameters, and worlds under the conditions of a recording.

Anything with these attributes and methods can be calibrated; nothing is inherited. A model keeps
four promises, to which `driftwalk.testing.MotionModelContract` holds it:

1. A world is a function of its values, the conditions and its key alone. The same bits come out
   whatever the rest of the batch, its order and the number of threads.
2. Failure is data: a world that lost its numbers has a status, the others go on.
3. Worlds are what the camera of the recording would have seen: at its time stamps, with its noise,
   its resolution and its field of view.
4. Values arrive by name, one entry per world.

The worlds of a call: which of them go together, where each starts, and its random numbers, one
stream or one seed per world from its address.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats, Keys
from driftwalk.core.random_streams import MotionStream, world_keys
from driftwalk.simulation.initial import Start, world_orientations

if TYPE_CHECKING:
    from driftwalk.comparison import StepReference
    from driftwalk.conditions.recorded import Conditions
    from driftwalk.schema import Parameter

Values = Mapping[str, Floats]
Details = Literal["none", "steps", "all"]
"""Results kept of a world besides its distance: nothing, its steps, or its density and excerpt."""
Scores = dict[str, npt.NDArray[Any]]
"""Arrays by name with one entry per world each; see `driftwalk.motion.score_worlds`."""


class Worlds(NamedTuple):
    """Simulated worlds as the camera saw them."""

    x: npt.NDArray[Any]
    """Position x [m], shape (worlds, samples); NaN where the camera saw nothing."""
    y: npt.NDArray[Any]
    """Position y [m], likewise."""
    theta: npt.NDArray[Any]
    """Orientation [rad], likewise; NaN throughout where the model has none."""
    status: npt.NDArray[np.uint32]
    """Bits of `driftwalk.simulation.backend.STATUS`, shape (worlds,); 0 is sound."""


@runtime_checkable
class MotionModel(Protocol):
    """A stochastic motion that can be calibrated on a recording."""

    @property
    def name(self) -> str:
        """Name of the model in results and messages."""

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Its parameters; the names are the dimensions of every map."""

    @property
    def needs_flow(self) -> bool:
        """Whether it has to know the water's velocity."""

    def simulate(self, values: Values, like: Conditions, keys: Keys) -> Worlds:
        """Return one world per key.

        Parameters
        ----------
        values : mapping of str to ndarray, shape (worlds,)
            The value of every parameter in every world.
        like : Conditions
            The conditions of the recording.
        keys : ndarray of uint64, shape (worlds,)
            The address of every world's random numbers.
        """

    def describe(self) -> dict[str, Any]:
        """Return what determines its numbers, as JSON values, for the record of a run."""

    def facts(self, estimate: Mapping[str, float]) -> dict[str, Any]:
        """Return what else the answer has to say at an estimate, as attributes."""


@runtime_checkable
class ScoresItself(MotionModel, Protocol):
    """A model that simulates and compares in one native call, and keeps no trajectory.

    It gives the bits that `simulate` followed by `driftwalk.comparison.StepDistance` gives.
    """

    def score(
        self,
        values: Values,
        like: Conditions,
        keys: Keys,
        reference: StepReference,
        *,
        details: Details = "none",
    ) -> Scores:
        """Return the KS distance of every world to the recording; see `score_worlds`."""


class WorldRandom:
    """Random numbers of many worlds, each from its own stream.

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


def world_seeds(keys: Keys) -> list[int]:
    """Return a seed per world for random numbers that are made elsewhere, below 2**53.

    A program that reads all numbers as floats holds such a seed exactly.

    Examples
    --------
    >>> seeds = world_seeds(np.array([1, 2], dtype=np.uint64))
    >>> max(seeds) < 2**53, seeds[0] == seeds[1]
    (True, False)
    """
    mixed = world_keys(0, trial=keys, replicate=MotionStream.MOTION)
    return [int(seed) for seed in mixed >> np.uint64(11)]


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
