"""The protocol of a motion model: parameters, and worlds under the conditions of a recording.

Anything with these attributes and methods can be calibrated; nothing is inherited. A model keeps
four promises, to which `driftwalk.testing.MotionModelContract` holds it:

1. A world is a function of its values, the conditions and its key alone. The same bits come out
   whatever the rest of the batch, its order and the number of threads.
2. Failure is data: a world that lost its numbers has a status, the others go on.
3. Worlds are what the camera of the recording would have seen: at its time stamps, with its noise,
   its resolution and its field of view.
4. Values arrive by name, one entry per world.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from driftwalk.core.arrays import Floats, Keys

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
